"""The regression that shows the form of a controller: linear in gains and feedforwards, not in the filters' numbers.

    u = F (kp (b C r - V w) + ki I(C r - V w) + a_ff a* + f_ff sign(r)) + u0        F, V, C: filters of torque, velocity, command

For given filters this is a linear least squares in (kp, kp b, ki, a_ff, f_ff, u0).
The filters' numbers are searched outside of it (variable projection, Golub and Pereyra 1973).
u0 is what the integrator held before the record began.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Filter
from gaident.control.filtering import filtered
from gaident.control.filters import LowPass, Notch
from gaident.data.record import Record
from gaident.policy.table import POLICY

__all__ = ["FILTER_SETS", "Law", "Place", "Shape", "at_places", "bounds_of", "fitted_shape", "law_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Place: TypeAlias = tuple[str, type[LowPass] | type[Notch]]
"""(argument of `Cascade`, kind of filter)."""

LONGEST = 1 << 13  # no decision: work; samples that a form is fitted to; all of them decide whether it follows
PLACES: tuple[Place, ...] = (
    ("torque_filters", LowPass),
    ("torque_filters", Notch),
    ("velocity_filters", LowPass),
    ("command_filters", LowPass),
)
FILTER_SETS: tuple[tuple[Place, ...], ...] = tuple(s for k in range(3) for s in combinations(PLACES, k))
"""None, one, and two filters, the fewer first."""

# Starts of the search: a low pass in samples, a notch as share of the sampling frequency, and its dampings.
TAUS = np.geomspace(0.3, 100.0, 8)  # no decision: starts of a search
NOTCHES = tuple(product(np.geomspace(2e-3, 0.4, 14), ((0.1, 0.7), (0.3, 1.5))))
BOUNDS = {
    LowPass: ((np.log(0.05),), (np.log(1e5),)),
    Notch: ((np.log(1e-4), 0.0, np.log(5e-3)), (np.log(0.495), 5.0, np.log(10.0))),
}
"""Of the numbers searched: ln(tau/T); ln(f T), zn, ln(zd)."""


@dataclass(frozen=True, eq=False)
class Law:
    """Records one after the other: command, velocity [rad/s] and logged torque [N m] (n,); used: where no limit acts."""

    command: Vector
    velocity: Vector
    torque: Vector
    used: NDArray[np.bool_]
    lengths: tuple[int, ...]
    period: float  # s

    def columns(self, places: Sequence[Place], numbers: Vector) -> Matrix:
        """(n used, 5 + records) [-w, r, integral of e by the trapezoidal rule, slope of r, sign of r, starts], filtered."""
        seen = {"command_filters": self.command, "velocity_filters": self.velocity}
        torque: list[tuple[Vector, Vector]] = []
        for (place, _), f in zip(places, filters(places, numbers, self.period), strict=True):
            b, a = _equation(f, self.period)
            if place == "torque_filters":
                torque.append((b, a))
            else:
                seen[place] = filtered(b, a, seen[place][None, :], self.lengths)[0]
        r, w = seen["command_filters"], seen["velocity_filters"]
        half = 0.5 * self.period * np.ones(2)  # no decision: the trapezoidal rule
        integral = filtered(half, np.array([1.0, -1.0]), (r - w)[None, :], self.lengths)[0]
        ends = np.cumsum(self.lengths) - 1
        slope = np.append(np.diff(self.command), 0.0) / self.period
        slope[ends] = 0.0
        rows: Matrix = np.stack([-w, r, integral, slope, np.sign(self.command)])
        for b, a in torque:
            rows = filtered(b, a, rows, self.lengths)
        starts = np.repeat(np.eye(len(self.lengths)), self.lengths, axis=1)
        return np.concatenate([rows, starts]).T[self.used]

    @property
    def logged(self) -> Vector:
        """The torque [N m] (n used,)."""
        return self.torque[self.used]


@dataclass(frozen=True, eq=False)
class Shape:
    """Filters as the logs show them, all gains free; coefficients: of `Law.columns`; left: what they leave [N m] (n used,)."""

    places: tuple[Place, ...]
    numbers: Vector
    coefficients: Vector
    left: Vector

    @property
    def rms(self) -> float:
        """Root mean square of `left` [N m]."""
        return float(np.sqrt(np.mean(self.left**2)))


def law_of(records: Sequence[Record], torque_limit: float) -> Law | None:
    """The regression's data; torque_limit [N m]: samples at it are left out. None where a signal or too much is missing."""
    share = max(LONGEST // len(records), 1)
    parts = []
    for rec in records:
        if rec.command is None or rec.torque is None:
            return None
        parts.append((rec.command[:share], rec.velocity[:share], rec.torque[:share]))
    command, velocity, torque = (np.concatenate(signal) for signal in zip(*parts, strict=True))
    used = np.abs(torque) < POLICY.at_limit * torque_limit
    lengths = tuple(len(c) for c, _, _ in parts)
    enough = int(np.sum(used)) >= POLICY.least_samples and bool(np.any(torque[used]))
    return Law(command, velocity, torque, used, lengths, records[0].dt) if enough else None


def filters(places: Sequence[Place], numbers: Vector, period: float) -> list[Filter]:
    """The filters of what the search moves."""
    made: list[Filter] = []
    at = 0
    for _, kind in places:
        if kind is LowPass:
            made.append(LowPass(float(np.exp(numbers[at])) * period))
            at += 1
        else:
            frequency, damping, pole = numbers[at : at + 3]
            made.append(Notch(float(np.exp(frequency)) / period, max(float(damping), 0.0), float(np.exp(pole))))
            at += 3
    return made


def at_places(places: Sequence[Place], numbers: Vector, period: float) -> dict[str, tuple[Filter, ...]]:
    """Argument of `Cascade` -> its filters."""
    made: dict[str, tuple[Filter, ...]] = {}
    for (place, _), f in zip(places, filters(places, numbers, period), strict=True):
        made[place] = (*made.get(place, ()), f)
    return made


def _equation(f: Filter, period: float) -> tuple[Vector, Vector]:
    """(b, a) of the digital filter, as `LowPass` and `Notch` define it: s = g (1 - 1/z)/(1 + 1/z), g = w/tan(w T/2)."""
    if isinstance(f, LowPass):
        share = -np.expm1(-period / f.time_constant)
        return np.array([share]), np.array([1.0, share - 1.0])
    w = 2.0 * np.pi * f.frequency
    g = w / np.tan(0.5 * w * period)

    def polynomial(damping: float) -> Vector:
        middle, edge = g * g + w * w, 2.0 * damping * w * g
        return np.array([middle + edge, 2.0 * (w * w - g * g), middle - edge])

    a = polynomial(f.denominator_damping)
    return polynomial(f.numerator_damping) / a[0], a / a[0]


def fitted_shape(law: Law, places: tuple[Place, ...], enough: float) -> Shape:
    """The filters' numbers that leave least, from the best starts of a grid; enough: rms [N m] that ends the search."""
    from scipy.optimize import least_squares

    def off(numbers: Vector) -> Vector:
        q, _ = np.linalg.qr(_scaled(law.columns(places, numbers))[0])
        left: Vector = law.logged - q @ (q.T @ law.logged)
        return left

    if not places:
        return _solved(law, places, np.zeros(0))
    low, high = bounds_of(places)
    grid = [np.concatenate(start) for start in product(*(_starts(kind) for _, kind in places))]
    costs = np.array([np.sum(off(start) ** 2) for start in grid])
    size = float(np.sqrt(np.mean(law.logged**2)))
    best: Shape | None = None
    followed_up = POLICY.starts if len(places) == 1 else 1  # the grid of two filters is fine enough
    for k in np.argsort(costs, kind="stable")[:followed_up]:
        inside = np.clip(grid[k], low + 1e-9, high - 1e-9)
        found = least_squares(lambda x: off(x) / size, inside, bounds=(low, high), xtol=1e-12, ftol=1e-6, gtol=1e-15, max_nfev=40)
        shape = _solved(law, places, found.x)
        if best is None or shape.rms < best.rms:
            best = shape
        if best.rms <= enough:
            break
    assert best is not None
    return best


def bounds_of(places: Sequence[Place]) -> tuple[Vector, Vector]:
    """(lowest, highest) of the filters' numbers."""
    none = [np.zeros(0)]
    low, high = (np.concatenate(none + [np.array(BOUNDS[kind][side]) for _, kind in places]) for side in (0, 1))
    return low, high


def _starts(kind: type[LowPass] | type[Notch]) -> list[Vector]:
    if kind is LowPass:
        return [np.array([np.log(tau)]) for tau in TAUS]
    return [np.array([np.log(f), zn, np.log(zd)]) for f, (zn, zd) in NOTCHES]


def _solved(law: Law, places: tuple[Place, ...], numbers: Vector) -> Shape:
    table, sizes = _scaled(law.columns(places, numbers))
    coefficients = np.linalg.lstsq(table, law.logged, rcond=1e-12)[0]
    return Shape(places, numbers, coefficients / sizes, law.logged - table @ coefficients)


def _scaled(table: Matrix) -> tuple[Matrix, Vector]:
    sizes = np.linalg.norm(table, axis=0)
    sizes[sizes == 0.0] = 1.0
    return table / sizes, sizes
