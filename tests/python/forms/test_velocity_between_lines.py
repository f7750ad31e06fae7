"""What a controller read between the lines of a slow log: their noise is not followed, and several parts of a form are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_smoothing_spline
from threadpoolctl import threadpool_limits

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.control.smoothing import _factor_of, expected_at
from gaident.control.ticks import smooth_between, straight_between
from gaident.diagnosis.controller.form_findings import loop_of
from loop_cases import PERIOD

KP, KI, EVERY = 0.0334, 2.44, 4
BARE = ga.Cascade(ga.PI(KP, KI), PERIOD)
NOTCH = ga.Notch(frequency=360.0, numerator_damping=0.1, denominator_damping=0.7)


def swing(n: int) -> np.ndarray:
    x = np.arange(n)
    return 30.0 * np.sin(x / 17.0) + 12.0 * np.cos(x / 41.0)


def test_the_spline_is_that_of_scipy_with_the_same_factor() -> None:
    line = swing(300) + 0.2 * np.random.default_rng(1).standard_normal(300)
    spline = make_smoothing_spline(np.arange(300.0), line, lam=_factor_of(line))
    assert np.abs(expected_at(line) - spline(np.arange(300.0))).max() < 1e-9


def test_a_spike_is_no_noise_of_the_other_lines() -> None:
    line = swing(400) + 0.05 * np.random.default_rng(6).standard_normal(400)
    spoiled = line + 50.0 * (np.arange(400) == 200)
    off = expected_at(spoiled) - expected_at(line)
    assert np.abs(off).max() < 2.0 and np.abs(np.delete(off, slice(190, 211))).max() < 0.1


def test_between_the_lines_the_noise_of_the_lines_is_not_followed() -> None:
    at, noise = np.arange(1600) / EVERY, 0.2 * np.random.default_rng(2).standard_normal(400)
    true = 30.0 * np.sin(at / 17.0) + 12.0 * np.cos(at / 41.0)
    line, between = true[::EVERY] + noise, np.arange(1600) % EVERY != 0
    for made in (smooth_between(line, EVERY), straight_between(line, EVERY)):
        assert np.array_equal(made[::EVERY], line)
        within = between & (at < 398)
        assert np.std((made - true)[within]) < 0.5 * np.std((CubicSpline(at[::EVERY], line)(at) - true)[within])


def test_a_velocity_without_noise_is_that_of_a_spline_through_its_lines() -> None:
    line = swing(400)
    through = CubicSpline(np.arange(400), line)(np.arange(399 * EVERY) / EVERY)
    assert np.abs(smooth_between(line, EVERY)[: 399 * EVERY] - through).max() < 1e-3
    few = np.array([1.0, 2.0, 4.0, 8.0])
    assert np.array_equal(expected_at(few), few) and np.array_equal(smooth_between(few, 1), few)


def noisy(loop: ga.Cascade, seed: int) -> ga.Record:
    """1200 lines of one mass under levels with a PRBS, noise of 0.1 rad/s on what the controller reads."""
    skip_without_library()
    rng = np.random.default_rng(seed)
    axis = Plant(J=2.6e-4, D=1.5e-3, kp=KP, ki=KI, dt=EVERY * PERIOD, cascade=loop)
    chips = np.repeat(rng.choice([-1.5, 1.5], 150), 8)
    whole = np.repeat(np.repeat(rng.uniform(-40.0, 40.0, 12), 100) + chips, EVERY)
    whole[: 20 * EVERY] = 0.0
    log = run_drive(axis, whole, velocity_noise=0.1 * rng.standard_normal(len(whole)))
    return ga.Record(axis.dt, command=whole[::EVERY], velocity=log.velocity[::EVERY].copy(), torque=log.torque[::EVERY].copy())


@pytest.mark.parametrize(
    ("loop", "expected"),
    [
        (
            replace(BARE, velocity=ga.PI(KP, KI, command_weight=0.0), torque_filters=(NOTCH,)),
            {"command_weight": {"weight": 0.0}, "torque_filter": {"frequency": 360.0, "denominator_damping": 0.7}},
        ),
        (
            replace(BARE, velocity=ga.PI(1.12 * KP, 0.89 * KI), torque_filters=(ga.LowPass(5e-4),)),
            {"other_gains": {"kp": 1.12 * KP, "ki": 0.89 * KI}, "torque_filter": {"time_constant": 5e-4}},
        ),
    ],
)
def test_several_parts_of_a_form_behind_noise_that_was_not_logged(
    loop: ga.Cascade, expected: dict[str, dict[str, float]]
) -> None:
    with threadpool_limits(1, user_api="blas"):
        found = {f.effect: f.parameters for f in loop_of([noisy(loop, 3)], BARE).findings}
    assert set(found) == set(expected)
    for name, numbers in expected.items():
        for parameter, value in numbers.items():
            estimate = found[name][parameter]
            assert abs(estimate.value - value) < max(5.0 * estimate.std, 0.02 * value), (name, parameter, estimate)
            assert estimate.std < 0.05 * max(value, 0.2)
