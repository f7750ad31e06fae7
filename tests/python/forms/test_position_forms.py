"""A position loop whose controller is not the given one, in a slow log: filters, gains and feedforwards are findings."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.axis import Text
from gaident.diagnosis.controller.other_form import other_form
from gaident.diagnosis.controller.wrong_number import closer_form, with_findings, wrong_numbers
from gaident.identification.logged_torque import Corrected, corrected
from loop_cases import PERIOD, jump_levels, jump_log

skip_without_library()

NOTCH = ga.Notch(frequency=180.0, numerator_damping=0.15, denominator_damping=0.7)
TRUE = ga.Cascade(
    ga.PI(0.03, 1.8),
    PERIOD,
    position=ga.P(20.0),
    position_period=8 * PERIOD,
    velocity_feedforward=0.6,
    acceleration_feedforward=2.5e-4,
)


@cache
def log(notch: bool) -> ga.Record:
    """1200 lines of moves there and back, noise of 0.05 rad/s in the loop, a line for every 4th sample."""
    axis = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.8, dt=4 * PERIOD, cascade=replace(TRUE, torque_filters=(NOTCH,) * notch))
    ramp = np.concatenate([np.linspace(0, 1, 25), np.ones(90), np.linspace(1, 0, 25), np.zeros(60)])
    speed = np.concatenate([size * ramp for size in (40.0, -60.0, 25.0, -5.0, 70.0, -70.0)])
    return rig(axis, np.cumsum(speed) * axis.dt, None, Noise(white=0.05), seed=7, position_logged=True)


def test_a_notch_that_was_not_given_is_a_torque_filter_and_no_feedforward() -> None:
    with threadpool_limits(1, user_api="blas"):
        form = other_form([log(True)], [], TRUE)
    other = Corrected(replace(TRUE, acceleration_feedforward=2e-4), {}, Text(""))
    assert form is not None and closer_form([log(True)], form, other) is form
    assert closer_form([log(True)], form, Corrected(form.controller, {}, Text(""))) is None
    (found,) = form.findings
    assert (found.effect, found.place) == ("torque_filter", "controller")
    frequency = found.parameters["frequency"]
    assert abs(frequency.value - 180.0) < 4.0 * frequency.std < 20.0
    assert isinstance(form.controller, ga.Cascade) and form.controller.position == TRUE.position
    assert form.controller.acceleration_feedforward == TRUE.acceleration_feedforward


def test_a_number_that_differs_is_a_finding() -> None:
    given = replace(TRUE, position=ga.P(25.0))
    with threadpool_limits(1, user_api="blas"):
        other = corrected([log(False)[:700]], given)
    assert other is not None
    (found,) = wrong_numbers([log(False)], given, other)
    estimate = found.parameters["position_gain"]
    assert (found.effect, found.place) == ("other_gains", "controller") and found.delta_bic > 100.0
    assert estimate.value == pytest.approx(20.0, rel=0.02) and estimate.unit == "1/s"
    numbers = with_findings(other).found
    assert numbers is not None and numbers.named is not None and numbers.covariance is not None
    assert numbers.named(numbers.at, numbers.covariance)["other_gains"]["position_gain"][0] == estimate.value


@pytest.mark.parametrize(
    ("name", "parameter"),
    [("velocity_feedforward", "share"), ("acceleration_feedforward", "inertia"), ("friction_feedforward", "torque")],
)
def test_a_feedforward_that_differs_has_its_own_name(name: str, parameter: str) -> None:
    given: ga.Cascade = replace(TRUE, **{name: 0.1})  # type: ignore[arg-type]
    other = Corrected(TRUE, {name: ga.Estimate(1.0, 0.1, "1")}, Text("why"))
    (found,) = wrong_numbers([log(False)], given, other)
    assert (found.effect, set(found.parameters), found.place) == (name, {parameter}, "controller")


def test_a_rule_of_integration_goes_before_other_gains() -> None:
    """On the lines a rectangular integral is a trapezoidal one with another kp."""
    given, true = (ga.Cascade(ga.PI(0.1, 6.0, rule=rule), PERIOD) for rule in ("trapezoidal", "backward"))
    rec = jump_log(jump_levels(4, 15, on_lines=True), 4, true)
    with threadpool_limits(1, user_api="blas"):
        other = corrected([rec], given)
    assert other is not None and other.controller == true and not other.estimates
    assert [f.effect for f in wrong_numbers([rec], given, other)] == ["integration_rule"]
