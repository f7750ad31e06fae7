"""What a log contains, for the person who has to name its columns: names, units, ranges, sample times."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.delimited import TextOptions
from gaident.data.formats.table import Column, LogTable
from gaident.data.formats.units import factor
from gaident.data.readers import open_log
from gaident.data.timeaxis import TimeAxis, stamp_unit, time_column
from gaident.data.torque_kind import kind_of_column
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["ColumnInfo", "Listing", "columns", "printable"]


@dataclass(frozen=True)
class ColumnInfo:
    """One column of a log.

    Attributes
    ----------
    name : str
        What the file calls it, as the `columns` of `read` take it.
    names : tuple of str
        Other names that `read` takes for it.
    unit : str or None
        Unit as the file says it; None if it does not.
    samples : int
        Number of values.
    lowest, highest : float or None
        Range of the values in the file's unit; None where there is no number.
    sample_time : float or None
        Sample time [s]; None where nothing tells it or the time stamps are irregular.
    is_time : bool
        Whether it is taken for the time of the others.
    rises_evenly : bool
        Whether it could be a time.
    note : str
        What stands in the way of its use; "" if nothing does.
    torque_is : {"commanded", "measured"} or None
        What kind of torque it is, where its name speaks of a torque or current and says which.

    See Also
    --------
    columns : Lists them, with an example.
    """

    name: str
    names: tuple[str, ...]
    unit: str | None
    samples: int
    lowest: float | None
    highest: float | None
    sample_time: float | None
    is_time: bool
    rises_evenly: bool
    note: str
    torque_is: str | None = None


@dataclass(frozen=True)
class Listing:
    """Format and columns of a log; `str()` is a table of them.

    Attributes
    ----------
    path : str
        The log.
    form : str
        Its format.
    columns : tuple of ColumnInfo
        Its columns of numbers.
    others : tuple of str
        What it contains besides.

    See Also
    --------
    columns : Makes it, with an example.
    """

    path: str
    form: str
    columns: tuple[ColumnInfo, ...]
    others: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return {"schema": "gaident/columns", "schema_version": 1, **asdict(self)}

    def __str__(self) -> str:
        timed = any(c.is_time for c in self.columns)
        rows = [("column", "unit", "samples", "lowest", "highest", "dt [ms]", "")]
        for c in self.columns:
            step = "" if c.sample_time is None else f"{1e3 * c.sample_time:.6g}"
            remark = "rises evenly: a time?" if c.rises_evenly and not timed else ""
            kind = f"{c.torque_is} torque" if c.torque_is else ""
            remark = "; ".join(filter(None, ["time" if c.is_time else "", c.note, remark, kind]))
            rows.append(
                (printable(c.name), printable(c.unit or "-"), str(c.samples), _number(c.lowest), _number(c.highest), step, remark)
            )
        widths = [max(len(row[k]) for row in rows) for k in range(6)]  # no decision: printed: columns of a table
        lines = [f"{self.path}: {self.form}"]
        for row in rows:
            # no decision: printed: columns of a table
            cells = [cell.ljust(w) if k < 2 else cell.rjust(w) for k, (cell, w) in enumerate(zip(row[:6], widths, strict=True))]
            lines.append("  ".join([*cells, row[6]]).rstrip())
        if self.others:
            lines.append(f"besides, no columns of numbers: {', '.join(self.others)}")
        return "\n".join(lines)


def printable(text: str) -> str:
    """The text for a terminal: tabs, line ends and control characters of a name as escapes."""
    return text if text.isprintable() else repr(text)[1:-1]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value + 0.0:.6g}"  # no -0


def columns(
    path: str | os.PathLike[str] | Any,
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> Listing:
    """List the columns of a log: names, units, ranges and sample times.

    The values pass through block by block, none is kept.

    Parameters
    ----------
    path : str, path-like or pandas.DataFrame
        The log, as `read` takes it.
    delimiter, decimal, skip, encoding : optional
        Of a text table, as `read` takes them.

    Returns
    -------
    Listing
        Its `columns` are one `ColumnInfo` each; `print` shows a table of them.

    Raises
    ------
    ReadError
        Where the log cannot be read.

    Examples
    --------
    >>> import gaident as ga
    >>> with open("run1.csv", "w") as log:
    ...     print("t [ms],w [rpm]", file=log)
    ...     for i in range(30):
    ...         print(f"{i},{3 * i}", file=log)
    >>> [(c.name, c.unit, c.highest, c.is_time) for c in ga.columns("run1.csv").columns]
    [('t [ms]', 'ms', 29.0, True), ('w [rpm]', 'rpm', 87.0, False)]
    """
    with open_log(path, TextOptions(delimiter, decimal, skip, encoding)) as table:
        real = [column for column in table.columns if column.values.dtype.kind in "iufb"]
        clocks = {column.clock for column in real if column.clock is not None}
        main = time_column(table, strict=False) if not clocks else None
        gathered = {
            column.key: _Gathered(column, column.key in clocks or (main is not None and column.key == main.key))
            for column in real
        }
        groups: Sequence[Sequence[Column]] = [real] if table.batches is not None else [[column] for column in real]
        for group in groups:
            for block in table.blocks(group):
                for column in block.columns:
                    gathered[column.key].push(block, column)
        found = []
        for column in real:
            own = gathered[column.key]
            clock = own if own.axis is not None else gathered.get(column.clock or (main.key if main is not None else ""))
            found.append(own.info(table, clock))
        return Listing(table.path, table.form, tuple(found), table.others)


class _Gathered:
    """A column's range, and its time axis where it is one, as its blocks pass."""

    def __init__(self, column: Column, is_time: bool) -> None:
        self.column, self.is_time = column, is_time
        self.samples, self.lowest, self.highest, self.bad = 0, np.inf, -np.inf, ""
        self.axis: TimeAxis | None = None
        self.irregular = ""
        self.even, self.first, self.rise = True, 0.0, 0.0  # as far as seen: rises by the same from value to value

    def push(self, block: LogTable, column: Column) -> None:
        values = column.whole().astype(np.float64, copy=False)
        finite = values[np.isfinite(values)]
        self._look_for_time(values)
        self.samples += len(values)
        if finite.size:
            self.lowest, self.highest = min(self.lowest, float(finite.min())), max(self.highest, float(finite.max()))
        if not self.bad and finite.size < len(values):
            row = int(np.argmin(np.isfinite(values)))
            text = column.bad[1] if column.bad is not None else str(values[row])
            # no decision: printed: of a cell in a message
            self.bad = f"{'empty' if not text else f'no number: {text[:20]!r}'} at {block.place(row)}"
        if self.is_time and not self.irregular:
            self._pass_time(block, values)

    def _look_for_time(self, values: NDArray[np.float64]) -> None:
        if not self.even or len(values) < 2:
            return
        if not np.all(np.isfinite(values)):
            self.even = False
            return
        if self.samples == 0:
            self.first, self.rise = float(values[0]), float(values[-1] - values[0]) / (len(values) - 1)
        expected = self.first + self.rise * (self.samples + np.arange(len(values)))
        self.even = self.rise > 0.0 and bool(np.all(np.abs(values - expected) <= POLICY.even_rise * self.rise))

    def _pass_time(self, block: LogTable, values: NDArray[np.float64]) -> None:
        if not len(values):
            return
        try:
            if self.axis is None:
                unit = self.column.unit
                self.axis = TimeAxis(self.column, factor("time", unit) if unit else stamp_unit(float(values[0])))
            self.axis.push(block, block.numbers(next(c for c in block.columns if c.key == self.column.key), "time"))
        except ReadError as error:
            self.irregular = error.fault or str(error)

    def step(self, table: LogTable) -> float | None:
        """The sample time of this time column [s]; None where it is irregular."""
        if self.axis is None or self.irregular or self.samples < 2:
            return None
        return self.axis.sample_time(table)

    def info(self, table: LogTable, clock: _Gathered | None) -> ColumnInfo:
        column = self.column
        step = clock.step(table) if clock is not None and clock.is_time and clock.samples == self.samples else None
        notes = [self.bad, self.irregular if self.irregular and not self.bad else ""]
        if self.samples and self.lowest == self.highest and not self.bad:
            notes.append("one number" if self.samples == 1 else "constant")
        lowest, highest = (self.lowest, self.highest) if np.isfinite(self.lowest) else (None, None)
        return ColumnInfo(
            column.key, column.names, column.unit, self.samples, lowest, highest,
            column.period if step is None and column.clock is None else step, self.is_time,
            self.even and self.samples > 2, ", ".join(filter(None, notes)), kind_of_column((column.key, *column.names)),
        )  # fmt: skip
