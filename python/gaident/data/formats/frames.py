"""Readers for tables of a data frame: Parquet files, and pandas' DataFrame as it is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import library, midnight, seconds_since, unique_keys
from gaident.data.formats.table import BLOCK, Column, LogTable, first_line
from gaident.data.formats.unit_names import unit_of
from gaident.errors import ReadError

__all__ = ["frame_table", "is_frame", "open_parquet"]

_BUFFER = 1 << 18  # no decision: memory; bytes per column that are read ahead


def open_parquet(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Numeric columns of a Parquet file, read block by block; a field's metadata `unit` or `units` is its unit."""
    parquet = library("pyarrow.parquet", "parquet", path, "a Parquet file")
    try:
        # Its defaults contain whole row groups, which may be the whole file, before the first row is given out.
        opened = stack.enter_context(parquet.ParquetFile(file, pre_buffer=False, buffer_size=_BUFFER))
        fields = list(opened.schema_arrow)
    except Exception as error:  # pyarrow's errors share no class
        raise ReadError(f"{path}: not a whole Parquet file ({first_line(error)}); copy it again, or export a CSV") from None
    names = [field.name for field in fields]
    times = Counter(names)
    twice = next((name for name in names if times[name] > 1), None)
    if twice is not None:
        raise ReadError(f"{path}: two columns are called {twice!r}; save the log again with one name for each")
    columns, others = [], []
    for field in fields:
        kind = np.dtype(field.type.to_pandas_dtype()).kind if _is_plain(field.type) else "O"
        if kind not in "iufbMm":
            others.append(f"{field.name!r} ({field.type})")
            continue
        metadata = field.metadata or {}
        stated = next((metadata[key].decode("utf-8", "replace") for key in (b"units", b"unit") if key in metadata), None)
        columns.append(Column(field.name, np.zeros(0), (), "s" if kind in "Mm" else stated or unit_of(field.name)))
    if not columns:
        raise ReadError(f"{path}: the file contains no columns of numbers (only {', '.join(others)})")

    origins: dict[str, Any] = {}  # midnight of each column of dates

    def batches(wanted: Sequence[Column]) -> Iterator[LogTable]:
        first = 0
        try:
            for batch in opened.iter_batches(BLOCK, columns=[column.key for column in wanted]):
                values = [_column(column, batch.column(column.key).to_numpy(zero_copy_only=False), origins) for column in wanted]
                yield LogTable(path, tuple(values), first=first)
                first += batch.num_rows
        except ReadError:
            raise
        except Exception as error:
            raise ReadError(f"{path}: damaged ({first_line(error)}); copy it again") from None

    return LogTable(path, tuple(columns), others=tuple(others), batches=batches, form="Parquet")


def _is_plain(kind: Any) -> bool:
    try:
        np.dtype(kind.to_pandas_dtype())
    except (NotImplementedError, TypeError):
        return False
    return True


def is_frame(source: object) -> bool:
    """Whether `source` is a DataFrame: pandas' own, or one with its attributes (`columns`, `index`, `iloc`)."""
    return all(hasattr(source, name) for name in ("columns", "index", "iloc"))


def frame_table(frame: Any) -> LogTable:
    """The columns of a pandas DataFrame, in its order; last its index, unless that only counts.

    Dates and time differences become seconds; what is no number is NaN, and refused where a channel needs it.
    """
    names = [str(name) if not isinstance(name, tuple) else "/".join(map(str, name)) for name in frame.columns]
    columns = [
        Column(key, np.zeros(0), () if key == name else (name,)) for key, name in zip(unique_keys(names), names, strict=True)
    ]
    filled = [_column(column, _plain(frame.iloc[:, k])) for k, column in enumerate(columns)]
    index = frame.index
    if type(index).__name__ != "RangeIndex" and getattr(index, "nlevels", 1) == 1:
        name = str(index.name or "index")
        name = name if name not in {column.key for column in filled} else f"{name} (index)"
        aliases = ("time",) if np.asarray(index).dtype.kind in "mM" else ()
        filled.append(_column(Column(name, np.zeros(0), aliases), _plain(index)))
    return LogTable("DataFrame", tuple(filled), form="DataFrame")


def _plain(series: Any) -> NDArray[Any]:
    """Values as numpy has them; pandas' own types with missing values become objects."""
    dates = "datetime" in str(series.dtype)
    return np.asarray(series.to_numpy(dtype="datetime64[ns]") if dates else series.to_numpy())


def _column(column: Column, values: NDArray[Any], origins: dict[str, Any] | None = None) -> Column:
    """The column with these values: dates in s since midnight of the first, kept in `origins`; objects as numbers."""
    if values.dtype.kind in "mM":
        stamps = values.astype(f"{values.dtype.kind}8[ns]")
        origin = ({} if origins is None else origins).setdefault(column.key, midnight(stamps))
        return replace(column, values=seconds_since(origin, stamps), unit="s")
    if values.dtype.kind in "OUST":
        return _from_objects(column, values)
    return replace(column, values=values)


def _from_objects(column: Column, values: NDArray[Any]) -> Column:
    numbers = np.full(len(values), np.nan)
    bad: tuple[int, str] | None = None
    for row, value in enumerate(values.tolist()):
        if isinstance(value, (int, float, np.number)) and not isinstance(value, bool):
            numbers[row] = value
        elif bad is None:
            missing = value is None or type(value).__name__ in ("NAType", "NaTType")
            bad = (row, "" if missing else str(value))
    return replace(column, values=numbers, bad=bad)
