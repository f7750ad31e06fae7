"""Coordinates of effects: how a fit moves their parameters, with bounds and starts.

They are chosen so that a fit moves smoothly: logarithms of positive numbers whose size is unknown, the two components
a cos(phase), a sin(phase) of a harmonic, ratios instead of differences.
The bounds are part of each definition: a Stribeck friction of any speed and any ratio comes close to the data of many other
effects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.term import Natural, Rows

HIGHEST_ORDER = 64  # no decision: what an argument may be
"""Of cogging and encoder ripple that a drive is expected to have [1/turn]."""
HIGHEST_LOBE = 8  # no decision: what an argument may be
"""Of a crank, an arm or a cam: how often its inertia changes in a turn [1/turn]."""

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def positive(*logs: int) -> Natural:
    def natural(z: Matrix) -> Matrix:
        out = z.copy()
        for i in logs:
            out[:, i] = np.exp(z[:, i])
        return out

    return natural


def grid(*axes: tuple[float, ...]) -> Rows:
    rows: Rows = [()]
    for axis in axes:
        rows = [(*row, value) for row in rows for value in axis]
    return rows


def ln(*values: float) -> tuple[float, ...]:
    return tuple(float(np.log(v)) for v in values)


def of(*names: str) -> Callable[[Mapping[str, float]], Vector]:
    return lambda p: np.array([p[n] for n in names])
