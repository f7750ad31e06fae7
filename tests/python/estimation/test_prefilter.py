"""The prefilter of output errors: a velocity error as the torque that makes it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

from gaident.estimation.objective import OutputErrors
from gaident.estimation.prefilter import Prefilter

DT, CORNER, INERTIA = 1e-3, 4.0, 2e-3
RNG = np.random.default_rng(5)


def weight(cutoff: float = 40.0) -> Prefilter:
    return Prefilter(DT, CORNER, cutoff, 4)


@pytest.mark.parametrize("cutoff", [5.0, 40.0, 200.0])
def test_white_noise_keeps_its_variance(cutoff: float) -> None:
    noise = RNG.normal(size=(1, 200_000))
    assert np.std(weight(cutoff).of(noise, (200_000,))) == pytest.approx(1.0, rel=0.03)


def test_the_error_of_a_rigid_axis_becomes_the_torque_that_it_lacks() -> None:
    """e = d/(J s + B) behind L is d/J behind the low-pass, but for the scale that all errors share."""
    t = DT * np.arange(8000)
    lacking = 0.3 * np.sign(np.sin(3.0 * t)) + 0.1 * np.sin(11.0 * t)
    pole = np.exp(-CORNER * DT)
    error = lfilter([0.0, (1.0 - pole) / (CORNER * INERTIA)], [1.0, -pole], lacking)
    found = weight().of(error[None, :], (len(error),))[0]
    expected = sosfiltfilt(butter(4, 2.0 * 40.0 * DT, output="sos"), lacking) / INERTIA
    inner = slice(500, -500)
    scale = float(found[inner] @ expected[inner]) / float(expected[inner] @ expected[inner])
    # The torque is held over a sample, half a sample late: 3 % of what changes at 40 Hz.
    assert np.std(found[inner] / scale - expected[inner]) < 0.03 * np.std(expected[inner])
    assert scale > 0.0


def test_each_record_is_filtered_by_itself() -> None:
    parts = [RNG.normal(size=(3, n)) for n in (700, 40, 300)]
    whole = weight().of(np.hstack(parts), (700, 40, 300))
    assert np.array_equal(whole, np.hstack([weight().of(p, (p.shape[1],)) for p in parts]))


def test_a_slow_error_counts_by_its_slope() -> None:
    """What drifts slowly over the record is a small torque, and what is fast beyond the cutoff is none."""
    t = DT * np.arange(20_000)
    inner = slice(500, -500)
    slow, middle, fast = (
        np.std(weight().of(np.sin(2.0 * np.pi * f * t)[None, :], (len(t),))[0, inner]) for f in (0.05, 10.0, 200.0)
    )
    assert slow < 0.1 * middle
    assert fast < 1e-3 * middle


def test_the_balance_is_where_slope_and_error_have_the_same_power() -> None:
    """A sine of w rad/s: its slope is w times itself. Several records are one answer."""
    t = DT * np.arange(6000)
    for angular in (3.0, 40.0):
        e = np.sin(angular * t)
        assert weight().balance(e, (len(e),)) == pytest.approx(angular, rel=0.03)
        assert weight().balance(np.concatenate([e, e]), (len(e), len(e))) == pytest.approx(angular, rel=0.03)


def test_of_a_measured_torque_a_heavier_axis_counts_more_and_a_lighter_one_the_same() -> None:
    """max(J/J_r, 1) times the error: what follows a noisy torque less gains nothing, nor does a shaft that friction holds."""
    E = np.repeat(RNG.normal(size=(1, 500)), 3, axis=0)
    family = OutputErrors(10.0, weight(), INERTIA)
    weighed = family.prefiltered(E, (500,), INERTIA * np.array([0.5, 1.0, 3.0]))
    expected = weight().of(E[:1], (500,))[0]
    assert np.allclose(weighed, expected * np.array([[1.0], [1.0], [3.0]]))
    assert np.array_equal(OutputErrors(10.0, weight()).prefiltered(E, (500,), INERTIA * np.ones(3)), weight().of(E, (500,)))
    assert OutputErrors(10.0).prefiltered(E, (500,)) is E
