"""The law of friction behind held speeds: which curve of the library fits them, by weighted least squares.

    T(w) = D w - sum_k curve_k(w)                  D >= 0; curve_k: static torque of an effect at the shaft, of the library
    x    = argmin sum ((T_i - T(w_i))/s_i)^2       s_i^2 = std_i^2 + t^2
    cov  = max(1, chi2/(N - k)) (J' J)^-1          J: slope of T(w_i)/s_i over the numbers x
    BIC  = N ln max(chi2/N, 1) + k ln N            N plateaus, k numbers

t is the deviation by which plateaus scatter beyond their own std: that with which the most general law has chi2 = N - k (R. C.
Paule, J. Mandel, Journal of Research of the National Bureau of Standards 87:377-385, 1982).
A law that leaves no more than the deviations (chi2/N < 1) gains nothing by another number.

A law contains viscous friction, one curve with a level or none, a drag or none, and a constant torque or none.
It has no more numbers of its curve than there are speeds, and all of its numbers are told by them: J has full rank.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.axis import Text, called, joined
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.terms import LIBRARY
from gaident.estimation.criterion import bic
from gaident.estimation.term import Scales
from gaident.models.effects import row_of
from gaident.policy.table import POLICY
from gaident.remedies.steady.plateaus import Plateau
from gaident.results.estimate import Estimate

__all__ = ["Fitted", "FrictionLaw", "laws_of", "missing_of", "speeds_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

STEP = 1e-6  # no decision: the step of a difference, of a number's own size
RANK = 1e-6  # no decision: exact to so much, columns that depend on each other are one in floating point
SNAP = 1e-3  # no decision: exact to; deviations of the plateaus, by which a number near its bound is as good as there
DIGITS = 6  # no decision: rounding; of BIC units, behind which two laws that are the same at these speeds may differ
HALVINGS = 60  # no decision: exact to the last digit of a number
EXACT = 1e-9  # no decision: exact to so much of the largest one, a torque or a temperature that a log holds without noise
TINY = 1e-300  # no decision: no division by 0


@dataclass(frozen=True, eq=False)
class FrictionLaw:
    """Torque of a held speed: viscous friction and effects of the library. Made by `friction_map`.

    Attributes
    ----------
    viscous : Estimate
        Viscous friction [N m s/rad].
    effects : dict of str to dict of str to Estimate
        Effect -> its parameters, as `gaident.effects.table()` names them.
    bic : float
        Bayesian information criterion; of two laws the lower one is the better.
    numbers : int
        Numbers that were fitted.
    misfit : float
        What it leaves of the torque, over the deviations of the plateaus, rms [1].
    alike : tuple of str
        Effects that show the same torque at held speeds as one of this law.

    See Also
    --------
    friction_map : Makes it, with an example.
    """

    viscous: Estimate
    effects: Mapping[str, Mapping[str, Estimate]]
    bic: float
    numbers: int
    misfit: float
    alike: tuple[str, ...] = ()

    @property
    def name(self) -> Text:
        """What it contains, in words."""
        return joined(" + ", ["viscous friction", *(called(effect) for effect in self.effects)])

    def torque(self, velocity: ArrayLike) -> Vector:
        """Return the torque that holds velocities [rad/s], an array of any shape [N m]; positive for a motion forwards."""
        w = np.asarray(velocity, dtype=np.float64)
        total = self.viscous.value * w
        for effect, parameters in self.effects.items():
            curve = LIBRARY[effect].curve
            assert curve is not None
            total = total - curve(w, {name: e.value for name, e in parameters.items()})
        return np.asarray(total)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""

        def plain(e: Estimate) -> dict[str, Any]:
            return {"value": e.value, "std": e.std, "unit": e.unit, "at_bound": e.at_bound}

        return {
            "viscous": plain(self.viscous),
            "effects": {effect: {name: plain(e) for name, e in own.items()} for effect, own in self.effects.items()},
            **{key: getattr(self, key) for key in ("bic", "numbers", "misfit")},
            "alike": list(self.alike),
        }


@dataclass(frozen=True, eq=False)
class Fitted:
    """The laws that plateaus admit, the best first, and by how much these scatter beyond their deviations.

    slope: torque of friction to a degree; None without temperatures that differ.
    """

    laws: tuple[FrictionLaw, ...] = ()
    beyond: float = 0.0
    slope: Estimate | None = None


@dataclass(frozen=True)
class _Law:
    """The rows of a law with the fit so far: numbers x, (D, coordinates of each row)."""

    rows: tuple[Cause, ...]
    x: Vector = field(default_factory=lambda: np.zeros(1))
    chi2: float = np.inf

    def torque(self, w: Vector, x: Vector) -> Vector:
        total, at = x[0] * w, 1
        for row in self.rows:
            assert row.curve is not None
            total = total - row.curve(w, _named(row, x[at : at + row.size]))
            at += row.size
        return np.asarray(total)

    def slopes(self, w: Vector, scales: Scales) -> Matrix:
        """Of the torque over each number (N, k); one-sided towards the middle of the range, where the number is at a bound."""
        low, high = _bounds(self.rows, scales)
        columns = []
        for j, value in enumerate(self.x):
            step = STEP * max(abs(value), STEP)
            ends = [np.clip(value + s, low[j], high[j]) for s in (-step, step)]
            moved = [np.where(np.arange(len(self.x)) == j, end, self.x) for end in ends]
            columns.append((self.torque(w, moved[1]) - self.torque(w, moved[0])) / (ends[1] - ends[0]))
        return np.column_stack(columns)


def _named(row: Cause, z: Vector) -> dict[str, float]:
    """The parameters of a row by name."""
    values = row.natural(z[None, :])[0]
    return {p.name: float(v) for p, v in zip(row_of(row.name).parameters, values, strict=True)}


def speeds_of(plateaus: Sequence[Plateau]) -> list[float]:
    """Speeds without direction that differ by more than a share of themselves, ascending [rad/s]."""
    kept: list[float] = []
    for speed in sorted(abs(p.velocity) for p in plateaus):
        if not kept or speed > (1.0 + POLICY.apart) * kept[-1]:
            kept.append(speed)
    return kept


def missing_of(speeds: int) -> list[Cause]:
    """Effects that so many speeds are too few for, beside viscous friction; a drag beside dry friction, too."""
    levels, drags, _ = _rows()
    return [row for row in levels if 1 + row.size > speeds] + [row for row in drags if 2 + row.size > speeds]


def laws_of(plateaus: Sequence[Plateau]) -> Fitted:
    """The laws within the margin of the best, but for those that only add to a better one; none of plateaus of one speed."""
    w, torque, std = (np.array([getattr(p, name) for p in plateaus]) for name in ("velocity", "torque", "std"))
    speeds = len(speeds_of(plateaus))
    if speeds < 2 or not np.any(torque):
        return Fitted()
    scales = _scales(w, torque)
    std = np.maximum(std, EXACT * scales.torque)
    fits = _all(w, torque, std, scales, speeds, {})
    if not fits:
        return Fitted()
    general = max(fits, key=lambda law: (len(law.x), -law.chi2))
    beyond = _beyond(general, w, torque, std, scales)
    if beyond > 0.0:
        std = np.hypot(std, beyond)
        fits = _all(w, torque, std, scales, speeds, {tuple(row.name for row in law.rows): law for law in fits})
    known = [(law, _bic(law, len(w))) for law in fits]
    known.sort(key=lambda one: (round(one[1], DIGITS), any(row.constant for row in one[0].rows)))
    best, least = known[0]
    kept: list[tuple[_Law, float]] = []
    for law, value in known:
        if value - least < POLICY.rival_margin and not any(_contains(law.rows, better.rows) for better, _ in kept):
            kept.append((law, value))
    told = [_told(law, value, w, std, scales) for law, value in kept]
    return Fitted(tuple(told), beyond, _slope(best, plateaus, w, torque, std, scales))


def _bic(law: _Law, count: int) -> float:
    return bic(max(law.chi2 / count, 1.0), count, len(law.x))


def _contains(rows: Sequence[Cause], others: Sequence[Cause]) -> bool:
    """Whether each of the others is among the rows, or contained in one of them."""
    there = {row.name for row in rows} | {name for row in rows for name in row.nested}
    return all(other.name in there for other in others)


def _scales(w: Vector, torque: Vector) -> Scales:
    """Sizes for bounds and starts; what none of these curves depends on is 1."""
    speed, top = float(np.max(np.abs(w))), float(np.max(np.abs(torque)))
    level = max(float(np.median(np.abs(torque))), TINY)
    return Scales(1.0, 1.0, speed, top, np.inf, 1.0, level, np.nan, np.nan, False, top)


def _first_of_each_curve(rows: Sequence[Cause]) -> list[Cause]:
    """Effects that have the same curve are one here: the first, which is the simplest."""
    found: dict[Callable[..., Vector], Cause] = {}
    for row in rows:
        assert row.curve is not None
        found.setdefault(row.curve, row)
    return list(found.values())


def _rows() -> tuple[list[Cause], list[Cause], list[Cause]]:
    """Effects with a static curve: those with a level, drags, constant torques."""
    curved = [row for row in LIBRARY.values() if row.curve is not None and not row.at_load]
    levels = _first_of_each_curve([row for row in curved if row.levels])
    constant = _first_of_each_curve([row for row in curved if row.constant])
    return levels, [row for row in curved if not row.levels and not row.constant], constant


def _all(w: Vector, torque: Vector, std: Vector, scales: Scales, speeds: int, near: Mapping[tuple[str, ...], _Law]) -> list[_Law]:
    """Every law that the plateaus can tell, fitted; each starts from the one with an effect less, or from one of `near`."""
    done: dict[tuple[str, ...], _Law] = {}
    told = []
    for chosen in itertools.product(*([None, *rows] for rows in _rows())):
        rows = tuple(row for row in chosen if row is not None)
        if 1 + sum(row.size for row in rows if not row.constant) > speeds or 1 + sum(row.size for row in rows) > len(w):
            continue
        names = tuple(row.name for row in rows)
        if names in near:
            starts = [near[names].x]
        elif rows:
            more = rows[-1].starts(scales)
            more = more[:1] if rows[-1].proportional else more  # one start finds the only minimum of its number
            starts = [np.append(done[names[:-1]].x, z) for z in more]
        else:
            starts = [np.zeros(1)]
        done[names] = law = _fitted(rows, starts, w, torque, std, scales)
        steps = (scales.torque / scales.speed, *(step for row in rows for step in row.steps(scales)))
        if _full_rank(law.slopes(w, scales) * steps / std[:, None]):
            told.append(law)
    return told


def _bounds(rows: Sequence[Cause], scales: Scales) -> tuple[Vector, Vector]:
    low, high = zip((0.0, np.inf), *(pair for row in rows for pair in row.limits(scales)), strict=True)
    return np.array(low), np.array(high)


def _fitted(rows: tuple[Cause, ...], starts: Sequence[Vector], w: Vector, torque: Vector, std: Vector, scales: Scales) -> _Law:
    """The best fit from the starts; one whose torque is linear in all numbers needs none."""
    from scipy.optimize import least_squares, lsq_linear

    low, high = _bounds(rows, scales)
    law = _Law(rows)
    if all(row.proportional for row in rows):
        columns = np.column_stack([law.torque(w, unit) for unit in np.eye(len(low))]) / std[:, None]
        exact = lsq_linear(columns, torque / std, (low, high), method="bvls")
        return _Law(rows, exact.x, 2.0 * float(exact.cost))  # no decision: a formula: as below

    def found(x: Vector, steps: int) -> tuple[float, Vector]:
        fit = least_squares(lambda z: (torque - law.torque(w, z)) / std, x, bounds=(low, high), x_scale="jac", max_nfev=steps)
        return 2.0 * float(fit.cost), fit.x  # no decision: a formula: the cost is half of the sum of squares

    inside = [np.clip(start, low, high) for start in starts]
    if len(inside) > 1:
        ranked = sorted((found(x, POLICY.short) for x in inside), key=lambda one: one[0])
        inside = [x for _, x in ranked[: POLICY.starts_each]]
    chi2, x = min((found(x, POLICY.final) for x in inside), key=lambda one: one[0])
    best = _Law(rows, x, chi2)
    effect = np.linalg.norm(best.slopes(w, scales) / std[:, None], axis=0)
    for bound in (low, high):  # the solver stays inside
        near = np.isfinite(bound) & (effect * np.abs(best.x - np.where(np.isfinite(bound), bound, 0.0)) < SNAP) & (effect > 0.0)
        at_bound = np.where(near, bound, best.x)
        left = float(np.sum(((torque - law.torque(w, at_bound)) / std) ** 2))
        if left < best.chi2 + SNAP:
            best = _Law(rows, at_bound, left)
    return best


def _full_rank(slopes: Matrix) -> bool:
    """Whether the plateaus tell all numbers of a law: (N, k), in deviations for a change of each number that matters."""
    sizes = np.linalg.norm(slopes, axis=0)
    return bool(np.all(sizes > RANK) and np.linalg.svd(slopes / sizes, compute_uv=False)[-1] > RANK)


def _beyond(law: _Law, w: Vector, torque: Vector, std: Vector, scales: Scales) -> float:
    """The deviation t with which chi2 of a law is as large as its degrees of freedom; 0 where it is no larger without."""
    free = len(w) - len(law.x)
    if free < 1:
        return 0.0
    low, high = 0.0, float(np.max(np.abs(torque)))
    if _chi2(law, w, torque, std) <= free:
        return 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _chi2(law, w, torque, np.hypot(std, middle)) > free else (low, middle)
    return high


def _chi2(law: _Law, w: Vector, torque: Vector, std: Vector) -> float:
    return float(np.sum(((torque - law.torque(w, law.x)) / std) ** 2))


def _covariance(slopes: Matrix, chi2: float, free: NDArray[np.bool_]) -> Matrix:
    """Of the numbers of a law (k, k), from slopes in deviations; nan of those that are not free, at a bound."""
    count, numbers = slopes.shape
    sizes = np.linalg.norm(slopes[:, free], axis=0)
    inverse = np.linalg.inv((slopes[:, free] / sizes).T @ (slopes[:, free] / sizes)) / np.outer(sizes, sizes)
    found = np.full((numbers, numbers), np.nan)
    found[np.ix_(free, free)] = max(1.0, chi2 / max(count - numbers, 1)) * inverse
    return found


def _told(law: _Law, value: float, w: Vector, std: Vector, scales: Scales) -> FrictionLaw:
    """A fitted law with the parameters of its effects."""
    free = _free(law, scales)
    covariance = _covariance(law.slopes(w, scales) / std[:, None], law.chi2, free)
    effects, at = {}, 1
    for row in law.rows:
        here = slice(at, at + row.size)
        effects[row.name] = _parameters(row, law.x[here], covariance[here, here], free[here])
        at += row.size
    viscous = Estimate(float(law.x[0]), float(np.sqrt(covariance[0, 0])), "N m s/rad", not free[0])
    names, curves = {row.name for row in law.rows}, {row.curve for row in law.rows}
    steady = [r for r in LIBRARY.values() if not (r.at_load or r.time_varying or r.beside or r.harmonic)]
    alike = tuple(r.name for r in steady if r.curve in curves and r.name not in names)
    return FrictionLaw(viscous, effects, value, len(law.x), float(np.sqrt(law.chi2 / len(w))), alike)


def _free(law: _Law, scales: Scales) -> NDArray[np.bool_]:
    """Which numbers of a law are at no bound."""
    low, high = _bounds(law.rows, scales)
    return np.asarray((law.x > low) & (law.x < high))


def _parameters(row: Cause, z: Vector, covariance: Matrix, free: NDArray[np.bool_]) -> dict[str, Estimate]:
    """Those of one effect: their covariance follows from that of its coordinates; nan of what is at a bound."""
    steps = STEP * np.maximum(np.abs(z), STEP)
    before, after = (row.natural(z + sign * np.diag(steps)) for sign in (-1.0, 1.0))
    slopes = ((after - before) / (2.0 * steps[:, None])).T  # no decision: a formula: a central difference
    values = row.natural(z[None, :])[0]
    known = np.where(free[:, None] & free, covariance, 0.0)
    found = {}
    for p, v, slope in zip(row_of(row.name).parameters, values, slopes, strict=True):
        held = not np.any(slope[free] != 0.0)
        found[p.name] = Estimate(float(v), float(np.nan) if held else float(np.sqrt(slope @ known @ slope)), p.unit, held)
    return found


def _slope(law: _Law, plateaus: Sequence[Plateau], w: Vector, torque: Vector, std: Vector, scales: Scales) -> Estimate | None:
    """c of c sign(w) (temperature - mean), regressed beside the numbers of the law [N m to a degree]."""
    heat = np.array([p.temperature for p in plateaus])
    seen = np.isfinite(heat)
    if not np.any(seen) or np.ptp(heat[seen]) <= EXACT * float(np.max(np.abs(heat[seen]))):
        return None
    column = np.where(seen, np.sign(w) * (heat - np.mean(heat[seen])), 0.0)
    slopes = np.column_stack([law.slopes(w, scales), column]) / std[:, None]
    if len(w) <= slopes.shape[1] or not _full_rank(slopes / np.linalg.norm(slopes, axis=0)):
        return None
    free = np.append(_free(law, scales), True)
    left = (torque - law.torque(w, law.x)) / std
    found = np.linalg.lstsq(slopes[:, free], left, rcond=None)[0]
    chi2 = float(np.sum((left - slopes[:, free] @ found) ** 2))
    return Estimate(float(found[-1]), float(np.sqrt(_covariance(slopes, chi2, free)[-1, -1])), "N m")
