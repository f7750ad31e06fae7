"""The picture of a diagnosis: what the model misses, over velocity, angle, reversals, time and frequency.

A pure function of arrays, whose matplotlib Figure needs no display and shares no state.
What it shows stands in diagnosis_charts.py, which the report draws too.
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
from gaident.show.draw import grid_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_evidence"]

Vector = NDArray[np.float64]


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
    position [rad]; drive_torque, the controller's [N m]; noise_std [rad/s]; curve: (velocity, torque,
    label) of a named effect; arrays (n,).
    """
    dt = float(time[1] - time[0])
    missing = f"Missing {word('torque', axis)}"
    after = None if extended is None else measured - extended
    over_time = _over_time(error_panel(time, measured - simulated, after, noise_std, axis))
    over_frequency = residual_spectrum(measured - simulated, after, dt, noise_std, axis)
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
        f"{missing}: lines per {'turn' if axis == 'rotary' else 'metre'}",
        "Error over frequency",
        f"{missing} around reversals",
    )
    titles = [f"{letter}  {head}" for letter, head in zip("abcdef", heads, strict=True)]
    fig = grid_figure(charts, 12.5, 9.6, titles)
    if title:
        fig.suptitle(title)
    return fig


def _over_time(panel: Panel) -> Chart:
    return Chart("", "time [s]", (panel,), "")
