"""By how many samples a logged velocity stands behind the logged position.

    w_f = w(t - tau) = v - tau a + ...,   tau = -sum (w_f - v) a / sum a^2

v and a are the slopes of the position, w_f the logged velocity, all behind the same zero-phase filter.
A velocity that is the position's backward difference is late by half a sample; a velocity filter by its time constant.
"""

from __future__ import annotations

from gaident.data.record import Record
from gaident.estimation.regression.motion import ORDER, cutoff_of, low_passed, motion_of
from gaident.policy.table import POLICY

__all__ = ["angle_is_ahead", "velocity_lag"]


def velocity_lag(rec: Record) -> float | None:
    """The lag [samples]; None without a position, without motion, or where the velocity is not that of the position.

    Parameters
    ----------
    rec : Record
        With velocity and position.

    Returns
    -------
    float or None
        Positive where the velocity is late.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> t = 1e-3 * np.arange(4000)
    >>> rec = ga.Record(1e-3, velocity=5 * np.sin(5 * (t - 3e-3)), position=1 - np.cos(5 * t), torque=np.ones(4000))
    >>> round(velocity_lag(rec), 2)
    3.0
    """
    if rec.position is None:
        return None
    motion = motion_of(rec, cutoff_of(rec, ORDER), ORDER)
    seen = low_passed(rec.velocity, rec.dt, cutoff_of(rec, ORDER), ORDER)
    late, slope = seen - motion.velocity, motion.acceleration
    power = float(slope @ slope)
    if not power > 0.0:
        return None
    lag = -float(late @ slope) / power
    rest = late + lag * slope
    if float(rest @ rest) > POLICY.lag_left * float(seen @ seen):
        return None
    return lag / rec.dt


def angle_is_ahead(rec: Record) -> bool:
    """Whether the logged velocity is late behind the logged angle: a sensor's filter is then on the velocity alone."""
    lag = velocity_lag(rec)
    return lag is not None and lag > POLICY.lag_said
