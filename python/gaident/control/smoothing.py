"""What noise leaves of a velocity between the lines of its log: the lines smoothed, by a cubic spline.

The controller read a noisy velocity at each of its samples, w + v.
At a line of the log that is what the log has.
Between the lines the noise v is another one, of which the lines say nothing: the best that is known there is w.
What is fitted to it has no bias (Berkson 1950).
A spline through the lines would follow their noise instead.

The smoothing spline s of the lines y, one unit apart (Reinsch 1967), and its factor by generalized cross-validation
(Craven and Wahba 1979):

    sum (y - s)^2 + lambda int s''^2 -> min,   s = y - lambda Q g,   (R + lambda Q' Q) g = Q' y,   Q' y: second differences,
    R: 2/3 beside 1/6 on either side;   (|y - s|^2/n)/(1 - tr H/n)^2 -> min

For the factor alone H is taken as it acts on a long log: 1/(1 + lambda (2 - 2 cos x)^2/((2 + cos x)/3)) at the frequency x.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["expected_at"]

Vector = NDArray[np.float64]

FACTORS = np.exp(np.arange(-14.0, 15.0))  # no decision: a grid; the best one is flat
LEAST = 4  # no decision: a formula: fewer lines have no smoother curve than a cubic through them


def expected_at(line: Vector) -> Vector:
    """The lines (n,) without what is noise of theirs, as far as they tell the two apart."""
    from scipy.linalg import solveh_banded

    if len(line) <= LEAST:
        return np.ascontiguousarray(line, dtype=np.float64)
    line = _without_spikes(np.asarray(line, dtype=np.float64))
    factor = _factor_of(line)
    bands = np.zeros((3, len(line) - 2))
    bands[0] = 2.0 / 3.0 + 6.0 * factor
    bands[1, :-1] = 1.0 / 6.0 - 4.0 * factor
    bands[2, :-2] = factor
    bent = solveh_banded(bands, np.diff(line, 2), lower=True)
    smooth: Vector = line - factor * np.convolve(bent, [1.0, -2.0, 1.0])
    return smooth


def _without_spikes(line: Vector) -> Vector:
    """The lines with the median of it and its two neighbours in the place of one that stands out of them, alone.

    It would be taken for noise of every line. Their distances from that median tell what stands out.
    """
    middle = line.copy()
    middle[1:-1] = np.median(np.stack([line[:-2], line[1:-1], line[2:]]), axis=0)
    far = np.abs(line - middle)
    some = far[far > 0.0]
    most = POLICY.above_noise * 1.4826 * float(np.median(some)) if len(some) else np.inf  # no decision: a formula: of a median
    return np.where(far > most, middle, line)


def _factor_of(line: Vector) -> float:
    """lambda of the least generalized cross-validation."""
    from scipy.fft import dct

    n = len(line)
    x = np.pi * np.arange(n) / n
    bends = (2.0 - 2.0 * np.cos(x)) ** 2 / ((2.0 + np.cos(x)) / 3.0)
    power = np.asarray(dct(line - np.linspace(line[0], line[-1], n), norm="ortho")) ** 2
    taken = FACTORS[:, None] * bends
    taken /= 1.0 + taken  # 1 - H
    off, rest = (taken**2) @ power, taken.mean(axis=1)
    return float(FACTORS[np.argmin(off / rest**2)])
