"""What a model misses, as charts: the error over time and frequency, the missing torque over velocity, place and reversals.

One description for matplotlib (diagnosis_plots.py) and for the report.
In all of them the missing torque is what must be added to the model: dry friction is negative for positive velocity.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, said, say, turns, unit, velocity_unit, word
from gaident.show.chart import Band, Chart, Mark, Panel, Trace, cloud, series
from gaident.show.diagnosis_numbers import binned_mean, branches, order_lines, reversal_averages, spectrum

__all__ = [
    "Curve",
    "error_panel",
    "missing_label",
    "missing_orders",
    "missing_over_velocity",
    "missing_reversals",
    "residual_spectrum",
    "std_band",
    "velocity_panel",
]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]
"""(velocity [rad/s], torque [N m], label) of a named effect."""

CLOSE = 0.06  # of the highest order: labels of two peaks that are closer cover each other


def velocity_panel(
    time: Vector,
    measured: Vector,
    linear: Vector,
    extended: Vector | None,
    command: Vector | None,
    axis: str,
    held_out_from: int = 0,
) -> Panel:
    """Measured against simulated velocity [rad/s] over time [s]; held_out_from: first sample that was held out, 0 for none."""
    traces = [] if command is None else [series(time, command, "command", "faint", dash="dot")]
    traces.append(series(time, measured, "measured", "measured", width=3.0))
    traces.append(series(time, linear, "linear model", "linear"))
    if extended is not None:
        traces.append(series(time, extended, "extended model", "extended", dash="dash"))
    marks = (Mark(float(time[held_out_from]), "held out from here"),) if held_out_from else ()
    return Panel(f"velocity [{velocity_unit(axis)}]", tuple(traces), marks=marks, height=1.7)


def error_panel(
    time: Vector,
    linear: Vector,
    extended: Vector | None,
    noise: float,
    axis: str,
    limits: tuple[float, float] | None = None,
    labelled: bool = True,
) -> Panel:
    """Measured minus simulated velocity [rad/s] over time [s], of both models, against the noise [rad/s].

    labelled: whether the models stand in the legend, where no panel above names them.
    """
    traces = [series(time, linear, "linear model" * labelled, "linear", width=1.0)]
    if extended is not None:
        traces.append(series(time, extended, "extended model" * labelled, "extended", width=1.0))
    band = Band(-2.0 * noise, 2.0 * noise, "±2 std of the noise")
    return Panel(f"error [{velocity_unit(axis)}]", tuple(traces), (band,), limits=limits)


def residual_spectrum(linear: Vector, extended: Vector | None, dt: float, noise: float, axis: str) -> Chart:
    """Where in frequency the error of the velocity lies; linear, extended: measured minus simulated [rad/s]."""
    traces = []
    for error, role, label in ((linear, "linear", "linear model"), (extended, "extended", "extended model")):
        if error is not None:
            # Of a run that runs away, what there is of it.
            lines = spectrum(error[: max(int(np.argmax(~np.isfinite(np.append(error, np.nan)))), 32)], dt)
            traces.append(Trace(lines.frequency, lines.density, label, role))
    f = traces[0].x
    floor = np.full(2, noise * math.sqrt(2.0 * dt))
    traces.append(Trace(f[[0, -1]], floor, "white noise of the sensor", "noise", dash="dash", width=1.8))
    text = "The error of the free-run simulation over frequency: a hill is a resonance that the model has not, or has elsewhere."
    panel = Panel(f"error [{velocity_unit(axis)}/√Hz]", tuple(traces), log=True)
    return Chart("residual-frequency", "frequency [Hz]", (panel,), text, log=True, height=330)


def missing_over_velocity(velocity: Vector, dhat: Vector, dt: float, std: float, curve: Curve | None, axis: str) -> Chart:
    """Both branches, the mean per bin, the band that zero cannot be told from, and the law of what was named.

    velocity [rad/s]; dhat: missing torque [N m] and its standard deviation std, 0 where it is not known.
    """
    faster, slower = branches(velocity, dt)
    steady = ~(faster | slower)
    traces = [cloud(velocity[m], dhat[m], role) for m, role in ((steady, "faint"), (faster, "faster"), (slower, "slower"))]
    for mask, role, label in ((faster, "faster", "accelerating"), (slower, "slower", "decelerating")):
        if np.sum(mask) < 50:
            continue
        mean = binned_mean(velocity, dhat, 24, mask)
        for side in (mean.x < 0.0, mean.x >= 0.0):  # no line across the jump at standstill
            if np.any(side):
                traces.append(Trace(mean.x[side], mean.mean[side], label, role, width=1.8))
                label = ""
    mean = binned_mean(velocity, dhat, 40)
    traces.append(Trace(mean.x, mean.mean, "mean ± sd", "ink", "means", spread=mean.std))
    if curve is not None:
        traces.append(Trace(curve[0], curve[1], curve[2], "effect", width=2.5))
    text = (
        f"What must be added to the model's {word('torque', axis)} so that it moves as measured. A step at standstill is dry "
        "friction, a slope viscous friction, a hump beside standstill Stribeck friction, an even offset a load; a gap between "
        f"the two branches is {said(Text('an inertia', 'a mass'), axis)} that is not right, or a delay."
    )
    low, high = robust_limits(dhat)
    limits = (min(low, -2.6 * std), max(high, 2.6 * std))
    panel = Panel(missing_label(axis), tuple(traces), std_band(std), limits=limits)
    return Chart("missing-velocity", f"velocity [{velocity_unit(axis)}]", (panel,), text, height=420)


def missing_orders(position: Vector, dhat: Vector, velocity: Vector, axis: str) -> Chart:
    """Lines per turn, on a linear axis per metre, in the missing torque, with the level that chance hardly passes.

    Drawn up to 40 per turn, on a linear axis to 200 in the travel.
    Without a trace where the record travels too little.
    """
    rotary = axis == "rotary"
    travel = float(np.ptp(position))
    scale = 1.0 if rotary else travel or 1.0
    top_order = 40.0 if rotary else 200.0
    lines = order_lines(position if rotary else position * (math.tau / scale), dhat, velocity, top_order)
    name, y = "order [per turn]" if rotary else "lines [1/m]", f"amplitude [{unit('N m', axis)}]"
    text = (
        f"Lines per {'turn' if rotary else 'metre'} of the missing {word('torque', axis)}, without what depends on the velocity "
        f"alone. {'Once per turn is an unbalance, whole multiples are cogging or the sensor.' if rotary else ''} Only what "
        "passes the dashed level is more than chance."
    )
    if not len(lines.order):
        few = say("{} between the lowest and the highest {angle}: too {}", turns(travel), Text("few", "little"))
        none = Panel(y, (), note=said(few, axis))
        return Chart("missing-orders", name, (none,), text, height=320)
    reached = said(say("over {}", turns(travel, 3)), axis)
    trace = Trace(lines.order / scale, lines.amplitude, reached, "faster", width=1.0)
    level = Trace(lines.order / scale, lines.level, "1 % level of chance", "noise", dash="dash", width=1.8)
    marked: list[float] = []
    marks = []
    for order, amplitude in lines.peaks:
        if all(abs(order - other) >= CLOSE * top_order for other in marked):
            marked.append(order)
            marks.append(Mark(order / scale, f"{order / scale:.3g}", amplitude))
    top = 1.2 * max(float(lines.amplitude.max()), float(lines.level[int(np.argmax(lines.amplitude))]), 1e-300)
    panel = Panel(y, (trace, level), marks=tuple(marks), limits=(0.0, top))
    return Chart("missing-orders", name, (panel,), text, limits=(0.0, top_order / scale), height=320)


def missing_reversals(velocity: Vector, dhat: Vector, torque: Vector, dt: float, axis: str) -> Chart:
    """The average reversal, the new direction positive; without a trace, and with a note, where there is none."""
    found = reversal_averages(velocity, dhat, torque, dt)
    ms, torque_word = 1e3 * found.time, word("torque", axis)
    roles = {"small": "faster", "large": "linear", "all": "faster"}
    top, low = [], []
    for name, (mean, spread, w, count) in found.groups.items():
        dash: Literal["solid", "dash"] = "dash" if name == "large" else "solid"
        label = f"{name if name == 'all' else f'{name} {torque_word}'}: {count} reversal{'s' * (count > 1)}"
        top.append(Trace(ms, mean, "", roles[name], "area", spread=spread))
        top.append(Trace(ms, mean, label, roles[name], width=1.8, dash=dash))
        low.append(Trace(ms, w, "", roles[name], dash=dash, width=1.5))
    text = (
        "The average reversal, the new direction positive. Dry friction jumps at 0, as steeply as the acceleration shows it; "
        "backlash leaves a spike that comes later the slower the reversal; presliding friction changes gradually, over a path "
        "and not over a time. A wave behind it is a shaft that rings."
    )
    upright = (Mark(0.0, ""),) if top else ()
    panels = (
        Panel(missing_label(axis), tuple(top), marks=upright, height=1.5, note="" if top else found.none),
        Panel(f"velocity [{velocity_unit(axis)}]", tuple(low), marks=upright),
    )
    return Chart("missing-reversals", "time from the reversal [ms]", panels, text, height=420)


def std_band(std: float) -> tuple[Band, ...]:
    """What the missing torque cannot be told from zero, of its standard deviation [N m]."""
    return (Band(-2.0 * std, 2.0 * std, "±2 std of the estimate"),) if std > 0.0 else ()


def robust_limits(values: Vector) -> tuple[float, float]:
    """Limits that contain all but the wildest half per cent at either end, zero included, with a margin."""
    low, high = (float(x) for x in np.quantile(values, (0.005, 0.995)))
    low, high = min(low, 0.0), max(high, 0.0)
    margin = 0.15 * (high - low) or 1.0
    return low - margin, high + margin


def missing_label(axis: str) -> str:
    """Title of the axis of the missing torque."""
    return f"missing {word('torque', axis)} [{unit('N m', axis)}]"
