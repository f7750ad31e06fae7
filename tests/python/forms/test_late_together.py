"""A delay alone, or a lag alone, of a drive that has both: the deviation contains what the other one would change."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.explain.beside import late_together
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Innovations, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.uncertainty import estimates_of

AXIS, DT = ga.OneMass(J=1e-3, D=2e-3).model(), 1e-3
PARAMETER = {"transport_delay": "delay", "torque_lag": "time_constant"}
TRUE = {"transport_delay": 1.2e-3, "torque_lag": 0.8e-3}


def fitted(effects: dict[str, float], alone: str, noise: float) -> tuple[Objective, Fit]:
    """The axis with one late effect, fitted to the record of an axis with these."""
    rng = np.random.default_rng(1)
    torque = np.repeat(rng.choice([-0.2, 0.2], 120), 25)
    drive = AXIS
    for effect, value in effects.items():
        drive = drive.with_effect(effect, **{PARAMETER[effect]: value})
    rec = ga.Record(DT, torque=torque, velocity=np.zeros(len(torque)))
    rec = rec.with_channels(velocity=ga.simulate(drive, rec) + noise * rng.standard_normal(len(torque)))
    data = DataSet.of([rec], None)
    objective = Objective(data, np.ones(len(rec))).under(Innovations())
    parameters = Parameterisation.of(AXIS, scales_of(data), data.moving)
    x = np.concatenate([parameters.start(AXIS), LIBRARY[alone].coordinates({PARAMETER[alone]: 1.5e-3})])
    return objective, ls.fit(objective, Hypothesis(parameters.extended(LIBRARY[alone]), OpenLoop(data)), x, WHITE, 30)


@pytest.mark.parametrize("alone", PARAMETER)
def test_the_truth_is_within_a_few_deviations_where_both_are_there(alone: str) -> None:
    objective, fit = fitted(TRUE, alone, 0.05)
    before = estimates_of(objective, fit)
    after, notes = late_together(objective, fit, tuple(LIBRARY.values()), before)
    name = PARAMETER[alone]
    one, both = before[alone][name], after[alone][name]
    assert abs(one.value - TRUE[alone]) > 10.0 * one.std, "alone it is the sum, and its deviation far too small"
    assert both.value == one.value and abs(both.value - TRUE[alone]) < 2.0 * both.std
    assert len(notes) == 1 and notes[0].startswith(f"What is late here is one number, {1e3 * one.value:.3g} ms")


@pytest.mark.parametrize("alone", PARAMETER)
def test_where_the_data_exclude_the_other_one_nothing_changes(alone: str) -> None:
    objective, fit = fitted({alone: TRUE[alone]}, alone, 1e-4)
    before = estimates_of(objective, fit)
    after, notes = late_together(objective, fit, tuple(LIBRARY.values()), before)
    name = PARAMETER[alone]
    assert notes == [] and after[alone][name].std < 3.0 * before[alone][name].std
    assert late_together(objective, fit, (), before) == (before, []), "no other effect is allowed"
