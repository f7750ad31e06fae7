"""The gain of a position controller around a velocity loop that is tuned."""

from __future__ import annotations

import numpy as np

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY
from gaident.remedies.loops import Loops, position_frequencies
from gaident.remedies.margins import gain_margins, phase_margins
from gaident.remedies.search import Asked, Search

__all__ = ["position_gain"]

GAINS = np.geomspace(1e-3, 1.0, 61)  # no decision: a grid: of the velocity loop's bandwidth


def position_gain(search: Search, cascade: Cascade, asked: Asked) -> float | None:
    """The largest gain [1/s] with which every drive keeps the margins and the step hardly overshoots; None: there is none."""
    loops = Loops(search.plants, cascade, search.responses)
    placed = loops.placed(cascade.position_every(search.plants.period))
    omega = position_frequencies(placed.period, POLICY.tuned_points)
    response = placed.response(omega)
    best = None
    for gain in 2.0 * np.pi * float(np.min(loops.bandwidths)) * GAINS:
        L = gain * response
        kept = np.min(phase_margins(L)) >= asked.phase_margin and np.min(gain_margins(L)) >= asked.gain_margin
        if not (kept and np.max(np.abs(L / (1.0 + L))) <= POLICY.position_peak and placed.stable(gain).all()):
            break
        best = float(gain)
    return best
