"""Pictures of results, as matplotlib Figures that need no display and share no state."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.axis import unit, velocity_unit, word
from gaident.checks import yes_or_no
from gaident.data.record import Record
from gaident.data.torque_kind import MEASURED
from gaident.errors import SettingsError
from gaident.models.model import Model
from gaident.results.identification import Identification
from gaident.show.draw import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, chart_figure, headed, line, new_figure, tidy
from gaident.show.search_charts import convergence_chart, roots_chart, structures_chart
from gaident.show.units import figure_in_units, scales_of
from gaident.show.wording import structure_words

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_bode", "plot_convergence", "plot_identification", "plot_poles_zeros", "plot_record", "plot_structures"]

SERIES = (BLUE, VERMILION, GREEN, ORANGE, SKY, BLACK)
SHOWN_RECORDS = 3

Vector = NDArray[np.float64]


def plot_record(rec: Record, axis: str = "rotary", units: Mapping[str, str | float] | None = None) -> Figure:
    """The channels of a record over time, velocity and position each with its command; units: the user's, see `scales_of`.

    What a sensor at the load shows stands below what the motor's shows, on a scale of its own: its unit is not known.
    """
    v, u, x = (unit(rotary, axis) for rotary in ("rad/s", "N m", "rad"))
    measured = " (measured)" if rec.torque_is == MEASURED else ""
    position = word("angle", axis)
    rows: list[tuple[str, float, list[tuple[Vector | None, str, str]]]] = [
        (f"velocity [{v}]", 1.6, [(rec.velocity, "measured", BLUE), (rec.command, "command", GREY)]),
        ("load velocity", 1.0, [(rec.load_velocity, "", SKY)]),
        (f"{word('torque', axis)}{measured} [{u}]", 1.0, [(rec.torque, "", GREEN)]),
        (f"{position} [{x}]", 1.0, [(rec.position, "measured", BLUE), (rec.position_command, "command", GREY)]),
        ("load position", 1.0, [(rec.load_position, "", SKY)]),
    ]
    rows = [(title, height, drawn) for title, height, lines in rows if (drawn := [row for row in lines if row[0] is not None])]
    fig = new_figure(8.0, 0.6 + 1.6 * sum(height for _, height, _ in rows))
    grid = fig.subplots(len(rows), 1, sharex=True, squeeze=False, height_ratios=[height for _, height, _ in rows])[:, 0]
    for ax, (title, _, lines) in zip(grid, rows, strict=True):
        for values, label, color in lines:
            assert values is not None  # such rows are left out above
            style = "--" if label == "command" else "-"
            line(ax, rec.time, values, color=color, linewidth=1.0, linestyle=style, label=label if len(lines) > 1 else "")
        ax.set_ylabel(title)
        ax.margins(x=0.01)
        headed(ax, "")
    grid[-1].set_xlabel("time [s]")
    tidy(fig)
    fig.suptitle(f"{rec.name + ': ' if rec.name else ''}{len(rec)} samples of {1e3 * rec.dt:.6g} ms")
    return figure_in_units(fig, scales_of(units, axis))


def plot_identification(idn: Identification, records: Sequence[Record], axis: str = "rotary") -> Figure:
    """Measured against simulated velocity, and below it the residual with the band of +-2 noise deviations.

    One column per record, three at most; in open loop the torque that drives the model stands in a third row.
    Long records are drawn as the envelope of their samples.
    """
    shown = list(records)[:SHOWN_RECORDS]
    v, u = velocity_unit(axis), unit("N m", axis)
    open_loop = idn.controller is None
    heights = (3.0, 1.4, 1.0) if open_loop else (3.0, 1.4)
    fig = new_figure(max(7.0, 4.6 * len(shown)), 1.25 * sum(heights))
    grid = fig.subplots(len(heights), len(shown), sharex="col", squeeze=False, height_ratios=heights)
    for column, rec in enumerate(map(idn.as_used, shown)):
        top, low = grid[0, column], grid[1, column]
        simulated = idn.simulate(rec)
        if rec.command is not None and not open_loop:
            line(top, rec.time, rec.command, color=GREY, linewidth=1.2, linestyle="--", label="command")
        # Wide below, thin above: both are seen where they agree to the width of a line.
        line(top, rec.time, rec.velocity, color=SKY, linewidth=3.0, label="measured")
        line(top, rec.time, simulated, color=BLACK, linewidth=0.8, label="simulated")
        band = 2.0 * idn.adequacy.noise_std
        low.axhspan(-band, band, color=ORANGE, alpha=0.35, linewidth=0, label="±2 std of the noise")
        low.axhline(0.0, color=BLACK, linewidth=0.5)
        line(low, rec.time, rec.velocity - simulated, color=BLUE, linewidth=0.7, label="measured − simulated")
        top.set_title(rec.name or f"record {column + 1}", fontsize="medium", loc="right")
        if open_loop:
            assert rec.torque is not None  # what drove the model
            line(grid[2, column], rec.time, rec.torque, color=GREEN, linewidth=0.8)
        grid[-1, column].set_xlabel("time [s]")
        top.margins(x=0.01)
    grid[0, 0].set_ylabel(f"velocity [{v}]")
    grid[1, 0].set_ylabel(f"residual [{v}]")
    if open_loop:
        grid[2, 0].set_ylabel(f"{word('torque', axis)} [{u}]")
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
    tidy(fig)
    verdict = "; linear model falsified" if idn.falsified else ""
    more = len(records) - len(shown)
    fig.suptitle(
        f"({idn.p},{idn.q}), {structure_words(idn.p, idn.q)}: fit {idn.fit_percent:.1f} %{verdict}"
        + (f" (not shown: {more} more record{'s' if more > 1 else ''})" if more > 0 else "")
    )
    return fig


def plot_convergence(idn: Identification) -> Figure:
    """Best fitness (6) per generation, one line per trial, the best trial in front."""
    return chart_figure(convergence_chart(idn), 7.0, 4.0, ["Genetic search"])


def plot_structures(idn: Identification) -> Figure:
    """BIC of the best structures above the lowest; the margin of 10 within which the smallest is reported."""
    return chart_figure(structures_chart(idn), 7.0, 4.2, ["Structures compared"])


def plot_poles_zeros(idn: Identification, hz: bool = False) -> Figure:
    """Poles and zeros in the s-plane [rad/s], or divided by 2 pi [Hz], with bars of +-2 standard deviations."""
    yes_or_no(hz, "hz", SettingsError)
    return chart_figure(roots_chart(idn, hz), 6.0, 5.0, ["Poles and zeros, bars ±2 std"])


def plot_bode(
    models: Model | Sequence[Model],
    labels: Sequence[str] | None = None,
    frequencies_hz: tuple[float, float] | None = None,
    axis: str = "rotary",
    hz: bool = True,
) -> Figure:
    """Magnitude and phase of one model or several, torque to velocity, over frequency [Hz], or [rad/s] for hz=False.

    frequencies_hz: (lowest, highest); None: a decade around the roots.
    """
    from matplotlib.ticker import MultipleLocator

    listed = [models] if isinstance(models, Model) else list(models)
    names = list(labels) if labels is not None else [f"model {i + 1}" for i in range(len(listed))]
    low, high = frequencies_hz if frequencies_hz is not None else _decades(listed)
    f = _frequencies(listed, low, high)
    scale = 1.0 if hz else math.tau
    fig = new_figure(7.0, 5.5)
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
    top.set_ylabel(f"magnitude [{unit('rad/s/(N m)', axis)}]")
    bottom.set_ylabel("phase [deg]")
    bottom.set_xlabel("frequency [Hz]" if hz else "frequency [rad/s]")
    bottom.yaxis.set_major_locator(MultipleLocator(45.0))
    top.set_title(f"{word('Torque', axis)} to velocity")
    if labels is not None or len(listed) > 1:
        top.legend()
    tidy(fig)
    return fig


def _decades(models: Sequence[Model]) -> tuple[float, float]:
    sizes = [abs(r) / math.tau for m in models for r in (*m.poles, *m.zeros) if r != 0.0]
    return (min(sizes) / 10.0, max(sizes) * 10.0) if sizes else (0.1, 1000.0)


def _frequencies(models: Sequence[Model], low: float, high: float) -> Vector:
    """Frequencies [Hz], even on the logarithmic axis, denser around each resonance so that its top is met."""
    f = [np.geomspace(low, high, 800)]
    for r in (r for m in models for r in (*m.poles, *m.zeros) if r.imag > 0.0):
        width = max(abs(r.real), 1e-6 * r.imag)
        near = (r.imag + width * np.linspace(-5.0, 5.0, 101)) / math.tau
        f.append(near[(near > low) & (near < high)])
    return np.unique(np.concatenate(f))
