"""What all peers are given: the record, the ranges, the two codings of a candidate, and the error sum by SciPy.

    G(s) = K prod (s + B) / prod (s + A),   PI kp + ki/s,   s = (2/Ts)(z-1)/(z+1),   w/w* = N/(D + N)

A candidate is 194 bits, structure included (Fig. 4 of the paper: p, q, K and nine complex numbers of 10 + 10 bits), or, where a
peer works on real numbers, six numbers in 0..1 with the true structure (1, 2) given: K, A1, Re and Im of the pole pair, Re
and Im of the zero pair. Nothing here uses gaident's core except to make the record.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import success
from numpy.typing import NDArray
from scipy.signal import cont2discrete, dlsim, lfilter, tf2ss

import gaident as ga

Array = NDArray[np.float64]
Roots = Sequence[complex]

BITS, FIELDS = 194, 19
STRUCTURE = (1, 2)
NUMBERS = 6
WORST = np.finfo(float).max
WEIGHTS = 1 << np.arange(9, -1, -1)


@dataclass(frozen=True)
class Problem:
    """A record and where to look; ranges in rad/s, K and (where `logarithmic`) the roots on a logarithmic scale."""

    name: str
    case: success.Case
    record: ga.Record
    truth: Array
    space: ga.SearchSpace
    logarithmic: bool

    @property
    def output(self) -> Array:
        """Measured velocity [rad/s]."""
        return self.record.velocity

    def ranges(self) -> Array:
        """Rows K, real, imaginary; columns lowest, highest. On a logarithmic scale a range from 0 covers four decades."""
        rows = np.array([self.space.gain, self.space.real, self.space.imaginary])
        if self.logarithmic:
            rows[1:, 0] = np.where(rows[1:, 0] > 0.0, rows[1:, 0], 1e-4 * rows[1:, 1])
        return rows

    def scaled(self, t: Array, row: int) -> Array:
        """Numbers in 0..1 on the scale of a row of ranges()."""
        lo, hi = self.ranges()[row]
        return np.asarray(lo * (hi / lo) ** t if row == 0 or self.logarithmic else lo + (hi - lo) * t)

    def from_numbers(self, x: Array) -> tuple[float, Roots, Roots]:
        """(K, A, B) of six numbers in 0..1."""
        K, re, im = self.scaled(x[0], 0), self.scaled(x[[1, 2, 4]], 1), self.scaled(x[[3, 5]], 2)
        A = [re[0], complex(re[1], im[0]), complex(re[1], -im[0])]
        return float(K), A, [complex(re[2], im[1]), complex(re[2], -im[1])]

    def from_bits(self, bits: Array) -> tuple[float, Roots, Roots]:
        """(K, A, B) of 194 bits, binary code; pairs as in the method: within a group first, the rest across, then single."""
        bits = np.asarray(bits, dtype=np.int64)
        p, q = int(2 * bits[0] + bits[1]), int(2 * bits[2] + bits[3])
        codes = bits[4:].reshape(FIELDS, 10) @ WEIGHTS
        t = codes / 1023.0
        group1 = [1 + 2 * i for i in range(p)]
        poles2, zeros2 = [7 + 4 * j for j in range(q)], [9 + 4 * j for j in range(q)]

        def roots(*groups: list[int]) -> list[complex]:
            found: list[complex] = []
            left: list[int] = []
            for group in groups:
                for a, b in zip(group[0::2], group[1::2], strict=False):
                    found += pair(a, b)
                left += group[len(group) // 2 * 2 :]
            return found + (pair(*left) if len(left) == 2 else [complex(self.scaled(t[a], 1)) for a in left])

        def pair(a: int, b: int) -> list[complex]:
            if codes[b + 1] < 512:  # the top bit of the second member's imaginary gene decides
                return [complex(self.scaled(t[a], 1)), complex(self.scaled(t[b], 1))]
            root = complex(self.scaled(t[a], 1), self.scaled(t[a + 1], 2))
            return [root, root.conjugate()]

        return float(self.scaled(t[0], 0)), roots(group1, poles2), roots(zeros2)


def problem(name: str, seed: int) -> Problem:
    """The two-mass record with the paper's ranges, or the hard one with the ranges that identify() derives from the data."""
    from gaident.identification.space import derive_space

    case = success.CASES[name][0](np.random.default_rng(0))
    truth = success.noise_free(case)
    noise = case.noise * np.random.default_rng([seed, 77]).standard_normal(len(truth))
    record = ga.Record(dt=success.DT, command=case.command, velocity=truth + noise)
    if name == "hard":
        return Problem(name, case, record, truth, derive_space([record], case.controller), True)
    return Problem(name, case, record, truth, ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0)), False)


def scipy_response(case: success.Case, K: float, A: Roots, B: Roots) -> Array:
    """Closed loop as one difference equation in z, by scipy.signal.lfilter: how one writes it in SciPy."""
    c, dt = 2.0 / success.DT, success.DT
    numerator, denominator = np.array([K]), np.array([1.0])
    for b in B:
        numerator = np.convolve(numerator, [c + b, b - c])
    for a in A:
        denominator = np.convolve(denominator, [c + a, a - c])
    for _ in range(len(A) - len(B)):
        numerator = np.convolve(numerator, [1.0, 1.0])
    pi = case.controller
    N = np.convolve(numerator, [pi.kp + 0.5 * pi.ki * dt, 0.5 * pi.ki * dt - pi.kp]).real
    D = np.convolve(denominator, [1.0, -1.0]).real
    return np.asarray(lfilter(N, D + N, case.command))


def scipy_error(case: success.Case, output: Array, K: float, A: Roots, B: Roots) -> float:
    """Error sum [rad^2/s^2]; the largest double where the candidate diverges."""
    with np.errstate(all="ignore"):
        e = output - scipy_response(case, K, A, B)
        total = float(e @ e)
    return total if total < WORST else WORST


def independent_error(case: success.Case, output: Array, K: float, A: Roots, B: Roots) -> float:
    """The same error sum another way: modules in state space, in time units of Ts, scipy.signal.cont2discrete, dlsim."""
    dt, pi = success.DT, case.controller

    def module(numerator: Array, denominator: Array) -> list[Array]:
        return [np.asarray(m) for m in cont2discrete(tf2ss(numerator, denominator), 1.0, method="bilinear")[:4]]

    def factors(roots: Roots) -> list[Array]:
        """Second-order factors, real roots two by two, at most one of first order at the end."""
        pairs = [np.array([1.0, 2.0 * r.real * dt, abs(r) ** 2 * dt**2]) for r in roots if complex(r).imag > 0.0]
        singles = [np.array([1.0, r.real * dt]) for r in roots if complex(r).imag == 0.0]
        pairs += [np.convolve(a, b) for a, b in zip(singles[0::2], singles[1::2], strict=False)]
        return pairs + singles[len(singles) // 2 * 2 :]

    zeros = factors(B)
    chain = [module(np.array([pi.kp, pi.ki * dt]), np.array([1.0, 0.0]))]
    for poles in factors(A):
        taken = zeros.pop(0) if zeros and len(zeros[0]) <= len(poles) else np.ones(1)
        chain.append(module(taken, poles))
    assert not zeros, "zeros without poles"
    F, G, H, d = chain[0]
    for f, g, h, e in chain[1:]:  # in series
        F = np.block([[F, np.zeros((len(F), len(f)))], [g @ H, f]])
        G, H, d = np.vstack([G, g @ d]), np.hstack([e @ H, h]), e @ d
    scale = K * dt ** (len(A) - len(B))
    H, d = scale * H, scale * d
    lead = 1.0 / (1.0 + d[0, 0])  # y = lead (H x + d r), e = lead (r - H x)
    _, y, _ = dlsim((F - lead * G @ H, lead * G, lead * H, lead * d, 1.0), case.command)
    return float(np.sum((output - y[:, 0]) ** 2))


class Reached(Exception):  # noqa: N818 - no error
    """The optimum was found, or the time is over."""


class Fitness:
    """Counts evaluations, keeps the best candidate and, where `until` is given, ends the run by raising Reached.

    one(x) -> error sum; many(X) -> error sums, `rows` of candidates at once. until(x) says whether x is the optimum.
    """

    def __init__(
        self,
        one: Callable[[Array], float],
        many: Callable[[Array], Array] | None = None,
        until: Callable[[Array], bool] | None = None,
        seconds: float = np.inf,
    ) -> None:
        self._one, self._many, self._until = one, many, until
        self.evaluations, self.best, self.x = 0, np.inf, np.zeros(0)
        self.reached = False
        self.end = time.perf_counter() + seconds

    @property
    def batched(self) -> bool:
        """Whether many() is one call."""
        return self._many is not None

    def one(self, x: Array) -> float:
        """Of one candidate."""
        f = float(self._one(x))
        self._note(1, f, x)
        return f

    def many(self, X: Array) -> Array:
        """Of the rows of X."""
        f = np.array([self._one(x) for x in X]) if self._many is None else self._many(X)
        k = int(np.argmin(f))
        self._note(len(X), float(f[k]), X[k])
        return f

    def _note(self, count: int, f: float, x: Array) -> None:
        self.evaluations += count
        if f < self.best:
            self.best, self.x = f, np.array(x)
            self.reached = self._until is not None and self._until(self.x)
        if self.reached or time.perf_counter() > self.end:
            raise Reached
