"""The prefilter of output errors: the velocity error as the torque error that makes it.

Where a model is not exact, what is minimised decides what comes out.
A prefilter L weighs the frequencies of the errors (Ljung 1999, chapter 14),

    e_L(n) = L(q) e(n),   minimise sum of e_L^2

The free run of a rigid axis integrates every torque that the model lacks: e = d/(J s + B).
Its errors are slow, and a long record contains few of them that are independent. With

    L(s) = (s + c) F(s)

and c = B/J, e_L is the lacking torque d over the inertia, as in the inverse-dynamics regression, but of a simulation: every
effect, several masses and a closed loop take part in it.
A larger c counts the velocity as well; `balance` gives the one at which both count alike.
There a torque that the model lacks still biases the inertia: the slope of its error is the smaller, the heavier the axis.
F is the zero-phase low-pass of that regression: differences of a sampled velocity say nothing above its cutoff.
L is fixed for all hypotheses, and scaled so that white noise keeps its variance.

L. Ljung, System Identification: Theory for the User, 2nd ed., Prentice Hall 1999.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import zero_phase

__all__ = ["Prefilter"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Prefilter:
    """L(s) = (s + corner) F(s), F a Butterworth low-pass of this order, forward and backward.

    dt: sample time [s]; corner: c [rad/s]; cutoff: of F [Hz], below half the sampling frequency.
    """

    dt: float
    corner: float
    cutoff: float
    order: int

    def of(self, E: Matrix, lengths: Sequence[int]) -> Matrix:
        """Rows of L e, each record by itself. E: rows of velocity errors of all records [rad/s]."""
        return np.concatenate([self._of(part) for part in np.split(E, np.cumsum(lengths)[:-1], axis=1)], axis=1)

    def balance(self, error: Vector, lengths: Sequence[int]) -> float:
        """The corner [rad/s] at which an error behind the low-pass has as much power in its slope as in itself."""
        smooth = [self._smooth(part[None, :]) for part in np.split(error, np.cumsum(lengths)[:-1])]
        slope = sum(float(np.sum(np.gradient(e, self.dt, axis=1) ** 2)) for e in smooth)
        return float(np.sqrt(slope / max(sum(float(np.sum(e**2)) for e in smooth), 1e-300)))

    def _of(self, E: Matrix) -> Matrix:
        smooth, slope = self._smooth(E), 1.0 / (self._gain * self.dt)
        out = smooth * (self.corner / self._gain)
        out[:, 1:-1] += (0.5 * slope) * (smooth[:, 2:] - smooth[:, :-2])  # no decision: a formula: a central difference
        out[:, 0] += slope * (smooth[:, 1] - smooth[:, 0])
        out[:, -1] += slope * (smooth[:, -1] - smooth[:, -2])
        return out

    def _smooth(self, E: Matrix) -> Matrix:
        padding = int(2.0 / (self.cutoff * self.dt))  # samples, two periods of the cutoff
        return zero_phase(self._sections, E, min(padding, E.shape[1] - 1))

    @cached_property
    def _sections(self) -> Any:
        from scipy.signal import butter

        return butter(self.order, 2.0 * self.cutoff * self.dt, output="sos")  # no decision: a formula

    @cached_property
    def _gain(self) -> float:
        """Rms of L over all frequencies."""
        from scipy.signal import sosfreqz

        angle, response = sosfreqz(self._sections, 1 << 14)
        power = np.abs(response) ** 4 * ((np.sin(angle) / self.dt) ** 2 + self.corner**2)
        return float(np.sqrt(power.mean()))
