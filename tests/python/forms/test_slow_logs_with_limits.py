"""Drives as in industry in logs of fewer lines than the controller has samples, with a torque limit that is reached."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from gaident.control.cascade import cascade_of
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.controller.slow_forms import torque_spread
from loop_cases import INDUSTRY_BITS, industrial_case


@pytest.mark.long
def test_an_integrator_that_is_held_makes_no_resonance() -> None:
    """A sample more or less at the limit changes the velocity by a jump: a fit from one side of it does not come to the other."""
    rec, validation, whole, truth = industrial_case("hold", 4, "coulomb_friction", 3061000, INDUSTRY_BITS, True)
    dia = ga.diagnose(rec, controller=whole, validation=validation)
    real = [f for f in dia.findings if not f.is_noise]
    assert dia.verdict == "explained"
    assert {f.effect for f in real} <= {"coulomb_friction", "torque_lag", "velocity_filter"} and len(real) == 2
    motor, load = (dia.mechanics[name] for name in ("motor_inertia", "load_inertia"))
    for found, true in ((motor, truth.plant.J), (load, truth.plant.JL)):
        assert abs(found.value - true) < 3.0 * found.std


@pytest.mark.long
def test_filter_limit_and_age_are_found_together() -> None:
    """The filter that the torque shows is 6 % off: with it the velocity seems no difference, and a resonance more to be there."""
    rec, validation, whole, truth = industrial_case("torque low pass", 4, "coulomb_friction", 3061000, INDUSTRY_BITS, True)
    given = ga.Cascade(ga.PI(truth.plant.kp, truth.plant.ki), period=truth.plant.dt / 4)
    dia = ga.diagnose(rec, controller=given, validation=validation)
    found = {f.effect: f for f in dia.findings if not f.is_noise}
    assert dia.verdict == "explained"
    assert {*found} - {"torque_lag", "velocity_filter"} == {"coulomb_friction", "torque_filter", "torque_saturation"}
    limit, time = found["torque_saturation"].parameters["limit"], found["torque_filter"].parameters["time_constant"]
    (built,) = whole.torque_filters
    assert abs(limit.value - whole.velocity.torque_limit) < 1e-3 * limit.value
    assert abs(time.value - built.time_constant) < 1e-3 * time.value


@pytest.mark.long
def test_a_limit_before_a_filter_is_as_unsure_as_the_filter() -> None:
    rec, _, whole, truth = industrial_case("torque low pass", 4, "coulomb_friction", 3061000, INDUSTRY_BITS, True)
    shown = form_shown([rec], ga.PI(truth.plant.kp, truth.plant.ki), every=4)
    limit = whole.velocity.torque_limit
    assert shown is not None and limit is not None
    value, std = shown.numbers["torque_saturation"]["limit"]
    spread = shown.found.covariance
    assert spread is not None and shown.found.at[-1] == value and std == np.sqrt(spread[-1, -1])
    assert abs(value - limit) < 2.0 * std and std > torque_spread([rec], value)
    other = shown.found.moved(np.append(np.zeros(len(spread) - 1), 0.1)).controller
    assert other is not None and cascade_of(other).velocity.torque_limit == value + 0.1
