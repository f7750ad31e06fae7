"""A chart as data: panels one above the other with one x axis.
Two renderers draw it:
matplotlib (draw.py) and, live in the report, plotly (report/live.py).

Colours are roles ("measured", "linear", ...), so that a page can be light or dark. Texts are plain texts.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["BINS", "PALETTES", "Band", "Chart", "Mark", "Panel", "Trace", "Vector", "bar_width", "cloud", "envelope", "series"]

Vector = NDArray[np.float64]

# Okabe and Ito's colours, which colour-blind readers can tell apart; lighter where the page is dark.
PALETTES: dict[str, dict[str, str]] = {
    "light": {
        "ink": "#1b1f24",
        "faint": "#8b939c",
        "grid": "#e3e6ea",
        "paper": "#ffffff",
        "measured": "#56b4e9",
        "linear": "#d55e00",
        "extended": "#1b1f24",
        "noise": "#e69f00",
        "faster": "#0072b2",
        "slower": "#d55e00",
        "effect": "#009e73",
    },
    "dark": {
        "ink": "#e6e9ed",
        "faint": "#8f98a3",
        "grid": "#333a43",
        "paper": "#1a1e24",
        "measured": "#56b4e9",
        "linear": "#ff8c42",
        "extended": "#ffffff",
        "noise": "#e69f00",
        "faster": "#5fb4f0",
        "slower": "#ff8c42",
        "effect": "#2fc79b",
    },
}

BINS = 1000  # stretches of a long signal, each drawn by its least and greatest sample
CLOUD = 1200  # points drawn of a cloud


@dataclass(frozen=True, eq=False)
class Trace:
    """One signal: x and y (n,), label in the legend ("" for none), role of its colour.

    kind: "line"; "points"; "bars"; "means", "crosses", "rings": points with error bars of `spread`; "area" between y - spread
    and y + spread.
    hover: whether its values are shown at the pointer.
    """

    x: Vector
    y: Vector
    label: str
    role: str
    kind: Literal["line", "points", "bars", "means", "crosses", "rings", "area"] = "line"
    width: float = 1.2
    dash: Literal["solid", "dash", "dot"] = "solid"
    spread: Vector | None = None
    hover: bool = True


@dataclass(frozen=True)
class Band:
    """Between two values of y, over the whole width."""

    low: float
    high: float
    label: str
    role: str = "noise"


@dataclass(frozen=True)
class Mark:
    """A text at a point, or without y an upright line at x with the text at its top."""

    x: float
    text: str
    y: float | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """Traces over one y axis; y: its title with the unit, limits: (lowest, highest) or None, height: share of the chart's.

    note: what stands in the middle of the panel, where there is nothing to draw.
    """

    y: str
    traces: tuple[Trace, ...]
    bands: tuple[Band, ...] = ()
    marks: tuple[Mark, ...] = ()
    log: bool = False
    limits: tuple[float, float] | None = None
    height: float = 1.0
    ticks: tuple[float, ...] = ()
    note: str = ""


@dataclass(frozen=True, eq=False)
class Chart:
    """key: a name unique in the page; x: title of the axis; link: charts of one link zoom together; height [px].

    caption: one or two sentences below the chart. shared: hover shows all traces at one x. ticks: (x, text), () for numbers.
    """

    key: str
    x: str
    panels: tuple[Panel, ...]
    caption: str
    log: bool = False
    limits: tuple[float, float] | None = None
    link: str = ""
    ticks: tuple[tuple[float, str], ...] = ()
    height: int = 380
    shared: bool = False

    @property
    def drawn(self) -> int:
        """Points in the page."""
        return sum(len(t.x) for p in self.panels for t in p.traces)


def envelope(time: Vector, values: Vector, bins: int = BINS) -> tuple[Vector, Vector]:
    """Least and greatest sample of each of `bins` stretches, in time order; short signals as they are."""
    n = len(values)
    if n <= 4 * bins:
        return time, values
    edges = np.linspace(0, n, bins + 1).astype(int)
    chosen = []
    for a, b in pairwise(edges):
        chosen += sorted({a + int(np.argmin(values[a:b])), a + int(np.argmax(values[a:b]))})
    picked = np.array(sorted({0, *chosen, n - 1}))
    return time[picked], values[picked]


def series(
    time: Vector, values: Vector, label: str, role: str, *, width: float = 1.2, dash: Literal["solid", "dash", "dot"] = "solid"
) -> Trace:
    """A long signal as the envelope of its samples: no peak is lost, whatever its length."""
    return Trace(*envelope(time, values, BINS), label, role, width=width, dash=dash)


def cloud(x: Vector, y: Vector, role: str, label: str = "") -> Trace:
    """A few of the points of a cloud, evenly over the record; what they say is carried by means of all of them beside it."""
    chosen = np.unique(np.linspace(0, len(x) - 1, min(len(x), CLOUD)).round().astype(int)) if len(x) else np.zeros(0, dtype=int)
    return Trace(x[chosen], y[chosen], label, role, "points", hover=False)


def bar_width(t: Trace) -> float:
    """Width of a bar: nine tenths of the least distance between two, or of 1."""
    steps = np.diff(np.unique(t.x))
    return 0.9 * min(float(steps.min(initial=1.0)), 1.0)
