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
    size = np.log(np.abs(L))
    crosses = (size[:, :-1] >= 0.0) != (size[:, 1:] >= 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(crosses, size[:, :-1] / (size[:, :-1] - size[:, 1:]), 0.0)
        phase = np.angle(-L[:, :-1]) + share * np.angle(L[:, 1:] / L[:, :-1])
    away = np.abs(np.remainder(phase + np.pi, 2.0 * np.pi) - np.pi)
    return np.asarray(np.min(np.where(crosses, np.degrees(away), np.inf), axis=1, initial=np.inf))


def gain_margins(L: Complex) -> Vector:
    """Least factor, upwards or downwards, that takes L to -1 [dB], (S,); infinite where L is never real and negative."""
    side = np.angle(-L)  # 0 where L is real and negative
    turned = np.angle(L[:, 1:] / L[:, :-1])
    crosses = (np.sign(side[:, :-1]) != np.sign(side[:, :-1] + turned)) & (np.abs(side[:, :-1]) < 0.5 * np.pi)
    crosses |= (np.sign(side[:, 1:]) != np.sign(side[:, 1:] - turned)) & (np.abs(side[:, 1:]) < 0.5 * np.pi)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.clip(np.where(crosses, -side[:, :-1] / turned, 0.0), 0.0, 1.0)
        size = np.log(np.abs(L[:, :-1])) * (1.0 - share) + np.log(np.abs(L[:, 1:])) * share
    found = np.min(np.where(crosses, np.abs(size), np.inf), axis=1, initial=np.inf)
    last = L[:, -1]  # at half the sampling frequency every loop is real
    at_end = np.where(last.real < 0.0, np.abs(np.log(np.abs(last))), np.inf)
    return decibels(np.minimum(found, at_end))


def decibels(nepers: Vector) -> Vector:
    """dB of the natural logarithm of a size."""
    return np.asarray(nepers * 20.0 / np.log(10.0))


def sensitivity_peaks(L: Complex) -> Vector:
    """Largest |1/(1 + L)| (S,): -1 is nearest to a point of L, or to the straight line between two of them."""
    a, side = 1.0 + L[:, :-1], L[:, 1:] - L[:, :-1]
    along = np.clip(-(a * side.conj()).real / np.maximum(np.abs(side) ** 2, 1e-300), 0.0, 1.0)
    return np.asarray(1.0 / np.min(np.abs(a + along * side), axis=1))


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
