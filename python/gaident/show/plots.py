"""Pictures of results, as matplotlib Figures that need no display and share no state."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from gaident.show.wording import structure_words, unit, velocity_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_bode", "plot_convergence", "plot_identification", "plot_poles_zeros", "plot_structures", "roots_of"]

# Okabe and Ito's colours: told apart by every eye, and in grey by their lightness.
BLACK, ORANGE, SKY, GREEN, BLUE, VERMILION = "#000000", "#E69F00", "#56B4E9", "#009E73", "#0072B2", "#D55E00"
GREY = "#999999"
SERIES = (BLUE, VERMILION, GREEN, ORANGE, SKY, BLACK)
SHOWN_RECORDS = 3
BINS = 1000

Vector = NDArray[np.float64]


def plot_identification(idn: Any, records: Sequence[Any], axis: str = "rotary") -> Figure:
    """Measured against simulated velocity, and below it the residual with the band of +-2 noise deviations.

    One column per record, three at most; in open loop the torque that drives the model stands in a third row.
    Long records are drawn as the envelope of their samples.
    """
    shown = list(records)[:SHOWN_RECORDS]
    v, u = velocity_unit(axis), unit("N m", axis)
    open_loop = idn.controller is None
    heights = (3.0, 1.4, 1.0) if open_loop else (3.0, 1.4)
    fig = _figure(max(7.0, 4.6 * len(shown)), 1.25 * sum(heights))
    grid = fig.subplots(len(heights), len(shown), sharex="col", squeeze=False, height_ratios=heights)
    for column, rec in enumerate(shown):
        top, low = grid[0, column], grid[1, column]
        simulated = idn.simulate(rec)
        if rec.command is not None and not open_loop:
            _line(top, rec.time, rec.command, color=GREY, linewidth=1.2, linestyle="--", label="command")
        # Wide below, thin above: both are seen where they agree to the width of a line.
        _line(top, rec.time, rec.velocity, color=SKY, linewidth=3.0, label="measured")
        _line(top, rec.time, simulated, color=BLACK, linewidth=0.8, label="simulated")
        band = 2.0 * idn.adequacy.noise_std
        low.axhspan(-band, band, color=ORANGE, alpha=0.35, linewidth=0, label="±2 std of the noise")
        low.axhline(0.0, color=BLACK, linewidth=0.5)
        _line(low, rec.time, rec.velocity - simulated, color=BLUE, linewidth=0.7, label="measured − simulated")
        top.set_title(rec.name or f"record {column + 1}", fontsize="medium", loc="right")
        if open_loop:
            _line(grid[2, column], rec.time, rec.torque, color=GREEN, linewidth=0.8)
        grid[-1, column].set_xlabel("time [s]")
        top.margins(x=0.01)
    grid[0, 0].set_ylabel(f"velocity [{v}]")
    grid[1, 0].set_ylabel(f"residual [{v}]")
    if open_loop:
        grid[2, 0].set_ylabel(f"{'torque' if axis == 'rotary' else 'force'} [{u}]")
    for ax in grid[:2, 0]:  # above the axes, where no line is covered
        ax.legend(
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=3,
            fontsize="small",
            frameon=False,
            borderaxespad=0.2,
            handlelength=1.5,
            columnspacing=1.2,
        )
    _tidy(fig)
    verdict = "; linear model falsified" if idn.falsified else ""
    more = len(records) - len(shown)
    fig.suptitle(
        f"({idn.p},{idn.q}), {structure_words(idn.p, idn.q)}: fit {idn.fit_percent:.1f} %{verdict}"
        + (f" (not shown: {more} more record{'s' if more > 1 else ''})" if more > 0 else "")
    )
    return fig


def plot_convergence(idn: Any) -> Figure:
    """Best fitness (6) per generation, one line per trial, the best trial in front."""
    fig = _figure(7.0, 4.0)
    ax = fig.subplots()
    best = min(range(len(idn.trials)), key=lambda i: float(idn.trials[i].fitness))
    others = [t for i, t in enumerate(idn.trials) if i != best]
    for i, trial in enumerate([*others, idn.trials[best]]):
        front = i == len(others)
        label = f"best of {len(idn.trials)} trials" if front and others else "other trials" if i == 0 and others else None
        ax.step(
            np.arange(1, len(trial.history) + 1),
            trial.history,
            where="post",
            label=label,
            color=BLUE if front else GREY,
            linewidth=1.6 if front else 0.8,
        )
    if all(f > 0.0 for t in idn.trials for f in t.history):
        ax.set_yscale("log")
    ax.set_xlabel("generation")
    ax.set_ylabel("best fitness (6)")
    ax.set_title("Genetic search")
    if others:
        ax.legend()
    _tidy(fig)
    return fig


def plot_structures(idn: Any) -> Figure:
    """BIC of every structure above the lowest; the margin of 10 within which the smallest is reported."""
    ordered = sorted(idn.structures, key=lambda s: (s.delta_bic, s.p + 2 * s.q))
    fig = _figure(7.0, max(2.5, 0.3 * len(ordered) + 1.2))
    ax = fig.subplots()
    chosen = (idn.p, idn.q)
    rivals = {(r.p, r.q) for r in idn.rivals}
    places = np.arange(len(ordered))
    for kind, color in (("reported", BLUE), ("rival", ORANGE), ("other", GREY)):
        mine = [
            i
            for i, s in enumerate(ordered)
            if kind == ("reported" if (s.p, s.q) == chosen else "rival" if (s.p, s.q) in rivals else "other")
        ]
        if mine:
            # A bar of length 0 could not be seen: the best stands at 1.
            ax.barh(places[mine], [max(ordered[i].delta_bic, 1.0) for i in mine], color=color, label=kind)
    ax.axvline(10.0, color=BLACK, linewidth=1.0, linestyle="--", label="margin 10")
    ax.set_xscale("log")
    ax.set_yticks(places, [f"({s.p},{s.q})" for s in ordered])
    ax.invert_yaxis()
    ax.set_xlabel("BIC above the lowest (1 stands for 0..1)")
    ax.set_ylabel("structure (p,q)")
    ax.set_title("Structures compared")
    ax.legend()
    _tidy(fig, grid="x")
    return fig


def plot_poles_zeros(idn: Any, hz: bool = False) -> Figure:
    """Poles and zeros in the s-plane [rad/s], or divided by 2 pi [Hz], with bars of +-2 standard deviations."""
    scale = 1.0 / math.tau if hz else 1.0
    fig = _figure(6.0, 5.0)
    ax = fig.subplots()
    highest = 0.0
    for kind, marker, color in (("pole", "x", VERMILION), ("zero", "o", BLUE)):
        points = roots_of(idn.parameters, kind)
        if not points:
            continue
        x, y, dx, dy = (scale * np.array(values) for values in zip(*points, strict=True))
        ax.errorbar(x, y, xerr=2.0 * dx, yerr=2.0 * dy, fmt="none", color=color, elinewidth=1.0, capsize=2.5)
        style: dict[str, Any] = {"markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.8}
        ax.plot(x, y, marker, color=color, label=f"{kind}s", **style)
        highest = max(highest, float(np.abs(y).max()))
    if highest == 0.0:  # real roots only
        ax.set_ylim(-1.0, 1.0)
    ax.axhline(0.0, color=BLACK, linewidth=0.6)
    ax.axvline(0.0, color=BLACK, linewidth=0.6)
    ax.margins(0.15)
    u = "Hz" if hz else "rad/s"
    ax.set_xlabel(f"real part [{u}]")
    ax.set_ylabel(f"imaginary part [{u}]")
    ax.set_title("Poles and zeros, bars ±2 std")
    ax.legend()
    _tidy(fig)
    return fig


def plot_bode(
    models: Any,
    labels: Sequence[str] | None = None,
    frequencies_hz: tuple[float, float] | None = None,
    axis: str = "rotary",
    hz: bool = True,
) -> Figure:
    """Magnitude and phase of one model or several, torque to velocity, over frequency [Hz], or [rad/s] for hz=False.

    frequencies_hz: (lowest, highest); None: a decade around the roots.
    """
    listed = list(models) if isinstance(models, (list, tuple)) else [models]
    names = list(labels) if labels is not None else [f"model {i + 1}" for i in range(len(listed))]
    low, high = frequencies_hz if frequencies_hz is not None else _decades(listed)
    f = _frequencies(listed, low, high)
    scale = 1.0 if hz else math.tau
    fig = _figure(7.0, 5.5)
    top, bottom = fig.subplots(2, 1, sharex=True, height_ratios=(1.4, 1.0))
    for i, (model, name) in enumerate(zip(listed, names, strict=True)):
        response = model.frequency_response(2.0 * math.pi * f)
        style = {
            "color": SERIES[i % len(SERIES)],
            "linestyle": ("-", "--", "-.", ":")[i % 4],
            "linewidth": 1.5,
        }
        top.plot(f * scale, np.abs(response), label=name, **style)
        bottom.plot(f * scale, np.degrees(np.unwrap(np.angle(response))), **style)
    top.set_xscale("log")
    top.set_yscale("log")
    u = unit("N m", axis)
    top.set_ylabel(f"magnitude [{velocity_unit(axis)}/{'(N m)' if u == 'N m' else u}]")
    bottom.set_ylabel("phase [deg]")
    bottom.set_xlabel("frequency [Hz]" if hz else "frequency [rad/s]")
    bottom.yaxis.set_major_locator(_locator(45.0))
    top.set_title(f"{'Torque' if axis == 'rotary' else 'Force'} to velocity")
    if labels is not None or len(listed) > 1:
        top.legend()
    _tidy(fig)
    return fig


def _figure(width: float, height: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from gaident.show.picture import Picture

    fig = Picture(figsize=(width, height), dpi=150, layout="constrained")
    FigureCanvasAgg(fig)
    return fig


def _locator(step: float) -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(step)


def _tidy(fig: Figure, grid: Literal["both", "x", "y"] = "both") -> None:
    for ax in fig.axes:
        ax.spines[["top", "right"]].set_visible(False)
        ax.grid(True, axis=grid, color="#DDDDDD", linewidth=0.5)
        ax.set_axisbelow(True)
    fig.align_ylabels()


def _line(ax: Axes, time: Vector, values: Vector, **style: Any) -> None:
    ax.plot(*envelope(time, values), **style)


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


def roots_of(parameters: Any, kind: str) -> list[tuple[float, float, float, float]]:
    """(real, imaginary, their deviations) of every pole or zero; 0 where no deviation is known."""
    points = []
    for name, e in parameters.items():
        if not name.startswith(f"{kind}_"):
            continue
        if "_pair_" not in name:
            points.append((e.value, 0.0, _finite(e.std), 0.0))
        elif name.endswith("_real"):
            im = parameters[name.removesuffix("_real") + "_imaginary"]
            points += [(e.value, sign * im.value, _finite(e.std), _finite(im.std)) for sign in (1.0, -1.0)]
    return points


def _finite(std: float) -> float:
    return std if math.isfinite(std) else 0.0


def _decades(models: Sequence[Any]) -> tuple[float, float]:
    sizes = [abs(r) / math.tau for m in models for r in (*m.poles, *m.zeros) if r != 0.0]
    return (min(sizes) / 10.0, max(sizes) * 10.0) if sizes else (0.1, 1000.0)


def _frequencies(models: Sequence[Any], low: float, high: float) -> Vector:
    """Frequencies [Hz], even on the logarithmic axis, denser around each resonance so that its top is met."""
    f = [np.geomspace(low, high, 800)]
    for r in (r for m in models for r in (*m.poles, *m.zeros) if r.imag > 0.0):
        width = max(abs(r.real), 1e-6 * r.imag)
        near = (r.imag + width * np.linspace(-5.0, 5.0, 101)) / math.tau
        f.append(near[(near > low) & (near < high)])
    return np.unique(np.concatenate(f))
