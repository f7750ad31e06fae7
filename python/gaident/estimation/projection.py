"""Linear algebra of sensitivities: what the parameters of a model can absorb."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["orthonormal_rows", "project_out", "slopes", "sums_of_squares"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

WORST = 1e100  # no decision: the cost of a model that diverges, which none reaches
"""The cost of a model that diverges."""


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
