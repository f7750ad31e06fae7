"""The report's charts: what each shows of a run, as data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from gaident.show.diagnosis_numbers import (
    binned_mean,
    branches,
    order_lines,
    over_period,
    reversal_averages,
    smoothed,
    spectrum,
)
from gaident.show.diagnosis_plots import robust_limits
from gaident.show.report.chart import BINS, Band, Chart, Mark, Panel, Trace, cloud, series
from gaident.show.report.views import Curve, Run, Vector
from gaident.show.response_plots import phase_line
from gaident.show.wording import number, unit, velocity_unit

__all__ = [
    "command_chart",
    "held_out_chart",
    "missing_over_place",
    "missing_over_time",
    "missing_over_velocity",
    "missing_reversals",
    "residual_spectrum",
    "response_chart",
    "run_chart",
]


def run_chart(run: Run, noise: float, key: str, axis: str) -> Chart:
    """Measured against simulated velocity, below it what is left, below that the torque."""
    v, kind = velocity_unit(axis), torque_word(axis)
    top = []
    if run.command is not None:
        top.append(series(run.time, run.command, "command", "faint", dash="dot"))
    top.append(series(run.time, run.measured, "measured", "measured", width=3.0))
    top.append(series(run.time, run.linear, "linear model", "linear"))
    low = [series(run.time, run.measured - run.linear, "", "linear", width=1.0)]
    if run.extended is not None:
        top.append(series(run.time, run.extended, "extended model", "extended", dash="dash"))
        low.append(series(run.time, run.measured - run.extended, "", "extended", width=1.0))
    text = "Error: measured minus simulated. Drag (or use the figure's buttons) to zoom all panels, double-click to come back."
    models = (run.linear, run.extended)
    limits, said = _error_limits([run.measured - m for m in models if m is not None])
    text += said
    held = (Mark(float(run.time[run.held_from]), "held out from here"),) if run.held_from else ()
    panels = [
        Panel(f"velocity [{v}]", tuple(top), marks=held, height=1.7),
        Panel(f"error [{v}]", tuple(low), (Band(-2.0 * noise, 2.0 * noise, "±2 std of the noise"),), limits=limits),
    ]
    if run.torque is not None:
        panels.append(
            Panel(f"{kind} [{unit('N m', axis)}]", (series(run.time, run.torque, "", "faster", width=1.0),), height=0.7)
        )
        if not run.torque_logged:
            text += f" The {kind} is not logged: it is what the controller makes of command and measured velocity."
    return Chart(key, "time [s]", tuple(panels), text + depth(run), link=key, height=590 if len(panels) > 2 else 480, shared=True)


def depth(run: Run) -> str:
    """How far zooming shows more."""
    n = len(run.time)
    if n <= 4 * BINS:
        return f" All {n} samples are drawn."
    stretch = n // BINS
    return (
        f" {n} samples, drawn as the least and greatest of every {stretch} ({number(1e3 * stretch * run.dt, 2)} ms): "
        "no peak is lost, but zooming deeper shows no more."
    )


def missing_over_velocity(run: Run, dhat: Vector, curve: Curve | None, axis: str) -> Chart:
    """Both branches, the mean per bin, the band that zero cannot be told from, and the law of what was named."""
    faster, slower = branches(run.measured, run.dt)
    steady = ~(faster | slower)
    traces = [cloud(run.measured[m], dhat[m], role) for m, role in ((steady, "faint"), (faster, "faster"), (slower, "slower"))]
    for mask, role, label in ((faster, "faster", "accelerating"), (slower, "slower", "decelerating")):
        if np.sum(mask) < 50:
            continue
        mean = binned_mean(run.measured, dhat, 24, mask)
        for side in (mean.x < 0.0, mean.x >= 0.0):  # no line across the jump at standstill
            if np.any(side):
                traces.append(Trace(mean.x[side], mean.mean[side], label, role, width=1.8))
                label = ""
    mean = binned_mean(run.measured, dhat, 40)
    traces.append(Trace(mean.x, mean.mean, "mean ± sd", "ink", "means", spread=mean.std))
    if curve is not None:
        traces.append(Trace(curve[0], curve[1], curve[2], "effect", width=2.5))
    kind = torque_word(axis)
    text = (
        f"What must be added to the model's {kind} so that it moves as measured. A step at standstill is dry friction, a slope "
        "viscous friction, a hump beside standstill Stribeck friction, an even offset a load; a gap between the two branches is "
        "an inertia that is not right, or a delay."
    )
    panel = Panel(missing_label(axis), tuple(traces), band(run), limits=_with_band(robust_limits(dhat), run.std))
    return Chart("missing-velocity", f"velocity [{velocity_unit(axis)}]", (panel,), text, height=420)


def missing_over_place(run: Run, dhat: Vector, axis: str) -> tuple[Chart, ...]:
    """Lines per turn, and the mean over one turn (linear: over the travel)."""
    rotary = axis == "rotary"
    travel = float(np.ptp(run.position))
    period = math.tau if rotary else travel or 1.0
    lines = order_lines(run.position * (math.tau / period), dhat, run.measured, 40.0 if rotary else 200.0)
    charts = []
    scale = 1.0 if rotary else period
    if len(lines.order):
        reached = f"{lines.turns:.3g} turns travelled" if rotary else f"{travel:.3g} m travelled"
        trace = Trace(lines.order / scale, lines.amplitude, reached, "faster", width=1.0)
        level = Trace(lines.order / scale, lines.level, "1 % level of chance", "noise", dash="dash", width=1.8)
        marks = tuple(Mark(k / scale, f"{k / scale:.3g}", a) for k, a in lines.peaks)
        top = 1.2 * max(float(lines.amplitude.max()), float(lines.level[int(np.argmax(lines.amplitude))]), 1e-300)
        panel = Panel(f"amplitude [{unit('N m', axis)}]", (trace, level), marks=marks, limits=(0.0, top))
        text = (
            f"Lines per {'turn' if rotary else 'metre'} of the missing {torque_word(axis)}, without what depends on the velocity "
            f"alone. {'Once per turn is an unbalance, whole multiples are cogging or the sensor.' if rotary else ''} Only what "
            "passes the dashed level is more than chance."
        )
        name = "order [per turn]" if rotary else "lines [1/m]"
        charts.append(Chart("missing-orders", name, (panel,), text, height=320))
    mean = over_period(run.position, dhat, run.measured, period)
    if len(mean.x) > 3:
        x = np.degrees(mean.x) if rotary else mean.x + float(run.position.min())
        error = Trace(x, mean.mean, "mean ± its standard error", "ink", "means", spread=mean.std / np.sqrt(mean.count))
        text = f"The same over {'one turn' if rotary else 'the travel'}: what belongs to a place stands out of the bars."
        panel = Panel(missing_label(axis), (error,))
        charts.append(Chart("missing-place", "angle in a turn [deg]" if rotary else "position [m]", (panel,), text, height=300))
    return tuple(charts)


def missing_over_time(run: Run, dhat: Vector, key: str, axis: str) -> Chart:
    """The missing torque as it comes, and its mean over a hundredth of the record."""
    slow = smoothed(dhat, max(3, len(dhat) // 100))
    traces = (
        series(run.time, dhat, "missing", "faster", width=0.8),
        series(run.time, slow, "mean over 1 % of the record", "ink", width=1.8),
    )
    text = (
        f"The missing {torque_word(axis)} over time. What grows or fades while the motion repeats itself drifts, as friction "
        "does with temperature. Zooms together with the velocity above."
    )
    return Chart(
        "missing-time", "time [s]", (Panel(missing_label(axis), traces, band(run)),), text, link=key, height=320, shared=True
    )


def missing_reversals(run: Run, dhat: Vector, axis: str) -> Chart | None:
    """The average reversal; None where the velocity never changes its sign."""
    if run.torque is None:
        return None
    found = reversal_averages(run.measured, dhat, run.torque, run.dt)
    if not found.groups:
        return None
    ms = 1e3 * found.time
    roles = {"small torque": "faster", "large torque": "linear", "all": "faster"}
    top, low = [], []
    for name, (mean, spread, w, count) in found.groups.items():
        dash: Any = "dash" if name == "large torque" else "solid"
        label = f"{name.replace('torque', torque_word(axis))}: {count} reversal{'s' * (count > 1)}"
        top += [
            Trace(ms, mean, "", roles[name], "area", spread=spread),
            Trace(ms, mean, label, roles[name], width=1.8, dash=dash),
        ]
        low.append(Trace(ms, w, "", roles[name], dash=dash, width=1.5))
    text = (
        "The average reversal, the new direction positive. Dry friction jumps at 0; backlash leaves a spike that comes later the "
        "slower the reversal; presliding friction turns round gradually."
    )
    panels = (
        Panel(missing_label(axis), tuple(top), height=1.5),
        Panel(f"velocity [{velocity_unit(axis)}]", tuple(low)),
    )
    return Chart("missing-reversals", "time from the reversal [ms]", panels, text, height=420)


def no_reversals(run: Run) -> str:
    """Why there is no average reversal of a run whose torques are known; "" where there is one."""
    assert run.torque is not None and run.dhat is not None
    return reversal_averages(run.measured, run.dhat, run.torque, run.dt).none.capitalize()


def residual_spectrum(run: Run, noise: float, axis: str) -> Chart:
    """Where in frequency the error of the velocity lies."""
    traces = []
    for values, role, label in ((run.linear, "linear", "linear model"), (run.extended, "extended", "extended model")):
        if values is not None:
            error = run.measured - values
            # Of a run that runs away, what there is of it.
            lines = spectrum(error[: max(int(np.argmax(~np.isfinite(np.append(error, np.nan)))), 32)], run.dt)
            traces.append(Trace(lines.frequency, lines.density, label, role))
    f = traces[0].x
    floor = np.full(2, noise * math.sqrt(2.0 * run.dt))
    traces.append(Trace(f[[0, -1]], floor, "white noise of the sensor", "noise", dash="dash", width=1.8))
    text = "The error of the free-run simulation over frequency: a hill is a resonance that the model has not, or has elsewhere."
    panel = Panel(f"error [{velocity_unit(axis)}/√Hz]", tuple(traces), log=True)
    return Chart("residual-frequency", "frequency [Hz]", (panel,), text, log=True, height=330)


def held_out_chart(run: Run, noise: float, key: str, axis: str) -> Chart:
    """What both models miss of data that were held out."""
    first = run.held_from or 0
    t = run.time[first:]
    traces = [series(t, (run.measured - run.linear)[first:], "linear model", "linear", width=1.0)]
    if run.extended is not None:
        traces.append(series(t, (run.measured - run.extended)[first:], "extended model", "extended", width=1.0))
    v = velocity_unit(axis)
    models = (run.linear, run.extended)
    limits, said = _error_limits([(run.measured - m)[first:] for m in models if m is not None])
    panel = Panel(f"error [{v}]", tuple(traces), (Band(-2.0 * noise, 2.0 * noise, "±2 std of the noise"),), limits=limits)
    text = f"Measured minus simulated velocity, one continuous free run.{said}"
    if first:
        text += (
            " The curves are those of the reported model, which has seen these samples; the figures in the table are of a model "
            "fitted to the samples before them."
        )
    return Chart(f"held-out-{key}", "time [s]", (panel,), text, height=300, shared=True)


def response_chart(r: Any, axis: str) -> Chart:
    """Bode diagram of the model against what the record shows by itself, with coherence."""
    m = r.measured
    sure = m.coherence > m.threshold
    # Magnitude and phase deviate by 1/sqrt(2) of what the complex value does.
    curves = [(m.frequency[sure], m.value[sure], "record", "measured", "means", 0.0, math.sqrt(2.0) * m.std[sure])]
    if r.simulated is not None:
        s = r.simulated
        curves.append((s.frequency, s.value, "model, estimated the same way", "extended", "line", 1.5, None))
    curves.append((r.fine, r.model, "linear part, exact", "linear", "line", 1.0, None))
    size, phase = [], []
    for f, g, label, role, kind, width, spread in curves:
        style: dict[str, Any] = {"kind": kind, "width": width, "dash": "dash" if role == "linear" else "solid"}
        size.append(Trace(f, np.abs(g), label, role, spread=spread, **style))
        turns = phase_line(g) if kind == "line" else np.degrees(np.angle(g))
        phase.append(
            Trace(f, turns, "", role, spread=None if spread is None else np.degrees(spread / np.abs(g)).clip(0, 180), **style)
        )
    ticks = (-180.0, -90.0, 0.0, 90.0, 180.0)
    per = unit("N m", axis)
    sure_line = (Trace(m.frequency, m.coherence, "", "faster"), Trace(m.frequency, m.threshold, "", "noise", dash="dash"))
    panels = (
        Panel(f"|G| [{velocity_unit(axis)}/{'(N m)' if ' ' in per else per}]", tuple(size), log=True, height=1.6),
        Panel("phase [deg]", tuple(phase), limits=(-200.0, 200.0), ticks=ticks),
        Panel("coherence", sure_line, limits=(0.0, 1.05), height=0.7),
    )
    hidden = int(np.sum(~sure))
    text = f"{m.sentence} Bars: 2 standard deviations."
    if hidden:
        text += f" {hidden} of {len(sure)} points are not drawn, as their coherence is what chance gives (dashed)."
    text += " Friction and other nonlinear effects bend the record's response; the model estimated the same way has them too."
    return Chart("response", "frequency [Hz]", panels, text, log=True, height=600)


def command_chart(command: Vector, dt: float, axis: str) -> Chart:
    """The proposed experiment."""
    time: Vector = dt * np.arange(len(command), dtype=np.float64)
    panel = Panel(f"command [{velocity_unit(axis)}]", (series(time, command, "", "effect", width=1.5),))
    return Chart("next-command", "time [s]", (panel,), "The velocity command of the next experiment.", height=260, shared=True)


def band(run: Run) -> tuple[Band, ...]:
    """What the missing torque cannot be told from zero."""
    return (Band(-2.0 * run.std, 2.0 * run.std, "±2 std of the estimate"),) if run.std > 0.0 else ()


def _with_band(limits: tuple[float, float], std: float) -> tuple[float, float]:
    """Limits that hold the band of what cannot be told from zero too."""
    return min(limits[0], -2.6 * std), max(limits[1], 2.6 * std)


def _error_limits(errors: Sequence[Vector]) -> tuple[tuple[float, float] | None, str]:
    """Limits that outliers do not stretch, and what is said then; (None, "") where nothing stands out."""
    size = np.max([np.abs(np.nan_to_num(e)) for e in errors], axis=0)
    usual = float(np.quantile(size, 0.995))
    if not float(size.max()) > 6.0 * usual > 0.0:
        return None, ""
    limit = 3.0 * usual
    return (
        -limit,
        limit,
    ), f" {int(np.sum(size > limit))} samples leave the panel of the error, the largest is {number(float(size.max()), 2)}."


def missing_label(axis: str) -> str:
    """Title of the axis of the missing torque."""
    return f"missing {torque_word(axis)} [{unit('N m', axis)}]"


def torque_word(axis: str) -> str:
    """What drives the axis."""
    return "torque" if axis == "rotary" else "force"
