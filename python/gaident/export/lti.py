"""A model as a linear system of scipy.signal or python-control, its linear effects included.

Continuous, the chain torque -> delay -> lag -> mechanism -> filter -> velocity is gain, poles and zeros; the delay exp(-s T) is
none, and takes its place as the Pade approximation of order n

    exp(-s T) = N(-s T) / N(s T),   N(x) = sum over k of (2n - k)! n! / ((2n)! k! (n - k)!) x^k

Sampled, with the torque held between the samples, it is exact, of any delay d dt + f, 0 <= f < dt:

    x(k+1) = e^(A dt) x(k) + G1 u(k-d-1) + G0 u(k-d)
    G0 = integral of e^(A s) B ds over 0..dt-f,   G1 = e^(A (dt-f)) times the integral over 0..f
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.checks import time_of_sample
from gaident.errors import ModelError
from gaident.models.effects_linear import LINEAR, Transfer
from gaident.models.model import Model
from gaident.models.roots import canonical_roots

__all__ = ["in_a_row", "to_control", "to_scipy"]

Matrix = NDArray[np.float64]

MOST_WAITING = 2000  # no decision: memory: states of a delay, whose matrix has their square
HIGHEST_PADE = 10  # no decision: beyond, the approximation's own poles are lost in rounding; what an argument may be


def to_scipy(model: Model, dt: float | None, pade: int | None) -> Any:
    """scipy.signal.ZerosPolesGain, or with dt StateSpace; see `Model.to_scipy`."""
    from scipy import signal

    chain = _chain(model)
    if dt is not None:
        step = _checked_step(model, dt, pade)
        return signal.StateSpace(*_sampled(chain, step), dt=step)
    chain = _rational(model, chain, pade)
    return signal.ZerosPolesGain(list(chain.zeros), list(chain.poles), chain.gain)


def to_control(model: Model, dt: float | None, pade: int | None) -> Any:
    """control.TransferFunction, or with dt control.StateSpace; see `Model.to_control`."""
    chain = _chain(model)
    step = None if dt is None else _checked_step(model, dt, pade)
    try:
        import control
    except ImportError as reason:
        raise ImportError('to_control needs python-control: pip install "gaident[control]"') from reason
    if step is not None:
        return control.ss(*_sampled(chain, step), step)
    chain = _rational(model, chain, pade)
    return control.zpk(list(chain.zeros), list(chain.poles), chain.gain)


def _chain(model: Model) -> Transfer:
    others = [effect.name for effect in model.effects if effect.name not in LINEAR]
    if others:
        raise ModelError(
            f"the model has {', '.join(others)}, which no linear system can contain: take it out with without_effect, use "
            f"model.linear, or write the whole with to_c (of the effects a linear system contains {', '.join(LINEAR)})"
        )
    mechanism = model.mechanism
    chain = Transfer(mechanism.gain, mechanism.poles, mechanism.zeros)
    for effect in model.effects:
        if effect.row.place != "plant":  # else it is part of the mechanism
            more = LINEAR[effect.name](effect.values)
            chain = Transfer(
                chain.gain * more.gain, (*chain.poles, *more.poles), (*chain.zeros, *more.zeros), chain.delay + more.delay
            )
    return chain


def _checked_step(model: Model, dt: float, pade: int | None) -> float:
    step = time_of_sample(dt, ModelError)
    if pade is not None:
        raise ModelError(f"pade is {pade!r}: sampled, the delay is exact; leave pade out, or dt for a continuous system")
    if model.p == 0:
        raise ModelError("the model has p = 0 (as many zeros as poles), which has no sampled form: leave dt out")
    return step


def _rational(model: Model, chain: Transfer, pade: int | None) -> Transfer:
    """The chain with the delay as poles and zeros."""
    if pade is not None and (isinstance(pade, bool) or not isinstance(pade, int) or not 1 <= pade <= HIGHEST_PADE):
        raise ModelError(f"pade is {pade!r}: give the order of the approximation, a whole number from 1 to {HIGHEST_PADE}")
    if chain.delay == 0.0:
        return chain
    if pade is None:
        late = " and ".join(e.name for e in model.effects if LINEAR[e.name](e.values).delay)
        raise ModelError(
            f"the model has a {late} of {chain.delay:g} s, which is no ratio of polynomials: give pade=3 for an "
            "approximation, or dt= for a sampled system, in which it is exact"
        )
    n = pade
    N = [math.factorial(2 * n - k) * math.comb(n, k) for k in range(n, -1, -1)]  # up to a common factor
    roots = np.roots(np.array(N, dtype=np.float64) / N[0]) / chain.delay
    # n is the same above and below: the leading coefficients are 1 and (-1)^n.
    zeros = (*chain.zeros, *(complex(-r) for r in roots))
    return Transfer(chain.gain * (-1.0) ** n, (*chain.poles, *(complex(r) for r in roots)), zeros, 0.0)


def _sampled(chain: Transfer, dt: float) -> tuple[Matrix, Matrix, Matrix, Matrix]:
    """(A, B, C, D) at the sample time: the plant's states, then the torques u(k-1), u(k-2), ... on their way."""
    from scipy.linalg import expm

    A, B, C = in_a_row(chain, dt)
    n = len(A)

    def over(share: float) -> tuple[Matrix, Matrix]:
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[:n, n] = A * share, B * share
        with np.errstate(over="ignore", invalid="ignore"):
            E = expm(M)
        if not np.all(np.isfinite(E)):
            raise ModelError(
                f"dt is {dt:g}: within one such step a pole of the model grows beyond all numbers; give a shorter dt"
            )
        return E[:n, :n], E[:n, n]

    samples = chain.delay / dt
    d = math.floor(samples + 1e-9)
    f = max(samples - d, 0.0)
    f = f if f > 1e-9 else 0.0
    late, G0 = over(1.0 - f)
    early, G_early = over(f)
    G1 = late @ G_early
    waiting = d + (f > 0.0)
    if waiting > MOST_WAITING:
        raise ModelError(
            f"dt is {dt:g}: the delay of {chain.delay:g} s has {waiting} states at it, and {MOST_WAITING} may be; "
            "give a longer dt"
        )
    F, G, H = np.zeros((n + waiting, n + waiting)), np.zeros((n + waiting, 1)), np.zeros((1, n + waiting))
    F[:n, :n] = late @ early
    H[0, :n] = C
    for column, gamma in ((d, G0), (d + 1, G1)):  # u(k - column)
        if column == 0:
            G[:n, 0] += gamma
        elif column <= waiting:
            F[:n, n + column - 1] += gamma
    for i in range(waiting):
        if i == 0:
            G[n, 0] = 1.0
        else:
            F[n + i, n + i - 1] = 1.0
    return F, G, H, np.zeros((1, 1))


def in_a_row(chain: Transfer, dt: float) -> tuple[Matrix, NDArray[np.float64], NDArray[np.float64]]:
    """(A, B, C) of the chain without its delay, time in units of dt, as sections of order two and one in a row.

    Each takes the output v of those before it:  x1' = x2, x2' = -e0 x1 - e1 x2 + v, y = n2 x2' + n1 x2 + n0 x1.
    """

    poles, zeros = (_sections(canonical_roots(roots, "roots"), dt) for roots in (chain.poles, chain.zeros))
    n = sum(len(section) for section in poles)
    A, B, C, D = np.zeros((n, n)), np.zeros(n), np.zeros(n), 1.0
    at = 0
    excess = len(chain.poles) - len(chain.zeros)
    # The long sections first: a pair of zeros needs a pair of poles to stand on.
    poles.sort(key=len, reverse=True)
    zeros.sort(key=len, reverse=True)
    for section in poles:
        e, size = section[::-1], len(section)  # e[0] + e[1] s + ... + s^size
        b = zeros.pop(0) if zeros and len(zeros[0]) <= size else ()
        numerator = np.zeros(size + 1)
        numerator[: len(b) + 1] = [*b[::-1], 1.0]
        rows = slice(at, at + size)
        A[at + size - 1, :], B[at + size - 1] = C, D
        for i in range(size - 1):
            A[at + i, at + i + 1] = 1.0
        A[at + size - 1, rows] -= e
        own = numerator[:size] - numerator[size] * np.array(e)
        C, D = C * numerator[size], D * numerator[size]
        C[rows] += own
        at += size
    return A, B, C * chain.gain * dt**excess


def _sections(roots: tuple[complex, ...], dt: float) -> list[tuple[float, ...]]:
    """(e1, e0) of conjugate pairs, (e0,) of real roots: s^2 + e1 s + e0, s + e0, with s in units of 1/dt."""
    made: list[tuple[float, ...]] = []
    reals = [-r.real * dt for r in roots if r.imag == 0.0]
    made += [(2.0 * -r.real * dt, abs(r) ** 2 * dt**2) for r in roots if r.imag > 0.0]
    made += [(a + b, a * b) for a, b in zip(reals[0::2], reals[1::2], strict=False)]
    return made + ([(reals[-1],)] if len(reals) % 2 else [])
