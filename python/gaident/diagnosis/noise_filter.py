"""Noise filters: what makes the error of a true model white.

    v(n) = B(q)/A(q) e(n),   B and A monic

Two families. An autoregression (A = 1) knows nothing of the drive. Where torques that nobody commanded turn the shaft and the
sensor adds white noise, the error of a torque-driven model is e = n + G d; a long autoregression takes hundreds of BIC units to
say what two numbers say:

    d(n+1) = phi d(n) + w(n),   e(n) = n(n) + G(q) d(n),   phi = exp(-dt/tau)

whose innovations are v = A(q)/C(q) e, A the characteristic polynomial of G and d together, C that of their steady Kalman filter.
The error of a model that runs in the loop of its own controller is S e with S = 1/(1 + G C): in v the closed loop's polynomial
takes the place of G's, and an integrator that of C.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.state_space import Discretised, discretised, disturbed, steady_covariance
from gaident.errors import GaidentError
from gaident.identification.noise import autocorrelation, autoregression_of, fit_autoregression, highest_order
from gaident.models.controller import PI
from gaident.models.model import Model

__all__ = ["HIGHEST", "WHITE", "NoiseFilter", "ShaftNoise", "autoregression"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

HIGHEST = 20  # order of an autoregression alone
ON_TOP = 6  # and of one behind a shaft's noise: what the sensor does
TAUS = 2.5 * 2.0 ** np.arange(10)  # samples
SIZES = 2.0 ** np.arange(-12.0, 6.0)  # std of w times the velocity that 1 N m for one sample leaves, over the std of n


@dataclass(frozen=True, eq=False)
class NoiseFilter:
    """b, a: coefficients of B and A from q^0 on, both 1 there; size: numbers that were estimated for it."""

    b: Vector = field(default_factory=lambda: np.ones(1))
    a: Vector = field(default_factory=lambda: np.ones(1))
    size: int = 0

    @cached_property
    def power(self) -> float:
        """Sum of the squared impulse response: what becomes of white noise of variance 1."""
        if len(self.a) == 1:
            return float(self.b @ self.b)
        h = self.of(np.eye(1, 4096), (4096,))
        return float(h[0] @ h[0])

    def of(self, E: Matrix, lengths: Sequence[int]) -> Matrix:
        """Rows of v, each record by itself with its past at 0."""
        if len(self.b) == len(self.a) == 1:
            return E
        from scipy.signal import lfilter

        ends = np.cumsum(lengths)[:-1]
        with np.errstate(invalid="ignore", over="ignore"):
            if len(ends) == 0:
                return np.asarray(lfilter(self.b, self.a, E, axis=1))
            return np.concatenate([lfilter(self.b, self.a, part, axis=1) for part in np.split(E, ends, axis=1)], axis=1)

    def then(self, phi: Vector) -> NoiseFilter:
        """This filter, and the autoregression phi on what it leaves."""
        return NoiseFilter(np.convolve(self.b, np.concatenate([[1.0], -phi])), self.a, self.size + len(phi))

    def coloured(self, v: Vector) -> Vector:
        """Noise of this colour from white noise, from rest."""
        from scipy.signal import lfilter

        return np.asarray(lfilter(self.a, self.b, v), dtype=np.float64)


WHITE = NoiseFilter()


def autoregression(parts: Sequence[Vector], highest: int = HIGHEST, floor: float = 0.0) -> Vector:
    """Coefficients by least squares, order by BIC: of strong colour the biased autocovariance takes too little.

    floor: variance of white noise that is taken to be on the parts beside what they show.
    """
    if floor == 0.0:
        order = fit_autoregression(parts, highest).order
    else:
        total = sum(len(e) for e in parts)
        products = np.sum([autocorrelation(e, highest_order([len(e) for e in parts], highest)) for e in parts], axis=0)
        products[0] += floor * total
        order = autoregression_of(products, total).order
    if order == 0:
        return np.zeros(0)
    gram, right = np.zeros((order, order)), np.zeros(order)
    for e in parts:
        rows = np.lib.stride_tricks.sliding_window_view(e[:-1], order)[:, ::-1]
        gram += rows.T @ rows + floor * len(rows) * np.eye(order)
        right += rows.T @ e[order:]
    return np.asarray(np.linalg.lstsq(gram, right, rcond=1e-13)[0], dtype=np.float64)


class ShaftNoise:
    """The filters of torque noise at the shaft of one linear model, over a grid of tau and size, each made when asked for."""

    def __init__(self, model: Model, dt: float, controller: PI | None) -> None:
        self.plant: Discretised = discretised(model, dt)
        self.loop = None if controller is None else np.linalg.eigvals(disturbed(self.plant, controller, dt).A)
        self.last: dict[bool, tuple[int, int]] = {}
        self.made: dict[tuple[int, int, bool], NoiseFilter | None] = {}

    def filter(self, i: int, j: int, looped: bool = False) -> NoiseFilter | None:
        """The filter of TAUS[i] and SIZES[j]; None outside the grid or where there is none."""
        if not (0 <= i < len(TAUS) and 0 <= j < len(SIZES)):
            return None
        key = (i, j, looped)
        if key not in self.made:
            self.made[key] = self._filter(float(np.exp(-1.0 / TAUS[i])), float(SIZES[j]) / self.plant.first_response, looped)
        return self.made[key]

    def _filter(self, phi: float, size: float, looped: bool) -> NoiseFilter | None:
        m = len(self.plant.B)
        A = np.zeros((m + 1, m + 1), dtype=np.complex128)
        A[:m, :m], A[:m, m], A[m, m] = self.plant.A, self.plant.B, phi
        H = np.append(self.plant.C, 0.0).astype(np.complex128)
        Q = np.zeros_like(A)
        Q[m, m] = size**2
        try:
            P = steady_covariance(A, H, Q)
        except GaidentError:
            return None
        K = A @ P @ H.conj() / (1.0 + (H @ P @ H.conj()).real)
        roots, filtered = np.linalg.eigvals(A), np.linalg.eigvals(A - np.outer(K, H))
        if looped and self.loop is not None:
            roots, filtered = np.append(self.loop, phi), np.append(filtered, 1.0)
        return NoiseFilter(np.asarray(np.poly(roots).real), np.asarray(np.poly(filtered).real), 2)

    def best(self, cost: Callable[[NoiseFilter], float], looped: bool) -> NoiseFilter | None:
        """The filter of least cost, downhill from the one before; the first time from the middle of the grid, in large steps."""
        costs: dict[tuple[int, int], float] = {}

        def at(k: tuple[int, int]) -> float:
            if k not in costs:
                f = self.filter(*k, looped)
                costs[k] = np.inf if f is None else cost(f)
            return costs[k]

        here = self.last.get(looped, (4, 7))
        for stride in (1,) if looped in self.last else (3, 1):
            while True:
                i, j = here
                around = [(i + stride * u, j + stride * v) for u in (-1, 0, 1) for v in (-1, 0, 1)]
                best = min(around, key=at)
                if not at(best) < at(here):
                    break
                here = best
        self.last[looped] = here
        return self.filter(*here, looped) if np.isfinite(at(here)) else None
