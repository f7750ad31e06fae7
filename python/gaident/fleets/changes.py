"""Changes in the course of a parameter, found one log after the other, with a rate of false alarms that is held.

Of an axis, y_i is the logarithm of a parameter x_i whose first 20 logs (`course_before`) are positive, s_i its deviation, T_i the
temperature where it is logged.
Below a tenth of the median of these 20, y is the tangent of the logarithm there, which goes on where x is 0 or negative.
Where the first 20 are not all positive, y is the parameter over the median of their sizes.
Behind each log n, the last m logs, m = 3, 4, 5, 8, 13, 21 and 34, are compared with those before them, b of them, 20 or more:

    y_i = a + c (T_i - T)  is fitted to those before, three times, without what is 3.5 deviations off (`course_clip`) from the
    second time on,
    r_i = y_i - a - c (T_i - T),  v_i = s_i^2 + t^2,  t^2 what the scatter of r shows beyond the s_i,  d_i = r_i/sqrt(v_i),
    z   = sum of clip(d_i, -h, h) over the m logs / sqrt(m + u' C u + w^2 c^2 var(T)),
    h   = the larger of 3.5 and g + 1.5 (`course_apart`),  g the d that most of the logs and three at least reach to one side,

so that one damaged log counts no more than the others, and logs that agree count as far as they are off.
Two damaged ones of three make no change.
The first scale is a median deviation, which twenty logs show to 18 %: what it put too far out comes back in the third fit.
u is the sum of the rows (1, T_i - T) of the m logs over sqrt(v_i), C the inverse of the normal matrix of the fit.
The line is fitted to logs with a temperature, where 20 or more have one, else c = 0; T and var(T) are of these logs.
A log behind them without one is taken for one at T: w is the sum of 1/sqrt(v_i) over such logs, as all of them may have been as
warm or cold.
The scale comes from those of b logs that are kept, k the terms of the fit.
It knows 0.9 (b - k) degrees of freedom (`course_known`), less than all, as what is left out may have been scatter.
|z| is compared with the quantile of Student's distribution with so many, of the probability

    p = R/(7 N),  R = `course_alarms` a year,  N logs a year, of the median step of the first 20,

to either side p/2: 7 N tests of a year, were they independent, would give R false alarms; as they share logs they give less.
A change begins with the m of the largest z, without those at their beginning that are off by less than half their median.
The next one is looked for behind it.
What log n says never depends on later logs: a course that is read every night raises the same alarms as one that is read once.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from gaident.policy.table import POLICY

__all__ = ["Scale", "Shift", "levels_of", "shifts_of"]

Vector = NDArray[np.float64]

LENGTHS = (3, 4, 5, 8, 13, 21, 34)  # no decision: a grid of how many logs a change is behind
MAD = 1.4826  # no decision: a formula: standard deviations in the median deviation of a normal distribution
DAILY = 365.25  # no decision: a unit: logs in a year of a log a day
PASSES = 3  # no decision: a formula: with the median deviation, without what is far off, with what came back
TANGENT = 0.1  # no decision: a formula: of the median, where the logarithm goes on straight


@dataclass(frozen=True)
class Shift:
    """A change: index of its first log, of the log that showed it, its size (of y) with deviation, and z."""

    first: int
    found: int
    size: float
    std: float
    score: float


@dataclass(frozen=True)
class _Line:
    """y = a + c (T - middle) of logs before, the scatter t^2 beyond their deviations, and the |z| that it needs.

    width: c^2 var(T), what a log without a temperature is off by.
    """

    coefficients: Vector
    inverse: NDArray[np.float64]
    scatter: float
    needed: float
    middle: float
    width: float

    def rows(self, temperatures: Vector) -> NDArray[np.float64]:
        """(1, T - middle) of logs (m, 2), or (m, 1) without a temperature."""
        return _rows(temperatures, self.middle)[:, : len(self.coefficients)]


def _rows(temperatures: Vector, middle: float) -> NDArray[np.float64]:
    away = np.where(np.isfinite(temperatures), temperatures - middle, 0.0)
    return np.column_stack([np.ones(len(away)), away])


@dataclass(frozen=True)
class Scale:
    """What makes a parameter relative: of some of its values, of one sign or not, and the median of their sizes."""

    logarithm: bool
    size: float

    @classmethod
    def of(cls, values: Vector) -> Scale:
        """Of the values that decide it (n,)."""
        return cls(bool(np.all(values > 0.0)), float(np.median(np.abs(values))) or 1.0)

    @classmethod
    def of_course(cls, values: Vector) -> Scale:
        """Of a course (n,): its first logs decide, so that no later one changes it."""
        return cls.of(values[: POLICY.course_before])

    def __call__(self, values: Vector, deviations: Vector) -> tuple[Vector, Vector]:
        """(y, s): relative values, whose differences are fractions of the parameter."""
        x, s = values / self.size, deviations / self.size
        if not self.logarithm:
            return x, s
        above = np.maximum(x, TANGENT)
        return np.log(above) + (x - above) / TANGENT, s / above

    def share(self, size: float, std: float) -> tuple[float, float]:
        """(change over what was before, its deviation) of a difference of y."""
        return (float(np.expm1(size)), float(np.exp(size) * std)) if self.logarithm else (size, std)


def shifts_of(values: Vector, deviations: Vector, temperatures: Vector | None, a_year: float = DAILY) -> list[Shift]:
    """The changes of a course, in the order of time; values and deviations as a `Scale` gives them, nan: no temperature.

    a_year: logs of the course in a year, of which the rate of false alarms is one of so many tests.
    """
    alarm = POLICY.course_alarms / (a_year * len(LENGTHS))
    heat = np.full(len(values), np.nan) if temperatures is None else temperatures
    found: list[Shift] = []
    lines: dict[int, _Line] = {}
    begin, n = 0, POLICY.course_before + POLICY.course_after - 1
    while n < len(values):
        best = _best(values, deviations, heat, begin, n, lines, alarm)
        if best is None:
            n += 1
            continue
        found.append(best)
        begin = best.first
        lines.clear()
        n = max(n + 1, begin + POLICY.course_before + POLICY.course_after - 1)
    return found


def _best(y: Vector, s: Vector, heat: Vector, begin: int, n: int, lines: dict[int, _Line], alarm: float) -> Shift | None:
    """The change that log n shows, if it does; lines: by the first log behind them."""
    best: Shift | None = None
    for m in LENGTHS:
        first = n + 1 - m
        if m < POLICY.course_after or first - begin < POLICY.course_before:
            continue
        if first not in lines:
            lines[first] = _line(y[begin:first], s[begin:first], heat[begin:first], alarm)
        line = lines[first]
        behind = slice(first, n + 1)
        rows = line.rows(heat[behind])
        r = y[behind] - rows @ line.coefficients
        sigma = np.sqrt(s[behind] ** 2 + line.scatter)
        u = (rows / sigma[:, None]).sum(axis=0)
        unknown = ~np.isfinite(heat[behind])
        w = float(np.sum(1.0 / sigma[unknown]))
        off = r / sigma
        bound = max(POLICY.course_clip, _agreed(off) + POLICY.course_apart)
        z = float(np.clip(off, -bound, bound).sum() / np.sqrt(m + u @ line.inverse @ u + w**2 * line.width))
        weights = sigma**-2.0
        size = float(np.median(r))
        if abs(z) > line.needed and abs(size) > POLICY.course_material and (best is None or abs(z) > abs(best.score)):
            near = np.abs(off) < 0.5 * abs(float(np.median(off)))  # no decision: a formula: half way
            start = first + int(np.argmin(near))
            mean = (rows * weights[:, None]).sum(axis=0) / weights.sum()
            apart = (float(weights[unknown].sum()) / float(weights.sum())) ** 2 * line.width
            best = Shift(start, n, size, float(np.sqrt(1.0 / weights.sum() + mean @ line.inverse @ mean + apart)), z)
    return best


def _agreed(off: Vector) -> float:
    """How far off most of the logs are, and course_after of them at least."""
    far = np.sort(off if off.sum() > 0.0 else -off)
    return float(far[-max(POLICY.course_after, len(far) // 2 + 1)])


@lru_cache(maxsize=1024)  # no decision: as many quantiles as logs of years have
def _needed(alarm: float, freedom: float) -> float:
    """The |z| that is as rare as that."""
    return float(student.isf(0.5 * alarm, freedom))


def _line(y: Vector, s: Vector, heat: Vector, alarm: float) -> _Line:
    known = np.isfinite(heat)
    middle = width = 0.0
    if known.sum() >= POLICY.course_before:
        y, s, heat = y[known], s[known], heat[known]
        middle = float(np.mean(heat))
        rows = _rows(heat, middle)
    else:
        rows = np.ones((len(y), 1))
    used = np.ones(len(y), dtype=bool)
    scatter = 0.0
    for step in range(PASSES):
        weights = np.where(used, 1.0 / (s**2 + scatter + POLICY.course_scatter**2), 0.0)
        # A temperature that did not change says nothing about its slope: a ridge far below what a degree does.
        normal = (rows * weights[:, None]).T @ rows + np.diag([0.0, *[1e-6] * (rows.shape[1] - 1)])
        inverse: NDArray[np.float64] = np.linalg.inv(normal).astype(np.float64)
        coefficients: Vector = inverse @ (rows * weights[:, None]).T @ y
        r = y - rows @ coefficients
        away = np.abs(r - np.median(r))  # of the middle: two bad logs of twenty move the line
        if step > 0:
            spread = float(np.sqrt(np.sum(r[used] ** 2) / max(used.sum() - rows.shape[1], 1)))
        else:
            spread = MAD * float(np.median(away))
        scatter = max(spread**2 - float(np.median(s**2)), POLICY.course_scatter**2)
        if step < PASSES - 1:
            used = away <= POLICY.course_clip * np.sqrt(s**2 + scatter)
    if rows.shape[1] > 1:
        width = float(coefficients[1] ** 2 * np.var(heat))
    freedom = POLICY.course_known * (len(y) - rows.shape[1])
    return _Line(coefficients, inverse, scatter, _needed(alarm, freedom), middle, width)


def levels_of(values: Vector, shifts: list[Shift]) -> list[tuple[int, int, float]]:
    """(first, behind the last, median of y) of the stretches between the changes."""
    ends = [0, *(s.first for s in shifts), len(values)]
    return [(a, b, float(np.median(values[a:b]))) for a, b in pairwise(ends) if b > a]
