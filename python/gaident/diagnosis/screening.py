"""Which candidates are worth a fit: each one's starts simulated once, with what the present model could absorb taken out.

With v the whitened error of the present model, v_c that of a start row and P the projection beyond the present model's
sensitivities,

    d = P (v_c - v),   V_c = min over t of |P v + t d|^2,

the cost after a linearised refit of everything else and of the size of the change. Harmonics of the angle need no grid: their two
components are linear, order by order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.driven import Driven
from gaident.diagnosis.layout import Layout, evenly_damped
from gaident.diagnosis.noise_filter import WHITE, NoiseFilter
from gaident.diagnosis.problem import Problem, orthonormal_rows, project_out

__all__ = ["Screened", "Screening"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

HIGHEST_ORDER = 64
FURTHEST = 2.0  # times the way to a start: the next one stands there


@dataclass(frozen=True)
class Screened:
    """One candidate: layout, start vectors from the best on, the filter that it was judged with.

    fall: what the best start promises against the model that it extends, under this filter; hope: the same against that model
    under the filter of its own errors, in which the effect may pass for noise.
    """

    effect: str
    layout: Layout
    starts: tuple[Vector, ...]
    noise: NoiseFilter
    fall: float
    hope: float


@dataclass(frozen=True, eq=False)
class _Trial:
    effect: str
    layout: Layout
    rows: Matrix  # start coordinates; for harmonics the orders
    errors: Matrix  # plain errors; for harmonics the two columns of each order, what the error loses per unit
    base: _Base
    columns: bool


@dataclass(frozen=True, eq=False)
class _Base:
    """The model that candidates extend: x, plain error and sensitivities."""

    layout: Layout
    x: Vector
    error: Vector
    J: Matrix


@dataclass(frozen=True, eq=False)
class _View:
    """A base under one filter: an orthonormal basis of what its parameters can explain, the rest of its error, its BIC."""

    noise: NoiseFilter
    basis: Matrix
    rest: Vector
    own: float


class Screening:
    """All candidates against one model; noise filters can be changed without a new simulation."""

    def __init__(self, problem: Problem, driven: Driven) -> None:
        self.problem, self.driven = problem, driven
        self.trials: list[_Trial] = []
        self._beyond: dict[_Base, tuple[int, NoiseFilter]] = {}
        self._views: dict[tuple[_Base, NoiseFilter, bool], _View] = {}
        self._screened: dict[tuple[_Trial, _View], Screened] = {}

    def add(self, layout: Layout, x: Vector, effects: Sequence[str]) -> None:
        """Candidates as extensions of the model x."""
        rough = [e for e in effects if CANDIDATES[e].rough]
        if rough and self.driven.loopable and not layout.looped:
            # A replayed torque that a limit inside the controller spoils has led the mechanism astray; the loop holds it.
            inside = replace(layout, looped=True)
            self.add(inside, x if self.driven.torque_logged else self.problem.fit(inside, x, WHITE, 8).x, rough)
            effects = [e for e in effects if CANDIDATES[e].place != "coupling"]
        self._add(layout, x, effects)
        between = [e for e in effects if CANDIDATES[e].place == "coupling"]
        if between:
            self._add(layout, evenly_damped(layout, x), between)

    def _add(self, layout: Layout, x: Vector, effects: Sequence[str]) -> None:
        _, J, error = self.problem.linearised(layout, x, WHITE)
        base = _Base(layout, x, error, J)
        for effect in effects:
            candidate = CANDIDATES[effect]
            longer = layout.extended(effect)
            if candidate.harmonic:
                orders, columns = self._columns(layout, x, effect, error)
                if len(orders):
                    self.trials.append(_Trial(effect, longer, orders[:, None], columns, base, True))
                continue
            rows = np.array(candidate.starts(layout.scales))
            if rows.size == 0:
                continue
            low, high = np.array(candidate.limits(layout.scales)).T
            rows = np.clip(rows, low, high)
            X = np.vstack([layout.inserted(x, z) for z in rows])
            self.trials.append(_Trial(effect, longer, rows, self.problem.errors(longer, X), base, False))

    def _columns(self, layout: Layout, x: Vector, effect: str, error: Vector) -> tuple[Vector, Matrix]:
        """(orders, columns): what the plain error loses per unit of the two components, pairs of rows per order."""
        candidate = CANDIDATES[effect]
        angle = self.driven.angle
        first = 1.0 if candidate.harmonic == "velocity" else 2.0
        orders = np.array([1.0]) if effect == "unbalance" else np.arange(first, HIGHEST_ORDER + 1.0)
        # Seen is what passes a few times, slowly enough for the sampling at the speeds that matter: there and back counts twice,
        # but most of a turn has to be there.
        turned, path = float(np.ptp(angle)), float(np.abs(np.diff(angle)).sum())
        speed = float(np.median(np.abs(self.problem.measured)) + 1e-12)
        seen = (orders * turned > 0.75 * 2.0 * np.pi) & (orders * path > 3.0 * 2.0 * np.pi)
        orders = orders[seen & (orders * speed * layout.scales.dt < 2.5)]
        if len(orders) == 0:
            return orders, np.zeros((0, len(error)))
        waves = _harmonics(angle, orders)
        if candidate.harmonic == "torque":
            pairs = np.stack([-waves.imag, -waves.real], axis=1).reshape(-1, len(angle))
            return orders, self.driven.response(layout, x, pairs)
        w = (self.problem.measured - error) * orders[:, None]
        return orders, np.stack([w * waves.real, -w * waves.imag], axis=1).reshape(-1, len(angle))

    def filter_beyond(self, base: _Base) -> NoiseFilter:
        """Noise filter of what nothing in the library explains, to first order: no effect is whitened away as noise."""
        directions = [base.J]
        rest = project_out(base.J, base.error[None, :])[0]
        for t in (t for t in self.trials if t.base is base):
            if t.columns:
                best = np.argsort(_pair_worth(project_out(base.J, t.errors), rest))[::-1][:2]
                directions += [t.errors[2 * i : 2 * i + 2] for i in best]
            else:
                finite = np.all(np.isfinite(t.errors), axis=1)
                if finite.any():
                    nearest = np.argmin(_along(project_out(base.J, t.errors[finite]) - rest, rest))
                    directions.append((t.errors[finite][nearest] - base.error)[None, :])
        D = np.vstack(directions)[: max(len(base.error) // 8, 1)]
        return self.problem.filter_of(project_out(D, base.error[None, :])[0], base.layout.looped)

    def ranked(self, noise: NoiseFilter | None) -> list[Screened]:
        """Candidates from the most to the least promising, each in its better view.

        What counts is the fall of a candidate's cost against the model that it extends, in the same view: a model in its loop
        leaves another error than one that the torque drives. noise: the filter; None: each view's own of what nothing explains.
        """
        best: dict[str, Screened] = {}
        for t in self.trials:
            view = self._view(t.base, noise)
            key = t, view
            if key not in self._screened:
                self._screened[key] = self._judged(t, view)
            found = self._screened[key]
            if t.effect not in best or found.fall > best[t.effect].fall:
                best[t.effect] = found
        return sorted(best.values(), key=lambda s: -s.fall)

    def _view(self, base: _Base, noise: NoiseFilter | None) -> _View:
        own = noise is None
        if noise is None:
            trials = sum(t.base is base for t in self.trials)
            if base not in self._beyond or self._beyond[base][0] != trials:
                self._beyond[base] = trials, self.filter_beyond(base)
            noise = self._beyond[base][1]
        key = base, noise, own
        if key not in self._views:
            basis = orthonormal_rows(self.problem.whitened(base.J, noise))
            v = self.problem.whitened(base.error[None, :], noise)[0]
            rest = v - (v @ basis.T) @ basis
            self._views[key] = _View(noise, basis, rest, self._without(base, None if own else noise))
        return self._views[key]

    def _judged(self, t: _Trial, view: _View) -> Screened:
        n, rest = self.problem.count, view.rest
        V = self.problem.whitened(t.errors, view.noise)
        finite = np.all(np.isfinite(V), axis=1)
        V[~finite] = 0.0
        V -= (V @ view.basis.T) @ view.basis
        power = float(rest @ rest)
        if t.columns:
            worth = _pair_worth(V, rest)
            order = np.argsort(worth)[::-1][:2]
            costs = np.maximum(power - worth[order], 1e-300)
            starts = tuple(_harmonic_start(t, V, rest, int(i)) for i in order)
        else:
            costs = np.where(finite, _along(V - rest, rest, CANDIDATES[t.effect].proportional), np.inf)
            order = np.argsort(costs)
            starts = tuple(t.base.layout.inserted(t.base.x, row) for row in _start_rows(t, V, rest, order[:3]))
            costs = costs[order]
        cost, size = max(float(costs[0]), 1e-300), CANDIDATES[t.effect].size
        fall = n * np.log(max(power, 1e-300) / cost) - size * np.log(n)
        bic = n * np.log(cost / n) + (t.base.layout.size + size + view.noise.size) * np.log(n)
        return Screened(t.effect, t.layout, starts, view.noise, float(fall), float(view.own - bic))

    def _without(self, base: _Base, noise: NoiseFilter | None) -> float:
        """BIC of the model that is extended, under a filter or that of its own errors."""
        n = self.problem.count
        f = noise or self.problem.filter_of(base.error, base.layout.looped)
        v = self.problem.whitened(base.error[None, :], f)[0]
        return float(n * np.log(max(float(v @ v), 1e-300) / n) + (base.layout.size + f.size) * np.log(n))


def _harmonics(angle: Vector, orders: Vector) -> NDArray[np.complex128]:
    """exp(i n angle), a row for each order n, these rising by whole numbers: each from the one before."""
    rows = np.empty((len(orders), len(angle)), dtype=np.complex128)
    turn = np.exp(1j * angle)
    wave, before = np.ones_like(turn), 0
    for row, order in zip(rows, orders, strict=True):
        for _ in range(int(order) - before):
            wave = wave * turn
        row[:], before = wave, int(order)
    return rows


def _along(D: Matrix, rest: Vector, proportional: bool = False) -> Vector:
    """|rest|^2 after the best step forward along each row of D: as far as the next start, further where all is proportional."""
    sizes = np.maximum(np.einsum("ij,ij->i", D, D), 1e-300)
    slopes = D @ rest
    steps = np.clip(-slopes / sizes, 0.0, np.inf if proportional else FURTHEST)
    return np.asarray(float(rest @ rest) + 2.0 * steps * slopes + steps**2 * sizes)


def _pair_worth(V: Matrix, rest: Vector) -> Vector:
    """Fall of |rest|^2 by each pair of rows of V."""
    A, B = V[0::2], V[1::2]
    aa, bb, ab = (np.einsum("ij,ij->i", *p) for p in ((A, A), (B, B), (A, B)))
    ra, rb = A @ rest, B @ rest
    det = aa * bb - ab**2
    good = det > 1e-9 * aa * bb
    det = np.where(good, det, 1.0)
    worth = (bb * ra**2 - 2.0 * ab * ra * rb + aa * rb**2) / det
    return np.where(good, worth, 0.0)


def _start_rows(t: _Trial, V: Matrix, rest: Vector, order: NDArray[np.intp]) -> Matrix:
    """Start coordinates from the best on; where the torque is proportional to them, at the end of the best step."""
    rows = t.rows[order]
    if CANDIDATES[t.effect].proportional:
        D = V[order] - rest
        rows = rows * np.maximum(-(D @ rest) / np.maximum(np.einsum("ij,ij->i", D, D), 1e-300), 0.0)[:, None]
    return np.asarray(rows)


def _harmonic_start(t: _Trial, V: Matrix, rest: Vector, i: int) -> Vector:
    z: Vector = np.asarray(np.linalg.lstsq(V[2 * i : 2 * i + 2].T, rest, rcond=None)[0], dtype=np.float64)
    coordinates: Vector = z if t.effect == "unbalance" else np.concatenate([z, t.rows[i]])
    return t.base.layout.inserted(t.base.x, coordinates)
