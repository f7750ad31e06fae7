"""The load's end of two masses in the score test: torques and angle there, against the independent integrator."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from fine_integrator import FineCase, integrate
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.screening.score_test import ScoreTest
from gaident.estimation.dataset import DataSet
from gaident.estimation.load_end import LoadEnd
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Scales

DT, N = 1e-3, 1200
DRIVE = ga.TwoMass(JM=1e-4, DM=0.003, JL=5.8e-4, DL=0.008, KG=2.6, DG=0.004)  # antiresonance at 67 rad/s
SCALES = Scales(DT, N * DT, 40.0, 1.0, 1e3, 10.0, 0.02, DRIVE.KG, 180.0, True, 1.0)
AMPLITUDE, ORDER, PHASE = 0.02, 4.0, 0.4


def case(at_load: dict[str, dict[str, float]]) -> FineCase:
    torque = np.repeat([0.3, 0.05, -0.25, 0.35], N // 4)
    return FineCase(
        DT, "open", torque, (DRIVE.JM, DRIVE.DM), (DRIVE.JL, DRIVE.DL), (DRIVE.KG, DRIVE.DG), 0.0, 0.0, at_load=at_load
    )


def test_a_torque_at_the_load_and_its_angle_go_through_the_shaft() -> None:
    cogging = {"cogging": {"amplitude": AMPLITUDE, "order": ORDER, "phase": PHASE}}
    out = integrate([case({}), case(cogging)], fine=200)
    plain, cogged = out.velocity.T
    noisy = cogged + 1e-3 * np.random.default_rng(0).standard_normal(N)
    # Twice the same record: the filters begin anew in the second one.
    data = DataSet.of([ga.Record(DT, torque=case({}).source, velocity=noisy)] * 2, None)
    model = DRIVE.model()
    parameters = Parameterisation.of(model, SCALES, [False, False])
    x = parameters.base_vector(model)
    end = LoadEnd.of(parameters, x, data)
    motor = out.angle[:, 1]
    load = end.angle(np.tile(motor, 2))
    np.testing.assert_array_equal(load[:N], load[N:])
    torque = -AMPLITUDE * np.sin(ORDER * load + PHASE)
    changed = OpenLoop(data).torque_response(parameters, x, end.carried(torque[None, :]))[0]
    for part in (changed[:N], changed[N:]):
        assert np.sqrt(np.mean((part - (cogged - plain)) ** 2)) < 0.1 * np.std(cogged - plain)
    torque = -AMPLITUDE * np.sin(ORDER * np.tile(motor, 2) + PHASE)
    at_motor = OpenLoop(data).torque_response(parameters, x, torque[None, :])[0][:N]
    assert np.sqrt(np.mean((at_motor - (cogged - plain)) ** 2)) > 0.5 * np.std(cogged - plain)

    test = ScoreTest(Objective(data, np.ones(2 * N)))
    test.add(Hypothesis(parameters, OpenLoop(data)), x, [LIBRARY["cogging"], LIBRARY["cogging@load"]])
    best, other = test.ranked(WHITE)
    assert best.term.name == "cogging@load"
    assert best.fall > 2.0 * other.fall
    found = best.hypothesis.parameters.effect_values(best.starts[0][None, :], "cogging@load")[0]
    assert found[:2] == pytest.approx([AMPLITUDE, ORDER], rel=0.1)
