"""The two places where "is the gain enough?" and "is this noise?" are decided.

**The information criterion.** A hypothesis with k fitted numbers, its noise model included, leaves the variance V/N of its
errors. With the information I, the number of independent samples,

    BIC = I ln(V/N) + k ln I                  (Schwarz 1978)

Under a noise model that makes the errors white, every sample counts: I = N. Before whitening the errors of a model that is not
exact are slow: neighbouring samples say the same, and

    I = N / (1 + 2 sum_k rho(k))              (effective sample size; Bartlett 1946)

with rho the autocorrelation of the errors about their mean, up to its first fall below a twentieth.

**The specification test** (Hausman 1978). Least squares of whitened errors and of output errors estimate the same parameters
where the errors are stationary noise; whitened, they are only more precise. With x_W and x_O the two estimates and V_O the sum
of squared output errors,

    H = I ln(V_O(x_W) / V_O(x_O))

is then near chi-square with as many degrees of freedom as there are parameters that a fit moves. A larger H says that what the
model leaves is no stationary noise (a friction that changes with load, angle and temperature, a torque that is itself measured):
the noise model has taken a misfit for noise, and trusts the frequencies where that happens to be small. H is defined for two
estimates of one model; two models are compared by the information criterion.

**The variance ratio.** A model leaves noise where the variance of its whitened errors is that of the sensor's noise, up to a
ratio that the policy states.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Specification", "bic", "chi_square_bound", "effective_samples", "specification_statistic"]

Vector = NDArray[np.float64]

DEAD = 0.05  # no decision: of the autocorrelation; from there on its own error is larger


def bic(variance: float, information: float, numbers: int) -> float:
    """I ln(variance) + k ln I."""
    return float(information * np.log(max(variance, 1e-300)) + numbers * np.log(max(information, 1.0)))


def effective_samples(error: Vector) -> float:
    """Independent samples in an error of colour, 1 at least.

    error: (N,), samples that do not count being 0.

    >>> import numpy as np
    >>> white = np.random.default_rng(1).normal(size=4000)
    >>> 3000 < effective_samples(white) <= 4000
    True
    >>> effective_samples(np.repeat(white[:400], 10)) < 800
    True
    """
    count = len(error)
    error = error - float(error.mean())
    power = float(error @ error)
    if not 0.0 < power < np.inf:
        return float(max(count, 1))
    size = 1 << (2 * count - 1).bit_length()
    rho = np.fft.irfft(np.abs(np.fft.rfft(error, size)) ** 2, size)[:count] / power
    dead = np.flatnonzero(rho < DEAD)
    memory = int(dead[0]) if len(dead) else count
    # no decision: the variance of a mean of correlated samples
    return float(max(count / (1.0 + 2.0 * float(rho[1:memory].sum())), 1.0))


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


def chi_square_bound(freedom: int, level: float) -> float:
    """What chi-square with so many degrees of freedom exceeds with this probability.

    >>> round(chi_square_bound(1, 0.05), 2)
    3.84
    """
    from scipy.special import chdtri

    return float(chdtri(freedom, level))
