"""Pictures of a diagnosis: what the model misses, over velocity, angle, reversals, time and frequency.

Pure functions of arrays; each returns a matplotlib Figure that needs no display and shares no state.
What they show stands in diagnosis_charts.py, which the report draws too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.axis import word
from gaident.show.chart import Chart, Panel
from gaident.show.diagnosis_charts import (
    Curve,
    error_panel,
    missing_orders,
    missing_over_velocity,
    missing_reversals,
    residual_spectrum,
    velocity_panel,
)
from gaident.show.draw import chart_figure, grid_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_evidence", "plot_orders", "plot_residual", "plot_reversals", "plot_torque_velocity"]

Vector = NDArray[np.float64]


def plot_torque_velocity(
    velocity: Vector, dhat: Vector, dt: float, std: float | None = None, curve: Curve | None = None, axis: str = "rotary"
) -> Figure:
    """Missing torque [N m] against velocity [rad/s], accelerating and decelerating apart, the mean per bin with its spread.

    std: of dhat [N m], drawn as the band that zero cannot be told from. curve: (velocity, torque, label) of a named effect.
    """
    chart = missing_over_velocity(velocity, dhat, dt, std or 0.0, curve, axis)
    return chart_figure(chart, 7.5, 4.8, [f"Missing {word('torque', axis)} against velocity"])


def plot_orders(position: Vector, dhat: Vector, velocity: Vector, highest: float | None = None, axis: str = "rotary") -> Figure:
    """Lines per turn in the missing torque, up to the order `highest` (None: 40), with the level that chance hardly passes."""
    return chart_figure(missing_orders(position, dhat, velocity, axis, highest), 7.5, 3.8, [_lines_per(axis)])


def plot_reversals(velocity: Vector, dhat: Vector, drive_torque: Vector, dt: float, axis: str = "rotary") -> Figure:
    """Missing torque and velocity around reversals, averaged with the new direction as positive; small and large torque apart."""
    chart = missing_reversals(velocity, dhat, drive_torque, dt, axis)
    return chart_figure(chart, 7.5, 5.0, ["Around a reversal, the new direction positive"])


def plot_residual(time: Vector, residual: Vector, noise_std: float, after: Vector | None = None, axis: str = "rotary") -> Figure:
    """Measured minus simulated velocity [rad/s] over time and frequency, against the noise floor `noise_std` [rad/s].

    after: the residual of the extended model, drawn in front.
    """
    charts = _residual(time, residual, noise_std, after, axis)
    return grid_figure([[chart] for chart in charts], 7.5, 5.4, ["Error over time", "Error over frequency"])


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
    missing = f"Missing {word('torque', axis)}"
    after = None if extended is None else measured - extended
    over_time, over_frequency = _residual(time, measured - simulated, noise_std, after, axis)
    charts = (
        (
            _over_time(velocity_panel(time, measured, simulated, extended, None, axis)),
            missing_over_velocity(measured, dhat, dt, std or 0.0, curve, axis),
        ),
        (over_time, missing_orders(position, dhat, measured, axis)),
        (over_frequency, missing_reversals(measured, dhat, drive_torque, dt, axis)),
    )
    heads = (
        "Measured and simulated",
        f"{missing} against velocity",
        "Error over time",
        _lines_per(axis),
        "Error over frequency",
        f"{missing} around reversals",
    )
    titles = [f"{letter}  {head}" for letter, head in zip("abcdef", heads, strict=True)]
    fig = grid_figure(charts, 12.5, 9.6, titles, bold=True)
    if title:
        fig.suptitle(title)
    return fig


def _residual(time: Vector, residual: Vector, noise: float, after: Vector | None, axis: str) -> tuple[Chart, Chart]:
    """The error over time and over frequency."""
    dt = float(time[1] - time[0])
    return _over_time(error_panel(time, residual, after, noise, axis)), residual_spectrum(residual, after, dt, noise, axis)


def _over_time(panel: Panel) -> Chart:
    return Chart("", "time [s]", (panel,), "")


def _lines_per(axis: str) -> str:
    return f"Missing {word('torque', axis)}: lines per {'turn' if axis == 'rotary' else 'metre'}"
