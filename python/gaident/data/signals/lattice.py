"""The lattice of a signal's values: encoder steps, converter bits, decimals of a text log."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.policy.table import POLICY

__all__ = ["changes", "digits_step", "encoder_lines", "encoder_step", "lattice_step", "place_step", "rounding_step"]

Vector = NDArray[np.float64]

SAME = 1e-9  # no decision: of the largest value, the last digits of a float, in which two values are the same
SPEEDS = (1.0, np.pi / 30.0, np.pi / 180.0, 2.0 * np.pi)  # no decision: a unit; rad/s in each: rad/s, rpm, deg/s, 1/s
PLACES = (1.0, np.pi / 180.0, 2.0 * np.pi, 1e-3)  # no decision: a unit of positions: rad or m, degrees, turns, mm
EXACT = 1e-4  # no decision: steps, what a decimal number is exact to in binary and scaled by ten

DIGITS = range(1, 10)  # no decision: significant digits that text logs are written with; more round off nothing that matters


def changes(values: Vector) -> Vector:
    """By how much neighbouring samples differ, without sign (n - 1,); 0 where that is what a sum in floating point loses."""
    steps = np.diff(values)
    np.abs(steps, out=steps)  # in place: records may be long
    steps[steps <= SAME * float(max(values.max(initial=0.0), -values.min(initial=0.0)))] = 0.0
    return steps


def lattice_step(values: Vector, rounded: bool = False) -> float:
    """The step q of the lattice x = x0 + k q, k whole, that all `values` lie on, in their unit; 0.0 where there is none.

    The gaps between neighbouring distinct values are multiples of q; their sum over the sum of the multiples gives q to the
    accuracy of the numbers.
    The number of steps in a wide gap is certain only when q is known well enough.
    So q is taken from gaps of up to twice the smallest, then of up to twice as many steps, and so on.
    rounded: a log may have rounded the values to a part of q.
    A value on the edge of two decimals may be rounded to either: gaps that are small against the median are within one place.
    A signal of fewer than four distinct values has no lattice that could be told from chance.
    """
    distinct = np.unique(values)
    size = float(np.abs(distinct).max())
    if len(distinct) < POLICY.lattice_values or not size > 0.0:
        return 0.0
    gaps = np.sort(np.diff(distinct))
    within = POLICY.on_lattice * float(np.median(gaps)) if rounded else 0.0
    gaps = gaps[gaps > max(within, SAME * size)]
    if len(gaps) < POLICY.lattice_values - 1:
        return 0.0
    step, reach = float(gaps[0]), 2.0
    while True:
        near = gaps[: int(np.searchsorted(gaps, (reach + 0.5) * step))]
        step = float(near.sum() / np.round(near / step).sum())
        if len(near) == len(gaps):
            break
        reach *= 2.0
    places = (values - distinct[0]) / step
    off = np.abs(places - np.round(places))
    # On no lattice, the gaps are no multiples of the least one and `off` is spread evenly over 0..0.5.
    return step if float(off.max()) < POLICY.on_lattice else 0.0


def encoder_lines(velocity: Vector, period: float, turn: float) -> int:
    """Lines to a turn of the encoder whose angle, differenced over `period` [s], gives these velocities; 0 where none does.

    A difference of counts is a multiple of q = turn/(lines period), `turn` 2 pi rad, or 1 m where velocities are in m/s.
    The number of lines that q gives is then whole; by chance it is whole as rarely as `whole_lines` says.
    Of a fine encoder, the decimals of a log do not give q to one line.
    Nearly all fine encoders have a power of two of lines: such a number, within the share `binary_lines`, is as rare by chance,
    and it is taken before a whole number beside it.
    A step of 1, 2 or 5 in some decimal place of a unit of speed is a log's rounding: whole rpm each ms would be 60000 lines.
    """
    step = lattice_step(velocity, rounded=True)
    if not step > 0.0 or any(_decimal(step / unit) for unit in SPEEDS):
        return 0
    lines = turn / (step * period)
    if lines < POLICY.fewest_lines:
        return 0
    exact, whole, binary = lattice_step(velocity), round(lines), 2 ** round(np.log2(lines))
    if abs(lines - binary) < POLICY.binary_lines * binary:
        return int(binary)
    return whole if exact == step and abs(lines - whole) < POLICY.whole_lines else 0


def encoder_step(velocity: Vector, linear: bool = False) -> float:
    """The step of the lattice that an encoder's velocities lie on [rad/s], also where a log has rounded them; 0.0: none.

    A step of 1, 2 or 5 in some decimal place of a unit of speed is the log's rounding itself, but on a linear axis: a scale of
    0.1 micrometres, differenced over 1 ms, has steps of 0.1 mm/s.
    """
    step = lattice_step(velocity, rounded=True)
    return 0.0 if step > 0.0 and not linear and any(_decimal(step / unit) for unit in SPEEDS) else step


def _decimal(x: float) -> bool:
    """Whether x is 1, 2 or 5 in some decimal place."""
    first = x / 10.0 ** np.floor(np.log10(x))
    return any(abs(first - digit) < EXACT for digit in (1.0, 2.0, 5.0, 10.0))


def rounding_step(values: Vector) -> float:
    """The step that all `values` are rounded to, in their unit: their lattice's, or, where a text log keeps so many significant
    digits, the last digit of the largest; 0.0 where they are not rounded.
    """
    return lattice_step(values) or _last_digit(values)


def digits_step(velocities: Vector) -> float:
    """The last digit of the largest velocity in a text log [rad/s], in the unit that needs the fewest; 0.0: binary numbers.

    A log of fixed decimals has as many significant digits in its largest value.
    """
    return max(unit * _last_digit(velocities / unit) for unit in SPEEDS)


def place_step(positions: Vector) -> float:
    """The step that positions are rounded to [rad or m]: their lattice, or the last digit in rad or m, degrees, turns or mm."""
    return lattice_step(positions) or max(unit * _last_digit(positions / unit) for unit in PLACES)


def _last_digit(values: Vector) -> float:
    """Of the largest value, where all are written with the same number of significant digits; 0.0 where they are not."""
    size = np.abs(values[values != 0.0])
    if len(size) < POLICY.lattice_values:
        return 0.0
    exponent = np.floor(np.log10(size))
    for digits in DIGITS:
        places = size * 10.0 ** (digits - 1 - exponent)
        if float(np.abs(places - np.round(places)).max()) < EXACT:
            return float(10.0 ** (exponent.max() + 1 - digits))
    return 0.0
