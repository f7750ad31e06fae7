"""By how many samples a logged torque stands behind the motion that it makes, from the inverse-dynamics regression.

    u_h(n)  = (u(n) + u(n-1))/2                 a torque held over each sample, as it shows in w(n+1) - w(n-1)
    J(k)    = min |u_h(n + k) - J a - B w - C sign(w) - T - g(theta)|^2 / |u_h - mean(u_h)|^2,   |k| <= `log_late` + 1
    lag     = where the parabola through the least of J and its neighbours has its lowest point
    std     = sqrt(J_min/(n_eff c)),   J(k) = J_min + c (k - lag)^2

g is the gravity or the spring that the regression of the record chooses (`inverse_dynamics`), else 0.
All channels pass the filter of the regression, and the low-pass of its decimation; but every sample is kept.
In a log of means u(n) is the mean of the time after line n, which stands in the next line: such a log is not late.
No row contains what lies before or behind the record: continued beyond a jump at its start, torque and motion do not fit.
With one row in ten the lag depended on which of them the log began with, by 0.05 to 0.1 samples where the load swings.
A lightly damped resonance above the filter's corner turns no phase, so an elastic axis has the lag of a rigid one.
A motion before its torque, lag > 0, is nothing that an axis can do; a motion behind it, lag < 0, is what a delay makes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.data.signals.decimation import low_passed, reach
from gaident.data.torque_kind import HELD
from gaident.errors import GaidentError
from gaident.estimation.criterion import effective_samples
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.regression.motion import ORDER, cutoff_of, motion_of
from gaident.estimation.regression.regression import solve
from gaident.estimation.regression.rows import decimation_of
from gaident.estimation.regression.torque_terms import columns_of
from gaident.models.held_torque import held_mean
from gaident.policy.table import POLICY

__all__ = ["TorqueLag", "torque_lag"]

Vector = NDArray[np.float64]

OF_ANGLE = ("gravity", "spring")


@dataclass(frozen=True)
class TorqueLag:
    """lag and std [samples]; left: share of the torque's power that the regression leaves at that lag."""

    lag: float
    std: float
    left: float


def torque_lag(rec: Record, cutoff_hz: float | None = None, axis: str = "rotary") -> TorqueLag | None:
    """The lag of the record's torque; None without one, or where the motion does not tell.

    cutoff_hz: of the filter, at most; None: that of the regression. What swings above it is no rigid axis.
    axis: as in `inverse_dynamics`.
    """
    if rec.torque is None:
        return None
    rec = held_mean(rec[: POLICY.lag_samples])
    assert rec.torque is not None
    cutoff = min(cutoff_of(rec, ORDER), np.inf if cutoff_hz is None else cutoff_hz)
    factor = decimation_of(None, cutoff, rec.dt)
    both = bool(np.any(rec.velocity > 0.0) and np.any(rec.velocity < 0.0))
    terms: tuple[str, ...] = ("inertia", "viscous", "coulomb", "offset") if both else ("inertia", "viscous", "offset")
    terms += _of_angle(rec, cutoff, axis)
    motion = motion_of(rec.with_channels(torque_log=HELD), cutoff, ORDER)
    torque = motion.torque
    assert torque is not None
    kept = ~motion.still
    edge = max(2 * factor, reach(factor))
    kept[:edge] = kept[-edge:] = False  # filters start there
    if np.count_nonzero(kept[::factor]) < POLICY.least_rows:
        return None
    columns = np.column_stack([low_passed(np.ascontiguousarray(c), factor) for c in columns_of(terms, motion).T])[kept]
    torque = low_passed(torque, factor)
    farthest = POLICY.log_late + 1  # a parabola has a neighbour on either side
    steps = range(-farthest, farthest + 1)
    left: list[float] = []
    residuals: list[Vector] = []
    for k in steps:
        moved = np.concatenate([torque[k:], np.full(k, torque[-1])] if k >= 0 else [np.full(-k, torque[0]), torque[:k]])[kept]
        power = float(np.sum((moved - np.mean(moved)) ** 2))
        if not power > 0.0:
            return None
        theta, rank = solve(columns, moved)
        if rank < len(theta):
            return None
        residuals.append(moved - columns @ theta)
        left.append(float(residuals[-1] @ residuals[-1]) / power)
    best = int(np.argmin(left))
    if best in (0, len(left) - 1) or left[best] > POLICY.lag_left:
        return None
    before, least, after = left[best - 1 : best + 2]
    curvature = 0.5 * (before + after) - least  # no decision: a formula: a parabola through three values
    if not curvature > 0.0:
        return None
    within = 0.25 * (before - after) / curvature  # no decision: a formula: a parabola through three values
    lowest = max(least - curvature * within**2, 0.0)
    std = float(np.sqrt(lowest / (effective_samples(residuals[best][::factor]) * curvature)))
    return TorqueLag(steps[best] + within, std, lowest) if std < POLICY.lag_std else None


def _of_angle(rec: Record, cutoff: float, axis: str) -> tuple[str, ...]:
    """The terms of the angle that the regression of a record chooses."""
    try:
        chosen = inverse_dynamics(rec, cutoff_hz=cutoff, axis=axis).terms
    except GaidentError:
        return ()
    return tuple(term for term in chosen if term in OF_ANGLE)
