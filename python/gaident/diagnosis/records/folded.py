"""A sensor that shows the speed without its sign: the velocity is reflected at zero.

An axis that passes zero with a slope a shows |w|: -a before, +a after, while the torque stays as it is.
No axis can do that: its acceleration would have to jump while the torque does not.
With the sign of what follows reversed, the slope is continuous.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.data.record import Record
from gaident.models.starts import noise_std
from gaident.policy.table import POLICY

__all__ = ["ADVICE", "FOLDED", "folded"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

FOLDED = Text("the sensor shows the speed without its sign")

ADVICE = say(
    "No cause can be named: the sensor shows the speed without its sign. The velocity falls to zero and rises again while the "
    "{torque} stays as it is, so that the direction of motion is not known; log a signed velocity, or the position."
)

WINDOW = 5  # no decision: the samples that two slopes and a curvature on either side of a turning point take


def folded(rec: Record) -> bool:
    """Whether the velocity is an absolute value."""
    w, u = rec.velocity, rec.torque
    top = float(w.max())
    if u is None or len(w) < WINDOW or not top > 0.0 or float(w.min()) < -POLICY.still * top:
        return False
    around = np.lib.stride_tricks.sliding_window_view(w, WINDOW)
    # no decision: a formula: slopes over two samples
    before, after = 0.5 * (around[:, 2] - around[:, 0]), 0.5 * (around[:, 4] - around[:, 2])
    usual = float(np.quantile(np.abs(np.diff(w)), POLICY.usual_slope))
    steep = max(POLICY.folded_steep * usual, POLICY.above_noise * noise_std(w))
    turning = (before < -steep) & (after > steep) & (around[:, 2] <= np.minimum(around[:, 1], around[:, 3]))
    held = np.ptp(np.lib.stride_tricks.sliding_window_view(u[:-1], WINDOW - 1), axis=1) < POLICY.still * float(np.ptp(u))
    # The sign changes just before or just after the lowest sample.
    turned = [_curvature(around * np.where(np.arange(WINDOW) < first, 1.0, -1.0)) for first in (2, 3)]
    through = np.minimum(*turned) < POLICY.folded_smoother * _curvature(around)
    return int(np.sum(turning & held & through)) >= POLICY.folded_points


def _curvature(rows: Matrix) -> Vector:
    return np.asarray(np.abs(np.diff(rows, 2, axis=1)).sum(axis=1))
