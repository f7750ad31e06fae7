"""Velocity commands [rad/s] as arrays: holds, ramps, stairs, pseudo-random binary signals.

Every pattern starts and ends at rest and comes back to where it began: whatever goes forwards goes backwards as long, forwards
first, so that the positions swept are 0 to the longest single stroke.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["both_ways", "dithered", "largest_jump", "levels", "rest", "strokes", "triangles"]

Vector = NDArray[np.float64]


def rest(seconds: float, dt: float) -> Vector:
    """Standstill."""
    return np.zeros(max(1, round(seconds / dt)))


def levels(speeds: Sequence[float], dwell: float, slope: float, dt: float, most: int) -> Vector:
    """Each of the speeds held for `dwell` [s], reached from the one before at `slope` [rad/s^2] (inf: at once), back to 0.

    Of a ramp only the first `most` samples are made: with it the command is longer than there is time for.
    """
    parts, now = [], 0.0
    for speed in [*speeds, 0.0]:
        count = 0.0 if not np.isfinite(slope) else np.floor(abs(speed - now) / max(slope * dt, 1e-300))
        parts.append(now + (speed - now) * np.arange(1, int(min(count, most)) + 1) / (count + 1.0))
        parts.append(np.full(max(1, round(dwell / dt)), speed))
        now = speed
    return np.concatenate(parts)


def strokes(speeds: Sequence[float], dwell: float, travel: float, slope: float, dt: float, most: int) -> Vector:
    """Each speed forwards and backwards for up to `dwell` [s], shortened so that no stroke is longer than `travel` [rad]."""
    parts = []
    for speed in speeds:
        ramp = 0.0 if not np.isfinite(slope) else speed / slope
        # One stroke covers speed (dwell + ramp): half a ramp at each end.
        held = min(dwell, travel / speed - ramp) if speed > 0.0 else dwell
        parts.append(both_ways(levels([speed], max(held, dt), slope, dt, most)[: -max(1, round(max(held, dt) / dt))], dt))
    return np.concatenate(parts)


def both_ways(forwards: Vector, dt: float) -> Vector:
    """A pattern, the same backwards, and a sample of rest behind each."""
    still = rest(dt, dt)
    return np.concatenate([forwards, still, -forwards, still])


def triangles(tops: Sequence[float], period: float, travel: float, dt: float) -> Vector:
    """One triangle through zero per top speed: up, down through zero, up again; shortened to sweep no more than `travel`."""
    parts = []
    for top in tops:
        # A half period sweeps top * period / 4.
        quarter = max(2, round(min(period, 4.0 * travel / top) / 4.0 / dt))
        rise = top * np.arange(quarter) / quarter
        parts += [rise, top - rise, -rise, rise - top]
    return np.concatenate([*parts, np.zeros(1)])


def dithered(command: Vector, amplitude: float, clock: int, seed: int = 0) -> Vector:
    """`command` with a pseudo-random binary signal of `amplitude` [rad/s] and `clock` samples a bit where it holds a speed.

    Ramps stay as they are: their torque leaves less for the signal's.
    A command at rest throughout gets it throughout, but for the last sample. The signal's mean is zero.
    """
    held = (command != 0.0) & (np.diff(command, prepend=0.0) == 0.0)
    moving = held if np.any(command != 0.0) else np.arange(len(command)) < len(command) - 1
    bits = np.random.default_rng(seed).choice((-1.0, 1.0), -(-len(command) // clock))
    signal = np.repeat(bits, clock)[: len(command)] * moving
    signal -= moving * (signal.sum() / max(int(moving.sum()), 1))
    out: Vector = command + amplitude * signal
    return out


def largest_jump(command: Vector, samples: int) -> float:
    """Largest change of the command [rad/s] within so many samples, from rest on and back to it."""
    padded = np.pad(command, samples)
    return max(float(np.abs(padded[k:] - padded[:-k]).max()) for k in range(1, samples + 1))
