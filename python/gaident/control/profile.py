"""A position command between the lines of its log, as a controller makes it that computes the profile at its own clock.

Between two lines it is the cubic through four of them.
Where the acceleration jumps, as at the corners of a trapezoidal velocity, no polynomial goes through the lines on both sides.
There the parabola L of the three lines before goes over into the parabola R of the three lines after,
at the time at which both have the same position and the same slope:

    R(t) - L(t) = a (t - t*)^2 + c,   c = 0

With the time between two lines as unit, -c/a is at most 1/(4 r^2) where a controller adds slopes up at its samples, r to a line.
Of a cubic c/a is 0.42.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import at_the_clock, cubics
from gaident.policy.table import POLICY

__all__ = ["profile_between"]

Vector = NDArray[np.float64]
Parabola: TypeAlias = tuple[Vector, Vector, Vector]
"""x0, x1, x2 of x0 + x1 t + x2 t^2 over each interval; t from 0 at its line to 1 at the next."""

BEFORE, AFTER = 2, 3  # no decision: lines that the parabolas of an interval take beside its own


def profile_between(line: Vector, every: int) -> Vector:
    """The positions at the controller's samples (n every,), of those at the lines (n,) [rad]."""
    if every == 1 or len(line) <= BEFORE + AFTER:
        return at_the_clock(line, every)
    p = [x for x in np.lib.stride_tricks.sliding_window_view(_continued(line), BEFORE + 1 + AFTER).T]
    here, bent, bent_after = p[2], p[3] - 2.0 * p[2] + p[1], p[4] - 2.0 * p[3] + p[2]
    rise = p[3] - here
    before = here, (3.0 * here - 4.0 * p[1] + p[0]) / 2.0, (here - 2.0 * p[1] + p[0]) / 2.0
    slope, half = (-3.0 * p[3] + 4.0 * p[4] - p[5]) / 2.0, (p[5] - 2.0 * p[4] + p[3]) / 2.0
    after = p[3] - slope + half, slope - 2.0 * half, half
    corner, at = _corners(before, after, _noise(line))
    # What goes through an interval beside a corner takes no line from behind it.
    ahead, behind = np.append(corner[1:], False), np.append(False, corner[:-1])
    bent, bent_after = np.where(behind, bent_after, bent), np.where(ahead, bent, bent_after)
    bent, bent_after = (np.where(ahead & behind, 0.0, x) for x in (bent, bent_after))
    t = np.arange(every) / every
    curved = cubics(here, rise, bent, bent_after, every)
    turned = np.where(t[None, :] <= at[:, None], _at(before, t), _at(after, t))
    return np.where(corner[:, None], turned, curved).ravel()


def _continued(line: Vector) -> Vector:
    """The lines with some before the first and behind the last, on the parabolas of the first and the last three."""

    def beyond(end: Vector, count: int) -> list[float]:
        a, b, c = end
        return [float(a + j * (a - b) + 0.5 * j * (j + 1) * (a - 2.0 * b + c)) for j in range(1, count + 1)]

    return np.concatenate([beyond(line[:3], BEFORE)[::-1], line, beyond(line[:-4:-1], AFTER)])  # no decision: a formula


def _corners(before: Parabola, after: Parabola, noise: float) -> tuple[NDArray[np.bool_], Vector]:
    """(whether the acceleration jumps in each interval, where)."""
    apart, slope, a = (y - x for x, y in zip(before, after, strict=True))
    seen = np.abs(a) > POLICY.corner_seen * noise
    a = np.where(seen, a, 1.0)
    at = -slope / (2.0 * a)  # no decision: a formula: a parabola
    c = apart - slope**2 / (4.0 * a)
    return seen & (np.abs(c) < POLICY.corner_square * np.abs(a)) & (at >= 0.0) & (at <= 1.0), at


def _noise(line: Vector) -> float:
    """What rounding and a changing acceleration make of a third difference: the median of those that are not 0."""
    third = np.abs(np.diff(line, 3))
    third = third[third > 0.0]
    return float(np.median(third)) if len(third) else 0.0


def _at(x: Parabola, t: Vector) -> Vector:
    made: Vector = x[0][:, None] + x[1][:, None] * t + x[2][:, None] * t * t
    return made
