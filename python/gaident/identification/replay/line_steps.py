"""Steps of the logged torque from line to line of a slow log, and what the log does not tell of them.

What the velocity did between the lines adds up in the integral, as a random walk; so steps D are compared, not torques.
Of a command that jumps between two lines the share s is unknown that came early, see `control.between`:

    D(n) = D_usual(n) + sum over intervals i of  c_i(n) (s_i - s_i0) + v(n)

c_i: the controller's answer to a pulse of the command in that interval.  v: an autoregression; both sides are whitened by it.
Behind filters one share moves several steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import Unsure
from gaident.control.filtering import filtered
from gaident.identification.noise import Autoregression, autocorrelation, autoregression_of, highest_order
from gaident.policy.table import POLICY

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["LineSteps"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

BESIDE = 2  # no decision: lines beside a limit: between them it may have acted too
MEDIAN = 1.4826  # no decision: a formula: deviation of normal numbers over the median of their sizes


@dataclass(frozen=True, eq=False)
class LineSteps:
    """used (n - 1,): steps between limits, not beside one; unsure: what the n lines do not tell of the command."""

    used: NDArray[np.bool_]
    unsure: Unsure

    @classmethod
    def of(cls, stretch: NDArray[np.intp], unsure: Unsure) -> LineSteps:
        """stretch (n,): number of each line's stretch between two limits, -1: none."""
        used = (stretch[1:] >= 0) & (stretch[1:] == stretch[:-1])
        used = np.convolve(np.pad(used, BESIDE, constant_values=True), np.ones(2 * BESIDE + 1), "valid") > 2 * BESIDE
        return cls(used, unsure)

    def noise_of(self, off: Vector, rounding: float) -> Autoregression:
        """Of steps (n - 1,) [N m] where they are used, without what the shares are still off by: the quiet lines show its size.

        rounding: the least deviation [N m].
        """
        quiet = max(MEDIAN * float(np.median(np.abs(off[self.used]))), rounding)
        most = POLICY.above_noise * quiet
        count = len(off[self.used])
        noise = autoregression_of(autocorrelation(np.clip(off, -most, most), highest_order([count])), count)
        return Autoregression(noise.phi, max(noise.std, rounding))

    def whitened(self, rows: Matrix, noise: Autoregression) -> Matrix:
        """Rows of steps (k, n - 1) over their noise; 0 where a limit lies within the filter."""
        rows = filtered(np.append(1.0, -noise.phi), np.ones(1), rows, [rows.shape[1]]) / noise.std
        return np.where(self.reached(noise.order), rows, 0.0)

    def reached(self, order: int) -> NDArray[np.bool_]:
        """Steps before which `order` others are used (n - 1,)."""
        counts = np.cumsum(np.append(0, self.used))
        first = np.maximum(np.arange(len(self.used)) - order, 0)
        return np.asarray(counts[1:] - counts[first] == np.minimum(np.arange(len(self.used)), order) + 1)

    def columns(self, share: Vector, pulse: Vector, noise: Autoregression) -> csc_array:
        """What the whitened steps change with each share (n - 1, m).

        pulse (k,): the controller's torque [N m] at its samples after a command of 1 rad/s in the first of them.
        """
        from scipy.sparse import csc_array

        every, unsure = self.unsure.every, self.unsure
        middle, n = unsure.middle(share), len(self.used)
        lines = len(pulse) // every
        # The torque at the lines behind a pulse at sample p of an interval, from its own line on.
        answers = np.array([np.append(0.0, pulse[every - p :: every])[:lines] for p in range(every)])
        shapes = filtered(np.append(1.0, -noise.phi), np.ones(1), np.diff(answers, axis=1), [lines - 1])
        size = np.abs(shapes).max(axis=0)
        lasts = int(np.flatnonzero(size > POLICY.negligible * size.max(initial=0.0)).max(initial=0)) + 1
        rows = unsure.at[:, None] + np.arange(lasts)
        values = shapes[middle, :lasts] * (unsure.rise * (every - 1) / noise.std)[:, None]
        inside = rows < n
        inside &= np.append(self.reached(noise.order), False)[np.minimum(rows, n)]
        of = np.broadcast_to(np.arange(len(unsure.at))[:, None], rows.shape)
        return csc_array((values[inside], (rows[inside], of[inside])), shape=(n, len(unsure.at)))
