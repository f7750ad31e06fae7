"""What the controller does to command and integral beyond its gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import rate_limited
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import ONE_SIZE_UNLOGGED, Cause
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]

Vector = NDArray[np.float64]


def _clamped(rec: Record, controller: PI, values: Vector) -> tuple[Record, PI]:
    return rec, replace(controller, integrator_limit=min(float(values[0]), controller.limits[1]))


def _rate_limited(rec: Record, controller: PI, values: Vector) -> tuple[Record, PI]:
    assert rec.command is not None
    command = rate_limited(rec.command, float(values[0]), rec.dt, 0.0)
    return rec.with_channels(command=command), controller


CAUSES: tuple[Cause, ...] = (
    single(
        "integrator_clamp", "controller", "limit", lambda s: 1e-3 * s.integral, lambda s: s.integral,
        lambda s: tuple(s.integral * np.geomspace(5e-3, 0.95, 14)),
        multimodal=True,
        replayed=_clamped,
        needs=(t.in_a_loop, t.integrates),
        unseen=t.integral_beyond,
        excited_by=("steps of three sizes",),
        alike={ONE_SIZE_UNLOGGED: ("limit",)},
    ),
    single(
        "command_rate_limit", "controller", "rate", lambda s: 1e-3 * s.acceleration, lambda s: s.acceleration,
        lambda s: tuple(s.acceleration * np.geomspace(2e-3, 0.7, 8)),
        multimodal=True,
        replayed=_rate_limited,
        needs=(t.in_a_loop, t.command_changes),
        unseen=t.slope_beyond,
        excited_by=("steps of three sizes",),
        alike={ONE_SIZE_UNLOGGED: ("limit",)},
    ),
)  # fmt: skip
