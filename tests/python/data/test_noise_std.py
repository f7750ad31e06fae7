"""The noise of a velocity, where the axis rests, where the encoder is coarse, and where neither is so."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gaident.models.starts import noise_std, rounding_noise

N = 20_000
TIME = 1e-3 * np.arange(N)
SMOOTH = 20.0 * np.sin(2.0 * np.pi * 1.5 * TIME)
WHITE = np.random.default_rng(0).standard_normal(N)
RESTS = TIME % 1.0 < 0.6


def over_all(w: NDArray[np.float64]) -> float:
    """The median over all third differences, runs of equal values among them."""
    return float(1.4826 * np.median(np.abs(np.diff(w, 3))) / np.sqrt(20.0))


@pytest.mark.parametrize(
    "w",
    [WHITE, SMOOTH, SMOOTH + 0.2 * WHITE, np.round(SMOOTH + 0.2 * WHITE, 1), WHITE[:20], SMOOTH[:21], np.arange(30.0) ** 3],
    ids=["white", "smooth", "both", "rounded to half its noise", "20 samples", "21 samples", "cubic"],
)
def test_without_runs_of_equal_values_nothing_changes(w: NDArray[np.float64]) -> None:
    assert noise_std(w) == pytest.approx(over_all(w), rel=0.05)
    if len(np.unique(w)) == len(w):
        assert noise_std(w) == over_all(w)


def test_white_noise_is_what_it_is() -> None:
    assert noise_std(WHITE) == pytest.approx(1.0, rel=0.03)
    assert noise_std(SMOOTH + 0.2 * WHITE) == pytest.approx(0.2, rel=0.03)
    assert noise_std(SMOOTH) < 1e-4


def test_an_axis_that_rests_most_of_the_time() -> None:
    w = np.where(RESTS, 0.0, SMOOTH + 0.2 * WHITE)  # noise of 1 % of the speed, in motion alone
    assert over_all(w) == 0.0
    assert noise_std(w) == pytest.approx(0.2, rel=0.05)
    assert noise_std(np.where(RESTS, 0.0, SMOOTH)) < 1e-4


@pytest.mark.parametrize("step", [0.05, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("rests", [False, True])
def test_a_quantised_velocity(step: float, rests: bool) -> None:
    """The right order: between two steps of a coarse encoder only the samples that flicker are seen, which doubles it at most."""
    for noise in (0.0, 0.2):
        w = step * np.round((SMOOTH + noise * WHITE) / step)
        error = float(np.std(w - SMOOTH))
        w = np.where(RESTS, 0.0, w) if rests else w
        assert 0.6 * error < noise_std(w, step) < 2.4 * error
        assert noise_std(w, step) >= step / np.sqrt(12.0)


def test_what_never_moves_or_only_jumps_shows_no_noise() -> None:
    jumps = np.repeat([0.0, 3.0, -2.0, 5.0], 50)
    assert noise_std(np.zeros(50)) == noise_std(jumps) == 0.0
    assert noise_std(jumps, 1.0) == pytest.approx(1.0 / np.sqrt(12.0))


@pytest.mark.parametrize("speed", [3.0, 40.0])
def test_the_difference_of_two_rounded_angles_has_the_noise_of_two_roundings(speed: float) -> None:
    """Of a coarse encoder the median of the third differences is that of whole steps, and less."""
    dt, step = 125e-6, 2.0 * np.pi / 2**19
    t = dt * np.arange(8 * 4000)
    angle = -speed / 5.0 * np.cos(5.0 * np.minimum(t, 2.0))  # at rest in the end
    true = np.diff(angle, prepend=angle[0]) / dt
    seen = np.diff(np.floor(angle / step), prepend=np.floor(angle[0] / step)) * step / dt
    w, error = seen[::8], (seen - true)[::8]
    noise = rounding_noise(w, step / dt, differenced=True)
    assert noise == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.05)
    assert rounding_noise(w, step / dt, differenced=False) == pytest.approx(step / dt / np.sqrt(12.0))
    assert rounding_noise(np.zeros(10), step / dt, differenced=True) == 0.0
