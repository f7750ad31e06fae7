"""Where the numbers of a controller are searched, as the search moves them: logarithms of what is above 0; and its algebra."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY

__all__ = [
    *("EXCHANGEABLE", "FREQUENCIES", "SMALLEST", "TIME_CONSTANTS"),
    *("exchanged", "grid_of", "inverse", "off_bound", "range_of", "slopes"),
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

SMALLEST = 1e-300  # no decision: no division by 0, and a controller of two gains of 0 is none
TIME_CONSTANTS = np.geomspace(0.3, 100.0, POLICY.grid)  # no decision: a start; controller periods
EXCHANGEABLE = ("position.gain", "velocity.ki")
SLOPE_STEP = 1e-5  # no decision: the step of a difference, of a number
FREQUENCIES = np.geomspace(2e-3, 0.4, POLICY.notches)  # no decision: a start; of the controller's sampling frequency


def grid_of(field: str, period: float) -> list[float]:
    """Starts of a number, as the search moves it."""
    grids = {
        "time_constant": np.log(TIME_CONSTANTS * period),
        "frequency": np.log(FREQUENCIES / period),
        "numerator_damping": np.array([0.1, 0.4]),  # no decision: a start
        "denominator_damping": np.log(np.array([0.7, 1.5])),  # no decision: a start
        "gain": np.log(np.geomspace(1.0, 300.0, POLICY.grid)),  # no decision: a start
        "velocity_feedforward": np.array([0.0, 1.0]),
    }
    return list(grids[field])


def range_of(field: str, period: float) -> tuple[float, float]:
    """(lowest, highest) of a number, as the search moves it."""
    match field:
        case "time_constant":
            return _logarithms(POLICY.filter_fastest * period, POLICY.filter_slowest * period)
        case "frequency":
            return _logarithms(POLICY.notch_slowest / period, POLICY.notch_fastest / period)
        case "numerator_damping":
            return 0.0, POLICY.most_zero_damping
        case "denominator_damping":
            return _logarithms(POLICY.least_pole_damping, POLICY.most_pole_damping)
        case "gain":
            return _logarithms(POLICY.least_position_gain, POLICY.most_position_gain)
        case "kp":
            return SMALLEST, np.inf
        case "ki" | "command_weight":
            return 0.0, np.inf
    return -np.inf, np.inf


def _logarithms(low: float, high: float) -> tuple[float, float]:
    return float(np.log(low)), float(np.log(high))


def inverse(J: Matrix) -> tuple[Matrix, Matrix]:
    """((J'J)^-1, (J'J)^-1 J'); infinite where a column is 0, very large where it is made of the others."""
    sizes = np.linalg.norm(J, axis=0)
    used = np.where(sizes > 0.0, sizes, 1.0)
    u, s, vt = np.linalg.svd(J / used, full_matrices=False)
    s = np.maximum(s, 1e-9)  # no decision: rounding
    back = ((vt.T / s) @ u.T) / used[:, None]
    spread = ((vt.T / s**2) @ vt) / np.outer(used, used)
    spread[np.diag_indices_from(spread)] += np.where(sizes > 0.0, 0.0, np.inf)
    return spread, back


def off_bound(x: Vector, low: Vector, high: Vector) -> Vector:
    """A start strictly inside of its bounds."""
    margin = np.maximum(np.abs(x), 1.0) * 1e-12  # no decision: rounding
    return np.clip(x, np.where(np.isfinite(low), low + margin, low), np.where(np.isfinite(high), high - margin, high))


def slopes(off: Callable[[Vector], Vector], x: Vector, low: Vector) -> Matrix:
    """(lines, numbers): how `off` changes with each number."""
    columns = []
    for k in range(len(x)):
        moved = SLOPE_STEP * max(abs(float(x[k])), SLOPE_STEP) * np.eye(len(x))[k]
        up, down = x + moved, x - moved if x[k] - moved[k] >= low[k] else x
        columns.append((off(up) - off(down)) / (up[k] - down[k]))
    table: Matrix = np.array(columns).T
    return table


def exchanged(unknown: Sequence[str], x: Vector, controller: Cascade) -> Vector | None:
    """The numbers (as they are searched) with position gain and ki/kp in each other's place; None where these are not unknown.

        u = kp (gain d + d') + ki integral(gain d + d') = kp (d/dt + gain)(d/dt + ki/kp) integral(d),   d = q* - q

    With all of the command's slope fed forward only their sum and product show in the torque.
    """
    if not set(EXCHANGEABLE) <= set(unknown):
        return None
    gain, ki = (unknown.index(name) for name in EXCHANGEABLE)
    kp = x[unknown.index("velocity.kp")] if "velocity.kp" in unknown else controller.velocity.kp
    if not (x[ki] > 0.0 and kp > 0.0):
        return None
    other = x.copy()
    other[gain], other[ki] = math.log(x[ki] / kp), kp * math.exp(x[gain])
    return other
