"""Docstrings as this project writes them, for mkdocs: a list of names with their meanings, aligned in columns, becomes a list.

gain    real, not 0
poles   roots of the denominator [rad/s],
        complex ones in pairs
"""

from __future__ import annotations

import re
from typing import Any

import griffe

NAMES = re.compile(r"[A-Za-z_]\w*(, ?[A-Za-z_]\w*)*")
COLUMN = re.compile(r"^\S+(?:, \S+)* {2,}(?=\S)")


def listed(text: str) -> str:
    """The text with aligned lists as Markdown lists."""
    paragraphs = re.split(r"\n(?:[ \t]*\n)+", text)
    return "\n\n".join(_listed(paragraph.split("\n")) for paragraph in paragraphs)


def _listed(lines: list[str]) -> str:
    columns = {len(found[0]) for line in lines if (found := COLUMN.match(line))}
    if len(columns) != 1:
        return "\n".join(lines)
    (column,) = columns
    out = []
    for line in lines:
        name, meaning = line[:column].strip(), line[column:].strip()
        aligned = len(line) > column and line[column - 1] == " " and (not name or line[column] != " ")
        if not aligned or (name and not NAMES.fullmatch(name)):
            return "\n".join(lines)
        out.append(f"- `{name}`: {meaning}" if name else f"  {meaning}")
    return "\n".join(out)


class Lists(griffe.Extension):
    """Applied to every docstring that is read."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Called for each object."""
        if obj.docstring is not None:
            obj.docstring.value = listed(obj.docstring.value)
