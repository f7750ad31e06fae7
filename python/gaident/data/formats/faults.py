"""What a text table shows of faults in how it was written: marks between thousands, a last line that is cut within a number."""

from __future__ import annotations

import re
from collections.abc import Sequence

from gaident.arguments import arg
from gaident.data.formats.dialect import Dialect, parse_number, split
from gaident.errors import ReadError

__all__ = ["Thousands", "cut_unseen", "refuse_cut_line"]

_SHORT = re.compile(r"[+-]?\d{1,3}")
_GROUPS = {mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(?:{re.escape(mark)}\d{{3}})+") for mark in ".,"}


class Thousands:
    """Looks for whole numbers whose thousands are marked, `1,000` or `1.000`, which would be read as 1.

    Where one cell of the table can only have decimals (0.5, 12.25, 1e-3), so have the others: the mark is that of decimals.
    Where none does, and a column has numbers of three digits at most beside such with a mark before three digits (900, 1,000),
    the mark separates thousands, or nobody knows. In quotation marks between commas nobody knows either.
    """

    def __init__(self, path: str, dialect: Dialect, known: bool) -> None:
        """known: whether the user says what the decimal mark is."""
        self.path, self.dialect, self.known = path, dialect, known
        self.marked: dict[int, tuple[int, str]] = {}
        self.short: set[int] = set()
        self.long: set[int] = set()

    def push(self, numbers: Sequence[int], body: Sequence[str]) -> None:
        """The next lines, numbers: theirs in the file. Raises ReadError where a mark has two meanings."""
        mark = self.dialect.decimal
        if not self.known and (self.marked or mark == self.dialect.delimiter or any(mark in text for text in body)):
            self._look(numbers, body)
        elif not self.known:
            self._look(numbers[:1], body[:1])
        if self.known:
            return
        for k, (number, cell) in self.marked.items():
            if k not in self.long and (k in self.short or self.dialect.delimiter == mark):
                raise ReadError.at(
                    f"{self.path}, line {number}",
                    f"{cell!r} may be a number with decimals or one with a mark between its thousands",
                    f"export the log without marks between thousands; if these are decimals, give {arg('decimal', repr(mark))}",
                )

    def _look(self, numbers: Sequence[int], body: Sequence[str]) -> None:
        mark, groups = self.dialect.decimal, _GROUPS[self.dialect.decimal]
        wanted = [k for k, numeric in enumerate(self.dialect.numeric) if numeric]
        for number, text in zip(numbers, body, strict=True):
            cells = split(text, self.dialect.delimiter)
            for k in wanted:
                cell = cells[k] if k < len(cells) else ""
                if not cell:
                    continue
                if mark not in cell:
                    (self.short if _SHORT.fullmatch(cell) else self.long).add(k)
                elif groups.fullmatch(cell):
                    self.marked.setdefault(k, (number, cell))
                elif parse_number(cell, mark) is not None:
                    self.known = True
                    return


def refuse_cut_line(path: str, numbers: Sequence[int], body: Sequence[str], dialect: Dialect) -> None:
    """Raises ReadError where the last of these lines, which has no line end, is cut within its last number.

    That shows where it ends with the decimal mark, lacks a quotation mark, or has fewer decimals than all other lines.
    Of whole numbers, and of numbers printed with as many digits as they need, it does not show.
    """
    last = _tail(body[-1], dialect)
    others = {_tail(text, dialect) for text in body[:-1]} if last is not None else set()
    mark = dialect.decimal
    at_mark = dialect.numeric[-1] and mark != dialect.delimiter
    at_mark = at_mark and body[-1].endswith(mark) and not any(text.endswith(mark) for text in body[:-1])
    unclosed = body[-1].count('"') % 2 == 1 and not any(text.count('"') % 2 for text in body[:-1])
    if at_mark or unclosed or (last is not None and len(others) == 1 and last < (others.pop() or 0)):
        raise ReadError.at(
            f"{path}, line {numbers[-1]}",
            "the file ends within a number, for its last line has no line end and is shorter than the others",
            "copy the log again, or remove its last line",
        )


def cut_unseen(body: Sequence[str], dialect: Dialect) -> bool:
    """Whether the last of these lines, which has no line end, may be cut within its last number, and nothing shows it.

    That is so of whole numbers, and of numbers printed with as many digits as they need, where others are longer than the last.
    """
    tails = [_tail(text, dialect) for text in body]
    lengths = [len(split(text, dialect.delimiter)[-1]) for text, tail in zip(body, tails, strict=True) if tail is not None]
    found = set(tails) - {None}
    return tails[-1] is not None and (len(found) > 1 or found == {0}) and lengths[-1] < max(lengths)


def _tail(text: str, dialect: Dialect) -> int | None:
    """Characters of a line's last cell behind the decimal mark; None where it is no number, or cells are missing."""
    cells = split(text, dialect.delimiter)
    if len(cells) != dialect.width or parse_number(cells[-1], dialect.decimal) is None:
        return None
    return len(cells[-1].partition(dialect.decimal)[2])
