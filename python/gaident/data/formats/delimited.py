"""Reader for text tables: CSV, TSV, TXT and what else logs are called, whole or block by block."""

from __future__ import annotations

import codecs
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gaident.arguments import arg
from gaident.data.formats.cells import ROWS, numbers_of
from gaident.data.formats.dialect import Dialect, detect
from gaident.data.formats.exports import END_MARK, refined, scope_layout
from gaident.data.formats.faults import Thousands, cut_unseen, refuse_cut_line
from gaident.data.formats.header import COMMENT, Header, find_header
from gaident.data.formats.table import Column, LogTable, first_line
from gaident.data.formats.text import Line, check_text, encoding_of, lines_of
from gaident.errors import ReadError

__all__ = ["WHOLE", "TextOptions", "open_text"]

WHOLE = 1 << 25  # no decision: memory; bytes
"""Bytes of a text that is kept in memory as it is; longer ones are read block by block."""

_HEAD = 1 << 18  # no decision: memory; bytes
_CHARACTER = 4  # no decision: a format: bytes of the widest character
_MAY_BE_CUT = (
    "The file's last line has no line end, so that its last number may be cut, which numbers of this form do not show: compare "
    "it with the drive's, or leave the line out."
)
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
                    f"{arg('delimiter', repr(self.delimiter))} cannot stand between columns; give ',', ';', 'tab', 'space' or '|'"
                )
        if self.decimal is not None and (not isinstance(self.decimal, str) or self.decimal not in (".", ",")):
            raise ReadError(f"{arg('decimal', repr(self.decimal))} is no decimal mark; give '.' or ','")
        if self.skip is not None and (isinstance(self.skip, bool) or not isinstance(self.skip, int) or self.skip < 0):
            raise ReadError(f"{arg('skip', repr(self.skip))} is no number of lines; give a whole number from 0")
        if self.encoding is not None and not isinstance(self.encoding, str):
            raise ReadError(f"{arg('encoding', repr(self.encoding))} is no text; give for example 'utf-8' or 'latin-1'")
        return TextOptions(delimiter, self.decimal, self.skip, self.encoding)


@dataclass(frozen=True)
class _Layout:
    """What is known of a table before its numbers are read; start: number of the line where they begin."""

    dialect: Dialect
    header: Header
    start: int

    @property
    def trailing(self) -> bool:
        """Lines that end with a separator have a last column of nothing."""
        return self.dialect.empty and self.header.headings[-1].key == f"#{self.dialect.width - 1}"

    def table(self, path: str, numbers: Sequence[int], body: Sequence[str]) -> LogTable:
        """The columns of these rows; `numbers`: their line numbers."""
        values, bad = numbers_of(path, numbers, body, self.dialect, self.trailing)
        headings = self.header.headings[: self.dialect.width - self.trailing]
        columns = [Column(h.key, values[:, k], h.names, h.unit, bad.get(k), h.clock, h.period) for k, h in enumerate(headings)]
        if self.dialect.ragged:
            columns = _without_tail(columns)
        cells = self.dialect.width - self.trailing
        unused = f"the header has {self.header.unused} names, the rows have {cells} cells" if self.header.unused else ""
        return LogTable(path, tuple(columns), lines=numbers, form="text", remark=unused)


def open_text(path: str, file: Path, options: TextOptions) -> LogTable:
    """The table in a text file, whatever its dialect; a long one is read when its blocks are asked for.

    Raises ReadError with the line and the remedy.
    """
    options = options.check()
    if os.path.getsize(file) <= WHOLE:
        everything = lines_of(path, file.read_bytes(), options.encoding)
        layout, lines = _layout(path, everything, options)
        numbers, body = zip(*lines, strict=True)
        Thousands(path, layout.dialect, options.decimal is not None).push(numbers, body)
        if everything[-1]:
            refuse_cut_line(path, numbers, body, layout.dialect)
        table = layout.table(path, numbers, body)
        if everything[-1] and not layout.trailing and cut_unseen(body, layout.dialect):
            table = replace(table, columns=(*table.columns[:-1], replace(table.columns[-1], note=_MAY_BE_CUT)))
        return table
    with open(file, "rb") as stream:
        head = stream.read(_HEAD)
    encoding = encoding_of(head[: head.rfind(b"\n") + 1] or head, options.encoding)
    text = codecs.getincrementaldecoder(encoding)(errors="replace").decode(head)
    layout, lines = _layout(path, text.replace("\r\n", "\n").replace("\r", "\n").split("\n")[:-1], options)
    sample = layout.table(path, *zip(*lines[:1], strict=True))

    def batches(columns: Sequence[Column]) -> Iterator[LogTable]:
        keys = {column.key for column in columns}
        thousands = Thousands(path, layout.dialect, options.decimal is not None)
        before: list[str] = []
        for numbers, body, ended in _blocks(path, file, encoding, layout.start):
            thousands.push(numbers, body)
            if not ended:
                refuse_cut_line(path, numbers, [*before, *body], layout.dialect)
            before = body
            block = layout.table(path, numbers, body)
            yield replace(block, columns=tuple(column for column in block.columns if column.key in keys))

    empty = [replace(column, values=column.whole()[:0], bad=None) for column in sample.columns]
    end = _end(file, encoding)
    if end and not layout.trailing and cut_unseen(end, layout.dialect):
        empty[-1] = replace(empty[-1], note=_MAY_BE_CUT)
    return replace(sample, columns=tuple(empty), lines=None, batches=batches)


def _end(file: Path, encoding: str) -> list[str]:
    """The last lines of a long file whose last line has no line end; none where it has one."""
    with open(file, "rb") as stream:
        # At a whole character, of those that have one width.
        stream.seek(max(0, os.path.getsize(file) // _CHARACTER * _CHARACTER - _HEAD))
        raw = stream.read()
    plain = {"utf-16": "utf-16-le", "utf-32": "utf-32-le"}.get(encoding, encoding)
    text = raw.decode(plain, errors="replace").rstrip("\x1a").replace("\r\n", "\n").replace("\r", "\n")
    return [] if text.endswith("\n") else text.split("\n")[1:]


def _without_tail(columns: Sequence[Column]) -> list[Column]:
    """The columns of slower channels end where their time column does; the rows go on for the others."""
    filled = {column.key: np.flatnonzero(np.isfinite(column.whole())) for column in columns}
    ends = {key: int(rows[-1]) + 1 if rows.size else 0 for key, rows in filled.items()}
    found = []
    for column in columns:
        end = ends[column.clock or column.key]
        bad = None if column.bad is None or column.bad[0] >= end else column.bad
        found.append(replace(column, values=column.whole()[:end], bad=bad))
    return found


def _layout(path: str, everything: Sequence[str], options: TextOptions) -> tuple[_Layout, list[Line]]:
    """How the table is written, and the lines of its numbers among those given."""
    skip = options.skip or 0
    lines = list(_filled(enumerate(everything[skip:], skip + 1)))
    comments = [line for line in lines if COMMENT.match(line[1])]
    if comments:
        lines = [line for line in lines if not COMMENT.match(line[1])]
    if not lines:
        raise ReadError(
            f"{path}: no line is left after {arg('skip', repr(skip))} and comments; give a smaller {arg('skip')}, or a "
            "log with data"
        )
    scope = scope_layout(lines) if options.delimiter is None and options.decimal is None else None
    if scope is not None:
        dialect, header = scope
    else:
        dialect = detect(path, lines, options.delimiter, options.decimal)
        header = refined(lines, find_header(lines, comments, dialect), dialect)
    rows = lines[header.start :]
    if not rows:
        raise ReadError(f"{path}: below the header stands no row of numbers; export the log with its data")
    return _Layout(dialect, header, rows[0][0]), rows


def _filled(lines: Iterable[Line]) -> Iterator[Line]:
    """Those that contain something; the mark of the end is nothing."""
    return ((number, text) for number, text in lines if text and not text.isspace() and text != END_MARK)


def _blocks(path: str, file: Path, encoding: str, start: int) -> Iterator[tuple[list[int], list[str], bool]]:
    """(line numbers, lines, whether the last one has a line end) of the rows of numbers, some thousand at a time."""
    with open(file, encoding=encoding, newline=None) as stream:
        numbers: list[int] = []
        body: list[str] = []
        ended = True
        try:
            for number, line in _filled(enumerate(stream, 1)):
                text, ended = line.rstrip("\n"), line.endswith("\n")
                if number < start or text == END_MARK or COMMENT.match(text):
                    continue
                numbers.append(number)
                body.append(text)
                if len(body) == ROWS:
                    check_text(path, body, numbers[0])
                    yield numbers, body, ended
                    numbers, body = [], []
        except UnicodeError as error:
            raise ReadError(
                f"{path}, after line {numbers[-1] if numbers else start}: the text is damaged or no {encoding} "
                f"({first_line(error)}); give its {arg('encoding')}, for example 'latin-1'"
            ) from None
        if body:
            check_text(path, body, numbers[0])
            yield numbers, body, ended
