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
from gaident.remedies.steady.laws import FrictionLaw
from gaident.remedies.steady.plateaus import Plateau
from gaident.results.retuning import Retuning
from gaident.show.draw import new_figure
from gaident.show.report.views import LoopCurves

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["loop_curves", "plot_friction", "plot_retuning"]

COLOURS = {"before": "#888888", "after": "#1f77b4"}
SHOWN = 1e-3  # no decision: drawn: lowest size of a loop
STYLES = ("-", "--")
NAMED = 8  # no decision: drawn: records that a legend names
LOWEST, CURVE = 1e-3, 400  # no decision: drawn: lowest speed of a law, of the highest, and its points


def plot_friction(
    velocity: NDArray[np.float64],
    rows: Sequence[tuple[str, NDArray[np.float64], NDArray[np.float64]]],
    axis: str,
    plateaus: Sequence[Plateau] = (),
    laws: Sequence[FrictionLaw] = (),
) -> Figure:
    """Torque over the velocity, a line with the scatter of its bins for each record: (name, mean, scatter); no rows: left out.

    Beside it, where speeds are held, those with their deviations, the law and the best of its rivals.
    """
    panels = [rows] * bool(rows) + [plateaus] * bool(plateaus)
    figure = new_figure(8.0 if len(panels) < 2 else 12.0, 5.0)
    axes = list(figure.subplots(1, len(panels), squeeze=False)[0])
    named = len(rows) <= NAMED and len({p.record for p in plateaus}) <= NAMED
    if rows:
        ax = axes[0]
        for name, mean, scatter in rows:
            ax.errorbar(velocity, mean, scatter, marker=".", capsize=2.0, label=name if named else None)
        ax.set_ylabel(said(say("{torque} without that of the {inertia}"), axis) + f" [{unit('N m', axis)}]")
        if named:
            ax.legend()
    if plateaus:
        _held_speeds(axes[-1], plateaus, laws, axis, named)
    for each in axes:
        each.axhline(0.0, color="black", linewidth=0.5)
        each.set_xlabel(f"velocity [{velocity_unit(axis)}]")
    return figure


def _held_speeds(ax: Axes, plateaus: Sequence[Plateau], laws: Sequence[FrictionLaw], axis: str, named: bool) -> None:
    for name in dict.fromkeys(p.record for p in plateaus):
        w, torque, std = zip(*((p.velocity, p.torque, p.std) for p in plateaus if p.record == name), strict=True)
        ax.errorbar(w, torque, std, fmt=".", capsize=2.0, label=name if named else None)
    fastest = max(abs(p.velocity) for p in plateaus)
    for law, style in zip(laws, STYLES, strict=False):
        label: str | None = said(law.name, axis)
        for way in sorted({float(np.sign(p.velocity)) for p in plateaus}):
            speeds = way * np.linspace(LOWEST, 1.0, CURVE) * fastest
            ax.plot(speeds, law.torque(speeds), style, color="black", linewidth=1.0, label=label)
            label = None
    ax.set_ylabel(said(say("{torque} at held speeds"), axis) + f" [{unit('N m', axis)}]")
    if named or laws:
        ax.legend(fontsize="small")


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
    answer.set_ylabel(f"velocity, command 1 [{velocity_unit(axis)}]")
    answer.set_xlabel("time after a step of the command [s]")
    answer.set_xlim(0.0, _shown_time(result))
    size.legend()
    return figure


def _shown_time(result: Retuning) -> float:
    times = [f.settling_time.value for f in (result.before, result.after)]
    known = [t for t in times if np.isfinite(t)]
    return 2.0 * max(known, default=100.0 * result.period)
