"""The paper's Figs. 6, 7 and 8 for the simulated rig, and the friction behind them: pure functions of what was computed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.paper.conventional import MethodComparison
from gaident.paper.experiment import StepTest
from gaident.show.draw import BLACK, BLUE, GREY, ORANGE, SKY, VERMILION, line, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_bias", "plot_engines", "plot_friction", "plot_identified", "plot_nominal"]

Vector = NDArray[np.float64]
ABOVE: dict[str, Any] = {
    "loc": "lower left",
    "bbox_to_anchor": (0.0, 1.0),
    "fontsize": "small",
    "frameon": False,
    "borderaxespad": 0.2,
    "handlelength": 1.6,
    "columnspacing": 1.2,
}


def plot_nominal(tests: Sequence[StepTest]) -> Figure:
    """Fig. 6: response of the rig and of the model with the sheet values."""
    curves = [[("nominal model", BLACK, "-", t.nominal_velocity)] for t in tests]
    return _responses(tests, curves, [f"fitness {t.nominal_fitness:.1f}" for t in tests])


def plot_identified(tests: Sequence[StepTest]) -> Figure:
    """Fig. 8: response of the rig and of the identified models, the best trial of each engine."""
    curves, notes = [], []
    for t in tests:
        paper, default = t.engine("paper").best, t.engine("default").best
        curves.append([
            ("paper's GA", VERMILION, "--", paper.simulate(t.record)),
            ("default engine", BLACK, "-", default.simulate(t.record)),
        ])  # fmt: skip
        notes.append(f"fitness {paper.fitness:.4g} and {default.fitness:.4g}")
    return _responses(tests, curves, notes)


def _responses(
    tests: Sequence[StepTest], curves: Sequence[Sequence[tuple[str, str, str, Vector]]], notes: Sequence[str]
) -> Figure:
    fig = new_figure(9.0, 4.6)
    grid = fig.subplots(2, len(tests), sharex="col", sharey="row", squeeze=False, height_ratios=(2.4, 1.0))
    for column, (test, mine) in enumerate(zip(tests, curves, strict=True)):
        rec, (top, low) = test.record, grid[:, column]
        t = 1e3 * rec.time
        top.plot(t, rec.command, color=GREY, linewidth=1.2, linestyle=":", label="command")
        top.plot(t, rec.velocity, color=SKY, linewidth=3.0, label="rig")
        for label, color, style, velocity in mine:
            top.plot(t, velocity, color=color, linewidth=1.1, linestyle=style, label=label)
            low.plot(t, rec.velocity - velocity, color=color, linewidth=0.9, linestyle=style)
        low.axhline(0.0, color=GREY, linewidth=0.6)
        top.legend(ncols=4, **ABOVE)
        low.set_xlabel(f"time [ms]\n({'ab'[column]}) {test.mechanism.title}: {notes[column]}")
        low.margins(x=0.01)
    grid[0, 0].set_ylabel("motor velocity [rad/s]")
    grid[1, 0].set_ylabel("rig - model\n[rad/s]")
    tidy(fig)
    return fig


def plot_engines(tests: Sequence[StepTest]) -> Figure:
    """Fig. 7: mean of the trials' best fitness by generation; the dot at the end is what is reported after the local fits."""
    fig = new_figure(9.0, 3.6)
    axes = fig.subplots(1, len(tests), sharey=True, squeeze=False)[0]
    for column, (ax, test) in enumerate(zip(axes, tests, strict=True)):
        for key, color, words in (("paper", VERMILION, "paper's GA"), ("default", BLUE, "default engine")):
            engine = test.engine(key)
            generation = np.arange(1, len(engine.history) + 1)
            label = f"{words}: right structure in {engine.right} of {engine.trials}"
            ax.plot(generation, engine.history, color=color, linewidth=1.6, label=label)
            if key == "default":
                mean = float(np.mean(engine.final))
                ax.plot(generation[[-1, -1]], [engine.history[-1], mean], color=color, linewidth=1.0, linestyle=":")
                ax.plot(generation[-1], mean, "o", color=color, markersize=6, label="after its local fits")
        ax.axhline(test.nominal_fitness, color=GREY, linewidth=1.0, linestyle="--", label="nominal model")
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xlabel(f"generation\n({'ab'[column]}) {test.mechanism.title}")
        ax.legend(fontsize="small")
    axes[0].set_ylabel(f"best fitness (6), mean of {tests[0].engines[0].trials} trials")
    tidy(fig)
    return fig


def plot_friction(rec: Record, linear: Vector, extended: Vector, law: tuple[Vector, Vector, Vector]) -> Figure:
    """A record with reversals: rig, both models and their errors [rad/s]; beside it the friction law.

    law: velocities [rad/s], dry friction of the rig and as found [N m].
    """
    fig = new_figure(9.0, 4.6)
    grid = fig.add_gridspec(2, 2, width_ratios=(2.1, 1.0), height_ratios=(1.5, 1.0))
    top = fig.add_subplot(grid[0, 0])
    low = fig.add_subplot(grid[1, 0], sharex=top)
    side = fig.add_subplot(grid[:, 1])
    line(top, rec.time, rec.velocity, color=SKY, linewidth=3.0, label="rig")
    line(top, rec.time, linear, color=VERMILION, linewidth=1.0, linestyle="--", label="linear model")
    line(top, rec.time, extended, color=BLACK, linewidth=0.8, label="extended model")
    line(low, rec.time, rec.velocity - linear, color=VERMILION, linewidth=0.7)
    line(low, rec.time, rec.velocity - extended, color=BLACK, linewidth=0.7)
    top.tick_params(labelbottom=False)
    top.legend(ncols=3, **ABOVE)
    top.set_ylabel("motor velocity [rad/s]")
    low.set_ylabel("rig - model\n[rad/s]")
    low.set_xlabel("time [s]")
    low.margins(x=0.01)
    w, true, found = law
    side.plot(w, true, color=ORANGE, linewidth=3.0, label="in the rig")
    side.plot(w, found, color=BLACK, linewidth=1.1, linestyle="--", label="found")
    side.set_ylim(0.0, 1.25 * float(np.max(true)))
    side.set_xlabel("motor velocity [rad/s]")
    side.set_ylabel("dry friction [N m]")
    side.legend(loc="lower right")
    tidy(fig)
    return fig


def plot_bias(comparisons: Sequence[MethodComparison], titles: Sequence[str]) -> Figure:
    """Deviation of the mechanical parameters from the truth [%], by method: mean over the seeds, bars of two spreads."""
    fig = new_figure(9.0, 3.4)
    axes = fig.subplots(1, len(comparisons), sharey=True, squeeze=False)[0]
    styles = (("plain", "plain least squares", "s", GREY), ("refined", "instruments and whitening", "^", ORANGE),
              ("genetic", "genetic", "o", BLUE))  # fmt: skip
    for column, (ax, c, title) in enumerate(zip(axes, comparisons, titles, strict=True)):
        names = c.mechanism.names
        places = np.arange(len(names))
        for k, (key, label, marker, color) in enumerate(styles):
            values = 100.0 * (c.method(key).mechanics / c.mechanics - 1.0)
            known = np.sum(np.isfinite(values[:, 0])) > 1
            if not known:
                continue
            mean, spread = np.nanmean(values, axis=0), np.nanstd(values, axis=0)
            ax.errorbar(
                places + 0.22 * (k - 1), mean, 2.0 * spread, fmt=marker, color=color, markersize=5, capsize=3, label=label
            )
        ax.axhline(0.0, color=BLACK, linewidth=0.6)
        ax.set_yscale("symlog", linthresh=1.0)
        ax.set_xticks(places, names)
        ax.set_xlim(-0.6, len(names) - 0.4)
        ax.set_xlabel(f"({'abcd'[column]}) {title}")
    axes[0].set_ylabel("deviation from the truth [%]")
    axes[0].legend(ncols=3, **ABOVE)
    tidy(fig)
    return fig
