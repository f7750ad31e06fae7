"""The lattice of a signal's values: encoder steps, converter bits, decimals of a text log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["lattice_step", "rounding_step"]

Vector = NDArray[np.float64]

FEWEST = 4  # no decision: distinct values that a lattice could be told from chance by
EXACT = 1e-4  # no decision: steps, what a decimal number is exact to in binary and scaled by ten

DIGITS = range(4, 10)  # no decision: significant digits that text logs are written with; more round off nothing that matters


def lattice_step(values: Vector) -> float:
    """The step q of the lattice x = x0 + k q, k whole, that all `values` lie on, in their unit; 0.0 where there is none.

    The gaps between neighbouring distinct values are multiples of q; their sum over the sum of the multiples gives q to the
    accuracy of the numbers. A signal of fewer than four distinct values has no lattice that could be told from chance.
    """
    distinct = np.unique(values)
    size = float(np.abs(distinct).max())
    if len(distinct) < FEWEST or not size > 0.0:
        return 0.0
    gaps = np.diff(distinct)
    gaps = gaps[gaps > 1e-9 * size]  # below, the same value in the last digits of a float
    if len(gaps) < FEWEST - 1:
        return 0.0
    multiples = np.round(gaps / gaps.min())
    step = float(gaps.sum() / multiples.sum())
    places = (values - distinct[0]) / step
    off = np.abs(places - np.round(places))
    # On no lattice, the gaps are no multiples of the least one and `off` is spread evenly over 0..0.5.
    return step if float(off.max()) < POLICY.on_lattice else 0.0


def rounding_step(values: Vector) -> float:
    """The step that all `values` are rounded to, in their unit: their lattice's, or, where a text log keeps so many significant
    digits, the last digit of the largest; 0.0 where they are not rounded.
    """
    step = lattice_step(values)
    if step > 0.0:
        return step
    size = np.abs(values[values != 0.0])
    if len(size) < FEWEST:
        return 0.0
    exponent = np.floor(np.log10(size))
    for digits in DIGITS:
        places = size * 10.0 ** (digits - 1 - exponent)
        if float(np.abs(places - np.round(places)).max()) < EXACT:
            return float(10.0 ** (exponent.max() + 1 - digits))
    return 0.0
