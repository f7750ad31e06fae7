"""Whether a signal repeats itself, but for the rounding of its numbers.

    change(p) = mean (x[i + p] - x[i])^2 / (2 mean x^2),   x without its mean

is 1 on average where x is noise, and 0 at a period; the period is the first such minimum after change has been above a half.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["period_of"]

Vector = NDArray[np.float64]

LEAST = 2  # no decision: a formula: a period shows from its second time on
FAR = 0.5  # no decision: a formula: half of what unlike values differ by


def period_of(x: Vector) -> int:
    """Lines of the shortest period that x repeats twice or more; 0: none.

    It repeats where the rms of what differs is below `repeats_within` of the rms: a command in a log has the digits of the log,
    and cos(omega t) those of its computing.
    """
    x = x - x.mean()
    n = len(x)
    longest = n // LEAST
    size = 1 << (2 * n - 1).bit_length()
    product = np.fft.irfft(np.abs(np.fft.rfft(x, size)) ** 2, size)[: longest + 1]
    p = np.arange(longest + 1)
    power = np.concatenate([[0.0], np.cumsum(x * x)])
    twice = 2 * float(power[n]) / n  # what unlike values differ by
    change = (power[n] - power[p] + power[n - p] - 2 * product) / (n - p) / twice
    far = np.flatnonzero(change > FAR)
    if not len(far):
        return 0
    # A smooth signal hardly changes from line to line: the least of the first run that is near 0, and that written out, as the
    # differences of large sums are rounding.
    near = np.flatnonzero((change < POLICY.repeats_within) & (p > far[0]))
    if not len(near):
        return 0
    after = np.flatnonzero(np.diff(near) > 1)
    run = near[: int(after[0]) + 1] if len(after) else near
    best = int(run[np.argmin(change[run])])
    differs = math.sqrt(float(np.mean((x[best:] - x[:-best]) ** 2)))
    return best if differs < POLICY.repeats_within * math.sqrt(twice) else 0
