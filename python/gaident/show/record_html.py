"""A Record as a notebook shows it: a short table with a small picture of each channel. Pure function of the record."""

from __future__ import annotations

from html import escape

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED

__all__ = ["record_html", "sparkline"]

_WIDTH, _HEIGHT = 240, 28
_CELL = 'style="text-align:right"'
_UNITS = {"command": "rad/s", "velocity": "rad/s", "torque": "N m", "position": "rad", "position_command": "rad"}
"""A channel of the load has any unit, which a record does not know."""


def record_html(rec: Record) -> str:
    """name, samples, dt, duration, and per channel unit, range, mean and a small chart; no script, everything escaped."""
    name = f"<b>{escape(rec.name)}</b> " if rec.name else ""
    head = f"<div>{name}Record, {len(rec)} samples, dt {rec.dt:.6g} s, {rec.duration:.4g} s</div>"
    kind = {"torque": " (measured)"} if rec.torque_is == MEASURED else {}
    rows = "".join(
        f"<tr><td>{key}{kind.get(key, '')}</td><td>{_UNITS.get(key, '')}</td>"
        + "".join(f"<td {_CELL}>{_number(value)}</td>" for value in (values.min(), values.max(), values.mean()))
        + f"<td>{sparkline(values)}</td></tr>"
        for key, values in rec.channels()
    )
    titles = "".join(f"<th {_CELL}>{title}</th>" for title in ("lowest", "highest", "mean"))
    body = f"<tbody>{rows}</tbody></table><div><small>on a linear axis m/s, N, m</small></div>"
    return f"{head}<table><thead><tr><th></th><th></th>{titles}<th></th></tr></thead>{body}"


def _number(value: float) -> str:
    return f"{value + 0.0:.4g}".replace("-", "&minus;")  # no -0


def sparkline(values: NDArray[np.float64]) -> str:
    """An inline SVG over time: lowest and highest of each column of pixels, so that no peak is lost."""
    columns = min(_WIDTH, len(values))
    edges = np.linspace(0, len(values), columns + 1).astype(int)
    low = np.minimum.reduceat(values, edges[:-1])
    high = np.maximum.reduceat(values, edges[:-1])
    bottom, top = float(low.min()), float(high.max())
    # Halved, for a range as wide as float64 itself.
    spread = 0.5 * top - 0.5 * bottom or 1.0

    def height(v: NDArray[np.float64]) -> NDArray[np.float64]:
        return 1.0 + (_HEIGHT - 2.0) * (1.0 - (0.5 * v - 0.5 * bottom) / spread)

    x = np.arange(columns) * (_WIDTH / max(1, columns - 1))
    upper = [f"{a:.1f},{b:.1f}" for a, b in zip(x, height(high), strict=True)]
    lower = [f"{a:.1f},{b:.1f}" for a, b in zip(x[::-1], height(low)[::-1], strict=True)]
    return (
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="values over time">'
        f'<polygon points="{" ".join(upper + lower)}" fill="currentColor" stroke="currentColor" stroke-width="1"/></svg>'
    )
