"""Noise model: an autoregressive filter that makes residuals white.

v(n) = e(n) - sum_i phi_i e(n-i)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import mul
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.estimation.criterion import bic

__all__ = ["Autoregression", "autocorrelation", "autoregression_of", "chi2_tail", "highest_order", "ljung_box", "ljung_box_of"]

Vector = NDArray[np.float64]

MAX_ORDER = 30  # no decision: a grid: BIC takes the order
DIRECT = 40  # no decision: lags up to which products are quicker than a transform


class Autoregression(NamedTuple):
    """phi (order numbers) and the standard deviation of v [unit of e]."""

    phi: Vector
    std: float

    @property
    def order(self) -> int:
        """Number of coefficients; 0: the residual is white."""
        return len(self.phi)


def highest_order(lengths: Sequence[int], max_order: int = MAX_ORDER) -> int:
    """The largest order that so many samples are asked for."""
    # no decision: the orders that a record can contain; a criterion chooses
    return max(0, min(max_order, sum(lengths) // 20, min(lengths) - 1))


def autoregression_of(products: Vector, total: int) -> Autoregression:
    """Order by BIC, coefficients by Levinson-Durbin, from sums of products e(n) e(n+k), k = 0..top, over `total` samples.

    e is not centred: a mean is an error too.
    """
    cov = (products / total).tolist()
    if not cov[0] > 0.0:
        return Autoregression(np.zeros(0), 0.0)
    phi: list[float] = []
    variance = cov[0]
    best, best_std, best_score = phi, math.sqrt(variance), bic(variance, total, 0)
    for m in range(1, len(cov)):
        reflection = (cov[m] - sum(map(mul, phi, cov[m - 1 : 0 : -1]))) / variance
        phi = [f - reflection * g for f, g in zip(phi, phi[::-1], strict=True)] + [reflection]
        variance *= 1.0 - reflection**2
        if not variance > 1e-14 * cov[0]:
            break
        score = bic(variance, total, m)
        if score < best_score:
            best, best_std, best_score = phi, math.sqrt(variance), score
    return Autoregression(np.array(best, dtype=np.float64), best_std)


def ljung_box(residuals: Sequence[Vector], lags: int) -> float:
    """p-value of the Ljung-Box test that residuals are white up to `lags`, pooled over records."""
    products: Vector = np.sum([autocorrelation(e, lags) for e in residuals], axis=0)
    return ljung_box_of(products, sum(len(e) for e in residuals))


def ljung_box_of(products: Vector, total: int) -> float:
    """The same from sums of products e(n) e(n+k), k = 0..lags, over `total` samples."""
    lags = len(products) - 1
    if not products[0] > 0.0 or lags < 1:
        return 1.0
    statistic = float(np.sum((products[1:] / products[0]) ** 2 / (total - np.arange(1, lags + 1))))
    return chi2_tail(total * (total + 2) * statistic, lags)


def autocorrelation(e: Vector, lags: int) -> Vector:
    """sum_n e(n) e(n+k), k = 0..lags; many by FFT (padded, so not circular)."""
    if lags <= DIRECT:
        return _core.lagged_products(e, lags)
    size = 1 << (len(e) + lags).bit_length()
    spectrum = np.fft.rfft(e, size)
    r: Vector = np.fft.irfft(spectrum.real**2 + spectrum.imag**2, size)[: lags + 1]
    return r


def chi2_tail(x: float, dof: int) -> float:
    """P(chi2 > x) for so many degrees of freedom."""
    from scipy.special import chdtrc

    return float(chdtrc(dof, x))
