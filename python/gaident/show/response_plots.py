"""Bode diagram of a model against the frequency response that its record shows by itself, with the coherence below."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident.show.plots import BLACK, BLUE, GREY, ORANGE, SKY, VERMILION, _figure, _locator, _tidy
from gaident.show.wording import unit, velocity_unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["phase_line", "plot_response"]


def phase_line(response: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Phase [deg] within 180 either way, to be drawn as a line: not a number, a gap, where it goes on at the other end."""
    phase = np.degrees(np.angle(response))
    phase[1:][np.abs(np.diff(phase)) > 180.0] = math.nan
    return phase


def plot_response(responses: Any, hz: bool = False, axis: str = "rotary", title: str = "") -> Figure:
    """Magnitude, phase and coherence from torque to velocity.

    responses: measured and simulated (or None), estimates with frequency [Hz], value, std, coherence, threshold; fine [Hz] and
    model: the linear part as the loop samples it. Points whose coherence chance could give are left out; bars are 2 standard
    deviations of the magnitude and of the phase, 1/sqrt(2) of the complex value's each. hz: frequencies in Hz instead of rad/s.
    """
    scale = 1.0 if hz else math.tau
    m, s = responses.measured, responses.simulated
    sure = m.coherence > m.threshold
    fig = _figure(7.5, 6.6)
    top, middle, low = fig.subplots(3, 1, sharex=True, height_ratios=(1.6, 1.0, 0.7))
    f, g, spread = scale * m.frequency[sure], m.value[sure], math.sqrt(2.0) * m.std[sure]
    size = np.abs(g)
    style: dict[str, Any] = {"fmt": "o", "color": SKY, "markersize": 3.5, "elinewidth": 1.0, "zorder": 1}
    # A bar that would reach 0 ends at a hundredth of the value: the axis is logarithmic.
    top.errorbar(f, size, [np.minimum(spread, 0.99 * size), spread], label="record, ±2 std", **style)
    if not len(f):
        text = "the record shows nothing here: its coherence is nowhere above chance"
        middle.text(0.5, 0.5, text, transform=middle.transAxes, ha="center", va="center", color=GREY, fontsize="small")
    middle.errorbar(f, np.degrees(np.angle(g)), np.degrees(np.minimum(spread / size, math.pi)), **style)
    if s is not None:
        top.plot(scale * s.frequency, np.abs(s.value), color=BLACK, linewidth=1.2, label="model, estimated the same way")
        middle.plot(scale * s.frequency, phase_line(s.value), color=BLACK, linewidth=1.2)
    dashes: dict[str, Any] = {"color": VERMILION, "linewidth": 1.0, "linestyle": (0, (4, 2))}
    top.plot(scale * responses.fine, np.abs(responses.model), label="its linear part, exact", **dashes)
    middle.plot(scale * responses.fine, phase_line(responses.model), **dashes)
    low.plot(scale * m.frequency, m.coherence, color=BLUE, linewidth=1.2)
    low.plot(scale * m.frequency, m.threshold, color=ORANGE, linewidth=1.2, linestyle="--", label="reached by chance, 1 of 20")
    top.set_xscale("log")
    top.set_yscale("log")
    middle.yaxis.set_major_locator(_locator(90.0))
    middle.set_ylim(-200.0, 200.0)
    low.set_ylim(0.0, 1.05)
    u = unit("N m", axis)
    top.set_ylabel(f"magnitude [{velocity_unit(axis)}/{'(N m)' if u == 'N m' else u}]")
    middle.set_ylabel("phase [deg]")
    low.set_ylabel("coherence")
    low.set_xlabel("frequency [Hz]" if hz else "frequency [rad/s]")
    way = "joint input-output, by the command" if m.instrument else "H1: biased where a loop's noise is large"
    top.set_title(
        title or f"{'Torque' if axis == 'rotary' else 'Force'} to velocity ({way})", fontsize="medium", loc="left", pad=20.0
    )
    for ax, columns in ((top, 3), (low, 1)):
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, frameon=False, fontsize="small", borderaxespad=0.2)
    _tidy(fig)
    return fig
