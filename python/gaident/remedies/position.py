"""The gain of a position controller around a velocity loop that is tuned."""

from __future__ import annotations

import numpy as np

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY
from gaident.remedies.loops import Loops, Placed, overshoot, position_frequencies
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
    kept = []
    gains, most = 2.0 * np.pi * float(np.min(loops.bandwidths)) * GAINS, asked.most[2]
    for gain in np.append(gains[gains < most], most) if np.isfinite(most) else gains:
        L = gain * response
        margins = np.min(phase_margins(L)) >= asked.phase_margin and np.min(gain_margins(L)) >= asked.gain_margin
        if not (margins and placed.stable(gain).all()):
            break
        kept.append(float(gain))
    own = Placed(placed.A[:1], placed.B[:1], placed.period)
    return next((gain for gain in reversed(kept) if overshoot(own.step(gain))[0] <= POLICY.position_overshoot), None)
