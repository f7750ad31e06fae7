"""What every reader of arrays does: name them, flatten rows and columns, and say what is no column."""

from __future__ import annotations

import importlib
import logging
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.table import Column, LogTable, Stored, first_line
from gaident.data.formats.unit_names import unit_of
from gaident.errors import ReadError

__all__ = ["Matrix", "array_table", "channel_table", "check_unpacked", "library", "midnight", "seconds_since", "unique_keys"]

_LISTED_COLUMNS = 1000  # no decision: how many columns are listed
MOST_UNPACKED = 1 << 28  # no decision: memory: bytes that a file may unpack to whatever its size
MOST_TIMES = 20  # no decision: memory: and times its size


class Matrix:
    """A two-dimensional array that stays in its file, as the table addresses it: `m[:, k]`, `m[k, :]`, `m.shape`."""

    def __init__(self, path: str, shape: tuple[int, int], dtype: np.dtype[Any], read: Callable[[Any, Any], NDArray[Any]]) -> None:
        self.path, self.shape, self.dtype, self.read = path, shape, dtype, read

    def __getitem__(self, index: tuple[Any, Any]) -> Stored:
        row, column = index
        if isinstance(row, slice):
            k = column % self.shape[1]
            return Stored(self.path, self.shape[0], self.dtype, lambda a, b: self.read(slice(a, b), k).reshape(-1))
        k = row % self.shape[0]
        return Stored(self.path, self.shape[1], self.dtype, lambda a, b: self.read(k, slice(a, b)).reshape(-1))


def array_table(
    path: str,
    arrays: Mapping[str, NDArray[Any] | Stored | Matrix],
    others: list[str],
    units: Mapping[str, str] | None = None,
    form: str = "",
) -> LogTable:
    """The table of named arrays, one- and two-dimensional. Raises ReadError where there are none."""
    if not arrays:
        rest = f" (only {', '.join(others)})" if others else ""
        raise ReadError(f"{path}: the file contains no arrays of numbers{rest}; save the log's columns as plain vectors")
    columns: list[Column] = []
    matrices: dict[str, Any] = {}
    units = {name: unit for name in arrays if (unit := (units or {}).get(name) or unit_of(name)) is not None}
    for name, array in arrays.items():
        if isinstance(array, Stored) or (isinstance(array, np.ndarray) and array.ndim == 1):
            columns.append(Column(name, array, _last_part(name), units.get(name)))
            continue
        matrices[name] = array
        rows, cols = array.shape
        # Time runs along the longer side; the other way can still be addressed.
        if rows >= cols:
            columns += [Column(f"{name}[:,{k}]", array[:, k], (), units.get(name)) for k in range(min(cols, _LISTED_COLUMNS))]
        else:
            columns += [Column(f"{name}[{k},:]", array[k, :], (), units.get(name)) for k in range(min(rows, _LISTED_COLUMNS))]
    return LogTable(path, tuple(columns), matrices=matrices, others=tuple(others), form=form)


def channel_table(path: str, columns: list[Column], others: list[str], form: str) -> LogTable:
    """The table of a logger's channels. Raises ReadError where there are none."""
    if not columns:
        rest = f" (only {', '.join(others)})" if others else ""
        raise ReadError(f"{path}: the file contains no channels of numbers{rest}; give a log with measured channels")
    return LogTable(path, tuple(columns), others=tuple(others), form=form)


def _last_part(name: str) -> tuple[str, ...]:
    """`log/speed` and `log.speed` also answer to `speed`."""
    last = name.replace(".", "/").rsplit("/", 1)[-1]
    return (last,) if last != name and last else ()


def unique_keys(names: list[str]) -> list[str]:
    """The names, those that are empty or that others have too with ` #k`, their number counted from 0."""
    times = Counter(names)
    return [name if name and times[name] == 1 else f"{name} #{k}".strip() for k, name in enumerate(names)]


def check_unpacked(path: str, unpacked: int, packed: int) -> None:
    """Raises ReadError for a file of `packed` bytes that stands for so many more that no log of a drive does."""
    most = max(MOST_UNPACKED, MOST_TIMES * packed)
    if unpacked > most:
        raise ReadError(
            f"{path}: its {packed} bytes unpack to {unpacked} or more, which is beyond {MOST_TIMES} times the file and "
            f"{MOST_UNPACKED >> 20} MiB; save the log without what repeats, or in parts"
        )


def library(module: str, extra: str, path: str, what: str) -> Any:
    """The module that reads a format, imported; ReadError with the line that installs it where it is missing."""
    name = module.split(".")[0]
    try:
        found = importlib.import_module(module)
    except Exception as error:  # one that does not suit the others fails otherwise than by ImportError
        raise ReadError(
            f"{path}: this is {what}, and reading it needs the library {name}, which cannot be imported ({first_line(error)}); "
            f'install it with pip install "gaident[{extra}]"'
        ) from None
    # What it has to say comes as an error of ours, not as lines of its loggers beside it.
    for logger in list(logging.root.manager.loggerDict):
        if logger.split(".")[0] == name:
            logging.getLogger(logger).setLevel(logging.CRITICAL)
    return found


def midnight(stamps: NDArray[Any]) -> Any:
    """The day on which dates begin; counted from there, seconds keep all digits of a stamp as float64."""
    there = stamps[~np.isnat(stamps)]
    return there[0].astype("datetime64[D]") if there.size and there.dtype.kind == "M" else np.timedelta64(0, "ns")


def seconds_since(origin: Any, stamps: NDArray[Any]) -> NDArray[np.float64]:
    """Dates or time differences [s], counted from `origin`; NaN where there is none."""
    passed = (stamps - origin).astype("timedelta64[ns]")
    return np.where(np.isnat(passed), np.nan, passed.astype(np.int64) * 1e-9)
