"""The table of a pandas DataFrame, as it is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import midnight, seconds_since, unique_keys
from gaident.data.formats.table import Column, LogTable

__all__ = ["frame_column", "frame_table", "is_frame"]


def is_frame(source: Any) -> bool:
    """Whether `source` is a DataFrame: pandas' own, or one with its attributes (`columns`, `index`, `iloc`)."""
    return all(hasattr(source, name) for name in ("columns", "index", "iloc")) and isinstance(source.columns, Iterable)


def frame_table(frame: Any) -> LogTable:
    """The columns of a pandas DataFrame, in its order; last its index, unless that only counts.

    Dates and time differences become seconds; what is no number is NaN, and refused where a channel needs it.
    """
    names = [str(name) if not isinstance(name, tuple) else "/".join(map(str, name)) for name in frame.columns]
    columns = [
        Column(key, np.zeros(0), () if key == name else (name,)) for key, name in zip(unique_keys(names), names, strict=True)
    ]
    filled = [frame_column(column, _plain(frame.iloc[:, k])) for k, column in enumerate(columns)]
    index = frame.index
    if type(index).__name__ != "RangeIndex" and getattr(index, "nlevels", 1) == 1:
        name = str(index.name or "index")
        name = name if name not in {column.key for column in filled} else f"{name} (index)"
        aliases = ("time",) if np.asarray(index).dtype.kind in "mM" else ()
        filled.append(frame_column(Column(name, np.zeros(0), aliases), _plain(index)))
    return LogTable("DataFrame", tuple(filled), form="DataFrame")


def _plain(series: Any) -> NDArray[Any]:
    """Values as numpy has them; pandas' own types with missing values become objects."""
    dates = "datetime" in str(series.dtype)
    return np.asarray(series.to_numpy(dtype="datetime64[ns]") if dates else series.to_numpy())


def frame_column(column: Column, values: NDArray[Any], origins: dict[str, Any] | None = None) -> Column:
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
