"""How a text table is written: what separates columns, what marks decimals, which columns are numbers."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gaident.arguments import arg
from gaident.data.formats.text import Line
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["Dialect", "detect", "parse_number", "split"]

# Blanks come last, and stand for any run of white space: between other separators a cell may be empty.
_DELIMITERS = (";", "\t", "|", ",", " ")
_EXPONENT = r"(?:[eEdD][+-]?\d+)?"
_SPECIAL = r"[+-]?(?:nan|inf|infinity)"
_NUMBER = {
    ".": re.compile(rf"[+-]?(?:\d+(?:\.\d*)?|\.\d+){_EXPONENT}|{_SPECIAL}", re.IGNORECASE),
    # A digit must follow the comma, so that the separator in '1, 2' is none.
    ",": re.compile(rf"[+-]?(?:\d+(?:,\d+)?|,\d+){_EXPONENT}|{_SPECIAL}", re.IGNORECASE),
}
LONGEST_NUMBER = 400  # no decision: a format: characters; all digits of a float64 written out are 325
_LEADING_ZERO = re.compile(r"0\d+")


@dataclass(frozen=True)
class Dialect:
    """How a table is written.

    delimiter  between columns; ' ' stands for any run of white space
    decimal    "." or ","
    numeric    whether column k contains numbers
    empty      whether the last column contains nothing at all
    ragged     whether rows may end early, where the columns at the right have no more values
    """

    delimiter: str
    decimal: str
    numeric: tuple[bool, ...]
    empty: bool = False
    ragged: bool = False

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.numeric)


def parse_number(text: str, decimal: str) -> float | None:
    """The number that `text` is, None if it is none."""
    if len(text) > LONGEST_NUMBER or _NUMBER[decimal].fullmatch(text) is None:
        return None
    plain = text.replace(",", ".") if decimal == "," else text
    return float(plain.replace("d", "e").replace("D", "E"))


def split(text: str, delimiter: str) -> list[str]:
    """Cells of a line, without blanks and quotation marks around them."""
    if '"' in text:
        skip = delimiter in " \t"
        blank_run = delimiter == " "
        source = re.sub(r"\s+", " ", text.strip()) if blank_run else text
        try:
            cells = next(csv.reader([source], delimiter=delimiter, skipinitialspace=not skip), [])
        except csv.Error:  # a cell of more than 131 072 characters: no name and no number, whatever its quotation marks are
            cells = source.split(delimiter)
        return [cell.strip() for cell in cells]
    cells = text.split() if delimiter == " " else text.split(delimiter)
    return [cell.strip() for cell in cells]


def detect(path: str, lines: Sequence[Line], delimiter: str | None, decimal: str | None) -> Dialect:
    """The dialect in which most of the file's second half is a table of numbers.

    lines      the lines that are neither empty nor comments
    delimiter  as the user says, or None; decimal likewise
    """
    half = lines[len(lines) // 2 :]
    sample = [text for _, text in half[:: max(1, len(half) // POLICY.sampled_lines)]]
    best: Dialect | None = None
    best_score = (0.0, 0.0, 0.0)
    for mark in _DELIMITERS if delimiter is None else (delimiter,):
        rows = [split(text, mark) for text in sample]
        for point in (".", ",") if decimal is None else (decimal,):
            # An unquoted decimal comma cannot be told from a separating comma.
            if mark == "," and point == "," and not any('"' in text for text in sample):
                continue
            candidate, score = _weigh(rows, mark, point)
            if score > best_score:
                best, best_score = candidate, score
    if best is None:
        line, text = half[0]
        options = f" with {arg('delimiter', repr(delimiter))}, {arg('decimal', repr(decimal))}" if delimiter or decimal else ""
        raise ReadError(
            f"{path}, line {line}: no table of numbers was found{options}, this line reads {_short(text)!r}; "
            f"give {arg('delimiter')} and {arg('decimal')} as the log is written, or export it as a plain table"
        )
    if best.delimiter == "," and best.decimal == "." and (delimiter is None or decimal is None):
        _refuse_two_meanings(path, lines, half, best)
    if decimal is None and best.delimiter != "," and best.decimal == ".":
        best = _look_further(lines, best)
    return best


def _weigh(rows: list[list[str]], delimiter: str, decimal: str) -> tuple[Dialect, tuple[float, float, float]]:
    """A candidate, and (numeric cells, minus text cells, minus those between numbers, each per line): the larger the better."""
    width = Counter(len(row) for row in rows).most_common(1)[0][0]
    # no decision: a format: comma is not the delimiter where another mark is
    others = [mark for mark in _DELIMITERS[:3] if mark != delimiter]
    table = [row for row in rows if len(row) == width]
    pattern = _NUMBER[decimal]
    numeric = []
    numbers = texts = between = 0
    for column in zip(*table, strict=True):
        filled = [cell for cell in column if cell]
        good = sum(len(cell) <= LONGEST_NUMBER and pattern.fullmatch(cell) is not None for cell in filled)
        numeric.append(2 * good > len(filled))
        numbers += good
        texts += len(filled) - good
        between += sum(map(_text_between_numbers, filled)) if not numeric[-1] else 0
        # Text with a separator in it was cut at the wrong one.
        if not numeric[-1] and any(mark in cell for cell in filled for mark in others):
            return Dialect(delimiter, decimal, ()), (0.0, 0.0, 0.0)
    empty = width > 1 and not any(row[-1] for row in table)
    return Dialect(delimiter, decimal, tuple(numeric), empty), (numbers / len(rows), -texts / len(rows), -between / len(rows))


def _text_between_numbers(cell: str) -> bool:
    """`30,0 on 10,5` that is cut at its commas leaves `0 on 10`."""
    words = cell.split()
    return len(words) > 2 and parse_number(words[0], ".") is not None and parse_number(words[-1], ".") is not None


def _look_further(lines: Sequence[Line], found: Dialect) -> Dialect:
    """A sample of whole numbers says nothing of the decimal mark; then the whole file decides."""
    sampled_point = any("." in text for _, text in lines[len(lines) // 2 :])
    if sampled_point:
        return found
    pattern = re.compile(r"(?<![\d,])\d+,\d+(?![\d,])")
    if any(pattern.search(text) for _, text in lines[1:]) and not any(re.search(r"\d\.\d", text) for _, text in lines[1:]):
        return replace(found, decimal=",")
    return found


def _refuse_two_meanings(path: str, lines: Sequence[Line], half: Sequence[Line], found: Dialect) -> None:
    """`0,001,1,5`: is that four whole numbers or two with decimal commas? Then only the user knows."""
    rows = [(number, split(text, ",")) for number, text in half[:: max(1, len(half) // POLICY.sampled_lines)]]
    whole = [(number, row) for number, row in rows if all(cell.lstrip("+-").isdigit() for cell in row)]
    if len(whole) < POLICY.whole_rows * len(rows) or all(text.count('"') >= 2 * found.width for _, text in half):
        return  # in quotation marks, a comma is what it is
    names = next((split(text, ",") for _, text in reversed(lines[: len(lines) // 2]) if not _digits_only(text)), [])
    suspicious = [number for number, row in whole if any(_LEADING_ZERO.fullmatch(cell) for cell in row[1:])]
    other_widths = [number for number, row in whole if len(row) != found.width]
    half_named = len([name for name in names if name]) * 2 == found.width
    if not suspicious and not half_named and len(other_widths) < POLICY.odd_rows * len(whole):
        return
    number = (suspicious or other_widths or [whole[0][0]])[0]
    text = next(text for n, text in half if n == number)
    raise ReadError(
        f"{path}, line {number}: commas stand between the columns and, it seems, inside the numbers too: "
        f"{_short(text)!r}; export the log with ';' between columns or with decimal points; if these are "
        "whole numbers, "
        f"give {arg('delimiter', repr(','))} and {arg('decimal', repr('.'))}, if it is one column with decimal "
        f"commas, {arg('delimiter', repr(';'))} and "
        f"{arg('decimal', repr(','))}"
    )


def _digits_only(text: str) -> bool:
    return not any(character.isalpha() for character in text)


def _short(text: str) -> str:
    return text if len(text) <= 60 else text[:57] + "..."  # no decision: printed: of a line in a message
