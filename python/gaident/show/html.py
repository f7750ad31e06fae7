"""Numbers, tables and pictures as HTML: small pure functions. Text is escaped unless it is `Html` already."""

from __future__ import annotations

import base64
import html
import math
import re
from collections.abc import Iterable, Sequence

__all__ = ["Cell", "Html", "Row", "figure", "joined", "number", "png_uri", "safe", "table", "tag", "typeset"]


class Html(str):
    """Text that is HTML. Only the functions here make it, so that nothing from a file gets into a page unescaped."""

    __slots__ = ()


Cell = str | float | int | complex | None
Row = Sequence[Cell]

VOID = ("img", "input", "meta", "link", "br")

# Of text that is escaped already: 1e-04, +-, m^2, a minus before a digit.
_TYPESET = (
    (re.compile(r"(?<=[\d)])e\+?(-?)0*(\d+)\b"), r"&times;10<sup>\1\2</sup>"),
    (re.compile(r"\+-"), "&plusmn;"),
    (re.compile(r"\^(-?\d+(?:/\d+)?)"), r"<sup>\1</sup>"),
    (re.compile(r"(?<![\w.)\]-])-(?=\d)"), "&minus;"),
)


def safe(text: str) -> Html:
    """Escaped, unless it is HTML already."""
    return text if isinstance(text, Html) else Html(html.escape(text))


def joined(parts: Iterable[str], between: str = "") -> Html:
    """One after the other, each made safe."""
    return Html(safe(between).join(map(safe, parts)))


def tag(element: str, *inside: str, **attributes: str | None) -> Html:
    """An element; attributes: class_ is class, data_x is data-x, None leaves one out, "" has no value."""
    words = "".join(
        f" {key.rstrip('_').replace('_', '-')}" + (f'="{html.escape(value)}"' if value else "")
        for key, value in attributes.items()
        if value is not None
    )
    return Html(f"<{element}{words}>" if element in VOID else f"<{element}{words}>{joined(inside)}</{element}>")


def typeset(text: str) -> Html:
    """Plain text with numbers and units as they are set: 1.2e-04 N m s^2 +- 3 gets its powers, minus and plus-minus signs."""
    done: str = safe(text)
    for pattern, better in _TYPESET:
        done = pattern.sub(better, done)
    return Html(done)


def number(value: float, digits: int = 4) -> Html:  # no decision: printed: a number
    """A number of so many digits, fixed where that is short, else m x 10^e."""
    if not math.isfinite(value):
        return Html("&ndash;" if math.isnan(value) else "&infin;")
    if value == 0.0:
        return Html("0")
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    # no decision: printed: a number
    text = f"{value:.{max(digits - 1 - power, 0)}f}" if -3 < power < 6 else f"{mantissa}&times;10<sup>{power}</sup>"
    return Html(text.replace("-", "&minus;"))


def filled_table(columns: Sequence[str], rows: Sequence[Row]) -> Html:
    """A table of one block without the columns in which no row has anything."""
    kept = [k for k in range(len(columns)) if any(row[k] not in ("", None) for row in rows)]
    return table([columns[k] for k in kept], [[tuple(row[k] for k in kept) for row in rows]])


def table(
    columns: Sequence[str], blocks: Sequence[Sequence[Row]], groups: Sequence[tuple[str, int]] = (), left: Sequence[int] = ()
) -> Html:
    """A table of blocks of rows with a line between the blocks.

    Text is escaped, numbers are formatted, None is a dash. groups: (title, number of columns) above the header.
    left: columns set to the left whatever the page's style says, as a notebook has one of its own.
    """
    sides = [' style="text-align:left"' if k in left else "" for k in range(len(columns))]
    above = "".join(f'<th colspan="{span}">{html.escape(title)}</th>' for title, span in groups)
    head = f'<tr class="groups">{above}</tr>' if groups else ""
    head += "<tr>" + "".join(f"<th{side}>{safe(name)}</th>" for name, side in zip(columns, sides, strict=True)) + "</tr>"
    lines = []
    for i, block in enumerate(blocks):
        for j, row in enumerate(block):
            mark = ' class="new"' if i > 0 and j == 0 else ""
            lines.append(
                f"<tr{mark}>"
                + "".join(f"<td{side}>{_cell(value)}</td>" for value, side in zip(row, sides, strict=True))
                + "</tr>"
            )
    body = "\n".join(lines)
    return Html(f'<div class="scroll"><table><thead>{head}</thead><tbody>\n{body}\n</tbody></table></div>')


def figure(png: bytes, caption: str) -> Html:
    """A picture in the page itself."""
    text = html.escape(caption)
    image = f'<img alt="{text}" src="{png_uri(png)}">'
    return Html(f"<figure>{image}<figcaption>{text}</figcaption></figure>")


def png_uri(png: bytes) -> str:
    """The picture as an address of its own."""
    return f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"


def _cell(value: Cell) -> Html:
    if value is None:
        return Html("&ndash;")
    if isinstance(value, str):
        return safe(value)
    if isinstance(value, int):
        return Html(str(value))
    if isinstance(value, complex):
        if value.imag == 0.0:
            return number(value.real)
        return Html(f"{number(value.real)}&nbsp;&plusmn;&nbsp;{number(abs(value.imag))}i")
    return number(float(value))
