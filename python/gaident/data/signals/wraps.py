"""Counters that overflow: a position that starts again at the other end of its range, a velocity or torque of the wrong sign.

A wrap is a step d(n) = x(n+1) - x(n) of nearly the whole range seen so far, between steps p before and after it that are small,
alike and of the other sign: the motion goes on as if nothing had happened. The counter's range is

    M = |d| + |p|        p: mean of the steps before and after, in the direction of the motion

to within the difference of the two; where it has a usual range (2^8 .. 2^32, 1, 360, 2 pi, counts per turn, ...), it is that.
Where the steps beside it differ by more than half or are 0, as of an encoder at low speed, only a usual range counts.
A position is continued: x + k M, k the wraps so far.
A glitch, which jumps back at once, is no wrap. Nor is a jump of a rotor that moves by more than a quarter of M in a sample.
Beside a velocity in the same unit the position has wrapped only where the continued one moves as that velocity says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.policy.table import POLICY

__all__ = ["Unwrapper", "continued", "overflow", "wrapped_words"]

Vector = NDArray[np.float64]

BLOCK = 1 << 16  # no decision: memory; values that are looked at together
_USUAL = (1.0, 100.0, 360.0, 3600.0, 36000.0, 360000.0, 1000.0, 2.0 * math.pi, *(float(2**k) for k in range(8, 33)))
_INTEGERS = (float(2**16), float(2**32))  # of an integer that overflows


def _clean(x: Vector, usual: Sequence[float]) -> tuple[NDArray[np.intp], Vector]:
    """(n of each clean jump from x(n) to x(n+1), what it lacks of M: the mean step beside it)."""
    if len(x) < 4:  # no decision: how many values a jump with a step on either side has
        return np.zeros(0, dtype=np.intp), np.zeros(0)
    at = _jumps(x)
    jump, before, after = (x[at + k + 1] - x[at + k] for k in (0, -1, 1))
    size = np.abs(jump)
    beside = np.maximum(np.abs(before), np.abs(after))
    clean = (beside <= POLICY.wrap_beside * size) & (np.abs(before - after) <= POLICY.wrap_alike * size)
    lacking = 0.5 * np.abs(before + after)
    sign = -np.sign(jump)
    steady = (
        (sign * before > 0.0) & (sign * after > 0.0) & (np.minimum(np.abs(before), np.abs(after)) >= POLICY.wrap_steady * beside)
    )
    # no decision: rounding: digits that a range is logged with
    known = np.array([any(abs(m - s) <= 1e-3 * m for m in usual) for s in size + lacking], dtype=bool)
    came = sign * (x[at] - x[np.maximum(at - POLICY.wrap_reach, 0)])
    went = sign * (x[np.minimum(at + 1 + POLICY.wrap_reach, len(x) - 1)] - x[at + 1])
    clean &= steady | (known & (came >= 0.0) & (went >= 0.0) & (came + went > 0.0))
    return at[clean], lacking[clean]


def _jumps(x: Vector) -> NDArray[np.intp]:
    """n of each step from x(n) to x(n+1) of nearly the whole range, with a step on either side; a long signal part by part."""
    least, found = POLICY.wrap_jump * float(np.ptp(x)), [np.zeros(0, dtype=np.intp)]
    if not least > 0.0:
        return found[0]
    for start in range(1, len(x) - 2, BLOCK):
        steps = np.diff(x[start : min(start + BLOCK, len(x) - 2) + 1])
        found.append(np.flatnonzero(np.abs(steps) >= least) + start)
    return np.concatenate(found)


class Unwrapper:
    """A position made continuous as it comes in, block by block; usual: more ranges that a counter may have, in its unit."""

    def __init__(self, usual: Sequence[float] = ()) -> None:
        self.usual = (*usual, *_USUAL)
        self.period: float | None = None
        self.wraps = 0
        self._tail = np.zeros(0)  # the last values as they came, for a jump between two blocks
        self._turns = 0.0

    def push(self, values: Vector) -> Vector:
        """The next values, continued; they are not changed where nothing wraps."""
        x = np.concatenate([self._tail, values])
        if self.period is None:
            self.period = self._period(x)
        if self.period is not None and len(values):
            before = self._tail[-1:] if len(self._tail) else values[:1]
            k = -np.round(np.diff(np.concatenate([before, values])) / self.period)
            turns = self._turns + np.cumsum(k)
            self.wraps += int(np.count_nonzero(k))
            self._turns = float(turns[-1])
            values = values + turns * self.period
        self._tail = x[-3:]
        return values

    def _period(self, x: Vector) -> float | None:
        """M from the clean jumps; None where there is none, or where other steps would be taken for wraps."""
        at, lacking = _clean(x, self.usual)
        if not len(at):
            return None
        d = np.diff(x)
        found = np.abs(d[at]) + lacking
        period = float(np.median(found))
        # no decision: rounding: digits that a range is logged with
        slack = max(float(np.abs(d[at - 1] - d[at + 1]).max()), 1e-3 * period)
        near = [m for m in self.usual if abs(m - period) <= slack and m >= float(np.ptp(x))]
        period = min(near, key=lambda m: abs(m - period), default=period)
        rest = np.abs(d - period * np.round(d / period))
        return period if float(np.quantile(rest, POLICY.wrap_spared)) < POLICY.wrap_beside * period else None


def continued(x: Vector, velocity: Vector, dt: float, scaled: bool = False) -> tuple[Vector, float, int] | None:
    """(a position made continuous, M, how often it wrapped) beside its velocity, sampled every dt [s]; None where nothing wraps.

    A jump that the velocity has too is a motion.
    scaled: the velocity is that of another shaft: the steps without a jump say by which factor s it moves the position,

        s = sum(d(n) v(n)) / sum(v(n)^2)    d(n): step from x(n) to x(n+1),  v(n) = (dt/2) (velocity(n) + velocity(n+1))
    """
    one = Unwrapper()
    with np.errstate(over="ignore", invalid="ignore"):
        found = one.push(x)
    if one.period is None:
        return None
    jumps = np.abs(np.diff(found - x)) > 0.5 * one.period  # no decision: rounding: a whole number of periods
    moved = 0.5 * dt * (velocity[:-1] + velocity[1:])
    if scaled:
        moved *= _slope(moved[~jumps], np.diff(found)[~jumps])
    off = np.diff(found)[jumps] - moved[jumps]
    return (found, one.period, one.wraps) if float(np.abs(off).max()) < POLICY.wrap_beside * one.period else None


def _slope(x: Vector, y: Vector) -> float:
    """The factor s with which s x is nearest to y; 0 where x rests."""
    size = float(np.abs(x).max(initial=0.0))
    if not size > 0.0:
        return 0.0
    return float((x / size) @ y / ((x / size) @ x))


def wrapped_words(wraps: int, period: float, unit: str, what: str = "position") -> Text:
    """What was done to a position that wrapped.

    unit: of `period`, with a space before it, or nothing; what: the position's name.
    """
    times = "once" if wraps == 1 else f"{wraps} times"
    return say("The {} wrapped {}, by {:.6g}{}, and was continued over these jumps.", what, times, period, unit)


def overflow(x: Vector) -> tuple[int, float] | None:
    """(n, M) where an integer overflowed from x(n) to x(n+1), M its 2^16 or 2^32 steps in the unit of x; None where none did.

    The jump has to be as long as 2^16 or 2^32 of the smallest steps between values: a torque that is reversed also jumps.
    """
    at, lacking = _clean(x, ())
    if not len(at):
        return None
    distinct = np.unique(x)
    gaps = np.diff(distinct)
    step = float(gaps[gaps > 1e-9 * float(np.abs(x).max())].min())
    for n, more in zip(at, lacking, strict=True):
        size = abs(float(x[n + 1] - x[n])) + float(more)
        for integer in _INTEGERS:
            if abs(size / (integer * step) - 1.0) < POLICY.unit_shown:
                return int(n), integer * step
    return None
