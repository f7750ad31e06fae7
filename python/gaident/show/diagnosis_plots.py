"""Pictures of a diagnosis: what the model misses, over velocity, angle, reversals, time and frequency.

Pure functions of arrays; each returns a matplotlib Figure that needs no display and shares no state. In all of them the missing
torque is what must be added to the model: dry friction is negative for positive velocity.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.show.diagnosis_numbers import binned_mean, branches, order_lines, reversal_averages, spectrum
from gaident.show.plots import BLACK, BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, _figure, _line, _tidy
from gaident.show.wording import unit, velocity_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_evidence", "plot_orders", "plot_residual", "plot_reversals", "plot_torque_velocity"]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]

CLOUD = 4000  # points drawn of a cloud
ROW = 62  # letters of a legend in one row


def plot_torque_velocity(
    velocity: Vector, dhat: Vector, dt: float, std: float | None = None, curve: Curve | None = None, axis: str = "rotary"
) -> Figure:
    """Missing torque [N m] against velocity [rad/s], accelerating and decelerating apart, the mean per bin with its spread.

    std: of dhat [N m], drawn as the band that zero cannot be told from. curve: (velocity, torque, label) of a named effect.
    """
    fig = _figure(7.5, 4.8)
    ax = fig.subplots()
    _torque_velocity(ax, velocity, dhat, dt, std, curve, axis)
    _head(ax, f"Missing {_kind(axis)} against velocity")
    _tidy(fig)
    return fig


def plot_orders(position: Vector, dhat: Vector, velocity: Vector, highest: float = 40.0, axis: str = "rotary") -> Figure:
    """Lines per turn in the missing torque, up to the order `highest`, with the level that chance hardly passes."""
    fig = _figure(7.5, 3.8)
    ax = fig.subplots()
    _orders(ax, position, dhat, velocity, highest, axis)
    _head(ax, f"Missing {_kind(axis)}: lines per {_period(axis)}")
    _tidy(fig)
    return fig


def plot_reversals(velocity: Vector, dhat: Vector, drive_torque: Vector, dt: float, axis: str = "rotary") -> Figure:
    """Missing torque and velocity around reversals, averaged with the new direction as positive; small and large torque apart."""
    fig = _figure(7.5, 5.0)
    top, low = fig.subplots(2, 1, sharex=True, height_ratios=(1.6, 1.0))
    _reversals(top, velocity, dhat, drive_torque, dt, axis, low)
    _head(top, "Around a reversal, the new direction positive")
    top.set_xlabel("")
    low.set_xlabel("time from the reversal [ms]")
    _tidy(fig)
    return fig


def plot_residual(time: Vector, residual: Vector, noise_std: float, after: Vector | None = None, axis: str = "rotary") -> Figure:
    """Measured minus simulated velocity [rad/s] over time and frequency, against the noise floor `noise_std` [rad/s].

    after: the residual of the extended model, drawn in front.
    """
    fig = _figure(7.5, 5.4)
    top, low = fig.subplots(2, 1, height_ratios=(1.0, 1.2))
    _residual_time(top, time, residual, noise_std, after, axis)
    _residual_frequency(low, time, residual, noise_std, after, axis)
    _head(top, "Residual over time")
    _head(low, "Residual over frequency")
    _tidy(fig)
    return fig


def plot_evidence(
    time: Vector,
    measured: Vector,
    simulated: Vector,
    dhat: Vector,
    position: Vector,
    drive_torque: Vector,
    noise_std: float,
    std: float | None = None,
    extended: Vector | None = None,
    curve: Curve | None = None,
    title: str = "",
    axis: str = "rotary",
) -> Figure:
    """What the model misses at a glance: six panels.

    time [s]; measured, simulated and (optional) extended velocity [rad/s]; missing torque dhat and its deviation std [N m];
    position [rad]; drive_torque, the controller's [N m]; noise_std [rad/s]; curve as in `plot_torque_velocity`; arrays (n,).
    """
    dt = float(time[1] - time[0])
    fig = _figure(12.5, 9.6)
    axes = fig.subplots(3, 2)
    v = velocity_unit(axis)
    (run, cloud), (over_time, lines), (over_frequency, turning) = axes
    _line(run, time, measured, color=SKY, linewidth=2.4, label="measured")
    _line(run, time, simulated, color=VERMILION, linewidth=0.9, label="linear model")
    if extended is not None:
        _line(run, time, extended, color=BLACK, linewidth=0.8, linestyle=(0, (4, 2)), label="extended model")
    run.set_ylabel(f"velocity [{v}]")
    run.set_xlabel("time [s]")
    run.margins(x=0.01)
    after = None if extended is None else measured - extended
    _residual_time(over_time, time, measured - simulated, noise_std, after, axis)
    _residual_frequency(over_frequency, time, measured - simulated, noise_std, after, axis)
    _torque_velocity(cloud, measured, dhat, dt, std, curve, axis)
    _orders(lines, position, dhat, measured, 40.0, axis)
    _reversals(turning, measured, dhat, drive_torque, dt, axis, None)
    heads: Sequence[tuple[Axes, str]] = (
        (run, "Measured and simulated"),
        (cloud, f"Missing {_kind(axis)} against velocity"),
        (over_time, "Residual over time"),
        (lines, f"Missing {_kind(axis)}: lines per {_period(axis)}"),
        (over_frequency, "Residual over frequency"),
        (turning, f"Missing {_kind(axis)} around reversals"),
    )
    for letter, (ax, head) in zip("abcdef", heads, strict=True):
        _head(ax, f"{letter}  {head}", bold=True)
    if title:
        fig.suptitle(title)
    _tidy(fig)
    return fig


def _torque_velocity(
    ax: Axes, velocity: Vector, dhat: Vector, dt: float, std: float | None, curve: Curve | None, axis: str
) -> None:
    faster, slower = branches(velocity, dt)
    steady = ~(faster | slower)
    step = max(1, len(velocity) // CLOUD)
    if std is not None:
        ax.axhspan(-2.0 * std, 2.0 * std, color=ORANGE, alpha=0.3, linewidth=0, label="±2 std")
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    for mask, color, label in ((steady, GREY, "steady"), (faster, BLUE, "accelerating"), (slower, VERMILION, "decelerating")):
        chosen = np.flatnonzero(mask)[::step]
        ax.plot(velocity[chosen], dhat[chosen], ".", color=color, markersize=2.2, alpha=0.45, rasterized=True)
        if color == GREY or np.sum(mask) < 50:
            continue
        mean = binned_mean(velocity, dhat, 24, mask)
        for side in (mean.x < 0.0, mean.x >= 0.0):  # no line across the jump at standstill
            ax.plot(mean.x[side], mean.mean[side], "-", color=color, linewidth=1.3, label=label if np.any(side) else None)
            label = label if not np.any(side) else ""
    mean = binned_mean(velocity, dhat, 40)
    ax.errorbar(
        mean.x, mean.mean, yerr=mean.std, fmt="o", color=BLACK, markersize=3.2, elinewidth=0.8, capsize=1.8, label="mean ± sd"
    )
    if curve is not None:
        ax.plot(curve[0], curve[1], color=GREEN, linewidth=2.0, label=curve[2])
    ax.set_ylim(*robust_limits(dhat))
    _plain_numbers(ax)
    ax.set_xlabel(f"velocity [{velocity_unit(axis)}]")
    ax.set_ylabel(_torque_label(axis))


def _orders(ax: Axes, position: Vector, dhat: Vector, velocity: Vector, highest: float, axis: str) -> None:
    """Lines per turn; of a linear axis per metre, up to 200 in its travel."""
    scale = 1.0
    if axis == "linear":
        scale, highest = float(np.ptp(position)) or 1.0, 200.0
        position = position * (math.tau / scale)
    lines = order_lines(position, dhat, velocity, highest)
    orders = lines.order / scale
    ax.set_xlabel("order [per turn]" if axis == "rotary" else "lines [1/m]")
    ax.set_ylabel(f"amplitude [{unit('N m', axis)}]")
    if len(orders) == 0:
        ax.text(0.5, 0.5, f"{lines.turns:.2g} turns travelled: too few", transform=ax.transAxes, ha="center", color=GREY)
        return
    ax.fill_between(orders, lines.amplitude, color=BLUE, alpha=0.25, linewidth=0)
    travel = f"{lines.turns:.1f} turns" if axis == "rotary" else f"{scale:.3g} m"
    ax.plot(orders, lines.amplitude, color=BLUE, linewidth=0.8, label=travel)
    ax.plot(orders, lines.level, color=ORANGE, linewidth=1.2, linestyle="--", label="1 % level of chance")
    labelled: list[float] = []
    for order, amplitude in lines.peaks:
        if any(abs(order - other) < 0.06 * highest for other in labelled):
            continue
        labelled.append(order)
        where, text = (order / scale, amplitude), f"{order / scale:.3g}"
        ax.annotate(text, where, xytext=(0, 3), textcoords="offset points", ha="center", fontsize="small")
    ax.set_xlim(0.0, highest / scale)
    top = int(np.argmax(lines.amplitude))
    ax.set_ylim(0.0, 1.18 * max(float(lines.amplitude[top]), float(lines.level[top])) or 1.0)
    _plain_numbers(ax)


def _reversals(ax: Axes, velocity: Vector, dhat: Vector, drive_torque: Vector, dt: float, axis: str, low: Axes | None) -> None:
    found = reversal_averages(velocity, dhat, drive_torque, dt)
    ms = 1e3 * found.time
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.axvline(0.0, color=BLACK, linewidth=0.5)
    styles = {"small torque": (SKY, "-"), "large torque": (VERMILION, "--"), "all": (BLUE, "-")}
    for name, (mean, spread, w, count) in found.groups.items():
        color, dashes = styles[name]
        text = name.replace("torque", _kind(axis))
        ax.fill_between(ms, mean - spread, mean + spread, color=color, alpha=0.2, linewidth=0)
        ax.plot(ms, mean, color=color, linestyle=dashes, linewidth=1.6, label=f"{text}: {count} reversal{'s' * (count > 1)}")
        if low is not None:
            low.plot(ms, w, color=color, linestyle=dashes, linewidth=1.3)
    if low is not None:
        low.axhline(0.0, color=BLACK, linewidth=0.5)
        low.axvline(0.0, color=BLACK, linewidth=0.5)
        low.set_ylabel(f"velocity [{velocity_unit(axis)}]")
    if not found.groups:
        ax.text(0.5, 0.5, found.none, transform=ax.transAxes, ha="center", va="center", color=GREY)
        for each in (ax, low) if low is not None else (ax,):
            each.set_xticks([])
            each.set_yticks([])
        return
    ax.margins(x=0.0)
    _plain_numbers(ax)
    ax.set_xlabel("time from the reversal [ms], the new direction positive")
    ax.set_ylabel(_torque_label(axis))


def _residual_time(ax: Axes, time: Vector, residual: Vector, noise_std: float, after: Vector | None, axis: str) -> None:
    ax.axhspan(-2.0 * noise_std, 2.0 * noise_std, color=ORANGE, alpha=0.35, linewidth=0, label="±2 std of the noise")
    _line(ax, time, residual, color=VERMILION, linewidth=0.8, label="linear model")
    if after is not None:
        _line(ax, time, after, color=BLACK, linewidth=0.6, label="extended model")
    ax.axhline(0.0, color=BLACK, linewidth=0.5)
    ax.margins(x=0.01)
    _plain_numbers(ax)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"residual [{velocity_unit(axis)}]")


def _residual_frequency(ax: Axes, time: Vector, residual: Vector, noise_std: float, after: Vector | None, axis: str) -> None:
    dt = float(time[1] - time[0])
    floor = noise_std * math.sqrt(2.0 * dt)
    ax.axhline(floor, color=ORANGE, linewidth=1.5, linestyle="--", label="white noise floor")
    for values, color, width, label in ((residual, VERMILION, 1.3, "linear model"), (after, BLACK, 1.0, "extended model")):
        if values is not None:
            lines = spectrum(values, dt)
            ax.plot(lines.frequency, lines.density, color=color, linewidth=width, label=label)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"residual [{velocity_unit(axis)} / Hz$^{{1/2}}$]")
    _plain_decades(ax)


def _plain_numbers(ax: Axes) -> None:
    """A vertical scale without a common factor, which would stand where the legend does."""
    from matplotlib.ticker import FuncFormatter

    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: FuncFormatter.fix_minus(f"{value:g}")))


def _plain_decades(ax: Axes) -> None:
    """Logarithmic axes with plain numbers, at 1, 2, 5 where few decades are shown."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    for each, (low, high) in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        each.set_major_locator(LogLocator(subs=(1.0,) if high > 1e3 * low else (1.0, 2.0, 5.0)))
        each.set_major_formatter(FuncFormatter(lambda value, _: FuncFormatter.fix_minus(f"{value:g}")))
        each.set_minor_formatter(NullFormatter())


def _torque_label(axis: str) -> str:
    return f"missing {_kind(axis)} [{unit('N m', axis)}]"


def _kind(axis: str) -> str:
    return "torque" if axis == "rotary" else "force"


def _period(axis: str) -> str:
    return "turn" if axis == "rotary" else "metre"


def robust_limits(values: Vector) -> tuple[float, float]:
    """Limits that hold all but the wildest half per cent at either end, zero included, with a margin."""
    low, high = (float(x) for x in np.quantile(values, (0.005, 0.995)))
    low, high = min(low, 0.0), max(high, 0.0)
    margin = 0.15 * (high - low) or 1.0
    return low - margin, high + margin


def _head(ax: Axes, text: str, bold: bool = False) -> None:
    """Title, and the legend in a line or two below it, where no curve is covered."""
    handles, labels = ax.get_legend_handles_labels()
    rows = 2 if sum(map(len, labels)) > ROW else 1
    pad = 6.0 + 14.0 * rows * bool(handles)
    ax.set_title(text, loc="left", pad=pad, fontsize="medium", fontweight="bold" if bold else "normal")
    if not handles:
        return
    ax.legend(
        handles,
        labels,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        frameon=False,
        borderaxespad=0.2,
        ncols=-(-len(handles) // rows),
        fontsize="small",
        handlelength=1.5,
        columnspacing=1.2,
        labelspacing=0.2,
    )
