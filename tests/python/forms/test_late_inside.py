"""A low pass of the torque that was not given: the simulated loop is later behind its torque than the logged torque shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, log_of, skip_without_library
from gaident.axis import Text
from gaident.diagnosis import work
from gaident.diagnosis.explain.late_inside import late_inside
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Innovations, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import ClosedLoop
from gaident.models.drive_torque import driven_by
from loop_cases import INDUSTRY_BITS, industrial_case

EVERY, PERIOD, LAG, INSIDE = 4, 2.5e-4, 4.8e-4, 6.7e-4
GAINS, AXIS = ga.PI(kp=0.06, ki=1.2), ga.OneMass(J=4.6e-4, D=1e-3).model()
WHOLE = ga.Cascade(GAINS, PERIOD, torque_filters=(ga.LowPass(INSIDE),))


def record() -> ga.Record:
    """A rigid axis with a current loop's lag, on ramps."""
    skip_without_library()
    plant = Plant(J=4.6e-4, D=1e-3, kp=GAINS.kp, ki=GAINS.ki, dt=EVERY * PERIOD, cascade=WHOLE)
    levels = np.random.default_rng(4).uniform(-180.0, 180.0, 8)
    before, ramp = np.append(0.0, levels[:-1]), 0.375 * np.arange(200 * EVERY)
    ramps = [a + np.clip(b - a, -ramp, ramp) for a, b in zip(before, levels, strict=True)]
    return log_of(plant, np.concatenate(ramps), {"torque_lag": {"time_constant": LAG}}, Noise(white=0.25), 2)


def fitted(controller: ga.Cascade, effect: str, **changed: Any) -> tuple[Objective, Fit]:
    """The axis with this effect, fitted in the loop of a controller."""
    rec = record()
    data = replace(DataSet.of([driven_by(rec, controller)], controller, read=[rec]), **changed)
    objective = Objective(data, np.ones(len(rec))).under(Innovations())
    parameters = Parameterisation.of(AXIS, scales_of(data), data.moving)
    term = LIBRARY[effect]
    x = np.concatenate([parameters.start(AXIS), term.coordinates({"delay": 5e-4, "time_constant": 5e-4, "coefficient": 1e-9})])
    fit = ls.fit(objective, Hypothesis(parameters.extended(term), ClosedLoop(data)), x, WHITE, 30)
    return objective, ls.reestimated(objective, fit)


@pytest.mark.parametrize("effect", ["torque_lag", "transport_delay"])
def test_a_filter_that_was_not_given_is_what_the_loop_needs_more(effect: str) -> None:
    assert late_inside(*fitted(WHOLE, effect)) == []
    (note,) = late_inside(*fitted(ga.Cascade(GAINS, PERIOD), effect))
    inside = float(note.split("So about ")[1].split(" ms")[0])
    assert 0.7e3 * INSIDE < inside < 1.1e3 * INSIDE, "the loop makes up for a part of it by inertia and friction"


def test_an_axis_that_swings_between_the_lines_is_not_late_inside() -> None:
    """A shaft of 250 Hz, a line each millisecond: under the logged torque it is 0.15 ms less late than in its loop."""
    rec, _, whole, truth = industrial_case("bare", 8, "coulomb_friction", 3071000, INDUSTRY_BITS, True)
    plant, term = truth.plant, LIBRARY["torque_lag"]
    axis = ga.TwoMass(JM=plant.J, DM=plant.D, JL=plant.JL, DL=plant.DL, KG=plant.KG, DG=plant.DG).model()
    data = DataSet.of([driven_by(rec, whole)], whole, read=[rec]).aged(0.5 / 8)
    objective = Objective(data, np.ones(len(rec))).under(Innovations())
    parameters = Parameterisation.of(axis, scales_of(data), data.moving)
    x = np.concatenate([parameters.start(axis), term.coordinates(truth.effects["torque_lag"])])
    fit = ls.fit(objective, Hypothesis(parameters.extended(term), ClosedLoop(data)), x, WHITE, 30)
    assert late_inside(objective, ls.reestimated(objective, fit)) == []


def test_it_is_asked_only_in_the_loop_of_a_slow_log_with_a_torque() -> None:
    bare = ga.Cascade(GAINS, PERIOD)
    assert late_inside(*fitted(bare, "torque_lag", loop_follows=False)) == []
    assert late_inside(*fitted(bare, "quadratic_drag")) == [], "nothing is late"


@pytest.mark.long
def test_a_controller_that_lacks_something_is_an_alternative(monkeypatch: pytest.MonkeyPatch) -> None:
    rec, said = record(), Text("late inside")
    plain = ga.diagnose(rec, WHOLE)
    assert plain.verdict == "explained" and not any("torque_filter" in f.alternatives for f in plain.causes)
    monkeypatch.setattr(work, "late_inside", lambda objective, fit: [said])
    dia = ga.diagnose(rec, WHOLE)
    assert dia.verdict == "partly explained" and said in dia.notes
    assert all("torque_filter" in f.alternatives for f in dia.causes if f.place != "shaft")
