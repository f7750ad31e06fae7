"""Forms of a controller of which the torque was measured, with its noise, in a log that is slower than the controller."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.controller.wrong_number import other_rules

skip_without_library()

PERIOD, EVERY = 2.5e-4, 4  # s; controller samples to a line of the log
KP, KI, LAG = 0.31, 24.0, 1.1e-3  # N m s/rad, N m/rad, s
DRIVE = Plant(J=1.0e-3, D=0.004, JL=1.6e-3, DL=0.005, KG=420.0, DG=0.02, kp=KP, ki=KI, dt=EVERY * PERIOD)
NOISE = 0.008  # N m, of the measured torque


def log_of(rule: str, lag: float, seed: int = 3) -> ga.Record:
    """Levels in both directions; an encoder of 20 bits that is differenced over one sample of the controller."""
    filters = ga.LowPass(time_constant=lag) if lag else ()
    drive = replace(DRIVE, cascade=ga.Cascade(ga.PI(KP, KI, rule=rule), period=PERIOD, torque_filters=filters))
    rng = np.random.default_rng(seed)
    levels = np.repeat(np.concatenate([[0.0], rng.uniform(-60.0, 60.0, 20)]), 250)
    log = rig(drive, levels, {}, Noise(white=0.0, encoder=2 * np.pi / 2**20, differenced=True), seed=seed)
    assert log.torque is not None
    torque = np.round((log.torque + NOISE * rng.standard_normal(len(log))) / 0.006) * 0.006
    return log.with_channels(torque=torque, torque_is="measured")


@pytest.mark.parametrize("rule", ["backward", "trapezoidal"])
def test_a_torque_filter_is_found_behind_the_noise_of_a_measured_torque(rule: str) -> None:
    shown = form_shown([log_of(rule, LAG)], ga.PI(KP, KI), every=EVERY)
    assert shown is not None and set(shown.numbers) <= {"torque_filter", "integration_rule"}
    value, std = shown.numbers["torque_filter"]["time_constant"]
    assert value == pytest.approx(LAG, rel=0.03) and abs(value - LAG) < 3.0 * std


@pytest.mark.parametrize("rule", ["backward", "forward"])
def test_a_rule_that_was_given_right_is_kept_and_no_finding(rule: str) -> None:
    shown = form_shown([log_of(rule, LAG)], ga.PI(KP, KI, rule=rule), every=EVERY)
    assert shown is not None and set(shown.numbers) == {"torque_filter"} and shown.controller.velocity.rule == rule


def test_a_rule_that_was_given_wrong_is_a_finding_where_the_torque_tells_it() -> None:
    exact = rig(
        replace(DRIVE, kp=KP, cascade=ga.Cascade(ga.PI(KP, KI), period=PERIOD)),
        np.repeat([0.0, 40.0, -30.0, 20.0, -50.0, 10.0], 250),
        {},
        Noise(white=0.0),
    )
    shown = form_shown([exact], ga.PI(KP, KI, rule="backward"), every=EVERY)
    assert shown is not None and set(shown.numbers) == {"integration_rule"} and shown.controller.velocity.rule == "trapezoidal"


def test_noise_of_a_measured_torque_alone_is_no_filter() -> None:
    assert form_shown([log_of("trapezoidal", 0.0)], ga.PI(KP, KI), every=EVERY) is None


def test_the_other_rules_are_fitted_to_the_torque_again_and_the_drives_comes_first() -> None:
    log = log_of("backward", LAG)
    shown = form_shown([log], ga.PI(KP, KI), every=EVERY)
    assert shown is not None
    others = other_rules([log], shown.controller, shown.found)
    assert [one.finding.effect for one in others] == ["integration_rule"] * len(others)
    first = others[0].controller
    assert isinstance(first, ga.Cascade) and first.velocity.rule == "backward"
    (low_pass,) = first.torque_filters
    assert isinstance(low_pass, ga.LowPass) and low_pass.time_constant == pytest.approx(LAG, rel=0.01)


def test_a_rule_that_the_torque_tells_has_no_others() -> None:
    log = log_of("trapezoidal", 0.0)
    assert log.torque is not None
    exact = rig(
        replace(DRIVE, cascade=ga.Cascade(ga.PI(KP, KI), period=PERIOD)),
        np.repeat([0.0, 40.0, -30.0, 20.0], 250),
        {},
        Noise(white=0.0),
    )
    assert other_rules([exact], ga.Cascade(ga.PI(KP, KI), period=PERIOD), None) == []
    assert other_rules([exact], ga.Cascade(ga.PI(KP, ki=0.0), period=PERIOD), None) == []


@pytest.mark.long
def test_filter_and_rule_are_the_whole_difference_and_the_axis_is_linear() -> None:
    """Under the trapezoidal rule the age of the velocity passes for a filter; under the drive's nothing is left."""
    dia = ga.diagnose(log_of("backward", LAG), ga.Cascade(ga.PI(KP, KI), period=PERIOD))
    assert dia.verdict == "explained"
    assert {f.effect for f in dia.causes} == {"torque_filter", "integration_rule"}
    lag = next(f for f in dia.causes if f.effect == "torque_filter").parameters["time_constant"]
    assert lag.value == pytest.approx(LAG, rel=3e-3) and abs(lag.value - LAG) < 4.0 * lag.std
    assert dia.mechanics["inertia"].value == pytest.approx(DRIVE.J + DRIVE.JL, rel=1e-3)
