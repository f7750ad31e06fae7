"""Noise filters: what makes the error of a true model white.

    v(n) = B(q)/A(q) e(n),   B and A monic

Two families. An autoregression (A = 1) knows nothing of the drive.
Where disturbance torques turn the shaft and the sensor adds white noise, the error of a torque-driven model is e = n + G d; a
long autoregression takes hundreds of BIC units to say what two numbers say:

    d(n+1) = phi d(n) + w(n),   e(n) = n(n) + G(q) d(n),   phi = exp(-dt/tau)

whose innovations are v = A(q)/C(q) e, A the characteristic polynomial of G and d together, C that of their steady Kalman filter.
The error of a model that runs in the loop of its own controller is S e with S = 1/(1 + G C): in v the closed loop's polynomial
takes the place of G's, and an integrator that of C.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import filtered
from gaident.control.pi import PI
from gaident.estimation.state_space import discretised, disturbed, steady_covariances
from gaident.identification.noise import autocorrelation, autoregression_of, highest_order
from gaident.models.model import Model

__all__ = ["DIFFERENCED", "HIGHEST", "WHITE", "NoiseFilter", "ShaftNoise", "autoregression", "stationary_autoregression"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

HIGHEST = 20  # no decision: a grid: BIC takes the order; order of an autoregression alone
ON_TOP = 6  # no decision: and of one behind a shaft's noise: what the sensor does
TAUS = 2.5 * 2.0 ** np.arange(10)  # no decision: a grid; samples
SIZES = 2.0 ** np.arange(-12.0, 6.0)  # no decision: a grid
"""Std of w times the velocity that 1 N m for one sample leaves, over the std of n."""
MIDDLE = 4, 7  # no decision: place in the grid of both where a search begins


@dataclass(frozen=True, eq=False)
class NoiseFilter:
    """b, a: coefficients of B and A from q^0 on, both beginning with 1; size: number of estimated parameters."""

    b: Vector = field(default_factory=lambda: np.ones(1))
    a: Vector = field(default_factory=lambda: np.ones(1))
    size: int = 0

    @cached_property
    def key(self) -> tuple[bytes, bytes, int]:
        """The same for filters of the same numbers."""
        return self.b.tobytes(), self.a.tobytes(), self.size

    @cached_property
    def power(self) -> float:
        """Sum of the squared impulse response: the variance of filtered white noise of variance 1."""
        if len(self.a) == 1:
            return float(self.b @ self.b)
        h = self.of(np.eye(1, 4096), (4096,))
        return float(h[0] @ h[0])

    def of(self, E: Matrix, lengths: Sequence[int]) -> Matrix:
        """Rows of v, each record by itself with its past at 0."""
        if len(self.b) == len(self.a) == 1:
            return E
        return filtered(self.b, self.a, E, lengths)

    def then(self, phi: Vector) -> NoiseFilter:
        """This filter, and the autoregression phi on what it leaves."""
        return NoiseFilter(np.convolve(self.b, np.concatenate([[1.0], -phi])), self.a, self.size + len(phi))

    def coloured(self, v: Vector) -> Vector:
        """Noise of this colour from white noise, from rest."""
        from scipy.signal import lfilter

        return np.asarray(lfilter(self.a, self.b, v), dtype=np.float64)


WHITE = NoiseFilter()
DIFFERENCED = [NoiseFilter(a=np.array([1.0, -c]), size=1) for c in (0.9, 0.99, 0.999)]  # no decision: a grid
"""The rounding of an angle that is differenced sample by sample: e(n) = v(n) - v(n-1), as near to it as a filter is stable."""
Grid = dict[tuple[int, int], NoiseFilter | None]


def autoregression(parts: Sequence[Vector], highest: int = HIGHEST, floor: float = 0.0) -> Vector:
    """Coefficients by least squares, order by BIC: the biased autocovariance whitens strongly coloured errors too little.

    floor: variance of white noise that is added to that of the parts.
    """
    products, total = _products(parts, highest), sum(len(e) for e in parts)
    order = len(_by_autocovariance(products, total, floor))
    if order == 0:
        return np.zeros(0)
    M = sum(_moments(e, r, order) for e, r in zip(parts, products, strict=True))
    M = M + floor * (total - order * len(parts)) * np.eye(order + 1)
    return _solved(M[1:, 1:], M[0, 1:])


def _solved(M: Matrix, v: Vector) -> Vector:
    """M^-1 v of a positive definite M; where it is not definite beyond its rounding, the least x of the least error."""
    from scipy.linalg.lapack import dposv

    factor, x, reason = dposv(M, v)
    if reason == 0:
        pivots = factor.diagonal()
        if pivots.min() > 1e-6 * pivots.max():  # no decision: rounding; a pivot is the square root of what is left
            return np.asarray(x, dtype=np.float64)
    return np.asarray(np.linalg.lstsq(M, v, rcond=1e-13)[0], dtype=np.float64)


def stationary_autoregression(parts: Sequence[Vector], highest: int = HIGHEST) -> Vector:
    """Coefficients by the equations of Yule and Walker, order by BIC: a process that never grows, to draw noise from."""
    return _by_autocovariance(_products(parts, highest), sum(len(e) for e in parts))


def _products(parts: Sequence[Vector], highest: int) -> list[Vector]:
    """Of each part sum_n e(n) e(n+k), for k up to the highest order that they allow."""
    top = highest_order([len(e) for e in parts], highest)
    return [autocorrelation(e, top) for e in parts]


def _by_autocovariance(products: Sequence[Vector], total: int, floor: float = 0.0) -> Vector:
    pooled: Vector = np.sum(products, axis=0)
    pooled[0] += floor * total
    return autoregression_of(pooled, total).phi


def _moments(e: Vector, products: Vector, order: int) -> Matrix:
    """sum over n >= order of e(n-i) e(n-j), i, j = 0..order, from the sums of products over all n.

    The first row lacks the products at the start; each diagonal follows from its first by the two products at its ends.
    """
    head, tail = e[:order], e[len(e) - order :][::-1]
    M = np.empty((order + 1, order + 1))
    M[0] = products[: order + 1] - autocorrelation(head, order)
    ends = np.outer(head[::-1], head[::-1]) - np.outer(tail, tail)
    for i in range(order):
        M[i + 1, i + 1 :] = M[i, i:-1] + ends[i, i:]
    return np.triu(M) + np.triu(M, 1).T


def _polynomials(roots: NDArray[Any]) -> Matrix:
    """Real coefficients from the highest power on, of rows of roots."""
    c = np.zeros((len(roots), roots.shape[1] + 1), dtype=np.complex128)
    c[:, 0] = 1.0
    for i, r in enumerate(roots.T):
        c[:, 1 : i + 2] -= r[:, None] * c[:, : i + 1]
    return c.real.copy()


@dataclass(frozen=True, eq=False)
class ShaftNoise:
    """The filters of torque noise at the shaft of one linear model, over a grid of tau and size.

    dt [s]; controller: of a model that runs in its loop, None: no loop is closed.
    """

    model: Model
    dt: float
    controller: PI | None

    @cached_property
    def _open(self) -> Grid:
        return self._filters(closed=False)

    @cached_property
    def _closed(self) -> Grid:
        return self._filters(closed=True)

    def filters(self, places: Sequence[tuple[int, int]], closed: bool = False) -> list[NoiseFilter | None]:
        """The filters of TAUS[i] and SIZES[j]; None outside the grid or where there is none."""
        grid = self._closed if closed and self.controller is not None else self._open
        return [grid.get(k) for k in places]

    def _filters(self, closed: bool) -> Grid:
        """The whole grid at once, so that no filter depends on which others were asked for."""
        plant = discretised(self.model, self.dt)
        places = [(i, j) for i in range(len(TAUS)) for j in range(len(SIZES))]
        phis = np.exp(-1.0 / TAUS[[i for i, _ in places]])
        sizes = SIZES[[j for _, j in places]] / plant.first_response
        m = len(plant.B)
        A = np.zeros((len(phis), m + 1, m + 1), dtype=np.complex128)
        A[:, :m, :m], A[:, :m, m], A[:, m, m] = plant.A, plant.B, phis
        H = np.append(plant.C, 0.0).astype(np.complex128)
        Q = np.zeros_like(A)
        Q[:, m, m] = sizes**2
        P = steady_covariances(A, H, Q)
        known = np.all(np.isfinite(P), axis=(1, 2))
        PH = np.where(known[:, None, None], P, 0.0) @ H.conj()
        K = (A @ PH[:, :, None])[:, :, 0] / (1.0 + (PH @ H).real)[:, None]
        unfiltered: NDArray[Any] = np.linalg.eigvals(plant.A)
        filtered: NDArray[Any] = np.linalg.eigvals(A - K[:, :, None] * H)
        if closed:
            unfiltered = np.linalg.eigvals(disturbed(plant, self.controller, self.dt).A)
            filtered = np.append(filtered, np.ones((len(A), 1)), axis=1)
        numerators = _polynomials(np.append(np.tile(unfiltered, (len(A), 1)), phis[:, None], axis=1))
        denominators = _polynomials(filtered)
        return {k: NoiseFilter(numerators[n], denominators[n], 2) if known[n] else None for n, k in enumerate(places)}

    def best(self, costs_of: Callable[[Sequence[NoiseFilter]], Iterable[float]], closed: bool) -> NoiseFilter | None:
        """The filter of least cost, downhill from the middle of the grid, in large steps and then in small ones.

        Always from there, so that the filter of an error is a matter of this error alone. costs_of: of several filters of one
        size.
        """
        costs: dict[tuple[int, int], float] = {}
        here = MIDDLE
        for stride in (3, 1):
            while True:
                i, j = here
                around = [(i + stride * u, j + stride * v) for u in (-1, 0, 1) for v in (-1, 0, 1)]
                new = [k for k in around if k not in costs]
                there = {k: f for k, f in zip(new, self.filters(new, closed), strict=True) if f is not None}
                costs |= dict.fromkeys(new, np.inf)
                costs |= dict(zip(there, costs_of(list(there.values())), strict=True)) if there else {}
                best = min(around, key=costs.__getitem__)
                if not costs[best] < costs[here]:
                    break
                here = best
        return self.filters([here], closed)[0] if np.isfinite(costs[here]) else None
