"""What only one sample after the other gives, in the core: rational filters, states, clamped sums, limited slopes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident import _core

__all__ = ["clamped_sum", "filtered", "filtered_powers", "rate_limited", "recursion", "zero_phase"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]


def filtered(b: Vector, a: Vector, rows: Matrix, lengths: Sequence[int]) -> Matrix:
    """v(n) = sum_i b_i e(n-i) - sum_{i>=1} a_i v(n-i), a_0 = 1, from rest at the start of each record.

    rows: (n, samples) of e, records of these `lengths` one after the other -> (n, samples) of v.
    Raises ValueError where the lengths are not those of the rows, and for more than 16 numbers a_i behind a_0.
    """
    return _core.filtered(b, a, rows, lengths)


def filtered_powers(b: Matrix, a: Matrix, row: Vector, weight: Vector, lengths: Sequence[int]) -> Vector:
    """Sum of (weight v)^2 of one row under many filters of one size, side by side; v as `filtered` has it.

    b, a: (filters, numbers); row, weight: (samples,) -> (filters,). Rounded otherwise than the sum over what `filtered` gives.
    Raises ValueError where the sizes do not fit, and for more than 17 numbers.
    """
    return _core.filtered_powers(b, a, row, weight, lengths)


def zero_phase(sections: Matrix, rows: Matrix, extension: int) -> Matrix:
    """Rows behind a low-pass, forward and backward: no phase, and the square of its gain.

    sections: (k, 6), b and a of second order, with a gain of 1 at rest; rows: (n, samples), continued by their point reflections
    at both ends for `extension` samples, fewer than they have.
    As `scipy.signal.sosfiltfilt`, but all rows side by side: a fit asks for it at every step.
    The filter begins and ends at rest at the first and the last value, which pass it unchanged.
    Raises ValueError where the sizes do not fit.
    """
    return _core.zero_phase(sections, rows, extension)


def recursion(A: Complex, drive: ArrayLike, start: ArrayLike | None = None, newest: bool = False) -> Complex:
    """x(n+1) = A x(n) + drive(n) from x(0) = start (None: 0); drive (n, m) -> x(0..n-1) (n, m), with `newest` x(1..n).

    Raises ValueError where the sizes do not fit.
    """
    first = np.zeros(len(A)) if start is None else start
    return _core.state_recursion(A, np.asarray(drive, np.complex128), np.asarray(first, np.complex128), newest)


def clamped_sum(steps: Vector, limit: float, start: float = 0.0) -> Vector:
    """I(n) = I(n-1) + steps(n), clamped to +-limit after each step, from I(-1) = start; shape (n,)."""
    return _core.clamped_sum(steps, limit, start)


def rate_limited(command: Vector, rate: float, dt: float, start: float) -> Vector:
    """`command` [rad/s] followed from `start` with a slope of at most `rate` [rad/s^2], shape (n,)."""
    return _core.rate_limited(command, rate * dt, start)
