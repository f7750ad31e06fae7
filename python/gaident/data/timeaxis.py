"""The sample time from a log's time column, and the refusal of an irregular one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import NO_TIME, arg
from gaident.data.formats.table import Column, LogTable
from gaident.data.formats.time_names import TIME_NAMES
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["SLOW_STEP", "TimeAxis", "even_step", "stamp_unit", "time_column"]

SLOW_STEP = 0.5  # no decision: what is asked and said; s, longer steps of a column without a unit may be milliseconds

_BLOCK = 64  # no decision: memory; stamps of a block
_DIGITS = 16  # no decision: rounding: decimals of a double
_SINGLE_PRINTED = 6e-9  # no decision: rounding
"""Relative error of a single-precision number printed with its nine digits."""
_BY_CHANCE = 0.05  # no decision: rounding
"""A period of few digits is the exact one where the stamps tell it this much finer than its last digit."""


class TimeAxis:
    """A time column as it comes in, block by block: refused where it is irregular, else its sample time.

    A step may deviate from the median by 1 % (the logger's clock) and by the rounding of the printed digits:
    0.666666 ms is regular, and so is 0.667, 1.333, 2.000.
    """

    def __init__(self, column: Column, second: float, given: float | None = None, strict: bool = True) -> None:
        """second: what one of the column's units is in s; given: the dt [s] that must agree, None if there is none.

        strict: whether an irregular axis is refused, as it is where the column was named as the time; otherwise only lost and
        doubled rows and a time that goes back are.
        """
        self.column, self.second, self.given, self.strict = column, second, given, strict
        self.count, self.start, self.last, self.step, self.rounding = 0, 0.0, 0.0, 0.0, 0.0
        self.ends = [0.0, 0.0]  # the last printed digit of the first and the last stamp

    def push(self, table: LogTable, t: NDArray[np.float64]) -> None:
        """The time stamps of the rows of `table`. Raises ReadError with line, jump and remedy."""
        if t.size == 0:
            return
        shift = int(self.count > 0)
        if self.count == 0:
            self.start = float(t[0])
            self.ends[0] = float(_printed_step(t)[0])
        self.ends[1] = float(_printed_step(t[-_BLOCK:])[-1])
        self.count += t.size
        whole = np.concatenate([[self.last], t]) if shift else t
        self.last = float(t[-1])
        if whole.size < 2:
            return
        if self.given is not None:
            _check_given(table, self.column, float(np.median(np.diff(whole))) * self.second, self.second, self.given)
        if self.strict:
            self._check(table, whole, shift)
        else:
            self._check_rows(table, whole, shift)

    def sample_time(self, table: LogTable) -> float:
        """dt [s]: (t(n-1) - t(0)) / (n - 1), or the period of few digits that the stamps were rounded from.

        A drive that counts its time in single precision writes 19959.999 ms after 499 steps of 40 ms.
        """
        if self.count < 2:
            raise ReadError.at(table.path, f"time column {self.column.key!r} has {self.count} value", "give a longer log")
        # The mean is free of the rounding that the median keeps; 12 digits drop the noise of the division.
        steps = self.count - 1
        mean = (self.last - self.start) / steps
        mean = _of_few_digits(mean, sum(self.ends) / steps)
        # A stamp since 1970 in seconds is a double to 0.2 us.
        mean = _of_few_digits(mean, float(np.spacing(abs(self.start)) + np.spacing(abs(self.last))) / steps)
        return float(f"{mean * self.second:.12g}")

    def _check_rows(self, table: LogTable, t: NDArray[np.float64], shift: int) -> None:
        """Each step is one sample, whatever the clock's jitter: raises ReadError for rows that are lost or there twice."""
        assert self.given is not None
        steps = np.diff(t)
        if (steps < 0.0).any():
            self._refuse_back(table, t, int(np.argmax(steps < 0.0)) + 1, shift)
        even = t[0] + np.arange(t.size) * self.given / self.second
        if np.all(np.abs(t - even) <= _printed_step(t)):
            return
        usual = float(np.median(steps))
        lost = np.abs(steps - usual) > 0.5 * usual  # no decision: rounding: to whole samples
        if usual > 0.0 and lost.any() and not even_step(steps)[1]:
            _refuse(table, self.column, t, int(np.argmax(lost)), self.second, shift)

    def _refuse_back(self, table: LogTable, t: NDArray[np.float64], row: int, shift: int) -> None:
        raise ReadError.at(
            f"{table.path}, {table.place(row - shift)}",
            f"time column {self.column.key!r} does not increase ({t[row - 1]:.12g}, then {t[row]:.12g})",
            f"sort the log, or give {arg('dt')} and set {NO_TIME}",
        )

    def _check(self, table: LogTable, t: NDArray[np.float64], shift: int) -> None:
        steps = np.diff(t)
        median = float(np.median(steps))
        if median <= 0.0:
            if steps.min() == 0.0 and steps.max() > 0.0:
                _too_coarse(table, self.column, float(steps[steps > 0.0].min()))
            self._refuse_back(table, t, int(np.argmin(steps > 0.0)) + 1, shift)
        usual = self.step or median  # of the first block
        deviation = np.abs(steps - usual)
        unequal = deviation > POLICY.clock_jitter * usual
        if unequal.any():
            printed = _printed_step(t)
            rounding = np.maximum(printed[1:], printed[:-1])
            self.rounding = max(self.rounding, float(rounding.max()))
            irregular = deviation > POLICY.clock_jitter * usual + np.maximum(rounding, abs(self.step and self.rounding)) * (
                1.0 + 1e-9
            )
            if irregular.any():
                _refuse(table, self.column, t, int(np.argmax(irregular)), self.second, shift)
            if rounding.max() > POLICY.coarse_stamps * usual:
                # Where the digits suit the sample time, nearly all steps are equal and the few others are real.
                if unequal.mean() < POLICY.few_unequal:
                    _refuse(table, self.column, t, int(np.argmax(unequal)), self.second, shift)
                _too_coarse(table, self.column, float(rounding.max()))
        self.step = usual


def _of_few_digits(mean: float, doubt: float) -> float:
    """The number of fewest digits within `doubt` of the mean, where that is not by chance; else the mean."""
    if not 0.0 < doubt < mean:
        return mean
    for digits in range(1, _DIGITS):
        short = float(f"{mean:.{digits - 1}e}")
        last_digit = 10.0 ** (math.floor(math.log10(mean)) - digits + 1)
        if doubt > _BY_CHANCE * last_digit:
            return mean
        if abs(short - mean) <= doubt:
            return short
    return mean


def _check_given(table: LogTable, column: Column, found: float, second: float, dt: float) -> None:
    """Raise ReadError where the dt that the user gave [s] and the steps that were found [s] differ by more than 1 %."""
    if abs(found - dt) <= POLICY.clock_jitter * dt:
        return
    unit = next(
        # no decision: printed: a hint in a message
        (name for name, size in (("ms", 1e-3), ("us", 1e-6), ("min", 60.0)) if abs(found * size / dt - 1) < 0.01),
        None,
    )
    hint = f"; if it is in {unit}, give {arg('units', repr(unit), 'time')}" if unit and second == 1.0 else ""
    raise ReadError(
        f"{table.path}: {arg('dt', format(dt, 'g'))} s, but time column {column.key!r} has steps of {found:g} s{hint}; "
        f"leave dt out, or set {NO_TIME} to trust dt"
    )


# Stamps since 1970 name their unit by their size, and so do those of Windows since 1601: the years 1990 to 2100.
_EPOCHS = (
    (6.3e8, 4.2e9, 1.0),
    (6.3e11, 4.2e12, 1e-3),
    (6.3e14, 4.2e15, 1e-6),
    (6.3e17, 4.2e18, 1e-9),
    (1.22e17, 1.58e17, 1e-7),
)  # no decision: a format: dates


def stamp_unit(first: float) -> float:
    """What one unit of a time column without unit is in s, by its first value: of the date where it is one, else s."""
    return next((size for low, high, size in _EPOCHS if low < first < high), 1.0)


def time_column(table: LogTable, strict: bool = True) -> Column | None:
    """The column that is called as time is: in SI's language, ROS's or German. None if there is none.

    Two that are called time are one too many: strict, a ReadError; else None.

    ROS: `%time` and `field.header.stamp` of rostopic, `__time` of PlotJuggler, `/topic/header/stamp`.
    """
    for exact in ("time", "t", "Time", "TIME"):
        try:
            column = table.own(exact)
        except ReadError:
            if strict:
                raise
            return None
        if column is not None:
            return column
    for name in TIME_NAMES:
        found = [c for c in table.columns if any(_bare(n) == name or _bare(n).endswith(f"/{name}") for n in (c.key, *c.names))]
        if len(found) == 1:
            return found[0]
    return None


def _bare(name: str) -> str:
    return name.casefold().strip("%/ ")


def _too_coarse(table: LogTable, column: Column, printed: float) -> None:
    raise ReadError.at(
        table.path,
        f"time column {column.key!r} is printed in steps of {printed:g}, too coarse to tell the sample time",
        f"export more digits, or give {arg('dt')} [s] and set {NO_TIME}",
    )


def even_step(steps: NDArray[np.float64]) -> tuple[float, bool]:
    """(how far samples are apart if they are even and only their stamps are not, whether many steps differ).

    steps: from stamp to stamp (n,).
    Where few steps differ from the usual one, samples are lost, and the others are a usual step apart.
    Where many do, the stamps jitter, and the samples are apart by the mean: stamps that alternate between steps of 10 and 12 ms
    are those of samples every 11 ms, and neither is the median.
    The mean has no more digits than n steps show; what goes back and what is a pause does not count.
    """
    usual = float(np.median(steps))
    near = steps[(steps > 0.0) & (steps <= POLICY.pause * usual)]
    if not len(near) or float(np.mean(np.abs(near - usual) > POLICY.clock_jitter * usual)) < POLICY.few_unequal:
        return usual, False
    mean, doubt = float(near.mean()), float(np.ptp(near)) / len(near)
    written = (float(f"{mean:.{digits}g}") for digits in range(1, _DIGITS))
    return next((x for x in written if abs(x - mean) <= doubt), mean), True


def _refuse(table: LogTable, column: Column, t: NDArray[np.float64], step: int, second: float, shift: int) -> None:
    steps = np.diff(t)
    usual = float(np.median(steps))
    apart, jitters = even_step(steps)
    dt = format(apart * second, ".6g")
    if t[step + 1] - t[step] > POLICY.pause * usual:
        even = f"split the log there into two records, as read_pieces does ({arg('pieces', python='pieces=True')})"
    else:
        even = f"{'' if jitters else 'cut the log there, or '}put it on an even axis with {arg('resample', dt)}"
    others = f"its steps are {apart:.6g} on average" if jitters else f"elsewhere by {usual:.6g}"
    raise ReadError.at(
        f"{table.path}, {table.place(step + 1 - shift)}",
        f"time column {column.key!r} is irregular: from {t[step]:.12g} to {t[step + 1]:.12g} it jumps by "
        f"{t[step + 1] - t[step]:.6g}, {others}",
        f"{even}; if the samples are in truth evenly spaced, give {arg('dt', dt)} and set {NO_TIME}",
    )


def _printed_step(t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Per value, the unit of the last digit it was printed with (n,); 0 where it has full precision.

    Judged in blocks of samples, because a format like %g prints fewer decimals as the time grows: the largest
    power of ten (or single-precision spacing) that divides every value of the block.
    """
    padded = np.concatenate([t, np.full(-t.size % _BLOCK, t[-1])]).reshape(-1, _BLOCK)
    step = np.zeros(len(padded))
    unknown = np.ones(len(padded), dtype=bool)
    for digits in range(_DIGITS):
        with np.errstate(over="ignore", invalid="ignore"):  # inf - inf is not whole
            scaled = padded[unknown] * 10.0**digits
            whole = (np.abs(scaled - np.rint(scaled)) <= np.maximum(1e-9, 4e-16 * np.abs(scaled))).all(axis=1)
        found = np.flatnonzero(unknown)[whole]
        step[found] = 10.0**-digits
        unknown[found] = False
        if not unknown.any():
            break
    with np.errstate(over="ignore"):
        single = padded.astype(np.float32)
    spacing = np.spacing(np.abs(single).max(axis=1)).astype(np.float64)
    exact = (np.abs(single - padded) <= _SINGLE_PRINTED * np.abs(padded)).all(axis=1)
    # Stamps of a date look like it too, but differ by less than single precision could tell.
    steps = np.abs(np.diff(padded, axis=1))
    exact &= np.where(steps > 0.0, steps, np.inf).min(axis=1) >= 0.5 * spacing  # no decision: rounding
    step = np.where(exact, np.maximum(step, spacing), step)
    return np.repeat(step, _BLOCK)[: t.size]
