"""Predictors: effects of the controller beside effects of the angle, in the torque that drives an open loop."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.control.controller import Limiting
from gaident.diagnosis.library.terms import LIBRARY
from gaident.estimation.dataset import DataSet
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import ClosedLoop, ObserverLoop, OpenLoop
from gaident.estimation.records.driven import torque_in
from gaident.estimation.term import Scales, Term
from gaident.policy.table import POLICY

DT, N = 1e-3, 600
LOOP = ga.PI(kp=0.05, ki=1.5)
ONE = ga.OneMass(J=5e-4, D=2e-3).model()
SCALES = Scales(DT, N * DT, 40.0, 1.0, 1e3, 10.0, 0.02, float("nan"), float("nan"), False, 1.0)
COGGING, CLAMP, FILTER = (LIBRARY[name] for name in ("cogging", "integrator_clamp", "velocity_filter"))
VALUES = {"cogging": (0.02, 0.01, 6.0), "integrator_clamp": (np.log(0.05),), "velocity_filter": (np.log(2e-3),)}


def data() -> DataSet:
    rng = np.random.default_rng(0)
    asked = np.repeat([30.0, -20.0, 40.0], N // 3)
    rec = ga.Record(DT, command=asked, velocity=np.zeros(N))
    return DataSet.of([rec.with_channels(velocity=ga.simulate(ONE, rec, LOOP) + 0.5 * rng.standard_normal(N))], LOOP)


def parameters(*terms: Term) -> tuple[Parameterisation, np.ndarray]:
    p = Parameterisation.of(ONE, SCALES, [False])
    x = p.base_vector(ONE)
    for t in terms:
        p, x = p.extended(t), np.concatenate([x, VALUES[t.name]])
    return p, x


@pytest.mark.parametrize("own_angle", [False, True])
@pytest.mark.parametrize("beside", [(), (FILTER,)], ids=["", "behind a filter"])
def test_the_angle_is_the_same_matter_with_an_effect_of_the_controller(own_angle: bool, beside: tuple[Term, ...]) -> None:
    """Under the torque that the clamped controller makes, the model is the one without a clamp, whichever angle it turns with."""
    found = data()
    p, x = parameters(CLAMP, COGGING, *beside)
    less, y = parameters(COGGING, *beside)
    torque = torque_in(found.replayed({CLAMP: np.exp(VALUES[CLAMP.name])})[0])
    driven = (found.driven[0].with_channels(torque=torque),)
    clamped = replace(found, driven=driven, free=tuple(r.with_channels(position=None) for r in driven))
    w = OpenLoop(found, own_angle).velocities(p, x[None, :])
    np.testing.assert_array_equal(w, OpenLoop(clamped, own_angle).velocities(less, y[None, :]))
    other = OpenLoop(found, not own_angle).velocities(p, x[None, :])
    assert np.abs(w - other).max() > 1e-3, "the two angles are not the same"


def test_an_effect_of_the_controller_may_have_several_parameters() -> None:
    found = data()
    seen: list[np.ndarray] = []

    def limiting(values: np.ndarray) -> Limiting:
        seen.append(values.copy())
        return Limiting(integrator=float(values[0]), slope=1e3 * float(values[1]))

    two = replace(
        CLAMP,
        natural=lambda Z: np.exp(Z),
        limits=lambda s: [(-10.0, 10.0)] * 2,
        steps=lambda s: (0.1, 0.1),
        limiting=limiting,
    )
    p, x = parameters()
    rows = np.array([[0.05, 0.6], [0.05, 0.2], [0.05, 0.6]])
    w = OpenLoop(found).velocities(p.extended(two), np.hstack([np.tile(x, (3, 1)), np.log(rows)]))
    np.testing.assert_array_equal(w[0], w[2])
    assert np.abs(w[0] - w[1]).max() > 0.1, "they differ in the second parameter alone"
    np.testing.assert_allclose(np.array(seen), [[0.05, 0.2], [0.05, 0.6]])


def test_a_corrected_loop_adds_a_share_of_the_controller_to_the_torque_of_the_record() -> None:
    """u + s C (w_measured - w), sample by sample; C with a trapezoidal integral, the mass with its exact step."""
    found, share = data(), POLICY.observer_share
    p, x = parameters()
    u, measured = torque_in(found.driven[0]), found.records[0].velocity
    decay = np.exp(-2e-3 / 5e-4 * DT)
    w, integral, before, expected = 0.0, 0.0, 0.0, []
    for torque, seen in zip(u, measured, strict=True):
        expected.append(w)
        error = seen - w
        integral += 0.5 * LOOP.ki * DT * (error + before)
        before = error
        w = decay * w + (1.0 - decay) / 2e-3 * (torque + share * (LOOP.kp * error + integral))
    np.testing.assert_allclose(ObserverLoop(found).velocities(p, x[None, :])[0], expected, atol=1e-9)
    assert np.abs(ClosedLoop(found).velocities(p, x[None, :])[0] - expected).max() > 0.1


def test_an_effect_inside_the_controller_is_simulated_in_the_drives_loop() -> None:
    found = data()
    p, x = parameters(CLAMP)
    np.testing.assert_array_equal(ObserverLoop(found).velocities(p, x[None, :]), ClosedLoop(found).velocities(p, x[None, :]))
    assert ObserverLoop.possible(found) and not ObserverLoop.possible(found.aged(0.5))
    assert not ObserverLoop.possible(replace(found, controller=ga.Cascade(LOOP, period=DT / 2)))


def test_substeps_are_those_of_the_samples_that_are_simulated() -> None:
    """Of a line of 1 ms 8, of the controller's sample of 125 us in a loop 1: each of them 0.125 ms, whatever drives the model."""
    t = 1e-3 * np.arange(400)
    rec = ga.Record(1e-3, command=np.sin(50.0 * t), velocity=np.sin(50.0 * t), torque=np.cos(50.0 * t))
    slow = ga.Cascade(ga.PI(0.1, 1.0), period=125e-6)
    data = DataSet.of([rec], slow)
    assert (data.substeps(None), data.substeps(slow), data.substeps(ga.PI(0.1, 1.0))) == (8, 1, 8)


@pytest.mark.parametrize("age", [0.0, 0.25, 0.5])
def test_a_record_that_turns_otherwise_is_the_one_loaded_with_that_angle(age: float) -> None:
    """Torque-driven, behind a velocity of now, of a quarter of a line ago, and one that is a difference; and in the loop."""
    found = data().aged(age)
    p, x = parameters(COGGING)
    names, values = p.values(x[None, :])
    angle = np.cumsum(found.driven[0].velocity) * DT + 0.3
    for records, loop in ((found.driven, None), (found.turned, LOOP)):
        anew = found.load(records[0].with_channels(position=angle), 0, loop)
        turned = found.loaded(records, loop)[0].turned(angle if loop else found.ready_angle(angle, 0))
        runs = [one.velocities(p.structure, names, values, substeps=4) for one in (anew, turned)]
        np.testing.assert_array_equal(*runs)
        other = found.loaded(records, loop)[0].velocities(p.structure, names, values, substeps=4)
        assert np.abs(runs[0] - other).max() > 1e-6, "the angle matters"
