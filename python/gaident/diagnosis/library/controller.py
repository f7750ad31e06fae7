"""What the controller does to command and integral beyond its gains."""

from __future__ import annotations

import numpy as np

from gaident.control.controller import Limiting
from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import ONE_SIZE_UNLOGGED, Cause
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]


CAUSES: tuple[Cause, ...] = (
    single(
        "integrator_clamp", "controller", "limit", lambda s: 1e-3 * s.integral, lambda s: s.integral,
        lambda s: tuple(s.integral * np.geomspace(5e-3, 0.95, 14)),
        multimodal=True,
        limiting=lambda p: Limiting(integrator=float(p[0])),
        needs=(t.in_a_loop, t.integrates),
        unseen=t.integral_beyond,
        excited_by=("steps of three sizes",),
        alike={ONE_SIZE_UNLOGGED: ("limit",)},
    ),
    single(
        "command_rate_limit", "controller", "rate", lambda s: 1e-3 * s.acceleration, lambda s: s.acceleration,
        lambda s: tuple(s.acceleration * np.geomspace(2e-3, 0.7, 8)),
        multimodal=True,
        limiting=lambda p: Limiting(slope=float(p[0])),
        needs=(t.in_a_loop, t.command_changes),
        unseen=t.slope_beyond,
        excited_by=("steps of three sizes",),
        alike={ONE_SIZE_UNLOGGED: ("limit",)},
    ),
)  # fmt: skip
