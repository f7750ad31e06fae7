"""A chart by matplotlib, on white: Figures, and the report's pictures for print and for readers that run no scripts."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from gaident.checks import check_installed
from gaident.show.chart import PALETTES, Chart, Panel, Trace, Vector, bar_width, envelope

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["chart_figure", "draw_panel", "grid_figure", "headed", "label_x", "line", "new_figure", "picture", "tidy"]

# Okabe and Ito's colours: colour-blind readers can tell them apart, and their lightness differs in a grey print.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION = "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00"
GREY = "#999999"

WIDTH = 7.2  # inch
DPI = 140
ROW = 62  # letters of a legend in one row
SYMBOLS = {"means": ("o", 3.2), "crosses": ("x", 7.0), "rings": ("o", 7.0)}


def picture(chart: Chart) -> bytes:
    """PNG with a palette, a third of the size."""
    fig = chart_figure(chart, WIDTH, 0.5 * chart.height / 72.0)
    return _png(fig)


def chart_figure(chart: Chart, width: float, height: float, titles: Sequence[str] = ()) -> Figure:
    """A chart as a Figure of width and height [inch]; titles: of its panels, from the top."""
    fig = new_figure(width, height)
    heights = [p.height for p in chart.panels]
    axes = fig.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for i, (ax, panel) in enumerate(zip(axes, chart.panels, strict=True)):
        draw_panel(ax, chart, panel)
        headed(ax, titles[i] if i < len(titles) else "")
    label_x(axes[-1], chart)
    tidy(fig)
    for ax in axes:
        _plain_decades(ax)
    return fig


def grid_figure(charts: Sequence[Sequence[Chart]], width: float, height: float, titles: Sequence[str]) -> Figure:
    """Charts of one panel each, in rows and columns; titles: theirs, row by row."""
    fig = new_figure(width, height)
    axes = fig.subplots(len(charts), len(charts[0]), squeeze=False)
    drawn = [(ax, chart) for line, row in zip(axes, charts, strict=True) for ax, chart in zip(line, row, strict=True)]
    for (ax, chart), title in zip(drawn, titles, strict=True):
        draw_panel(ax, chart, chart.panels[0])
        label_x(ax, chart)
        headed(ax, title, bold=True)
    tidy(fig)
    for ax, _ in drawn:
        _plain_decades(ax)
    return fig


def new_figure(width: float, height: float) -> Figure:
    """An empty Figure of width and height [inch] that needs no display."""
    check_installed(("matplotlib",), "pictures", "a picture")
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from gaident.show.picture import Picture

    fig = Picture(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(fig)
    return fig


def tidy(fig: Figure, grid: Literal["both", "x", "y"] = "both") -> None:
    """The look of every picture: a light grid, no frame above and at the right."""
    for ax in fig.axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(True, axis=grid, color="#DDDDDD", linewidth=0.5)
        ax.set_axisbelow(True)
    fig.align_ylabels()


def line(ax: Axes, time: Vector, values: Vector, *, color: str, linewidth: float, linestyle: str = "-", label: str = "") -> None:
    """A long signal as the envelope of its samples."""
    ax.plot(*envelope(time, values), color=color, linewidth=linewidth, linestyle=linestyle, label=label or None)


def headed(ax: Axes, text: str, bold: bool = False) -> None:
    """Title, and the legend in a line or two below it, where no curve is covered."""
    handles, labels = ax.get_legend_handles_labels()
    rows = 2 if sum(map(len, labels)) > ROW else 1
    if text:
        pad = 6.0 + 14.0 * rows * bool(handles)
        ax.set_title(_plain(text), loc="left", pad=pad, fontsize="medium", fontweight="bold" if bold else "normal")
    if handles:
        ax.legend(
            handles, labels, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=-(-len(handles) // rows), fontsize="small",
            frameon=False, borderaxespad=0.2, handlelength=1.5, columnspacing=1.2, labelspacing=0.2,
        )  # fmt: skip


def label_x(ax: Axes, chart: Chart) -> None:
    """Title, ticks and limits of the x axis."""
    ax.set_xlabel(_plain(chart.x))
    if chart.ticks:
        ax.set_xticks([x for x, _ in chart.ticks], [_plain(name) for _, name in chart.ticks])
    if chart.limits is not None:
        ax.set_xlim(*chart.limits)


def draw_panel(ax: Axes, chart: Chart, panel: Panel) -> None:
    """One panel of a chart, with the scales of its axes and the title of y."""
    from matplotlib.ticker import FuncFormatter

    _draw(ax, panel)
    ax.set_ylabel(_plain(panel.y))
    ax.margins(x=0.01)
    if chart.log:
        ax.set_xscale("log")
    if panel.log:
        ax.set_yscale("log")
    else:  # without a common factor, which would stand where the legend does
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: FuncFormatter.fix_minus(f"{value:g}")))
    if panel.limits is not None:
        ax.set_ylim(*panel.limits)
    if panel.ticks:
        ax.set_yticks(panel.ticks)
    if panel.note:
        ax.text(0.5, 0.5, _plain(panel.note), transform=ax.transAxes, ha="center", va="center", color=PALETTES["light"]["faint"])
    if not panel.traces:
        ax.set_xticks([])
        ax.set_yticks([])


def _plain_decades(ax: Axes) -> None:
    """Logarithmic axes with plain numbers, at 1, 2, 5 where few decades are shown."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for each, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        if each.get_scale() == "log":
            each.set_major_locator(LogLocator(subs=(1.0,) if high > 300.0 * low else (1.0, 2.0, 5.0)))
            each.set_major_formatter(FuncFormatter(lambda value, _: FuncFormatter.fix_minus(f"{value:g}")))
            each.set_minor_formatter(NullFormatter())


def _png(fig: Figure) -> bytes:
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
        _trace(ax, trace, colours[trace.role], panel.log)
    for mark in panel.marks:
        if mark.y is None:
            ax.axvline(mark.x, color=colours["faint"], linewidth=0.8, linestyle=":")
        if mark.y is None and mark.text:
            ax.text(mark.x, 0.98, _plain(mark.text), transform=ax.get_xaxis_transform(), va="top", fontsize="small")
        elif mark.y is not None:
            ax.annotate(
                _plain(mark.text), (mark.x, mark.y), xytext=(0, 3), textcoords="offset points", ha="center", fontsize="small"
            )
    if not panel.log and panel.traces:
        ax.axhline(0.0, color=colours["faint"], linewidth=0.5)


def _trace(ax: Axes, t: Trace, colour: str, log: bool) -> None:
    label = _plain(t.label) or None
    if t.kind == "area" and t.spread is not None:
        ax.fill_between(t.x, t.y - t.spread, t.y + t.spread, color=colour, alpha=0.2, linewidth=0)
    elif t.kind == "bars":
        ax.bar(t.x, t.y, bar_width(t), color=colour, label=label)
    elif t.kind == "points":
        ax.plot(t.x, t.y, ".", color=colour, markersize=2.0, alpha=0.4, label=label, rasterized=True)
    elif t.kind in SYMBOLS:
        symbol, size = SYMBOLS[t.kind]
        fill = colour if t.kind == "means" else "none"
        # A bar that would reach 0 ends at a hundredth of the value where the axis is logarithmic.
        below = np.minimum(t.spread, 0.99 * t.y) if log and t.spread is not None else t.spread
        bars = None if t.spread is None or below is None else np.stack([below, t.spread])
        ax.errorbar(t.x, t.y, bars, fmt=symbol, color=colour, markersize=size, mfc=fill, elinewidth=0.8, capsize=1.8, label=label)
    else:
        style = {"solid": "-", "dash": "--", "dot": ":"}[t.dash]
        ax.plot(t.x, t.y, color=colour, linewidth=0.8 * t.width, linestyle=style, label=label)


def _plain(text: str) -> str:
    """Matplotlib reads formulas between dollars: none are meant."""
    return text.replace("$", r"\$")
