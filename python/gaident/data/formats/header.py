"""Names and units of the columns of a text table, from the lines above its numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from gaident.data.formats.dialect import Dialect, parse_number, split
from gaident.data.formats.text import Line
from gaident.data.formats.time_names import NO_NAME
from gaident.data.formats.unit_names import name_and_unit
from gaident.data.formats.units import is_any_unit, is_unit

__all__ = ["COMMENT", "Header", "Heading", "find_header"]

COMMENT = re.compile(r"\s*(#|//|%)")
"""How a comment line starts."""

_BRACKETS = re.compile(r"(.*\S)\s*[\[(<{]([^\])>}]+)[\])>}]")
_NOTED = re.compile(r"(.*\S)\s*\[([^\]]+)\]\s*\S.*")  # n_ist [1/min] (smoothed)
_AFTER = re.compile(r"(.*\S)\s+(?:/|in)\s+(\S.*)")
_PER = re.compile(r"([^/]*[^\s/])/([^\s/].*)")  # PosAct/mm, a quantity over its unit as ISO 80000-1 writes axes of figures
LONGEST_TITLE = 1000  # no decision: a format: characters; a longer title is no name with a unit
_ENCLOSED = re.compile(r"[\[(<{](.*)[\])>}]")


@dataclass(frozen=True)
class Heading:
    """One column's key (unique), other names and unit; key of its time column and its sample time [s], where stated."""

    key: str
    names: tuple[str, ...] = ()
    unit: str | None = None
    clock: str | None = None
    period: float | None = None


@dataclass(frozen=True)
class Header:
    """headings: one per column; start: position, among the lines given, of the first row of numbers.

    unused: names in the line above the numbers, where they are more or fewer than the columns and so name none; 0: none.
    """

    headings: tuple[Heading, ...]
    start: int
    unused: int = 0


def find_header(lines: Sequence[Line], comments: Sequence[Line], dialect: Dialect) -> Header:
    """Look above the numbers for a row of names, a row of units below it and a second row of names above it.

    lines     lines that are neither empty nor comments; comments: the comment lines above or among them
    The names are the last row above the numbers that has one cell per column, no number, and is not all
    units.
    """
    start = _first_data(lines, dialect)
    rows = [(index, cells) for index, (_, text) in enumerate(lines[:start]) if (cells := _cells(text, dialect))]
    below = None
    if len(rows) >= 2 and _is_unit_row(rows[-1][1], rows[-2][1]):
        below = rows.pop()[1]
    names_at = next((k for k in reversed(range(len(rows))) if not _has_number(rows[k][1], dialect)), None)
    if names_at is None:
        in_comments = [cells for _, text in comments if (cells := _cells(COMMENT.sub("", text, count=1), dialect))]
        units = in_comments.pop() if len(in_comments) >= 2 and _is_unit_row(in_comments[-1], in_comments[-2]) else below
        named = in_comments[-1] if in_comments and not _has_number(in_comments[-1], dialect) else None
        unused = 0 if named else _unused(lines[:start], dialect)
        return Header(_headings(named or [""] * dialect.width, None, units), start, unused)
    index, names = rows[names_at]
    above = rows[names_at - 1][1] if names_at and rows[names_at - 1][0] == index - 1 else None
    if above is not None and _has_number(above, dialect):
        above = None
    # A damaged first row of numbers must not pass as one more line of text below the names.
    for later in range(index + 1, start):
        cells = split(lines[later][1], dialect.delimiter)
        if any(parse_number(cell, dialect.decimal) is not None for cell in cells) and cells != below:
            start = later
            break
    return Header(_headings(names, above, below), start)


def _unused(above: Sequence[Line], dialect: Dialect) -> int:
    """How many names the last line above the numbers contains; 0 where it is no line of names."""
    cells = split(above[-1][1], dialect.delimiter) if above else []
    return len(cells) if len(cells) > 1 and all(cells) and not _has_number(cells, dialect) else 0


def _first_data(lines: Sequence[Line], dialect: Dialect) -> int:
    """Position of the first line whose columns of numbers contain numbers, at least one, or nothing."""
    for index, (_, text) in enumerate(lines):
        cells = split(text, dialect.delimiter)
        if len(cells) != dialect.width:
            continue
        used = [cell for cell, numeric in zip(cells, dialect.numeric, strict=True) if numeric and cell]
        if used and all(parse_number(cell, dialect.decimal) is not None for cell in used):
            return _backwards(lines, index, dialect)
    return len(lines)


def _backwards(lines: Sequence[Line], index: int, dialect: Dialect) -> int:
    """Rows just above that are mostly numbers are damaged rows of the table, not part of its header."""
    while index > 0:
        cells = split(lines[index - 1][1], dialect.delimiter)
        good = sum(parse_number(cell, dialect.decimal) is not None for cell in cells)
        if len(cells) != dialect.width or 2 * good <= sum(map(bool, cells)):
            break
        index -= 1
    return index


def _cells(text: str, dialect: Dialect) -> list[str] | None:
    """Cells of a header line if it has one per column (trailing empty ones may be missing), else None."""
    delimiters = [dialect.delimiter, "\t", ";", ","] if dialect.delimiter == " " else [dialect.delimiter]
    for delimiter in delimiters:
        cells = split(text, delimiter)
        candidates = [cells, _join_units(cells)]
        if dialect.delimiter == " ":
            candidates.append([cell.strip() for cell in re.split(r"\s{2,}|\t", text.strip())])
        for candidate in candidates:
            while len(candidate) > dialect.width and not candidate[-1]:
                candidate = candidate[:-1]
            if len(candidate) == dialect.width and any(candidate):
                return candidate
            # Where rows end with a separator, the line of names may do without.
            if dialect.empty and len(candidate) == dialect.width - 1 and all(candidate):
                return [*candidate, ""]
    return None


def _join_units(cells: list[str]) -> list[str]:
    """`t [s] w [1 / min]` split at blanks: put each unit back to its name."""
    joined: list[str] = []
    for cell in cells:
        within = bool(joined) and any(joined[-1].count(a) > joined[-1].count(b) for a, b in ("[]", "()"))
        if joined and (within or cell.startswith(("[", "("))):
            joined[-1] += f" {cell}"
        else:
            joined.append(cell)
    return joined


def _has_number(cells: list[str], dialect: Dialect) -> bool:
    return any(parse_number(cell, dialect.decimal) is not None for cell in cells)


def _is_unit_row(cells: list[str], above: list[str]) -> bool:
    """Every cell is a unit below something that is none; the first, of a time, may stand below no name (EPOS Studio)."""
    filled = [(cell, over) for cell, over in zip(cells, above, strict=True) if cell]
    if filled and not above[0] and is_unit(cells[0], "time"):
        filled = filled[1:]
    if not filled or not all(over for _, over in filled) or all(is_unit(over) for _, over in filled):
        return False
    return all(is_any_unit(cell) or _ENCLOSED.fullmatch(cell) for cell, _ in filled)


def _headings(names: list[str], above: list[str] | None, below: list[str] | None) -> tuple[Heading, ...]:
    found = []
    for k, cell in enumerate(names):
        over = above[k] if above is not None else ""
        unit = _bare_unit(below[k]) if below is not None else None
        # One cell of the row of names may be the unit of a name above it: `Time` over `ms`.
        if over and is_unit(cell) and not is_unit(over):
            cell, over, unit = over, "", unit or _bare_unit(cell)
        if k == 0 and not cell and unit is not None and is_unit(unit, "time"):
            cell = NO_NAME
        name, inline = _split_unit(cell)
        others = {name, over, _split_unit(over)[0]} - {"", cell}
        found.append(Heading(cell, tuple(sorted(others)), unit or inline))
    return _unique(found)


def _unique(headings: list[Heading]) -> tuple[Heading, ...]:
    """Give columns without a name, or with one that others have too, a key of their own that ends in #k."""
    counts = Counter(heading.key for heading in headings)
    return tuple(
        heading
        if heading.key and counts[heading.key] == 1
        else Heading(f"{heading.key} #{k}".strip(), (*filter(None, [heading.key]), *heading.names), heading.unit)
        for k, heading in enumerate(headings)
    )


def _bare_unit(cell: str) -> str | None:
    """`[rpm]`, `rpm` -> rpm; a label or a dash -> None."""
    enclosed = _ENCLOSED.fullmatch(cell)
    bare = enclosed[1].strip() if enclosed else cell
    return None if bare.casefold() in ("", "-", "--", "1", "unit", "units", "none", "n/a") else bare


def _split_unit(cell: str) -> tuple[str, str | None]:
    """`w [rpm]`, `w (rpm)`, `w / rpm`, `n in rpm`, `w/rpm` -> (w, rpm).

    Square brackets always contain a unit, unless a number (`w[0]`); what else is enclosed counts if it is a
    known unit. Of the others `name_and_unit` knows those that end a name: speed_rpm.
    """
    if len(cell) > LONGEST_TITLE:
        return cell, None
    for pattern in (_BRACKETS, _NOTED, _AFTER):
        match = pattern.fullmatch(cell)
        if match is None:
            continue
        name, unit = match[1].strip(), match[2].strip()
        square = pattern is _BRACKETS and cell.endswith("]") and not unit.lstrip("+-").isdigit()
        if is_any_unit(unit) or square:
            return name, _bare_unit(unit)
    found, over = name_and_unit(cell), _PER.fullmatch(cell)
    if found is None and over is not None and is_any_unit(over[2].strip()):
        return over[1].strip(), _bare_unit(over[2].strip())
    return found or (cell, None)
