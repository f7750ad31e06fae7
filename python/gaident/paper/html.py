"""Numbers, tables and pictures as HTML: small pure functions, text escaped."""

from __future__ import annotations

import base64
import html
import math
from collections.abc import Sequence

__all__ = ["Cell", "figure", "number", "table"]

Cell = str | float | int | complex | None
Row = Sequence[Cell]


def number(value: float, digits: int = 4) -> str:
    """A number of so many digits, fixed where that is short, else m x 10^e."""
    if not math.isfinite(value):
        return "&ndash;" if math.isnan(value) else "&infin;"
    if value == 0.0:
        return "0"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    power = int(exponent)
    text = f"{value:.{max(digits - 1 - power, 0)}f}" if -3 < power < 6 else f"{mantissa}&times;10<sup>{power}</sup>"
    return text.replace("-", "&minus;")


def table(columns: Sequence[str], blocks: Sequence[Sequence[Row]], groups: Sequence[tuple[str, int]] = ()) -> str:
    """A table of blocks of rows with a line between the blocks.

    Text is escaped, numbers are formatted, None is a dash. groups: (title, number of columns) above the header.
    """
    above = "".join(f'<th colspan="{span}">{html.escape(title)}</th>' for title, span in groups)
    head = f'<tr class="groups">{above}</tr>' if groups else ""
    head += "<tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in columns) + "</tr>"
    lines = []
    for i, block in enumerate(blocks):
        for j, row in enumerate(block):
            mark = ' class="new"' if i > 0 and j == 0 else ""
            lines.append(f"<tr{mark}>" + "".join(f"<td>{_cell(value)}</td>" for value in row) + "</tr>")
    body = "\n".join(lines)
    return f'<div class="scroll"><table><thead>{head}</thead><tbody>\n{body}\n</tbody></table></div>'


def figure(png: bytes, caption: str) -> str:
    """A picture in the page itself."""
    data, text = base64.b64encode(png).decode("ascii"), html.escape(caption)
    image = f'<img alt="{text}" src="data:image/png;base64,{data}">'
    return f"<figure>{image}<figcaption>{text}</figcaption></figure>"


def _cell(value: Cell) -> str:
    if value is None:
        return "&ndash;"
    if isinstance(value, str):
        return html.escape(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, complex):
        if value.imag == 0.0:
            return number(value.real)
        return f"{number(value.real)}&nbsp;&plusmn;&nbsp;{number(abs(value.imag))}i"
    return number(float(value))
