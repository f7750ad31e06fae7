"""The records as a fit sees them, and the fit: least squares of whitened errors over base, effects and start states at once.

A model is driven by the torque that the controller issued, as logged or as the controller makes it from command and *measured*
velocity: noise inside the loop then acts on the record as it did on the drive, and what is left at the truth is the noise of the
sensor alone.

    e(n) = w(n) - w_model(n; x),   v = H^-1 e,   minimise V(x) = sum of v^2 over the samples in use

Every hypothesis is judged with a noise filter H^-1 of its own, which is part of it and charged for:

    BIC = N ln(V / N) + (k + size of H) ln N

so that no effect is whitened away by a filter that was estimated without it, and none is favoured by one estimated with it.

A velocity of next to no noise would let the filter judge by what is of no account: the exact instant of a reversal, the corner
that a jump of friction makes there. White noise of a variance f is then added to the account of every hypothesis alike, as if it
had been on the velocity: H is that of e plus this noise, and V/N above becomes V/N + f |h|^2, h the impulse response of H^-1.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.layout import Layout
from gaident.diagnosis.noise_filter import HIGHEST, ON_TOP, WHITE, NoiseFilter, ShaftNoise, autoregression
from gaident.errors import GaidentError

__all__ = ["Fit", "Problem", "orthonormal_rows", "project_out"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Index = NDArray[np.intp]
Predict = Callable[[Layout, Matrix], Matrix]

LOST = 1e60  # rad/s: the error of a model that diverges, every sample; its squares stay numbers
WORST = 1e100


@dataclass(frozen=True)
class Fit:
    """A layout with its best x under a noise filter: cost V there, and BIC."""

    layout: Layout
    x: Vector
    noise: NoiseFilter
    cost: float
    bic: float
    converged: bool = False

    @property
    def key(self) -> Hashable:
        """The same for fits of the same numbers."""
        return self.layout, self.x.tobytes(), self.noise.key, self.cost, self.bic, self.converged

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects in the model, in the order in which they were added."""
        return self.layout.effects


@dataclass
class Problem:
    """Errors of many parameter vectors at once.

    predict(layout, X) -> simulated velocities (n, N), records one after the other; measured: (N,); lengths: samples of each
    record; weight: (N,), 0 for samples that are left out; shaft: the noise of torques at the shaft, None: not looked for; floor:
    f [(rad/s)^2].
    """

    predict: Predict
    measured: Vector
    lengths: tuple[int, ...]
    weight: Vector
    shaft: ShaftNoise | None = None
    simulations: int = 0
    floor: float = 0.0
    _known: dict[Hashable, Fit] = field(init=False, default_factory=dict, repr=False)

    def errors(self, layout: Layout, X: Matrix) -> Matrix:
        """Rows of plain errors."""
        self.simulations += len(X)
        with np.errstate(invalid="ignore", over="ignore"):
            E = self.measured - self.predict(layout, X)
            E[~np.all(np.abs(E) < LOST, axis=1)] = LOST
        return E

    def whitened(self, E: Matrix, noise: NoiseFilter) -> Matrix:
        """Rows of whitened errors; samples that do not count are 0."""
        V = noise.of(self._bridged(E), self.lengths)
        with np.errstate(invalid="ignore"):
            return np.multiply(V, self.counted, out=None if V is E else V)

    @cached_property
    def counted(self) -> Vector:
        """1 for samples that count: all but the masked ones and the head of each record."""
        use = self.weight.copy()
        at = 0
        for n in self.lengths:
            use[at : at + self.head] = 0.0
            at += n
        return use

    def _bridged(self, E: Matrix) -> Matrix:
        """Errors with a straight line over the masked samples, so that a filter does not see them."""
        gaps, before, after, share = self._bridges
        if len(gaps) == 0:
            return E
        E = E.copy()
        E[:, gaps] = E[:, before] + share * (E[:, after] - E[:, before])
        return E

    @cached_property
    def _bridges(self) -> tuple[Index, Index, Index, Vector]:
        """Masked samples, those that count before and after each, and its place between them from 0 to 1."""
        gaps, known = np.flatnonzero(self.weight == 0.0), np.flatnonzero(self.weight > 0.0)
        right = np.searchsorted(known, gaps)
        before, after = known[np.maximum(right - 1, 0)], known[np.minimum(right, len(known) - 1)]
        return gaps, before, after, np.clip((gaps - before) / np.maximum(after - before, 1), 0.0, 1.0)

    @property
    def head(self) -> int:
        """Samples at the start of each record that never count, so that filters of all orders are judged on the same ones."""
        return min(HIGHEST, min(self.lengths) // 12)

    @cached_property
    def count(self) -> float:
        """Number of samples that count."""
        return float(self.counted.sum())

    def filter_of(self, error: Vector, looped: bool = False) -> NoiseFilter:
        """The noise filter of one row of plain errors, of a model in its loop or not: an autoregression or noise at the shaft."""
        if float(np.abs(error).max()) >= LOST:
            return WHITE
        error = self._bridged(error[None, :])
        plain = WHITE.then(autoregression(self._parts(error[0]), floor=self.floor))
        if self.shaft is None:
            return plain
        shaft = self.shaft.best(lambda f: self._variance(float(_sums(self.whitened(error, f))[0]), f), looped)
        if shaft is None:
            return plain
        shaft = shaft.then(autoregression(self._parts(shaft.of(error, self.lengths)[0]), ON_TOP, self.floor * shaft.power))
        return min((plain, shaft), key=lambda f: self.bic(float(_sums(self.whitened(error, f))[0]), f, 0))

    def _parts(self, row: Vector) -> list[Vector]:
        """The records without their heads, where filters begin."""
        return [part[self.head // 2 :] for part in np.split(row, np.cumsum(self.lengths)[:-1])]

    def costs(self, layout: Layout, X: Matrix, noise: NoiseFilter) -> Vector:
        """V of each row; WORST where a model diverges."""
        V = self.whitened(self.errors(layout, X), noise)
        return _sums(V)

    def linearised(self, layout: Layout, x: Vector, noise: NoiseFilter) -> tuple[Vector, Matrix, Vector]:
        """(v, J, plain errors) at x: J[j] = dv/dx_j, forward differences; rows of entries that are not moved are 0."""
        steps = layout.steps()
        limits = layout.limits()
        moved = np.flatnonzero(steps > 0.0)
        h = (3e-3 if layout.looped else 1e-3) * steps  # stops and impacts make the error rough on a small scale
        h = np.where(x + h > limits[1], -h, h)
        X = np.repeat(x[None, :], len(moved) + 1, axis=0)
        X[np.arange(1, len(moved) + 1), moved] += h[moved]
        E = self.errors(layout, X)
        V = self.whitened(E, noise)
        J = np.zeros((layout.size, V.shape[1]))
        with np.errstate(invalid="ignore", over="ignore"):
            J[moved] = (V[1:] - V[0]) / h[moved][:, None]
        return V[0], J, E[0]

    def fit(self, layout: Layout, x: Vector, noise: NoiseFilter, iterations: int = 12) -> Fit:
        """Levenberg-Marquardt from x, eight dampings side by side, bounds by projection; the same fit is made once."""
        key = "fit", layout, x.tobytes(), noise.key, iterations
        return self._once(key, lambda: self._fit(layout, x, noise, iterations))

    def _once(self, key: Hashable, work: Callable[[], Fit]) -> Fit:
        """What the search asks for again, on another way to the same model, is remembered."""
        key = key, self.shaft, self.floor
        if key not in self._known:
            self._known[key] = work()
        return self._known[key]

    def _fit(self, layout: Layout, x: Vector, noise: NoiseFilter, iterations: int) -> Fit:
        limits, steps = layout.limits(), layout.steps()
        x = np.clip(x, *limits)
        damping, converged = 1e-2, False
        v, J, _ = self.linearised(layout, x, noise)
        cost = float(_sums(v[None, :])[0])
        count = max(self.count, 1.0)
        for _ in range(iterations):
            if cost >= WORST:
                break
            A, g = J @ J.T, J @ v
            diagonal = np.diag(A).copy()
            usable = (diagonal > 0.0) & (steps > 0.0) & np.isfinite(diagonal)
            # At a bound with the descent pointing outward: not moved in this step.
            usable &= ~(((x <= limits[0]) & (g > 0.0)) | ((x >= limits[1]) & (g < 0.0)))
            if not usable.any():
                break
            index = np.flatnonzero(usable)
            sub, gradient, scale = A[np.ix_(index, index)], g[index], diagonal[index]
            factors = damping * 10.0 ** np.arange(-3.0, 5.0)
            X = np.repeat(x[None, :], len(factors), axis=0)
            X[:, index] -= _damped_steps(sub, gradient, factors[:, None] * scale + 1e-18 * scale.max())
            X = np.clip(X, *limits)
            costs = self.costs(layout, X, noise)
            best = int(np.argmin(costs))
            if not costs[best] < cost:
                if damping > 1e5:
                    converged = True
                    break
                damping *= 1e5
                continue
            fall = cost - float(costs[best])
            x, cost = X[best], float(costs[best])
            damping = float(np.clip(damping * 10.0 ** (best - 3.0), 1e-9, 1e9))
            # In units of the noise a fall of 0.02 changes no decision.
            if fall < 0.02 * cost / count:
                converged = True
                break
            v, J, _ = self.linearised(layout, x, noise)
        return self._scored(layout, x, noise, cost, converged)

    def settled(self, fit: Fit, iterations: int = 6) -> Fit:
        """The fit under the filter of what it leaves itself (two rounds of generalised least squares)."""
        if fit.cost >= WORST:
            return fit
        return self._once(("settled", fit.key, iterations), lambda: self._settled(fit, iterations))

    def _settled(self, fit: Fit, iterations: int) -> Fit:
        best = fit
        for n in (iterations, max(iterations // 2, 2)):
            noise = self.filter_of(self.errors(fit.layout, fit.x[None, :])[0], fit.layout.looped)
            fit = self.fit(fit.layout, fit.x, noise, n)
            if fit.bic < best.bic:
                best = fit
        return best

    def judged(self, fit: Fit) -> Fit:
        """The same x under the filter of what it leaves."""
        if fit.cost >= WORST:
            return fit
        return self._once(("judged", fit.key), lambda: self._judged(fit))

    def _judged(self, fit: Fit) -> Fit:
        error = self.errors(fit.layout, fit.x[None, :])
        noise = self.filter_of(error[0], fit.layout.looped)
        return self._scored(fit.layout, fit.x, noise, float(_sums(self.whitened(error, noise))[0]), fit.converged)

    def _scored(self, layout: Layout, x: Vector, noise: NoiseFilter, cost: float, converged: bool) -> Fit:
        return Fit(layout, x, noise, cost, self.bic(cost, noise, layout.size) if cost < WORST else np.inf, converged)

    def plain(self, rows: Matrix, error: Vector) -> float:
        """Sum of squared plain errors, beside what the rows can explain."""
        rest = project_out(self.whitened(rows, WHITE), self.whitened(error[None, :], WHITE))[0]
        return float(rest @ rest)

    def bic(self, cost: float, noise: NoiseFilter, numbers: int) -> float:
        """BIC of a cost V under a filter, for so many fitted numbers beside those of the filter."""
        n = self.count
        return float(n * np.log(self._variance(cost, noise)) + (numbers + noise.size) * np.log(n))

    def _variance(self, cost: float, noise: NoiseFilter) -> float:
        """V/N + f |h|^2."""
        return max(cost, 1e-300) / self.count + (self.floor * noise.power if self.floor else 0.0)


def _damped_steps(A: Matrix, g: Vector, damping: Matrix) -> Matrix:
    """(A + diag(d))^-1 g for each row d of damping; 0 where there is none."""
    M = A + damping[:, :, None] * np.eye(len(g))
    try:
        return np.asarray(np.linalg.solve(M, np.repeat(g[None, :, None], len(M), axis=0))[:, :, 0])
    except np.linalg.LinAlgError:
        return np.array([_solved(m, g) for m in M])


def _solved(M: Matrix, g: Vector) -> Vector:
    try:
        return np.asarray(np.linalg.solve(M, g))
    except np.linalg.LinAlgError:
        return np.zeros_like(g)


def _sums(V: Matrix) -> Vector:
    with np.errstate(invalid="ignore", over="ignore"):
        sums = np.einsum("ij,ij->i", V, V)
    return np.where(np.isfinite(sums), np.minimum(sums, WORST), WORST)


def orthonormal_rows(rows: Matrix) -> Matrix:
    """An orthonormal basis of the row space, as rows; rows without power or without a number do not count."""
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    rows = rows[(sizes > 0.0) & np.isfinite(sizes)]
    if len(rows) == 0:
        return np.zeros((0, rows.shape[1]))
    rows = rows / np.sqrt(np.einsum("ij,ij->i", rows, rows))[:, None]
    values, vectors = np.linalg.eigh(rows @ rows.T)
    known = values > 1e-10 * values[-1]
    return np.asarray((vectors[:, known] / np.sqrt(values[known])).T @ rows)


def project_out(J: Matrix, V: Matrix) -> Matrix:
    """Rows of V without what the rows of J can explain."""
    basis = orthonormal_rows(J)
    return np.asarray(V - (V @ basis.T) @ basis)


def split(rows: Sequence[Vector], lengths: Sequence[int]) -> list[Vector]:
    """One row, cut into records."""
    if len(rows) == 0:
        raise GaidentError("no samples")
    return np.split(np.asarray(rows), np.cumsum(lengths)[:-1])
