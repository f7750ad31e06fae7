"""A chart as plotly's figure: plain data for JSON. "@role" stands for a colour that the page fills in, light or dark."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterable

import numpy as np

from gaident.show.chart import Chart, Trace, Vector, bar_width

__all__ = ["figure", "json_of"]

GAP = 0.04  # of the height, between two panels
DIGITS = 6  # significant ones of what is drawn
SYMBOLS = {"means": ("circle", 5), "crosses": ("x-thin-open", 11), "rings": ("circle-open", 11)}


def figure(chart: Chart) -> dict[str, object]:
    """{"data": ..., "layout": ...}; one y axis per panel, all over one x axis."""
    data, shapes, notes = [], [], []
    layout: dict[str, object] = {
        "height": chart.height,
        "margin": {"l": 72, "r": 16, "t": 8, "b": 48},
        "font": {"color": "@ink", "size": 13},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "legend": {"orientation": "h", "x": 0, "xanchor": "left", "y": 1.0, "yanchor": "bottom", "font": {"size": 12}},
        "hovermode": "x unified" if chart.shared else "closest",
        "hoverlabel": {"bgcolor": "@paper", "bordercolor": "@faint", "font": {"color": "@ink"}},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "@faint", "activecolor": "@ink", "orientation": "v"},
        "barmode": "overlay",
    }
    spans = _spans([p.height for p in chart.panels])
    for i, (panel, span) in enumerate(zip(chart.panels, spans, strict=True)):
        end = "" if i == 0 else str(i + 1)
        ticks = _decades([t.y for t in panel.traces]) if panel.log else {"tickvals": list(panel.ticks)} if panel.ticks else {}
        layout[f"yaxis{end}"] = _axis(panel.y, panel.log, panel.limits, domain=span, **ticks)
        data += [trace for t in panel.traces for trace in _traces(t, f"y{end}")]
        for band in panel.bands:
            shown = {"showlegend": True, "name": _text(band.label)} if band.label else {}
            rows = {"y0": band.low, "y1": band.high, "xref": "paper", "x0": 0, "x1": 1, "yref": f"y{end}"}
            shapes.append({"type": "rect", "fillcolor": f"@{band.role}", "opacity": 0.25, "layer": "below", "line": {"width": 0},
                           **rows, **shown})  # fmt: skip
        for mark in panel.marks:
            at = math.log10(mark.x) if chart.log else mark.x
            common = {"text": _text(mark.text), "showarrow": False, "font": {"size": 12, "color": "@ink"}, "x": at}
            if mark.y is None:
                shapes.append({"type": "line", "x0": mark.x, "x1": mark.x, "yref": f"y{end} domain", "y0": 0, "y1": 1,
                               "line": {"color": "@faint", "width": 1, "dash": "dot"}})  # fmt: skip
                if mark.text:
                    notes.append({**common, "yref": f"y{end} domain", "y": 1, "yanchor": "top", "xanchor": "left", "xshift": 3})
            else:
                high = math.log10(mark.y) if panel.log else mark.y
                notes.append({**common, "yref": f"y{end}", "y": high, "yanchor": "bottom"})
    last = "y" if len(chart.panels) == 1 else f"y{len(chart.panels)}"
    ticks = _decades([t.x for p in chart.panels for t in p.traces]) if chart.log else {}
    if chart.ticks:
        ticks = {"tickvals": [x for x, _ in chart.ticks], "ticktext": [_text(name) for _, name in chart.ticks], "zeroline": False}
    layout["xaxis"] = _axis(chart.x, chart.log, chart.limits, anchor=last, **ticks)
    layout["shapes"], layout["annotations"] = shapes, notes
    return {"data": data, "layout": layout}


def json_of(data: object) -> str:
    """JSON without a blank."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


def _spans(heights: Iterable[float]) -> list[list[float]]:
    """Shares of the height from top to bottom, as plotly's domains from 0 at the bottom."""
    rows = list(heights)
    room = (1.0 - GAP * (len(rows) - 1)) / sum(rows)
    spans, top = [], 1.0
    for h in rows:
        spans.append([max(round(top - room * h, 4), 0.0), round(top, 4)])
        top -= room * h + GAP
    return spans


def _axis(title: str, log: bool, limits: tuple[float, float] | None, **more: object) -> dict[str, object]:
    axis = {
        "title": {"text": _text(title), "standoff": 6},
        "type": "log" if log else "linear",
        "gridcolor": "@grid",
        "linecolor": "@faint",
        "zeroline": not log,
        "zerolinecolor": "@faint",
        "zerolinewidth": 1,
        "ticks": "outside",
        "tickcolor": "@faint",
        "ticklen": 4,
        "exponentformat": "power",
        "automargin": True,
        **more,
    }
    if limits is not None:
        axis["range"] = [math.log10(x) for x in limits] if log else list(limits)
    return axis


def _decades(values: Iterable[Vector]) -> dict[str, object]:
    """Plain numbers on a logarithmic axis, at 1, 2, 5 where few decades are shown."""
    shown = np.concatenate([v[np.isfinite(v) & (v > 0.0)] for v in values] or [np.ones(1)])
    few = len(shown) == 0 or float(shown.max()) < 300.0 * float(shown.min())
    return {"dtick": "D2" if few else 1, "tickformat": "~g"}


def _traces(t: Trace, y: str) -> list[dict[str, object]]:
    """One trace, of an area two."""
    colour, label = f"@{t.role}", _text(t.label)
    base: dict[str, object] = {"type": "scatter", "yaxis": y, **_places(t.x), "name": label, "showlegend": bool(label)}
    base["legendgroup"] = t.role  # hidden and shown together in all panels
    if not t.hover:
        base["hoverinfo"] = "skip"
    if t.kind == "area" and t.spread is not None:
        edge = {**base, "mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
        fill = {"fill": "tonexty", "fillcolor": f"@{t.role}/0.25"}
        return [{**edge, "y": _numbers(t.y - t.spread)}, {**edge, **fill, "y": _numbers(t.y + t.spread)}]
    base["y"] = _numbers(t.y)
    if t.kind == "bars":
        return [{**base, "type": "bar", "width": bar_width(t), "marker": {"color": colour}}]
    if t.kind == "points":
        return [{**base, "mode": "markers", "marker": {"color": colour, "size": 3, "opacity": 0.4}}]
    if t.kind in SYMBOLS:
        symbol, size = SYMBOLS[t.kind]
        bars = {"type": "data", "array": _numbers(t.spread), "thickness": 1, "width": 2, "color": colour}
        error = {"error_y": bars} if t.spread is not None else {}
        marker = {"color": colour, "size": size, "symbol": symbol, "line": {"width": 1.8 if symbol.endswith("open") else 0}}
        return [{**base, "mode": "markers", "marker": marker, **error}]
    return [{**base, "mode": "lines", "line": {"color": colour, "width": t.width, "dash": t.dash}}]


def _places(x: Vector) -> dict[str, object]:
    """x as start and step where it is even, which is a third of the page."""
    if len(x) > 2:
        step = float(x[-1] - x[0]) / (len(x) - 1)
        if step > 0.0 and float(np.abs(np.diff(x) - step).max()) < 1e-6 * step:
            return {"x0": float(x[0]), "dx": step}
    return {"x": _numbers(x, 8)}


def _numbers(values: Vector | None, digits: int = DIGITS) -> list[float | None]:
    """Rounded for display; what is no number is a gap."""
    return [float(f"{x:.{digits}g}") if math.isfinite(x) else None for x in values.tolist()] if values is not None else []


def _text(text: str) -> str:
    """Plotly reads some tags in its texts: none may come from a file."""
    return html.escape(text, quote=False)
