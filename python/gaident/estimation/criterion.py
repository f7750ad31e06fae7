"""The formulas by which "is the gain enough?" and "is this noise?" are decided; `diagnosis/selection/model_space.py` asks them.

**The information criterion.**
A hypothesis with k fitted numbers, its noise model included, leaves the variance V/N of its errors.
With the information I, the number of independent samples,

    BIC = I ln(V/N) + k ln I                  (Schwarz 1978)

Under a noise model that makes the errors white, every sample counts: I = N. Before whitening the errors of a model that is not
exact are slow: neighbouring samples are alike, and

    I = N / (1 + 2 sum_k rho(k))              (effective sample size; Bartlett 1946)

with rho the autocorrelation of the errors about their mean, up to the first pair rho(2m-1) + rho(2m) that is not positive
(Geyer 1992): beyond it the estimate of rho is mostly error.
Errors of a shaft that swings have a rho that changes its sign, so that its sum is small.
The sum of rho^2 is then larger, and above `swings`, which white errors do not reach by chance.
The standard deviation of ln V is then sqrt(2/I) with

    I = N / (1 + 2 sum_k rho(k)^2)            (variance of a mean square; Bartlett 1946)

Slow errors beside the swinging ones show in the spectrum alone: S(0) = V (1 + 2 sum_k rho(k)). The lesser of both I counts.
Every comparison of two models and every count of independent samples in the package is one of these formulas.

**The specification test** (Hausman 1978).
Least squares of whitened errors and of output errors estimate the same parameters where the errors are stationary noise;
whitened, they are only more precise. With x_W and x_O the two estimates and V_O the sum of squared output errors,

    H = I ln(V_O(x_W) / V_O(x_O))

is then near chi-square with as many degrees of freedom as there are parameters that a fit moves.
A larger H says that what the model leaves is no stationary noise (a friction that changes with load,
angle and temperature, a torque that is itself measured).
The noise model then describes a misfit, and gives the most weight to the frequencies where the misfit is small.
H is defined for two estimates of one model; two models are compared by the information criterion.

**The variance ratio.** With sigma the standard deviation of the noise that the measured velocity itself shows,

    ratio = sqrt(V/N) / sigma

is compared with the level that records without effects pass, by the errors that V is of.
Whitened errors (`noise_ratio`) are the innovations, and may be smaller than the noise where that is slow.
Errors before whitening (`free_run_ratio`), in the loop where there is one, have all that disturbs the axis beside the
sensor's noise: their ratio is larger, and a misfit that the noise model has taken shows in them alone.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = [
    "Specification",
    "bic",
    "chi_square_bound",
    "cost_of",
    "effective_samples",
    "gained",
    "gained_by_chance",
    "specification_statistic",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def bic(variance: float, information: float, numbers: int) -> float:
    """I ln(variance) + k ln I."""
    return float(information * np.log(max(variance, 1e-300))) + cost_of(numbers, information)


def cost_of(numbers: int, information: float) -> float:
    """The penalty of k fitted numbers: k ln I."""
    return numbers * math.log(max(information, 1.0))


def gained(before: float, after: float, information: float, numbers: int = 0) -> float:
    """Decrease of BIC from one variance, or sum of squares, to another of the same errors, with `numbers` more parameters."""
    return bic(before, information, 0) - bic(after, information, numbers)


def effective_samples(*errors: Vector) -> float:
    """Number of independent samples in coloured errors, at least 1 and at most all samples.

    N/(1 + 2 sum rho) of slow errors.
    For errors that swing, whose rho changes its sign, the lesser of N/(1 + 2 sum rho^2) and of N V/S(0).
    S(0) is taken from the lowest frequencies of the spectrum.

    errors: of one record each, (n_i,), samples that do not count being 0; no pair of samples of two records is a neighbour.

    >>> import numpy as np
    >>> white = np.random.default_rng(1).normal(size=4000)
    >>> 3000 < effective_samples(white) <= 4000
    True
    >>> effective_samples(np.repeat(white[:400], 10)) < 800
    True
    """
    count, longest = sum(map(len, errors)), max(map(len, errors))
    mean = sum(float(e.sum()) for e in errors) / count
    size = 1 << (2 * longest - 1).bit_length()
    products = np.zeros(longest)
    for e in errors:
        products[: len(e)] += np.fft.irfft(np.abs(np.fft.rfft(e - mean, size)) ** 2, size)[: len(e)]
    if not 0.0 < products[0] < np.inf:
        return float(max(count, 1))
    pairs = (products[1:] / products[0])[: (longest - 1) // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(~(pairs > 0.0))
    slow = float(pairs[: negative[0]].sum()) if len(negative) else float(pairs.sum())
    squares = products[1 : 1 + longest // POLICY.samples_per_lag] ** 2 / products[0] ** 2
    chance = (count - np.arange(1, len(squares) + 1)) / count**2  # what rho^2 of white errors is in the mean
    swinging = float(np.sum(squares - chance))
    memory = 1.0 + 2.0 * slow  # no decision: a formula: as below
    if swinging > max(slow, POLICY.swings):
        lowest = sum(float(np.sum(np.abs(np.fft.rfft(e - mean)[1 : 1 + POLICY.spectrum_lines]) ** 2)) for e in errors)
        spectral = lowest / (products[0] * sum(min(POLICY.spectrum_lines, len(e) // 2) * len(e) for e in errors) / count)
        memory = max(1.0 + 2.0 * swinging, spectral)  # no decision: a formula: as below
    return float(np.clip(count / memory, 1.0, count))  # no decision: a formula: variances of means of correlated samples


def gained_by_chance(draws: Matrix, simpler: Matrix, fuller: Matrix, left: float, level: float) -> float:
    """What a fuller model gains over a simpler one of noise alone, with this probability at most.

    Of a draw v a model explains |P v|^2.
    The gain g = |P_1 v|^2 - |P_0 v|^2 is a sum of chi-squares of different weights.
    One chi-square with its mean and its variance stands for it (Satterthwaite 1946):

        g ~ var(g)/(2 mean(g)) chi2_k,   k = 2 mean(g)^2/var(g)

    draws: one a row; simpler, fuller: orthonormal bases of the sensitivities of either, as rows.
    left: what the fuller one leaves of the records; where draws leave more in the mean they are scaled to that.
    0 where the simpler model explains as much of the noise as the fuller one: nothing is gained by chance.
    """
    first, second = (np.sum((draws @ basis.T) ** 2, axis=1) for basis in (simpler, fuller))
    remains = float(np.mean(np.sum(draws**2, axis=1) - second))
    scale = min(1.0, left / remains) if remains > 0.0 else 1.0
    mean, variance = scale * float(np.mean(second - first)), scale**2 * float(np.var(second - first))
    if not mean > 0.0 or not variance > 0.0:
        return max(mean, 0.0)
    unit = variance / (2.0 * mean)  # no decision: a formula: chi-square has twice its mean as variance
    return unit * chi_square_bound(mean / unit, level)


class Specification(NamedTuple):
    """H of the specification test, and the bound from which on it speaks against a model."""

    statistic: float
    bound: float

    @property
    def contradicts(self) -> bool:
        """Whether the estimates of whitened and of output errors contradict each other."""
        return self.statistic > self.bound


def specification_statistic(whitened_estimate: float, output_estimate: float, information: float) -> float:
    """H from the sums of squared output errors at both estimates; 0 where the whitened one is no worse."""
    if not 0.0 < output_estimate < whitened_estimate:
        return 0.0
    return float(information * np.log(whitened_estimate / output_estimate))


def chi_square_bound(freedom: float, level: float) -> float:
    """What chi-square with so many degrees of freedom exceeds with this probability.

    >>> round(chi_square_bound(1, 0.05), 2)
    3.84
    """
    from scipy.special import chdtri

    return float(chdtri(freedom, level))
