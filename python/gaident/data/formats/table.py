"""What a log file contains, whatever its format: named columns, and where each value stands."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.checks import is_whole
from gaident.data.signals.arrays import first_not_finite
from gaident.errors import ReadError

__all__ = ["BLOCK", "Column", "Stored", "LogTable", "first_line"]

BLOCK = 1 << 16  # no decision: memory; values of a block
"""Rows that are kept in memory at once, of a log that is read block by block."""

_NUMBER_SIGN = re.compile(r"#\s*(\d+)")
_PICK = re.compile(r"(.+)\[\s*(:|-?\d+)\s*,\s*(:|-?\d+)\s*\]")
_LISTED = 40  # no decision: how many columns a message names
MOST_COLUMNS = 100_000  # no decision: what an argument may be: columns of a log
MOST_SAMPLES = 1_000_000_000  # no decision: what an argument may be: samples of a signal, 11 days at 1 kHz
LONGEST_NAME = 10_000  # no decision: what an argument may be: characters of a column's name
SHOWN_NAME = 20  # no decision: printed: letters of a name that is too long


def first_line(error: BaseException) -> str:
    """What an error of another library says, for a message of one line."""
    return (str(error).splitlines() or [type(error).__name__])[0][:120]  # no decision: printed: of an error


class Stored:
    """Values that stay in their file until they are asked for: `stored[a:b]` reads rows a to b-1.

    Raises ReadError where the library that reads them fails: the file is damaged there.
    """

    def __init__(self, path: str, length: int, dtype: np.dtype[Any], read: Callable[[int, int], NDArray[Any]]) -> None:
        self.path, self.length, self.dtype, self.read = path, length, dtype, read

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        start, stop, _ = rows.indices(self.length)
        try:
            values = self.read(start, stop)
        except ReadError:
            raise
        except MemoryError:
            raise ReadError(
                f"{self.path}: reading rows {start} to {stop - 1} takes more memory than there is; copy the file again, or save "
                "the log in parts"
            ) from None
        except Exception as error:  # every library has its own
            raise ReadError(
                f"{self.path}: damaged, rows {start} to {stop - 1} cannot be read ({first_line(error)}); copy the file again"
            ) from None
        if values.shape != (stop - start,):
            raise ReadError(
                f"{self.path}: damaged, it contains {values.size} values where {stop - start} are announced; copy it again"
            )
        return values


@dataclass(frozen=True)
class Column:
    """One column.

    key      what the file calls it; unique in its table
    values   shape (n,); a text cell that is no number is NaN
    names    other names it answers to; need not be unique
    unit     as the file says, None if it does not
    bad      (row, text) of the first cell that is no number, None if all are
    clock    key of the column with its time stamps, where the file says which
    period   sample time [s], where the file states it
    note     what the record's notes say of it, "" if nothing
    """

    key: str
    values: NDArray[Any] | Stored
    names: tuple[str, ...] = ()
    unit: str | None = None
    bad: tuple[int, str] | None = None
    clock: str | None = None
    period: float | None = None
    note: str = ""

    def whole(self) -> NDArray[Any]:
        """All values, read if they are still in the file."""
        return self.values[0 : len(self.values)] if isinstance(self.values, Stored) else self.values


@dataclass(frozen=True)
class LogTable:
    """All columns of one file.

    path      named in every message
    columns   in the order of the file
    lines     line number of each row, for text files; None where only an index makes sense
    matrices  two-dimensional arrays, addressed as `data[:,3]`, zero based
    others    names of what the file contains besides, such as text, which cannot be a channel
    first     index of the first row, where the table is a block of a longer one
    batches   of a file that is read row by row: the rows of the columns asked for, block by block; the columns of
              the table itself then contain no values
    form      what the format is called
    remark    why the columns have no names, where the file contains some; for messages about a missing column
    """

    path: str
    columns: tuple[Column, ...]
    lines: Sequence[int] | None = None
    matrices: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    others: tuple[str, ...] = ()
    first: int = 0
    batches: Callable[[Sequence[Column]], Iterator[LogTable]] | None = None
    form: str = ""
    remark: str = ""

    def checked(self) -> LogTable:
        """The table, where it has no more columns, and none with more samples or a longer name, than a log; raises ReadError."""
        if len(self.columns) > MOST_COLUMNS:
            raise ReadError(
                f"{self.path}: {len(self.columns)} columns, and at most {MOST_COLUMNS} are read; save those that belong to the "
                "drive"
            )
        for k, column in enumerate(self.columns):
            self._check_length(len(column.values), column.key)
            if len(column.key) > LONGEST_NAME:
                raise ReadError(
                    f"{self.path}: the name of column #{k} is {len(column.key)} characters long "
                    f"({column.key[:SHOWN_NAME]!r}...), and at most {LONGEST_NAME} are read; "
                    "a quotation mark may lack its end, or the rows may stand in one line"
                )
        return self

    def _check_length(self, samples: int, name: str) -> None:
        if samples > MOST_SAMPLES:
            raise ReadError(
                f"{self.path}: the signal {name!r} has {samples} samples or more, and at most {MOST_SAMPLES} are read; save the "
                "log in parts"
            )

    def place(self, row: int) -> str:
        """Where a row stands, for messages."""
        return f"index {self.first + row}" if self.lines is None else f"line {self.lines[row]}"

    def blocks(self, columns: Sequence[Column], rows: int = BLOCK) -> Iterator[LogTable]:
        """The rows of some columns of this table, block after block, each a table of just these columns.

        What is in memory anyway comes as one block. Columns that are still in the file must be of one length.
        """
        if self.batches is not None:
            rows = 0
            for block in self.batches(columns):
                rows += max((len(column.values) for column in block.columns), default=0)
                self._check_length(rows, columns[0].key if columns else "")
                yield block
        elif any(isinstance(column.values, Stored) for column in columns):
            for start in range(0, max(len(column.values) for column in columns), rows):
                part = tuple(replace(column, values=column.values[start : start + rows]) for column in columns)
                yield replace(self, columns=part, first=start)
        else:
            yield replace(self, columns=tuple(columns))

    def find(self, address: str | int, channel: str) -> Column:
        """The column called `address`: a name, `#k` or k (zero based), or `data[:,k]`.

        Raises ReadError, naming what there is, when none or more than one answers.
        """
        if not (isinstance(address, str) or is_whole(address)):
            raise ReadError(f"columns: {channel}={address!r} is no column; give its name, or its number as '#0'")
        wanted = address.strip() if isinstance(address, str) else f"#{address}"
        # The number comes before loose spellings, but a column may really be called '#1'.
        for matches in (
            self._exactly(wanted),
            self._number(wanted),
            self._pick(wanted, channel),
            self._loosely(wanted),
        ):
            if len(matches) == 1:
                return matches[0]
            if matches:
                raise ReadError(self._ambiguous(wanted, matches))
        raise ReadError(self._missing(wanted, channel))

    def own(self, name: str) -> Column | None:
        """The column that bears exactly this name, None if there is none; ReadError if there are several."""
        matches = self._exactly(name)
        if len(matches) > 1:
            raise ReadError(self._ambiguous(name, matches))
        return matches[0] if matches else None

    def numbers(self, column: Column, channel: str) -> NDArray[np.float64]:
        """A column as float64, shape (n,), all finite; else ReadError with the first line that is not."""
        where = f"{channel} column {column.key!r}"
        values = column.whole()
        if values.dtype.kind not in "iufb":
            raise ReadError.at(
                self.path,
                f"{where} contains no real numbers (dtype {values.dtype})",
                "name another column, or save its real part",
            )
        bad = first_not_finite(values.astype(np.float64, copy=False))
        if column.bad is not None and (bad is None or column.bad[0] <= bad):
            row, text = column.bad
            apart = f", or, where channels have times of their own, put them on one axis with {arg('resample')} [s]"
            raise ReadError.at(
                f"{self.path}, {self.place(row)}",
                f"{where} {'is empty' if not text else f'contains {text!r}, not a number'}{_comma_hint(text)}",
                f"correct or remove that {'line' if self.lines is not None else 'value'}{'' if text else apart}",
            )
        if bad is not None:
            raise ReadError.at(
                f"{self.path}, {self.place(bad)}",
                f"{where} contains {values[bad]}",
                "cut the log before it, or correct the value",
            )
        return values.astype(np.float64, copy=False)

    def listing(self) -> str:
        """The columns, for messages."""
        keys = [repr(column.key) for column in self.columns]
        shown = ", ".join(keys[:_LISTED]) + (f" and {len(keys) - _LISTED} more" if len(keys) > _LISTED else "")
        rest = f"; besides {', '.join(self.others)}, which are no columns of numbers" if self.others else ""
        return (shown or "no columns") + rest

    def _exactly(self, wanted: str) -> list[Column]:
        by_key = [column for column in self.columns if column.key == wanted]
        return by_key or [column for column in self.columns if wanted in column.names]

    def _number(self, wanted: str) -> list[Column]:
        match = _NUMBER_SIGN.fullmatch(wanted)
        return [self.columns[int(match[1])]] if match and int(match[1]) < len(self.columns) else []

    def _loosely(self, wanted: str) -> list[Column]:
        plain = wanted.casefold()
        return [column for column in self.columns if plain in {name.casefold() for name in (column.key, *column.names)}]

    def _pick(self, wanted: str, channel: str) -> list[Column]:
        """`data[:,3]` or `data[2,:]` out of a matrix."""
        if wanted in self.matrices:
            rows, cols = self.matrices[wanted].shape
            raise ReadError(
                f"{self.path}: {channel}={wanted!r} is an array of {rows} x {cols}; name one column of it, "
                f"for example '{wanted}[:,0]' (zero based, as numpy counts)"
            )
        match = _PICK.fullmatch(wanted)
        if match is None or match[1].strip() not in self.matrices or (match[2] == ":") == (match[3] == ":"):
            return []
        matrix = self.matrices[match[1].strip()]
        axis = 1 if match[2] == ":" else 0
        index, size = int(match[3] if axis else match[2]), matrix.shape[axis]
        if not -size <= index < size:
            raise ReadError(
                f"{self.path}: {channel}={wanted!r}, but {match[1]} is an array of {matrix.shape[0]} x "
                f"{matrix.shape[1]}; give an index from 0 to {size - 1} (zero based)"
            )
        return [Column(wanted, matrix[:, index] if axis else matrix[index, :])]

    def _ambiguous(self, wanted: str, matches: list[Column]) -> str:
        numbers = ", ".join(repr(f"#{self.columns.index(column)}") for column in matches)
        return (
            f"{self.path}: {len(matches)} columns are called {wanted!r}; say which by its number, counted "
            "from 0: "
            f"one of {numbers}"
        )

    def said(self) -> str:
        """What the file contains, in words."""
        return f"{f'{self.remark}, so ' if self.remark else ''}the file contains {self.listing()}"

    def _missing(self, wanted: str, channel: str) -> str:
        names = {name.casefold(): name for column in self.columns for name in (*column.names, column.key)}
        near = difflib.get_close_matches(wanted.casefold(), names, n=1)
        guess = f" (did you mean {names[near[0]]!r}?)" if near else ""
        return (
            f"{self.path}: there is no column {wanted!r} for {channel}{guess}; {self.said()}; "
            f"name one of these in {arg('columns', '...', channel)}, or give a number such as '#0' (zero based)"
        )


def _comma_hint(text: str) -> str:
    """What to say about a cell that would be a number with another decimal mark."""
    if re.fullmatch(r"[+-]?\d+,\d+([eE][+-]?\d+)?", text):
        return f" (a decimal comma? then give {arg('decimal', repr(','))})"
    if re.fullmatch(r"[+-]?\d+\.\d+", text):
        return " (a point in a log with decimal commas? export it with one decimal mark and none for thousands)"
    if re.fullmatch(r"[+-]?\d{1,3}([.,' ]\d{3})+([.,]\d+)?", text):
        return " (a mark between thousands? export the log without it)"
    return ""
