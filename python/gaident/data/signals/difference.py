"""The velocity that a drive forms of its encoder: the difference of the last two positions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["backward_difference", "is_backward_difference"]

Vector = NDArray[np.float64]

VELOCITY_ROUNDING = 1e-6  # no decision: of the largest velocity, what a quotient of logged numbers is exact to


def backward_difference(position: Vector, dt: float) -> Vector:
    """w(n) = (q(n) - q(n-1))/dt of a position q (n,) [rad], in rad/s; the first as the second.

    It is the mean velocity over the last sample and half a sample old.
    """
    w = np.diff(position, prepend=position[0]) / dt
    w[0] = w[1]
    return w


def is_backward_difference(velocity: Vector, position: Vector | None, dt: float) -> bool:
    """Whether a velocity [rad/s] is the difference of the last two of these positions [rad] on every line but the first."""
    if position is None:
        return False
    off = np.abs(velocity - backward_difference(position, dt))[1:]
    return float(off.max()) <= VELOCITY_ROUNDING * float(np.abs(velocity).max())
