"""Pictures: the velocity loop and its step before and after, and the friction of records."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.axis import said, say, unit, velocity_unit
from gaident.control.cascade import cascade_of
from gaident.control.controller import Controller
from gaident.policy.table import POLICY
from gaident.remedies.loops import Loops, frequencies_of
from gaident.remedies.plants import sampled_plants
from gaident.results.retuning import Retuning
from gaident.show.draw import new_figure
from gaident.show.report.views import LoopCurves

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["loop_curves", "plot_friction", "plot_retuning"]

COLOURS = {"before": "#888888", "after": "#1f77b4"}
SHOWN = 1e-3  # no decision: drawn: lowest size of a loop


def plot_friction(
    velocity: NDArray[np.float64],
    rows: Sequence[tuple[str, NDArray[np.float64], NDArray[np.float64]]],
    axis: str,
) -> Figure:
    """Torque over the velocity, a line with the scatter of its bins for each record: (name, mean, scatter)."""
    figure = new_figure(8.0, 5.0)
    ax = figure.subplots()
    for name, mean, scatter in rows:
        ax.errorbar(velocity, mean, scatter, marker=".", capsize=2.0, label=name)
    ax.axhline(0.0, color="black", linewidth=0.5)
    ax.set_xlabel(f"velocity [{velocity_unit(axis)}]")
    ax.set_ylabel(said(say("{torque} without that of the {inertia}"), axis) + f" [{unit('N m', axis)}]")
    ax.legend()
    return figure


def loop_curves(result: Retuning) -> tuple[LoopCurves, LoopCurves]:
    """The velocity loop before and after, without frequencies at which it is too small to matter."""
    before, after = (_curves(result, name, c) for name, c in (("before", result.given), ("after", result.controller)))
    return before, after


def _curves(result: Retuning, name: str, controller: Controller) -> LoopCurves:
    plants = sampled_plants([result.model.linear], result.period, controller.delay, result.velocity_age > 0.0)
    frequencies = frequencies_of(plants, POLICY.checked_points, POLICY.checked_near)
    loops = Loops(plants, cascade_of(controller), plants.responses(frequencies))
    hertz, L = loops.responses.omega[0] / (2.0 * np.pi), loops.L[0]
    seen = np.abs(L) > SHOWN
    if not loops.stable.all():
        return LoopCurves(name, hertz[seen], L[seen], None, None)
    velocity, _, dt = loops.step()
    time, end = dt * np.arange(velocity.shape[1], dtype=np.float64), _shown_time(result)
    short = time <= end
    answer = velocity[0, short]  # at rest from its end on
    return LoopCurves(name, hertz[seen], L[seen], np.append(time[short], end), np.append(answer, answer[-1]))


def plot_retuning(result: Retuning, axis: str = "rotary") -> Figure:
    """Size and phase of the broken loop, and the answer to a unit step of the velocity command."""
    figure = new_figure(8.0, 8.0)
    size, phase, answer = figure.subplots(3, 1)
    for one in loop_curves(result):
        colour = COLOURS[one.name]
        size.loglog(one.frequency, np.abs(one.loop), color=colour, label=one.name)
        phase.semilogx(one.frequency, np.degrees(np.unwrap(np.angle(one.loop))), color=colour)
        if one.time is not None and one.velocity is not None:
            answer.plot(one.time, one.velocity, color=colour)
    size.axhline(1.0, color="black", linewidth=0.5)
    phase.axhline(-180.0, color="black", linewidth=0.5)
    size.set_ylabel("size of the loop")
    phase.set_ylabel("phase [deg]")
    phase.set_xlabel("frequency [Hz]")
    answer.set_ylabel(f"velocity [{velocity_unit(axis)}]")
    answer.set_xlabel("time after a step of 1 [s]")
    answer.set_xlim(0.0, _shown_time(result))
    size.legend()
    return figure


def _shown_time(result: Retuning) -> float:
    times = [f.settling_time.value for f in (result.before, result.after)]
    known = [t for t in times if np.isfinite(t)]
    return 2.0 * max(known, default=100.0 * result.period)
