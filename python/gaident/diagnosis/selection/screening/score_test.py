"""The score test: which effects are worth a fit.

The starts of each effect are simulated once, and the part that the present model could explain is projected out.

With v the whitened error of the present model, v_c that of a start row and P the projection beyond the present model's
sensitivities,

    d = P (v_c - v),   V_c = min over t of |P v + t d|^2,

the cost after a linearised refit of everything else and of the size of the change.
Harmonics of the angle need no grid: their two components are linear, order by order.
So are those of a resonance in series with the mechanism, frequency by frequency,

    (s^2 + 2 zz wz s + wz^2)/(s^2 + 2 zp wp s + wp^2) = 1 + (c1 wp s + c0 wp^2)/(s^2 + 2 zp wp s + wp^2)

on the model's velocity, as long as it changes little: the frequencies with the largest gain become starts beside the given ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.selection.mechanisms import evenly_damped
from gaident.diagnosis.selection.screening.columns import DAMPING, harmonic_columns, resonance_columns, tone_columns
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import gained
from gaident.estimation.noise_model import WHITE, NoiseFilter
from gaident.estimation.objective import LOST, Fit, Hypothesis, Objective
from gaident.estimation.prediction import ClosedLoop
from gaident.estimation.projection import orthonormal_rows, project_out
from gaident.estimation.term import Term
from gaident.policy.table import POLICY

__all__ = ["Screened", "ScoreTest"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

FURTHEST = 2.0  # no decision: times the way to a start, where the next one stands


@dataclass(frozen=True)
class Screened:
    """One candidate: its hypothesis, start vectors from the best on, the filter that it was judged with.

    fall: fall of the BIC that the best start promises against the model that it extends, under this filter.
    hope: the same against that model under the filter of its own errors, which may describe the effect as noise.
    """

    term: Term
    hypothesis: Hypothesis
    starts: tuple[Vector, ...]
    noise: NoiseFilter
    fall: float
    hope: float


@dataclass(frozen=True, eq=False)
class _Trial:
    term: Term
    hypothesis: Hypothesis
    rows: Matrix  # start coordinates; of harmonics one for each order, without their two components
    errors: Matrix  # raw errors; for harmonics two columns of each order, the decrease of the error per unit
    base: _Base
    onto: tuple[Hypothesis, Vector]  # the model and its x that the coordinates are added to
    columns: bool

    def start(self, coordinates: Vector) -> Vector:
        """The x of the candidate."""
        hypothesis, x = self.onto
        return hypothesis.parameters.inserted(x, coordinates)


@dataclass(frozen=True, eq=False)
class _Base:
    """The model that candidates are compared with: x, raw error and sensitivities."""

    hypothesis: Hypothesis
    x: Vector
    error: Vector
    J: Matrix


@dataclass(frozen=True, eq=False)
class _Filtered:
    """A base under one filter: an orthonormal basis of what its parameters can explain, the rest of its error, its BIC."""

    noise: NoiseFilter
    basis: Matrix
    rest: Vector
    own: float


class ScoreTest:
    """All candidates against one model; noise filters can be changed without a new simulation."""

    def __init__(self, objective: Objective) -> None:
        self.objective, self.data = objective, objective.data
        self.trials: list[_Trial] = []
        self._bases: dict[tuple[Hypothesis, bytes], _Base] = {}
        self._beyond: dict[_Base, tuple[int, NoiseFilter]] = {}
        self._filtered_bases: dict[tuple[_Base, NoiseFilter, bool], _Filtered] = {}
        self._screened: dict[tuple[_Trial, _Filtered], Screened] = {}

    def add(self, hypothesis: Hypothesis, x: Vector, terms: Sequence[Term]) -> None:
        """Candidates as extensions of the model x."""
        valleys = [t for t in terms if t.multimodal]
        if valleys and self.data.fits_in_loop and not hypothesis.predictor.closed:
            # A replayed torque that ignores a limit of the controller biases the mechanism; the closed loop does not.
            inside = hypothesis.driven_by(ClosedLoop(self.data, hypothesis.predictor.own_angle))
            start = x if self.data.torque_logged else ls.fit(self.objective, inside, x, WHITE, POLICY.usual).x
            self.add(inside, start, valleys)
            terms = [t for t in terms if not t.in_coupling]
        self._add(hypothesis, x, terms)
        between = [t for t in terms if t.in_coupling]
        if between:
            self._add(hypothesis, evenly_damped(hypothesis.parameters, x), between)

    def replace(self, simple: Fit, effect: str, hypothesis: Hypothesis, x: Vector, terms: Sequence[Term]) -> None:
        """Candidates in the place of an effect that each of them contains.

        simple: the fit with the effect, which they are compared with; hypothesis, x: without it, what they are added to.
        """
        self._add(hypothesis, x, terms, (simple, effect))

    def more_waves(self, fit: Fit, hypothesis: Hypothesis, x: Vector, term: Term) -> None:
        """A harmonic with one wave more, of another order, in the place of that of a fit; hypothesis, x: without it."""
        self._add(hypothesis, x, [term], (fit, term.name))

    def _base(self, hypothesis: Hypothesis, x: Vector) -> _Base:
        key = hypothesis, x.tobytes()
        if key not in self._bases:
            J, error = self.objective.sensitivities(hypothesis, x)
            self._bases[key] = _Base(hypothesis, x, error, J)
        return self._bases[key]

    def _add(self, hypothesis: Hypothesis, x: Vector, terms: Sequence[Term], instead: tuple[Fit, str] | None = None) -> None:
        base = self._base(hypothesis, x) if instead is None else self._base(instead[0].hypothesis, instead[0].x)
        parameters, onto = hypothesis.parameters, (hypothesis, x)
        for term in terms:
            longer = hypothesis.extended(term)
            if term.harmonic or term.in_time:
                known, taken = np.zeros(0), np.zeros(0)
                if instead is not None:  # of a simpler friction the level, of fewer waves all of their coordinates
                    fit, effect = instead
                    known = fit.x[fit.parameters.slot(effect)][: term.components]
                    taken = fit.parameters.term(effect).orders_in(known) if term.waves > 1 else taken
                if term.harmonic:
                    orders, columns = harmonic_columns(self.objective, hypothesis, x, term, base.error, taken)
                else:
                    orders, columns = tone_columns(self.objective, hypothesis, x, term, base.error)
                if len(orders):
                    rows = np.zeros((len(orders), term.size))
                    if term.size > 2:
                        rows[:, -1] = orders
                    rows[:, : len(known)] = known
                    self.trials.append(_Trial(term, longer, rows, columns, base, onto, True))
                continue
            rows = np.array(term.starts(parameters.scales))
            if rows.size == 0:
                continue
            if term.resonates:
                rows = np.vstack([rows, self._narrow(rows, base)])
            if instead is not None:  # the coordinates that both have, beyond the level
                fit, effect = instead
                known = fit.x[fit.parameters.slot(effect)]
                for i, place in list(enumerate(term.shared.get(effect, ())))[1:]:
                    rows[:, place] = known[i]
            low, high = np.array(term.limits(parameters.scales)).T
            rows = np.clip(rows, low, high)
            X = np.vstack([parameters.inserted(x, z) for z in rows])
            self.trials.append(_Trial(term, longer, rows, self.objective.errors(longer, X), base, onto, False))

    def _narrow(self, rows: Matrix, base: _Base) -> Matrix:
        """Resonances between those of the start rows that lower the error most, without and with the noise filter of the base."""
        poles = np.exp(np.linspace(rows[:, 0].min(), rows[:, 0].max(), POLICY.resonances))
        columns = resonance_columns(self.data, poles, self.objective.measured - base.error)
        own = self.objective.noise_of(base.error, base.hypothesis.predictor.closed)
        found = []
        for noise in {f.key: f for f in (WHITE, own)}.values():
            filtered_base = self._filtered(base, noise)
            V = self.objective.whitened(columns, noise)
            V -= (V @ filtered_base.basis.T) @ filtered_base.basis
            for i in np.argsort(_pair_worth(V, filtered_base.rest))[::-1][: POLICY.promising]:
                c1, c0 = np.linalg.lstsq(V[2 * i : 2 * i + 2].T, filtered_base.rest, rcond=None)[0]
                wz = poles[i] * np.sqrt(np.clip(1.0 + c0, 0.25, 4.0))  # no decision: a start, no further than an octave
                found.append((np.log(poles[i]), DAMPING, np.log(wz), poles[i] * (DAMPING + 0.5 * c1) / wz))
        return np.array(found)

    def filter_beyond(self, base: _Base) -> NoiseFilter:
        """Noise filter of the error that no effect of the library explains, to first order: it whitens no effect as noise."""
        directions = [base.J]
        rest = project_out(base.J, base.error[None, :])[0]
        # Another wave of an effect that is in the model: other effects of the same order stand for it.
        for t in (t for t in self.trials if t.base is base and t.term.waves == 1):
            if t.columns:
                best = np.argsort(_pair_worth(project_out(base.J, t.errors), rest))[::-1][:2]
                directions += [t.errors[2 * i : 2 * i + 2] for i in best]
            else:
                finite = np.all(np.abs(t.errors) < LOST, axis=1)
                if finite.any():
                    nearest = np.argmin(_along(project_out(base.J, t.errors[finite]) - rest, rest))
                    directions.append((t.errors[finite][nearest] - base.error)[None, :])
        D = np.vstack(directions)[: max(len(base.error) // POLICY.direction_samples, 1)]
        return self.objective.noise_of(project_out(D, base.error[None, :])[0], base.hypothesis.predictor.closed)

    def ranked(self, noise: NoiseFilter | None) -> list[Screened]:
        """Candidates from the most to the least promising, each with the base where it gains more.

        Candidates are ranked by the fall of the cost against the base that they extend, under the same filter:
        a model in its loop leaves another error than one that the torque drives.
        noise: the filter; None: for each base that of the error that no effect explains.
        """
        best: dict[Term, Screened] = {}
        for t in self.trials:
            filtered = self._filtered(t.base, noise)
            key = t, filtered
            if key not in self._screened:
                self._screened[key] = self._judged(t, filtered)
            found = self._screened[key]
            if t.term not in best or found.fall > best[t.term].fall:
                best[t.term] = found
        return sorted(best.values(), key=lambda s: -s.fall)

    def _filtered(self, base: _Base, noise: NoiseFilter | None) -> _Filtered:
        own = noise is None
        if noise is None:
            trials = sum(t.base is base for t in self.trials)
            if base not in self._beyond or self._beyond[base][0] != trials:
                self._beyond[base] = trials, self.filter_beyond(base)
            noise = self._beyond[base][1]
        key = base, noise, own
        if key not in self._filtered_bases:
            basis = orthonormal_rows(self.objective.whitened(base.J, noise))
            v = self.objective.whitened(base.error[None, :], noise)[0]
            rest = v - (v @ basis.T) @ basis
            self._filtered_bases[key] = _Filtered(noise, basis, rest, self._without(base, None if own else noise))
        return self._filtered_bases[key]

    def _judged(self, t: _Trial, filtered: _Filtered) -> Screened:
        n, rest = self.objective.information, filtered.rest
        V = self.objective.whitened(t.errors, filtered.noise)
        finite = np.all(np.isfinite(V), axis=1)
        if not t.columns:
            finite &= np.all(np.abs(t.errors) < LOST, axis=1)
        V[~finite] = 0.0
        V -= (V @ filtered.basis.T) @ filtered.basis
        power = float(rest @ rest)
        if t.columns:
            worth = _pair_worth(V, rest)
            order = np.argsort(worth)[::-1][:2]
            costs = np.maximum(power - worth[order], 1e-300)
            starts = tuple(_harmonic_start(t, V, rest, int(i)) for i in order)
        else:
            costs = np.where(finite, _along(V - rest, rest, t.term.proportional), np.inf)
            order = np.argsort(costs)
            starts = tuple(t.start(row) for row in _start_rows(t, V, rest, order[: POLICY.starts]))
            costs = costs[order]
        cost, size = max(float(costs[0]), 1e-300), t.hypothesis.parameters.size - t.base.hypothesis.parameters.size
        if not np.isfinite(cost):  # every start diverges
            return Screened(t.term, t.hypothesis, starts, filtered.noise, -np.inf, -np.inf)
        fall = gained(power, cost, n, size)
        bic = self.objective.bic(cost, filtered.noise, t.hypothesis.parameters.size)
        return Screened(t.term, t.hypothesis, starts, filtered.noise, fall, float(filtered.own - bic))

    def _without(self, base: _Base, noise: NoiseFilter | None) -> float:
        """BIC of the model that is extended, under a filter or that of its own errors."""
        f = noise or self.objective.noise_of(base.error, base.hypothesis.predictor.closed)
        v = self.objective.whitened(base.error[None, :], f)[0]
        return self.objective.bic(float(v @ v), f, base.hypothesis.parameters.size)


def _along(D: Matrix, rest: Vector, proportional: bool = False) -> Vector:
    """|rest|^2 after the best step along each row of D: at most to the next start, unbounded where the effect is proportional."""
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
    if t.term.proportional:
        D = V[order] - rest
        rows = rows * np.maximum(-(D @ rest) / np.maximum(np.einsum("ij,ij->i", D, D), 1e-300), 0.0)[:, None]
    return np.asarray(rows)


def _harmonic_start(t: _Trial, V: Matrix, rest: Vector, i: int) -> Vector:
    first = t.term.components
    coordinates: Vector = t.rows[i].copy()
    coordinates[first : first + 2] = np.linalg.lstsq(V[2 * i : 2 * i + 2].T, rest, rcond=None)[0]
    return t.start(coordinates)
