"""What the sensor makes of the velocity: a filter, a tracking loop, a difference of angles over several samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import Cause
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]

Vector = NDArray[np.float64]


def _behind_filter(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """theta = theta_m + tau w_m: the integral of a filtered velocity is late."""
    return np.asarray(seen + values[0] * (velocity - velocity[0]))


def _behind_observer(seen: Vector, velocity: Vector, values: Vector) -> Vector:
    """As behind a filter: a tracking loop of the bandwidth b is 2/b late."""
    return np.asarray(seen + 2.0 / values[0] * (velocity - velocity[0]))


OTHERS = {
    name: frozenset({"velocity_filter", "velocity_observer", "velocity_difference"} - {name})
    for name in ("velocity_filter", "velocity_observer", "velocity_difference")
}
"""What makes the velocity: a model has one of them."""

CAUSES: tuple[Cause, ...] = (
    single(
        "velocity_filter", "sensor", "time_constant", lambda s: 0.02 * s.log_dt, lambda s: 30.0 * s.log_dt,
        lambda s: tuple(s.log_dt * np.geomspace(0.25, 16.0, 6)),
        seen_angle=_behind_filter,
        late=True,
        excludes=OTHERS["velocity_filter"],
        from_nothing=True,
        excited_by=("random signal at speed",),
    ),
    single(
        "velocity_observer", "sensor", "bandwidth", lambda s: 0.06 / s.log_dt, lambda s: 40.0 / s.log_dt,
        lambda s: tuple(np.geomspace(0.12, 6.0, 6) / s.log_dt),
        seen_angle=_behind_observer,
        late=True,
        excludes=OTHERS["velocity_observer"],
        needs=(t.moves, t.every_sample, t.torque_logged),
        excited_by=("random signal at speed",),
    ),
    single(
        "velocity_difference", "sensor", "samples", lambda s: 1.0, lambda s: 16.0,
        lambda s: (2.0, 3.0, 4.0, 6.0, 8.0, 12.0),
        excludes=OTHERS["velocity_difference"],
        needs=(t.moves, t.every_sample, t.on_a_lattice),
        excited_by=("random signal at speed",),
    ),
)  # fmt: skip
