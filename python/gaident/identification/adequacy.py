"""Does the linear model hold? Tests on the residual that are valid under feedback.

Whiteness says whether anything predictable is left; noise of a colour of its own leaves that too.
What falsifies the *model* is a residual that still depends on the input or on the motion:
whitened, and with what a change of the model's own parameters could explain taken out,
it is regressed on the input at several lags, a constant, and sign(w), w|w| of the simulated velocity. F-test.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.identification.noise import Autoregression, ljung_box_of
from gaident.policy.table import POLICY
from gaident.results.adequacy import Adequacy

__all__ = ["Sums", "assess", "independence_p", "regressor_lags", "white_lags"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Sums:
    """What the tests need of a fit, gathered by the core over all samples of all records.

    products: sums of e(n) e(n+k), k = 0..; white: X'X of X = F [e | J | regressors], see `_core.Experiment.fit_sums`;
    unknowns: columns of J; lengths: samples of each record; noise: the autoregression F.
    quiet: noise of the measured velocity by its third differences [rad/s]; beside: numbers of frequency responses in `white`.
    """

    products: Vector
    white: Vector
    unknowns: int
    lengths: Sequence[int]
    noise: Autoregression
    quiet: float
    beside: int = 0


def regressor_lags(lengths: Sequence[int], open_loop: bool) -> list[int]:
    """Lags of the input that the residual is tested on.

    open_loop: the input is a torque.
    It acts from the next sample on, and if a controller made it, it carries the noise of its own sample:
    lag 0 would then be correlated with the residual by construction and is left out.
    """
    lags, k = [] if open_loop else [0], 1
    while k <= POLICY.input_lag:
        lags.append(k)
        k *= 2
    return [k for k in lags if k < min(lengths) // POLICY.samples_per_input_lag]


def white_lags(lengths: Sequence[int]) -> int:
    """Lags of the whiteness test."""
    return min(POLICY.white_lags, sum(lengths) // POLICY.samples_per_white_lag)


def assess(s: Sums) -> Adequacy:
    """The verdict on a fit."""
    total = sum(s.lengths)
    power = float(s.products[0]) / total
    white_p = ljung_box_of(s.products[: white_lags(s.lengths) + 1], total)
    predictable = 1.0 - s.noise.std**2 / power if power > 0.0 else 0.0
    p = independence_p(s.white, s.unknowns, total + s.beside - s.noise.order * len(s.lengths))
    excess = math.sqrt(power) / s.quiet if s.quiet > 0.0 else (0.0 if power == 0.0 else math.inf)
    falsified = p < POLICY.test_level
    undecided = not falsified and white_p < POLICY.test_level and excess > POLICY.undecided_ratio
    return Adequacy(white_p, s.noise.order, s.noise.std, max(predictable, 0.0), excess, p, falsified, undecided)


def independence_p(sums: Vector, own: int, samples: int) -> float:
    """p-value of the F-test that rows explain nothing of v beyond the rows `own`; samples: degrees of freedom.

    sums: of products, of v first, then of `own` rows, then of the others.

    What `own` explains is taken out of the sums (a Schur complement); what is left of v is regressed on what is left of the
    others.
    """
    diagonal = np.diag(sums)
    # A column without power, or without a number, explains nothing.
    sound = np.isfinite(diagonal) & (diagonal > 0.0)
    scale = np.where(sound, np.sqrt(np.where(sound, diagonal, 1.0)), np.inf)
    scale[0] = 1.0
    G = np.nan_to_num(sums) / np.outer(scale, scale)
    mine = np.flatnonzero(sound[1 : 1 + own]) + 1
    others = np.flatnonzero(sound[1 + own :]) + 1 + own
    basis = _orthonormal(G[np.ix_(mine, mine)])
    of_v, of_others = basis @ G[mine, 0], basis @ G[np.ix_(mine, others)]
    rest = float(G[0, 0] - of_v @ of_v)
    cross = G[others, 0] - of_others.T @ of_v
    more = G[np.ix_(others, others)] - of_others.T @ of_others
    size = np.diag(more)
    keep = np.flatnonzero(size > 1e-8)  # of the column's power; what is less is rounding
    if len(keep) == 0:
        return 1.0
    root = np.sqrt(size[keep])
    directions = _orthonormal(more[np.ix_(keep, keep)] / np.outer(root, root))
    m = len(directions)
    explained = float(np.sum((directions @ (cross[keep] / root)) ** 2))
    left = rest - explained
    dof = samples - len(basis) - m
    if dof < 1 or not left > 0.0:
        return 1.0 if not explained > 0.0 else 0.0
    return _f_tail((explained / m) / (left / dof), m, dof)


def _f_tail(x: float, m: int, dof: int) -> float:
    """P(F > x) for m and dof degrees of freedom."""
    from scipy.special import fdtrc

    return float(fdtrc(m, dof, x))


def _orthonormal(gram: Vector) -> Vector:
    """Combinations (rows) of columns of unit power that make them orthonormal, from their sums of products."""
    if len(gram) == 0:
        return np.zeros((0, 0))
    values, vectors = np.linalg.eigh(gram)
    known = values > 1e-10 * values[-1]
    rows: Vector = (vectors[:, known] / np.sqrt(values[known])).T
    return rows
