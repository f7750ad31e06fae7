"""Linear algebra of sensitivities: what the parameters of a model can absorb."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["inverse_of", "orthonormal_rows", "project_out", "slopes", "sums_of_squares"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

WORST = 1e100  # no decision: the cost of a model that diverges, which none reaches
"""The cost of a model that diverges."""

GRAM_RANK = 1e-12  # no decision: of the largest eigenvalue, what a Gram matrix is exact to


def sums_of_squares(V: Matrix) -> Vector:
    """Of each row; WORST for a row that is not finite."""
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


def inverse_of(A: Matrix, sizes: Vector | None = None) -> Matrix:
    """The pseudo-inverse of a Gram matrix A (k, k) of columns that have different units.

    D^-1 (D^-1 A D^-1)^+ D^-1,   D = diag(sizes), None: the lengths sqrt(A_ii) of the columns

    A size of 0 counts as 1.
    """
    lengths = np.sqrt(np.maximum(np.diag(A), 0.0)) if sizes is None else sizes
    lengths = np.where(lengths == 0.0, 1.0, lengths)
    scale = np.outer(lengths, lengths)
    return np.asarray(np.linalg.pinv(A / scale, rcond=GRAM_RANK, hermitian=True) / scale)


def slopes(V: Matrix, h: Vector) -> Matrix:
    """Rows of differences over the steps h, 0 where there is none. V: the row at x, and one for each step."""
    moved = np.flatnonzero(h)
    with np.errstate(invalid="ignore", over="ignore"):
        S: Matrix = V[1:] - V[0]
        S /= h[moved][:, None]
    if len(moved) == len(h):
        return S
    J = np.zeros((len(h), V.shape[1]))
    J[moved] = S
    return J
