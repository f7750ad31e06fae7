"""The sizes that bounds and starts of a search are made of, from the records."""

from __future__ import annotations

import numpy as np

from gaident.estimation.dataset import DataSet
from gaident.estimation.term import Scales

__all__ = ["scales_of"]


def scales_of(data: DataSet) -> Scales:
    """Largest speed, torque, slope of the command, travel; what the mechanism says is filled in with it."""
    w, u, angle = data.velocity, data.torque, data.angle
    command, dt = data.command, data.dt
    borders = np.cumsum(data.lengths)[:-1]
    steps = 0.0
    if command is not None:
        steps = max(float(np.abs(np.diff(part, prepend=0.0)).max()) for part in np.split(command, borders)) / dt
    integral = float(np.abs(u).max())
    torque = max(float(np.abs(u).max()), 1e-300)
    return Scales(
        dt=dt,
        duration=data.duration,
        speed=max(float(np.abs(w).max()), 1e-300),
        torque=torque,
        acceleration=steps or float("inf"),
        travel=max(float(np.ptp(part)) for part in np.split(angle, borders)),
        friction=0.02 * torque,  # no decision: a start
        stiffness=float("nan"),
        resonance=float("nan"),
        two_masses=False,
        integral=integral,
        period_seen=data.period_seen,
    )
