"""The velocity that a drive forms of its encoder: the difference of the last two positions that it read.

Where a log has a line for r samples of the controller, the position between the lines is a spline of degree 5 through them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["backward_difference", "difference_at_clock", "is_difference_at_clock", "is_difference_of_lines"]

Vector = NDArray[np.float64]

DEGREE = 5  # no decision: a formula: a spline whose jerk is continuous

VELOCITY_ROUNDING = 1e-6  # no decision: of the largest velocity, what a quotient of logged numbers is exact to


def backward_difference(position: Vector, dt: float) -> Vector:
    """w(n) = (q(n) - q(n-1))/dt of a position q (n,) [rad], in rad/s; the first as the second.

    It is the mean velocity over the last sample and half a sample old.
    """
    w = np.diff(position, prepend=position[0]) / dt
    w[0] = w[1]
    return w


def difference_at_clock(position: Vector, dt: float, every: int) -> Vector:
    """w(n) = (q(n dt) - q(n dt - T))/T of a position q (n,) [rad] on the lines of a log, with T = dt/every, in rad/s.

    It is the mean velocity over the last sample of the controller and half of that old.
    """
    from scipy.interpolate import make_interp_spline

    if every == 1 or len(position) <= DEGREE:
        return backward_difference(position, dt)
    lines = np.arange(len(position), dtype=np.float64)
    before: Vector = make_interp_spline(lines, position, k=DEGREE)(lines - 1.0 / every)
    w: Vector = (position - before) * (every / dt)
    w[0] = w[1]
    return w


def is_difference_at_clock(
    velocity: Vector, position: Vector | None, dt: float, every: int, read: NDArray[np.bool_] | None = None
) -> bool:
    """Whether a velocity [rad/s] is that difference of these positions [rad] on every line but the first and the last.

    read: which lines stand as they were read (n,); None: all. An outlier was interpolated.
    """
    return position is not None and _same(velocity, difference_at_clock(position, dt, every), read)


def is_difference_of_lines(velocity: Vector, position: Vector, dt: float) -> bool:
    """Whether it is (q(n) - q(n-1))/dt, or (q(n+1) - q(n-1))/(2 dt), on every line but the first and the last."""
    return _same(velocity, backward_difference(position, dt)) or _same(velocity, np.gradient(position, dt))


def _same(velocity: Vector, difference: Vector, read: NDArray[np.bool_] | None = None) -> bool:
    off = np.abs(velocity - difference) * (1.0 if read is None else read)
    return float(off[1:-1].max()) <= VELOCITY_ROUNDING * float(np.abs(velocity).max())
