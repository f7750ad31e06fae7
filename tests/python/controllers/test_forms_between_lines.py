"""Which form a controller has, where its command jumped between the lines of a slow log: the times are found with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import cholesky_banded
from threadpoolctl import threadpool_limits

import gaident as ga
from drive_rig import skip_without_library
from gaident.diagnosis.controller import lost_times
from gaident.diagnosis.controller.form_findings import loop_of
from gaident.diagnosis.controller.forms import form_shown
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.timed_record import TimedRecord
from gaident.policy.table import POLICY
from loop_cases import PERIOD as T
from loop_cases import jump_levels as levels
from loop_cases import jump_log as record

skip_without_library()

KP, KI = 0.1, 6.0
GIVEN = ga.PI(KP, KI)
NOTCH = ga.Notch(frequency=120.0, numerator_damping=0.1, denominator_damping=0.7)
LOOPS: dict[str, tuple[ga.Cascade, dict[str, dict[str, float]]]] = {
    "backward": (ga.Cascade(replace(GIVEN, rule="backward"), T), {"integration_rule": {}}),
    "IP": (ga.Cascade(replace(GIVEN, command_weight=0.0), T), {"command_weight": {"weight": 0.0}}),
    "half": (ga.Cascade(replace(GIVEN, command_weight=0.5), T), {"command_weight": {"weight": 0.5}}),
    "other gains": (ga.Cascade(ga.PI(0.9 * KP, 1.1 * KI), T), {"other_gains": {"kp": 0.9 * KP, "ki": 1.1 * KI}}),
    "low pass": (ga.Cascade(GIVEN, T, torque_filters=(ga.LowPass(4e-4),)), {"torque_filter": {"time_constant": 4e-4}}),
    "notch": (ga.Cascade(GIVEN, T, torque_filters=(NOTCH,)), {"torque_filter": {"frequency": 120.0}}),
    "velocity filter": (
        ga.Cascade(GIVEN, T, velocity_filters=(ga.LowPass(6e-4),)),
        {"velocity_feedback_filter": {"time_constant": 6e-4}},
    ),
    "command filter": (
        ga.Cascade(GIVEN, T, command_filters=(ga.LowPass(3e-3),)),
        {"command_filter": {"time_constant": 3e-3}},
    ),
}


def shown(rec: ga.Record, every: int) -> Any:
    with threadpool_limits(1, user_api="blas"):
        return form_shown([rec], GIVEN, every=every)


@pytest.mark.long
@pytest.mark.parametrize("every", [2, 4])
@pytest.mark.parametrize("name", LOOPS)
def test_the_form_is_found_with_the_times(name: str, every: int) -> None:
    loop, expected = LOOPS[name]
    rec = record(levels(every, 11), every, loop)
    found = shown(rec, every)
    assert found is not None and set(found.numbers) == set(expected)
    for part, numbers in expected.items():
        for parameter, value in numbers.items():
            got, std = found.numbers[part][parameter]
            assert got == pytest.approx(value, rel=0.02, abs=0.01 if value == 0.0 else None), (part, parameter, std)
    (known,) = timed([rec], found.controller)
    assert isinstance(known, TimedRecord)


@pytest.mark.long
def test_a_record_longer_than_the_regression_reads() -> None:
    """More samples of the controller than `searched_samples`: the jumps of the lines that it reads are looked for, no others."""
    whole = np.concatenate([levels(8, 30 + k) for k in range(9)])
    assert whole.size > POLICY.searched_samples
    loop, expected = LOOPS["backward"]
    found = shown(record(whole, 8, loop), 8)
    assert found is not None and set(found.numbers) == set(expected)


@pytest.mark.long
def test_eight_samples_to_a_line() -> None:
    for name in ("backward", "IP", "low pass"):
        loop, expected = LOOPS[name]
        found = shown(record(levels(8, 12), 8, loop), 8)
        assert found is not None and set(found.numbers) == set(expected), name


def test_the_given_controller_is_no_finding() -> None:
    rec = record(levels(4, 13), 4, ga.Cascade(GIVEN, T))
    assert shown(rec, 4) is None


def test_a_limit_that_was_not_given_is_found_with_the_times() -> None:
    limited = ga.Cascade(replace(GIVEN, torque_limit=1.5, anti_windup="hold"), T)
    found = shown(record(levels(4, 14), 4, limited), 4)
    assert found is not None and set(found.numbers) == {"torque_saturation", "anti_windup"}
    assert found.controller.velocity.anti_windup == "hold"
    assert found.numbers["torque_saturation"]["limit"][0] == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize("name", ["backward", "IP", "low pass", "command filter"])
def test_jumps_on_the_lines_are_found_as_such(name: str) -> None:
    loop, expected = LOOPS[name]
    rec = record(levels(4, 15, on_lines=True), 4, loop)
    found = shown(rec, 4)
    assert found is not None and set(found.numbers) == set(expected)
    assert timed([rec], found.controller)[0] is rec


def test_gains_that_were_not_given_are_estimated_with_the_times() -> None:
    rec = record(levels(4, 16), 4, ga.Cascade(GIVEN, T))
    with threadpool_limits(1, user_api="blas"):
        loop = loop_of([rec], ga.Cascade(ga.PI(None, None), T))
    assert loop.findings == ()
    for name, value in (("velocity.kp", KP), ("velocity.ki", KI)):
        estimate = loop.estimates[name]
        assert estimate.value == pytest.approx(value, rel=0.01) and abs(estimate.value - value) < 5.0 * estimate.std
    assert loop.controller is not None
    (known,) = timed([rec], loop.controller)
    assert isinstance(known, TimedRecord) and np.ptp(known.command_between - rec.command[:, None], axis=1).max() > 1.0


def test_a_covariance_that_rounding_makes_none_gets_more_noise() -> None:
    """Two steps that depend wholly on each other, as in a log without noise; a sure one keeps every bit."""
    whole = lost_times._factor_of(np.array([[1.0, 1.0], [1.0, 0.0]]))
    lower = np.array([[whole[0, 0], 0.0], [whole[1, 0], whole[0, 1]]])
    np.testing.assert_allclose(lower @ lower.T, np.ones((2, 2)), atol=1e-11)
    sure = np.array([[2.0, 3.0], [1.0, 0.0]])
    np.testing.assert_array_equal(lost_times._factor_of(sure), cholesky_banded(sure, lower=True))
