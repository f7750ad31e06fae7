"""A chart as a picture on white: for print, and for readers that run no scripts."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from gaident.show.plots import _figure, _tidy
from gaident.show.report.chart import PALETTES, Chart, Panel, Trace
from gaident.show.report.live import bar_width

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["picture"]

WIDTH = 7.2  # inch
DPI = 140
SYMBOLS = {"means": ("o", 3.2), "crosses": ("x", 7.0), "rings": ("o", 7.0)}


def picture(chart: Chart) -> bytes:
    """PNG."""
    fig = _figure(WIDTH, 0.5 * chart.height / 72.0)
    axes = fig.subplots(len(chart.panels), 1, sharex=True, squeeze=False, height_ratios=[p.height for p in chart.panels])[:, 0]
    for ax, panel in zip(axes, chart.panels, strict=True):
        _draw(ax, panel)
        ax.set_ylabel(_plain(panel.y), fontsize="small")
        ax.tick_params(labelsize="small")
        ax.margins(x=0.01)
        if chart.log:
            ax.set_xscale("log")
        if panel.log:
            ax.set_yscale("log")
        if panel.limits is not None:
            ax.set_ylim(*panel.limits)
        if panel.ticks:
            ax.set_yticks(panel.ticks)
        handles, labels = ax.get_legend_handles_labels()
        if handles:
            ax.legend(
                handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(len(handles), 4), fontsize="small",
                frameon=False, borderaxespad=0.2, handlelength=1.5, columnspacing=1.2,
            )  # fmt: skip
    axes[-1].set_xlabel(_plain(chart.x), fontsize="small")
    if chart.ticks:
        axes[-1].set_xticks([x for x, _ in chart.ticks], [_plain(name) for _, name in chart.ticks])
    if chart.limits is not None:
        axes[-1].set_xlim(*chart.limits)
    _tidy(fig)
    for ax in axes:
        _plain_decades(ax)
    return _png(fig)


def _plain_decades(ax: Axes) -> None:
    """Logarithmic axes with plain numbers, at 1, 2, 5 where few decades are shown."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for each, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if each.get_scale() == "log":
            each.set_major_locator(LogLocator(subs=(1.0,) if high > 300.0 * low else (1.0, 2.0, 5.0)))
            each.set_major_formatter(FuncFormatter(lambda value, _: FuncFormatter.fix_minus(f"{value:g}")))
            each.set_minor_formatter(NullFormatter())


def _png(fig: Figure) -> bytes:
    """With a palette: a third of the size."""
    from PIL import Image

    fig.dpi = DPI
    fig.canvas.draw()
    drawn = Image.fromarray(np.asarray(fig.canvas.buffer_rgba()))  # type: ignore[attr-defined]
    small = io.BytesIO()
    drawn.convert("RGB").quantize(64, dither=Image.Dither.NONE).save(small, "png", optimize=True)
    return small.getvalue()


def _draw(ax: Axes, panel: Panel) -> None:
    colours = PALETTES["light"]
    for band in panel.bands:
        ax.axhspan(band.low, band.high, color=colours[band.role], alpha=0.25, linewidth=0, label=_plain(band.label) or None)
    for trace in panel.traces:
        _trace(ax, trace, colours[trace.role])
    for mark in panel.marks:
        if mark.y is None:
            ax.axvline(mark.x, color=colours["faint"], linewidth=0.8, linestyle=":")
            ax.text(mark.x, 0.98, _plain(mark.text), transform=ax.get_xaxis_transform(), va="top", fontsize="small")
        else:
            ax.annotate(
                _plain(mark.text), (mark.x, mark.y), xytext=(0, 3), textcoords="offset points", ha="center", fontsize="small"
            )
    if not panel.log:
        ax.axhline(0.0, color=colours["faint"], linewidth=0.5)


def _trace(ax: Axes, t: Trace, colour: str) -> None:
    label = _plain(t.label) or None
    if t.kind == "area" and t.spread is not None:
        ax.fill_between(t.x, t.y - t.spread, t.y + t.spread, color=colour, alpha=0.2, linewidth=0)
    elif t.kind == "bars":
        ax.bar(t.x, t.y, bar_width(t), color=colour, label=label)
    elif t.kind == "points":
        ax.plot(t.x, t.y, ".", color=colour, markersize=2.0, alpha=0.4, label=label)
    elif t.kind in SYMBOLS:
        symbol, size = SYMBOLS[t.kind]
        fill = colour if t.kind == "means" else "none"
        ax.errorbar(
            t.x, t.y, t.spread, fmt=symbol, color=colour, markersize=size, mfc=fill, elinewidth=0.8, capsize=1.8, label=label
        )
    else:
        style = {"solid": "-", "dash": "--", "dot": ":"}[t.dash]
        ax.plot(t.x, t.y, color=colour, linewidth=0.8 * t.width, linestyle=style, label=label)


def _plain(text: str) -> str:
    """Matplotlib reads formulas between dollars: none are meant."""
    return text.replace("$", r"\$")
