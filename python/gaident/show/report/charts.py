"""The report's charts: what each shows of a run, as data."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gaident.axis import unit, velocity_unit, word
from gaident.show.chart import BINS, Chart, Panel, Trace, series
from gaident.show.diagnosis_charts import error_panel, missing_label, missing_orders, std_band, velocity_panel
from gaident.show.diagnosis_numbers import over_period, smoothed
from gaident.show.report.views import RecordView, Vector
from gaident.show.wording import number

__all__ = [
    "command_chart",
    "held_out_chart",
    "missing_over_place",
    "missing_over_time",
    "run_chart",
]


def run_chart(run: RecordView, noise: float, key: str, axis: str) -> Chart:
    """Measured against simulated velocity, below it what is left, below that the torque."""
    kind = word("torque", axis)
    text = "Error: measured minus simulated. Drag (or use the figure's buttons) to zoom all panels, double-click to come back."
    errors = _errors(run)
    limits, said = _error_limits([e for e in errors if e is not None])
    text += said
    panels = [
        velocity_panel(run.time, run.measured, run.linear, run.extended, run.command, axis, run.held_out_from or 0),
        error_panel(run.time, *errors, noise, axis, limits, labelled=False),
    ]
    if run.torque is not None:
        panels.append(
            Panel(f"{kind} [{unit('N m', axis)}]", (series(run.time, run.torque, "", "faster", width=1.0),), height=0.7)
        )
        if not run.torque_logged:
            text += f" The {kind} is not logged: it is what the controller makes of command and measured velocity."
    return Chart(key, "time [s]", tuple(panels), text + depth(run), link=key, height=590 if len(panels) > 2 else 480, shared=True)


def depth(run: RecordView) -> str:
    """How far zooming shows more."""
    n = len(run.time)
    if n <= 4 * BINS:
        return f" All {n} samples are drawn."
    stretch = n // BINS
    return (
        f" {n} samples, drawn as the least and greatest of every {stretch} ({number(1e3 * stretch * run.dt, 2)} ms): "
        "no peak is lost, but zooming deeper shows no more."
    )


def missing_over_place(run: RecordView, dhat: Vector, axis: str) -> tuple[Chart, ...]:
    """Lines per turn, and the mean over one turn; on a linear axis, and where it turns less than that, over the travel."""
    rotary, travel = axis == "rotary", float(np.ptp(run.position)) or 1.0
    whole = rotary and travel >= math.tau
    period = math.tau if whole else travel
    lines = missing_orders(run.position, dhat, run.measured, axis)
    charts = [lines] if lines.panels[0].traces else []
    ways = [over_period(run.position, dhat, run.measured, period, direction=way) for way in (0, 1, -1)]
    mean = ways[0]
    if len(mean.x) > 3:

        def shown(x: Vector) -> Vector:
            place = x if whole else x + float(run.position.min())
            return np.degrees(place) if rotary else place

        traces = [
            Trace(shown(one.x), one.mean, label, role, width=1.2)
            for one, label, role in zip(ways[1:], ("forwards", "backwards"), ("faster", "slower"), strict=True)
            if len(one.x) > 3  # no decision: printed: points of a curve
        ]
        error = Trace(
            shown(mean.x), mean.mean, "mean ± its standard error", "ink", "means", spread=mean.std / np.sqrt(mean.count)
        )
        text = f"The same over {'one turn' if whole else 'the travel'}: what belongs to a place stands out of the bars."
        panel = Panel(missing_label(axis), (*traces, error))
        name = "angle in a turn [deg]" if whole else "angle [deg]" if rotary else "position [m]"
        charts.append(Chart("missing-place", name, (panel,), text, height=300))
    return tuple(charts)


def missing_over_time(run: RecordView, dhat: Vector, key: str, axis: str) -> Chart:
    """The missing torque as it comes, and its mean over a hundredth of the record."""
    slow = smoothed(dhat, max(3, len(dhat) // 100))
    traces = (
        series(run.time, dhat, "missing", "faster", width=0.8),
        series(run.time, slow, "mean over 1 % of the record", "ink", width=1.8),
    )
    text = (
        f"The missing {word('torque', axis)} over time. What grows or fades while the motion repeats itself drifts, as friction "
        "does with temperature. Zooms together with the velocity above."
    )
    return Chart(
        "missing-time",
        "time [s]",
        (Panel(missing_label(axis), traces, std_band(run.std)),),
        text,
        link=key,
        height=320,
        shared=True,
    )


def held_out_chart(run: RecordView, noise: float, key: str, axis: str) -> Chart:
    """What both models miss of data that were held out."""
    first = run.held_out_from or 0
    t = run.time[first:]
    linear, extended = _errors(run)
    linear, extended = linear[first:], None if extended is None else extended[first:]
    limits, said = _error_limits([e for e in (linear, extended) if e is not None])
    panel = error_panel(t, linear, extended, noise, axis, limits)
    text = f"Measured minus simulated velocity, one continuous free run.{said}"
    if first:
        text += (
            " The curves are those of the reported model, which has seen these samples; the figures in the table are of a model "
            "fitted to the samples before them."
        )
    return Chart(f"held-out-{key}", "time [s]", (panel,), text, height=300, shared=True)


def command_chart(command: Vector, dt: float, axis: str) -> Chart:
    """The proposed experiment."""
    time: Vector = dt * np.arange(len(command), dtype=np.float64)
    panel = Panel(f"command [{velocity_unit(axis)}]", (series(time, command, "", "effect", width=1.5),))
    return Chart("next-command", "time [s]", (panel,), "The velocity command of the next experiment.", height=260, shared=True)


def _errors(run: RecordView) -> tuple[Vector, Vector | None]:
    """Measured minus simulated velocity [rad/s] of the linear and of the extended model."""
    return run.measured - run.linear, None if run.extended is None else run.measured - run.extended


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
