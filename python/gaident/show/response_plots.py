"""Bode diagram of a model against the frequency response that its record shows by itself, with the coherence below."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.axis import said, unit, word
from gaident.policy.table import POLICY
from gaident.results.frequency import Responses
from gaident.show.chart import Chart, Panel, Trace
from gaident.show.draw import chart_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["phase_line", "plot_response", "response_chart"]


def phase_line(response: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase [deg] within 180 either way, to be drawn as a line: not a number, a gap, where it goes on at the other end."""
    phase = np.degrees(np.angle(response))
    phase[1:][np.abs(np.diff(phase)) > 180.0] = math.nan
    return phase


def plot_response(responses: Responses, hz: bool = False, axis: str = "rotary", title: str = "") -> Figure:
    """Magnitude, phase and coherence from torque to velocity as a Figure, see `response_chart`."""
    way = (
        " (joint input-output, by the command)"
        if responses.measured.instrument
        else " (H1: biased where a loop's noise is large)"
    )
    head = title or f"{word('Torque', axis)} to velocity{'' if responses.measured.given else way}"
    return chart_figure(response_chart(responses, axis, hz), 7.5, 6.6, [head])


def response_chart(r: Responses, axis: str, hz: bool = True) -> Chart:
    """Bode diagram of the model against what the record shows by itself, with coherence; over Hz, or rad/s for hz=False.

    Points whose coherence chance could give are left out.
    Bars are 2 standard deviations of the magnitude and of the phase, 1/sqrt(2) of the complex value's each.
    """
    m, s, scale = r.measured, r.simulated, 1.0 if hz else math.tau
    sure = m.coherence > m.threshold
    f, g, spread = scale * m.frequency[sure], m.value[sure], math.sqrt(2.0) * m.std[sure]
    angle = np.degrees(spread / np.abs(g)).clip(0.0, 180.0)
    name = "measured, ±2 std" if m.given else "record, ±2 std"
    size = [Trace(f, np.abs(g), name, "measured", "means", 0.0, spread=spread)]
    phase = [Trace(f, np.degrees(np.angle(g)), "", "measured", "means", 0.0, spread=angle)]
    if s is not None:
        size.append(Trace(scale * s.frequency, np.abs(s.value), "model, estimated the same way", "extended", width=1.5))
        phase.append(Trace(scale * s.frequency, phase_line(s.value), "", "extended", width=1.5))
    own = "model" if m.given else "its linear part, exact"
    size.append(Trace(scale * r.fine, np.abs(r.model), own, "linear", width=1.0, dash="dash"))
    phase.append(Trace(scale * r.fine, phase_line(r.model), "", "linear", width=1.0, dash="dash"))
    often = f"reached by chance, 1 of {1.0 / POLICY.coherence_level:.0f}"
    chance = Trace(scale * m.frequency, m.threshold, often, "noise", dash="dash")
    none = "" if len(f) else "the record shows nothing here: its coherence is nowhere above chance"
    coherence = [Trace(scale * m.frequency, m.coherence, "", "faster"), *(() if m.given else (chance,))]
    panels = (
        Panel(f"magnitude [{unit('rad/s/(N m)', axis)}]", tuple(size), log=True, height=1.6),
        Panel("phase [deg]", tuple(phase), limits=(-200.0, 200.0), ticks=(-180.0, -90.0, 0.0, 90.0, 180.0), note=none),
        *((Panel("coherence", tuple(coherence), limits=(0.0, 1.05), height=0.7),) if np.any(m.coherence < 1.0) else ()),
    )
    hidden = int(np.sum(~sure))
    text = f"{said(m.sentence, axis)} Bars: 2 standard deviations."
    if hidden:
        text += f" {hidden} of {len(sure)} points are not drawn, as their coherence is what chance gives (dashed)."
    if s is not None:
        text += (
            " Friction and other nonlinear effects change the record's response; the model estimated the same way has them too."
        )
    return Chart("response", "frequency [Hz]" if hz else "frequency [rad/s]", panels, text, log=True, height=600)
