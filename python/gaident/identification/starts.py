"""How the loop stood when a record began."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.models.controller import PI

__all__ = ["noise_std", "starts_moving"]


def noise_std(velocity: NDArray[np.float64]) -> float:
    """Standard deviation of white noise on a smooth signal, from its third differences (median, so robust) [rad/s].

    A third difference of white noise has the variance 1 + 9 + 9 + 1 = 20 times the noise's.
    """
    return float(1.4826 * np.median(np.abs(np.diff(velocity, 3))) / np.sqrt(20.0))


def starts_moving(rec: Record, controller: PI | None) -> bool:
    """Whether the record does not start at rest.

    At rest the first velocity is noise: within six standard deviations of it, or one step of a quantised signal, of zero. In the
    continuous loop a command at sample 0 passes through at once, so a first velocity between 0 and 0.6 of that command is no motion.
    """
    w = rec.velocity
    steps = np.abs(np.diff(w))
    smallest = float(steps[steps > 0.0].min()) if np.any(steps > 0.0) else 0.0
    quantum = smallest if np.mean(steps == 0.0) > 0.1 else 0.0  # repeats betray a quantised signal
    tolerance = max(6.0 * noise_std(w), 1.5 * quantum, 1e-3 * float(np.abs(w).max()))
    first = float(w[0])
    if controller is not None and controller.loop == "continuous" and rec.command is not None and rec.command[0] != 0.0:
        passed = first / float(rec.command[0])
        if 0.0 <= passed <= 0.6:
            return False
    return abs(first) > tolerance
