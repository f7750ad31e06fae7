"""What the sensor's filter makes of the velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]

Vector = NDArray[np.float64]


def _behind_filter(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """theta = theta_m + tau w_m: the integral of a filtered velocity is late."""
    return np.asarray(seen + values[0] * (velocity - velocity[0]))


CAUSES: tuple[Cause, ...] = (
    single(
        "velocity_filter", "sensor", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
        lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6)),
        seen_angle=_behind_filter,
        late=True,
        excited_by=("random signal at speed",),
    ),
)  # fmt: skip
