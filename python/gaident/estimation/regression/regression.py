"""Ordinary least squares whose deviations know that neighbouring residuals are alike.

    theta = argmin |y - X theta|^2
    cov   = (X'X)^-1 S (X'X)^-1
    S     = sum_j k(j) sum_i (x_i r_i)(x_i-j r_i-j)',   k(j) = 1 - |j|/(L + 1) for |j| <= L       (Newey and West 1987)

L = lags_per_root sqrt(n), with 1.3 as Lazarus, Lewis, Stock and Watson (2018) recommend for tests.
No deviation is smaller than that of white residuals.
Columns are chosen by the criterion of all models (estimation/criterion.py), with the independent samples of the residuals.
Theory: docs/theory/inverse-dynamics.md.

W. K. Newey, K. D. West, Econometrica 55(3):703-708, 1987.
E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, Journal of Business and Economic Statistics 36(4):541-559, 2018.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["covariance", "larger_of", "long_run", "solve"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

SOLVER_RANK = 1e-10  # no decision: of a solver
"""Singular values below this share of the largest, of columns of equal length, are zero."""


def solve(X: Matrix, y: Vector) -> tuple[Vector, int]:
    """(theta (k,), rank): the least-squares solution of X theta = y, columns scaled to equal length first."""
    length = np.linalg.norm(X, axis=0)
    length[length == 0.0] = 1.0
    theta, _, rank, _ = np.linalg.lstsq(X / length, y, rcond=SOLVER_RANK)
    return np.asarray(theta / length), int(rank)


def long_run(scores: Matrix) -> Matrix:
    """Covariance (k, k) of the sum of the scores (n, k) of one record, with Bartlett's weights over L lags (see above).

        S = sum_(|l| <= L) (1 - |l|/(L+1)) sum_n s(n) s(n+l)' = 1/(L+1) sum_t B(t) B(t)',   B(t) = s(t) + ... + s(t+L)

    B is the sum over a window that slides over the record, its ends included.
    """
    n = len(scores)
    if n == 0:
        return np.zeros((scores.shape[1],) * 2)
    window = min(int(np.ceil(POLICY.lags_per_root * np.sqrt(n))), n - 1) + 1
    sums = np.zeros((n + 2 * window - 1, scores.shape[1]))
    sums[window : window + n] = np.cumsum(scores, axis=0)
    sums[window + n :] = sums[window + n - 1]
    sliding = sums[window:] - sums[:-window]
    return np.asarray(sliding.T @ sliding / window)


def larger_of(first: Matrix, second: Matrix) -> Matrix:
    """The covariance (k, k) that gives no linear function of the numbers a smaller variance than either of two.

        first = L L',   L^+ second L^+' = U diag(r) U',   L U diag(max(r, 1)) U' L'

    Directions in which the first has no variance keep none.
    """
    sizes = np.sqrt(np.maximum(np.diag(first), 0.0))
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    values, vectors = np.linalg.eigh(first / np.outer(sizes, sizes))
    known = values > SOLVER_RANK**2 * max(float(values[-1]), 0.0)
    if not known.any():
        return first
    roots = np.sqrt(values[known])
    L, inverse = sizes[:, None] * vectors[:, known] * roots, (vectors[:, known] / roots).T / sizes
    ratios, turned = np.linalg.eigh(inverse @ second @ inverse.T)
    grown = L @ turned * np.sqrt(np.maximum(ratios, 1.0))
    return np.asarray(grown @ grown.T)


def covariance(X: Sequence[Matrix], residuals: Sequence[Vector]) -> Matrix:
    """Covariance (k, k) of the solution; X (n_i, k) and residuals (n_i,) by record, which are independent of each other.

    Directions that the columns do not determine have infinite variance.
    """
    whole = np.vstack(X)
    n, k = whole.shape
    length = np.linalg.norm(whole, axis=0)
    scale = np.where(length > 0.0, length, 1.0)
    values, vectors = np.linalg.eigh((whole / scale).T @ (whole / scale))
    known = values > SOLVER_RANK**2 * values[-1] if values[-1] > 0.0 else np.zeros(k, dtype=bool)
    known &= values > 1e-12 * k
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
    middle = np.zeros((k, k))
    for part, r in zip(X, residuals, strict=True):
        middle += long_run(part / scale * r[:, None])
    robust = inverse @ middle @ inverse
    white = inverse * (sum(float(r @ r) for r in residuals) / max(n - k, 1))
    # No smaller than white: both deviations are estimates, and the larger one is the safer.
    ratio = np.sqrt(np.maximum(np.diag(white) / np.maximum(np.diag(robust), 1e-300), 1.0))
    cov = robust * np.outer(ratio, ratio)
    lost = np.sum(vectors[:, ~known] ** 2, axis=1) > 1e-6  # no decision: rounding of eigenvectors
    cov[lost, :] = cov[:, lost] = 0.0
    cov[lost, lost] = np.inf
    return np.asarray(cov / np.outer(scale, scale))
