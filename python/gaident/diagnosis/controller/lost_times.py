"""Regression of a controller's form where a slow log does not tell when its command jumped: the times are part of the noise.

The steps D of the torque (`identification.replay.line_steps`) are linear in the form's numbers P and in the shares s,

    D = X P + C (s - s_i0) + v,   s normal with the mean s_usual and the deviations S

so with the noise v whitened the shares are integrated out:

    D - C (s_usual - s_i0) = X P + e,   cov(e) = V + C S^2 C' = L L',   L^-1 D = L^-1 X P + white noise

V is diagonal: 1 for the noise, and for each step the squares of what other velocities between the lines would change of it.
C falls to 0 within few lines, so L has few diagonals.
C needs the numbers: it is made with those that were found so far, about the shares s_i0 that were.
(Generalized least squares; Aitken 1935.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.identification.noise import Autoregression
from gaident.identification.replay.line_steps import LineSteps

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["LostTimes"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

ROUNDED = 1e-12  # no decision: exact to; of a variance, the least noise that is added
LARGER = 10.0  # no decision: of a solver: the next noise that is tried, times the last


@dataclass(frozen=True, eq=False)
class LostTimes:
    """rows (n - 1,): steps that count; answers (rows, m): C; factor (b, rows): the diagonals of L; expected (rows,): L^-1 C
    (s_usual - s_i0) [N m]."""

    steps: LineSteps
    noise: Autoregression
    rows: NDArray[np.bool_]
    answers: csc_array
    factor: Matrix
    expected: Vector

    @classmethod
    def of(cls, steps: LineSteps, share: Vector, off: Vector, others: Matrix, pulse: Vector, rounding: float) -> LostTimes:
        """share (m,): s_i0; off (n - 1,): steps of what the numbers found so far leave [N m], rounding: the least noise [N m];
        others (k, n - 1): what other velocities between the lines change of the steps [N m]; pulse: see `LineSteps.columns`."""
        from scipy.sparse import diags_array

        noise = steps.noise_of(off, rounding)
        rows = steps.reached(noise.order)
        C = steps.columns(share, pulse, noise)[rows]
        unseen = 1.0 + np.sum(steps.whitened(others, noise)[:, rows] ** 2, axis=0)
        cov = (diags_array(unseen) + C @ diags_array(steps.unsure.spread**2) @ C.T).tocoo()
        below = cov.row - cov.col
        band = np.zeros((int(below.max(initial=0)) + 1, C.shape[0]))
        low = below >= 0
        band[below[low], cov.col[low]] = cov.data[low]
        factor = _factor_of(band)
        made = cls(steps, noise, rows, C, factor, np.zeros(C.shape[0]))
        expected = made._solved((C @ (steps.unsure.usual - share))[:, None])[:, 0] * noise.std
        return cls(steps, noise, rows, C, factor, expected)

    def whitened(self, lines: Matrix) -> Matrix:
        """(rows, signals) [N m] of signals at the lines (signals, n)."""
        steps = np.where(self.steps.used, np.diff(lines), 0.0)
        return self._solved(self.steps.whitened(steps, self.noise)[:, self.rows].T) * self.noise.std

    def share(self, left: Vector) -> Vector:
        """The shares (m,) with the highest probability where the numbers leave this of the torque (rows,) [N m]."""
        back = self._solved(left[:, None] / self.noise.std, "T")[:, 0]
        unsure = self.steps.unsure
        share: Vector = np.clip(unsure.usual + unsure.spread**2 * (self.answers.T @ back), 0.0, 1.0)
        return share

    @property
    def cost(self) -> float:
        """ln det(V + C S^2 C')."""
        return float(2.0 * np.sum(np.log(self.factor[0])))  # no decision: a formula

    def _solved(self, rows: Matrix, trans: str = "N") -> Matrix:
        """L^-1 rows, or with "T" the inverse of its transpose."""
        from scipy.linalg.lapack import dtbtrs

        solved: Matrix = dtbtrs(self.factor, rows, uplo="L", trans=trans)[0]
        return solved


def _factor_of(band: Matrix) -> Matrix:
    """L of a covariance L L' in lower banded form; where rounding leaves it no covariance, with more noise in every step."""
    from scipy.linalg import cholesky_banded

    more = 0.0
    while True:
        try:
            return np.asarray(cholesky_banded(np.concatenate([band[:1] * (1.0 + more), band[1:]]), lower=True))
        except np.linalg.LinAlgError:
            if not more < 1.0 or not np.all(np.isfinite(band)):
                raise
            more = max(LARGER * more, ROUNDED)
