"""The sample time from a log's time column, and the refusal of an irregular one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.data.table import Column, Table
from gaident.errors import ReadError

__all__ = ["check_given", "sample_time"]

_JITTER = 0.01
"""Of one sample time: what a logger's clock may wander from sample to sample."""

_COARSE = 0.25
"""Of one sample time: a coarser print of the time hides a lost sample."""

_FEW = 0.1
_CONTRADICTION = 0.01
_BLOCK = 64
_DIGITS = 16
_SINGLE_PRINTED = 6e-9
"""Relative error of a single-precision number printed with its nine digits."""


def sample_time(table: Table, column: Column, second: float) -> float:
    """dt [s] of a regular time column: (t(n-1) - t(0)) / (n - 1), every step being about the median.

    column  of `table`; second: what one of its units is in s
    A step may deviate from the median by 1 % (the logger's clock) and by the rounding of the printed digits:
    0.666666 ms is regular, and so is 0.667, 1.333, 2.000. Raises ReadError with line, jump and remedy.
    """
    t = table.numbers(column, "time")
    if t.size < 2:
        raise ReadError(f"{table.path}: time column {column.key!r} has {t.size} value; give a longer log")
    steps = np.diff(t)
    median = float(np.median(steps))
    if median <= 0.0:
        if steps.min() == 0.0 and steps.max() > 0.0:
            _too_coarse(table, column, float(steps[steps > 0.0].min()))
        row = int(np.argmin(steps > 0.0)) + 1
        raise ReadError(
            f"{table.path}, {table.place(row)}: time column {column.key!r} does not increase "
            f"({t[row - 1]:.12g}, then {t[row]:.12g}); sort the log, "
            f"or give dt= and set columns={{'time': None}}"
        )
    deviation = np.abs(steps - median)
    unequal = deviation > _JITTER * median
    if unequal.any():
        printed = _printed_step(t)
        rounding = np.maximum(printed[1:], printed[:-1])
        irregular = deviation > _JITTER * median + rounding * (1.0 + 1e-9)
        if irregular.any():
            _refuse(table, column, t, int(np.argmax(irregular)), median * second)
        if rounding.max() > _COARSE * median:
            # Where the digits suit the sample time, nearly all steps are equal and the few others are real.
            if unequal.mean() < _FEW:
                _refuse(table, column, t, int(np.argmax(unequal)), median * second)
            _too_coarse(table, column, float(rounding.max()))
    # The mean is free of the rounding that the median keeps; 12 digits drop the noise of the division.
    mean = float(t[-1] - t[0]) / (t.size - 1) * second
    return float(f"{mean:.12g}")


def check_given(table: Table, column: Column, second: float, dt: float) -> None:
    """Raise ReadError where the dt that the user gave [s] and the time column differ by more than 1 %."""
    t = table.numbers(column, "time")
    found = float(np.median(np.diff(t))) * second if t.size > 1 else dt
    if abs(found - dt) <= _CONTRADICTION * dt:
        return
    unit = next(
        (name for name, size in (("ms", 1e-3), ("us", 1e-6), ("min", 60.0)) if abs(found * size / dt - 1) < 0.01),
        None,
    )
    hint = f"; if it is in {unit}, give units={{'time': {unit!r}}}" if unit and second == 1.0 else ""
    raise ReadError(
        f"{table.path}: dt={dt:g} s, but time column {column.key!r} has steps of {found:g} s{hint}; "
        f"leave dt out, or set columns={{'time': None}} to trust dt"
    )


def _too_coarse(table: Table, column: Column, printed: float) -> None:
    raise ReadError(
        f"{table.path}: time column {column.key!r} is printed in steps of {printed:g}, too coarse to "
        f"tell the sample time; export more digits, or give dt= [s] and set columns={{'time': None}}"
    )


def _refuse(table: Table, column: Column, t: NDArray[np.float64], step: int, dt: float) -> None:
    raise ReadError(
        f"{table.path}, {table.place(step + 1)}: time column {column.key!r} is irregular: from "
        f"{t[step]:.12g} to "
        f"{t[step + 1]:.12g} it jumps by {t[step + 1] - t[step]:.6g}, elsewhere by "
        f"{float(np.median(np.diff(t))):.6g}; "
        f"cut the log there or resample it; if the samples are in truth evenly spaced, give dt={dt:.6g} "
        "and set "
        f"columns={{'time': None}}"
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
    step = np.where(exact, np.maximum(step, spacing), step)
    return np.repeat(step, _BLOCK)[: t.size]
