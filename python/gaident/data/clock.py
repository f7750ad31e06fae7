"""Which column contains the time of a log's channels, and what one of its units is in s."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gaident.arguments import arg
from gaident.data.formats.table import Column, LogTable
from gaident.data.timeaxis import TimeAxis, stamp_unit, time_column
from gaident.data.wanted import Wanted, si_factor
from gaident.errors import ReadError

__all__ = ["axis_of", "clock_of", "common_clock", "part_of", "second_of"]


def clock_of(table: LogTable, wanted: Wanted, column: Column) -> Column | None:
    """The time column of one channel: the one named, its own, one that is called so; None: the file states its period."""
    columns = wanted.columns or {}
    address = columns.get("time")
    if address is not None:
        return table.find(address, "time")
    if column.clock is not None:
        return next(other for other in table.columns if other.key == column.clock)
    if column.period is not None:
        return None
    found = time_column(table)
    if found is None:
        raise ReadError(
            f"{table.path}: resample needs time stamps; give {arg('columns', '...', 'time')} with one of {table.listing()}"
        )
    return found


def common_clock(table: LogTable, wanted: Wanted, named: Mapping[str, Column]) -> Column | None:
    """The column named for time; else the channels' own; else one that is called so; else None."""
    columns = wanted.columns or {}
    if "time" in columns:
        address = columns["time"]
        return None if address is None else table.find(address, "time")
    clocks = {column.clock for column in named.values()}
    if None not in clocks:
        found = [column for column in table.columns if column.key in clocks]
        if len(found) > 1:
            _refuse_two_clocks(table, found)
        return found[0]
    periods = {column.period for column in named.values()}
    if None not in periods and wanted.dt is None:
        if len(periods) > 1:
            listed = ", ".join(f"{channel} {column.period:g} s" for channel, column in named.items())
            raise ReadError(
                f"{table.path}: the channels were logged at several rates ({listed}); name columns of one rate, or put them on "
                f"one axis with {arg('resample')} [s]"
            )
        return None
    column = time_column(table)
    if column is None and wanted.dt is None:
        raise ReadError(
            f"{table.path}: dt is not given and no column is called time or t; give {arg('dt')} [s], or "
            f"{arg('columns', '...', 'time')} with one of {table.listing()}"
        )
    return column


def _refuse_two_clocks(table: LogTable, clocks: list[Column]) -> None:
    """Raises where the channels' time columns differ: equal ones are one clock that was printed twice."""
    if len({len(clock.values) for clock in clocks}) == 1 and table.batches is None:
        first = clocks[0].whole()
        if all(np.array_equal(first, clock.whole(), equal_nan=True) for clock in clocks[1:]):
            return
    raise ReadError(
        f"{table.path}: the channels have time columns of their own ({', '.join(repr(clock.key) for clock in clocks)}), which "
        f"differ; name columns of one rate, put them on one axis with {arg('resample')} [s], or say which counts with "
        f"{arg('columns', repr(clocks[0].key), 'time')}"
    )


def axis_of(block: LogTable, wanted: Wanted, time: Column | None) -> TimeAxis | None:
    """What checks the time column; None where there is none, or where it need not be looked at."""
    if time is None:
        return None
    if wanted.dt is None:
        return TimeAxis(time, second_of(block, wanted, time))
    # A column that only happens to be called time must not stand in the way of a dt, unless it is one.
    explicit = wanted.columns is not None and "time" in wanted.columns
    part = part_of(block, time)
    values = part.whole()
    if explicit or (part.bad is None and values.dtype.kind in "iuf" and np.isfinite(values).all()):
        return TimeAxis(time, second_of(block, wanted, time), float(wanted.dt), strict=explicit)
    return None


def second_of(block: LogTable, wanted: Wanted, time: Column) -> float:
    """What one unit of the time column is in s; where nothing says it, what its first value suggests."""
    if "time" in wanted.units or time.unit is not None:
        return si_factor(block, wanted, "time", time)
    values = part_of(block, time).whole()
    return stamp_unit(float(values[0])) if len(values) and values.dtype.kind in "iuf" else 1.0


def part_of(block: LogTable, column: Column) -> Column:
    """The column's part in a block."""
    return next(part for part in block.columns if part.key == column.key)
