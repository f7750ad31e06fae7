"""Margins of loops from their frequency responses at a grid of frequencies, S loops side by side, (S, f).

A margin is the least one of all crossings: phase at |L| = 1, gain, upwards or downwards, where L is real and negative.
Between two frequencies ln L goes straight.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["below", "decibels", "gain_margins", "phase_margins", "sensitivity_peaks"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]


def phase_margins(L: Complex) -> Vector:
    """Least distance of the phase from -180 degrees where |L| is 1 [deg], (S,); infinite where it never is."""
    beyond = L.real**2 + L.imag**2 >= 1.0
    at = np.nonzero(beyond[:, :-1] != beyond[:, 1:])
    before, after = L[at], L[at[0], at[1] + 1]
    below, above = np.log(np.abs(before)), np.log(np.abs(after))
    phase = np.angle(-before) + below / (below - above) * np.angle(after / before)
    away = np.abs(np.remainder(phase + np.pi, 2.0 * np.pi) - np.pi)
    return _least(np.degrees(away), at[0], len(L))


def gain_margins(L: Complex) -> Vector:
    """Least factor, upwards or downwards, that takes L to -1 [dB], (S,); infinite where L is never real and negative."""
    left, upper = L.real < 0.0, np.signbit(L.imag)
    at = np.nonzero(((upper[:, :-1] != upper[:, 1:]) | (L.imag[:, :-1] == 0.0)) & (left[:, :-1] | left[:, 1:]))
    before, after = L[at], L[at[0], at[1] + 1]
    side, turned = np.angle(-before), np.angle(after / before)  # 0 where L is real and negative
    end = side + turned
    crosses = (np.sign(side) != np.sign(end)) & (np.minimum(np.abs(side), np.abs(end)) < 0.5 * np.pi)
    side, turned, before, after, rows = side[crosses], turned[crosses], before[crosses], after[crosses], at[0][crosses]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(np.where(turned != 0.0, -side / turned, 0.0), 0.0, 1.0)
        size = np.log(np.abs(before)) * (1.0 - share) + np.log(np.abs(after)) * share
    found = _least(np.abs(size), rows, len(L))
    last = L[:, -1]  # at half the sampling frequency every loop is real
    with np.errstate(divide="ignore"):
        at_end = np.where(last.real < 0.0, np.abs(np.log(np.abs(last))), np.inf)
    return decibels(np.minimum(found, at_end))


def _least(values: Vector, rows: NDArray[np.intp], count: int) -> Vector:
    """The least value of each row (count,); infinite where there is none."""
    found = np.full(count, np.inf)
    np.minimum.at(found, rows, values)
    return found


def decibels(nepers: Vector) -> Vector:
    """dB of the natural logarithm of a size."""
    return np.asarray(nepers * 20.0 / np.log(10.0))


def sensitivity_peaks(L: Complex) -> Vector:
    """Largest |1/(1 + L)| (S,): -1 is nearest to a point of L, or to the straight line between two of them."""
    a, side = 1.0 + L[:, :-1], L[:, 1:] - L[:, :-1]
    length = np.maximum(side.real**2 + side.imag**2, 1e-300)
    along = np.clip(-(a.real * side.real + a.imag * side.imag) / length, 0.0, 1.0)
    near = (a.real + along * side.real) ** 2 + (a.imag + along * side.imag) ** 2
    return np.asarray(1.0 / np.sqrt(np.min(near, axis=1)))


def below(T: Complex, omega: Vector, level: float) -> Vector:
    """First frequency [rad/s] at which |T| falls below a level, (S,); the highest one where it never does."""
    size = np.abs(T)
    under = size < level
    first = np.where(under.any(axis=1), under.argmax(axis=1), size.shape[1] - 1)
    rows = np.arange(len(size))
    before = np.maximum(first - 1, 0)
    a, b = np.log(size[rows, before] / level), np.log(np.maximum(size[rows, first], 1e-300) / level)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where((a > 0.0) & (b < 0.0), a / (a - b), 1.0)
    return np.asarray(omega[rows, before] ** (1.0 - share) * omega[rows, first] ** share)
