"""Reader for text tables: CSV, TSV, TXT and what else logs are called."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.dialect import Dialect, detect, parse_number, split
from gaident.data.header import COMMENT, find_header
from gaident.data.table import Column, Table
from gaident.data.text import Line, lines_of
from gaident.errors import ReadError

__all__ = ["TextOptions", "read_text"]

_BLOCK = 8192
_WORDS = {"tab": "\t", "space": " ", "comma": ",", "semicolon": ";", "pipe": "|", "\\t": "\t"}


@dataclass(frozen=True)
class TextOptions:
    """How a text log is written; None: found out.

    delimiter  between columns: one character, or "tab", "space" (any run of white space), "comma",
               "semicolon", "pipe"
    decimal    "." or ","
    skip       lines to leave out at the top
    encoding   as Python calls it, "utf-8", "latin-1", ...
    """

    delimiter: str | None = None
    decimal: str | None = None
    skip: int | None = None
    encoding: str | None = None

    def check(self) -> TextOptions:
        """These options with the delimiter as a character. Raises ReadError."""
        delimiter = self.delimiter
        if delimiter is not None:
            delimiter = _WORDS.get(delimiter, delimiter) if isinstance(delimiter, str) else ""
            if len(delimiter) != 1 or delimiter in '\n\r".+-' or delimiter.isalnum():
                raise ReadError(
                    f"delimiter={self.delimiter!r} cannot stand between columns; give ',', ';', 'tab', 'space' or '|'"
                )
        if self.decimal not in (None, ".", ","):
            raise ReadError(f"decimal={self.decimal!r} is no decimal mark; give '.' or ','")
        if self.skip is not None and (isinstance(self.skip, bool) or not isinstance(self.skip, int) or self.skip < 0):
            raise ReadError(f"skip={self.skip!r} is no number of lines; give a whole number from 0")
        if self.encoding is not None and not isinstance(self.encoding, str):
            raise ReadError(f"encoding={self.encoding!r} is no text; give for example 'utf-8' or 'latin-1'")
        return TextOptions(delimiter, self.decimal, self.skip, self.encoding)


def read_text(path: str, raw: bytes, options: TextOptions) -> Table:
    """The table in a text file, whatever its dialect. Raises ReadError with the line and the remedy."""
    options = options.check()
    everything = lines_of(path, raw, options.encoding)
    skip = options.skip or 0
    lines: list[Line] = [(n, text) for n, text in enumerate(everything[skip:], skip + 1) if text and not text.isspace()]
    comments = [line for line in lines if COMMENT.match(line[1])]
    if comments:
        lines = [line for line in lines if not COMMENT.match(line[1])]
    if not lines:
        raise ReadError(f"{path}: no line is left after skip={skip} and comments; give a smaller skip=, or a log with data")
    dialect = detect(path, lines, options.delimiter, options.decimal)
    header = find_header(lines, comments, dialect)
    numbers, body = zip(*lines[header.start :], strict=True)
    # Lines that end with a separator have a last column of nothing.
    trailing = dialect.empty and header.headings[-1].key == f"#{dialect.width - 1}"
    values, bad = _numbers(path, numbers, body, dialect, trailing)
    columns = [
        Column(heading.key, values[:, k], heading.names, heading.unit, bad.get(k))
        for k, heading in enumerate(header.headings[: dialect.width - trailing])
    ]
    return Table(path, tuple(columns), lines=numbers)


_Bad = dict[int, tuple[int, str]]


def _numbers(
    path: str, numbers: Sequence[int], body: Sequence[str], dialect: Dialect, trailing: bool
) -> tuple[NDArray[np.float64], _Bad]:
    """Values (n, width), NaN where no number stands, and per column the first such cell as (row, text).

    Block by block: numpy's own parser is fast but says little of a flaw, so a block that it does not like is
    read again cell by cell.
    """
    values = np.full((len(body), dialect.width), np.nan)
    bad: _Bad = {}
    for start in range(0, len(body), _BLOCK):
        block = body[start : start + _BLOCK]
        if not _clean(block, dialect, values[start : start + _BLOCK]):
            found = _careful(
                path,
                numbers[start : start + _BLOCK],
                block,
                dialect,
                trailing,
                values[start : start + _BLOCK],
            )
            bad = {k: (start + row, text) for k, (row, text) in found.items()} | bad
        elif start == 0 and not all(dialect.numeric):
            first = split(body[0], dialect.delimiter)
            bad = {k: (0, first[k]) for k in range(dialect.width) if not dialect.numeric[k]}
    return values, bad


def _clean(block: Sequence[str], dialect: Dialect, out: NDArray[np.float64]) -> bool:
    """Fill `out` (n, width) the fast way; False: the block has a flaw, or is one for the other way."""
    wanted = [k for k, numeric in enumerate(dialect.numeric) if numeric]
    if dialect.delimiter == dialect.decimal:
        return False
    if len(wanted) < dialect.width:
        # The parser does not look at the columns it leaves out, so count them here.
        if dialect.delimiter == " " or any('"' in text for text in block):
            return False
        if {text.count(dialect.delimiter) for text in block} != {dialect.width - 1}:
            return False
        if dialect.empty and not all(text.rstrip(" ").endswith(dialect.delimiter) for text in block):
            return False
    if dialect.decimal == ",":
        # A point here would be a mark between thousands, or another decimal mark.
        if any("." in text for text in block):
            return False
        block = [text.replace(",", ".") for text in block]
    delimiter = None if dialect.delimiter == " " else dialect.delimiter
    usecols = wanted if len(wanted) < dialect.width else None
    try:
        values = np.loadtxt(block, delimiter=delimiter, comments=None, ndmin=2, dtype=np.float64, usecols=usecols)
    except ValueError:
        return False
    if values.shape != (len(block), len(wanted)):
        return False
    out[:, wanted] = values
    return True


def _careful(
    path: str,
    numbers: Sequence[int],
    block: Sequence[str],
    dialect: Dialect,
    trailing: bool,
    out: NDArray[np.float64],
) -> _Bad:
    """Fill `out` (n, width) cell by cell; the first cell of each column that is no number, as (row, text)."""
    rows = [split(text, dialect.delimiter) for text in block]
    for number, text, row in zip(numbers, block, rows, strict=True):
        if len(row) != dialect.width or (trailing and row[-1]):
            found, usual = len(row) - (trailing and not row[-1]), dialect.width - trailing
            raise ReadError(
                f"{path}, line {number}: {found} fields where the other lines have {usual}: {text[:60]!r}; "
                f"correct or remove this line (a damaged row or a footer?)"
                f"{_comma_hint(dialect, found - usual)}"
            )
    bad: _Bad = {}
    for k in range(dialect.width):
        cells = [parse_number(row[k], dialect.decimal) for row in rows]
        missing = next((index for index, cell in enumerate(cells) if cell is None), None)
        if missing is not None:
            bad[k] = (missing, rows[missing][k])
        out[:, k] = [np.nan if cell is None else cell for cell in cells]
    return bad


def _comma_hint(dialect: Dialect, surplus: int) -> str:
    if dialect.delimiter == "," and surplus > 0:
        return "; if the log has decimal commas, export it with ';' between columns"
    return ""
