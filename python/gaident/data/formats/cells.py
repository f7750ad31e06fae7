"""The rows of a text table to numbers: fast where a block is clean, cell by cell where it is not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.dialect import Dialect, parse_number, split
from gaident.errors import ReadError

__all__ = ["ROWS", "numbers_of"]

ROWS = 8192  # no decision: memory; lines read at once
"""Lines of a text that are parsed at once."""

_Bad = dict[int, tuple[int, str]]


def numbers_of(
    path: str, numbers: Sequence[int], body: Sequence[str], dialect: Dialect, trailing: bool
) -> tuple[NDArray[np.float64], _Bad]:
    """Values (n, width), NaN where no number stands, and per column the first such cell as (row, text).

    Block by block: numpy's own parser is fast but says little of a flaw, so a block that it refuses is
    read again cell by cell.
    """
    values = np.full((len(body), dialect.width), np.nan)
    bad: _Bad = {}
    for start in range(0, len(body), ROWS):
        block = body[start : start + ROWS]
        if not _clean(block, dialect, values[start : start + ROWS]):
            found = _careful(
                path,
                numbers[start : start + ROWS],
                block,
                dialect,
                trailing,
                values[start : start + ROWS],
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
    if dialect.ragged:
        counts = {text.count(dialect.delimiter) for text in block}
        wanted = wanted[: max(counts) + 1] if len(counts) == 1 else []
        if not wanted:
            return False
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
    if dialect.ragged:
        rows = [row + [""] * (dialect.width - len(row)) for row in rows]
    for number, text, row in zip(numbers, block, rows, strict=True):
        if len(row) != dialect.width or (trailing and row[-1]):
            found, usual = len(row) - (trailing and not row[-1]), dialect.width - trailing
            raise ReadError(
                # no decision: printed: of a line in a message
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
