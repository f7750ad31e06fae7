"""What happens between motor and load."""

from __future__ import annotations

import numpy as np

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import AT_THE_SHAFT, ONE_SIZE, Cause
from gaident.diagnosis.library.coordinates import grid, ln, positive
from gaident.diagnosis.library.kinds import single

__all__ = ["CAUSES"]


CAUSES: tuple[Cause, ...] = (
    single(
        "backlash", "coupling", "gap", lambda s: 1e-4 * s.torque / s.stiffness, lambda s: 100.0 * s.torque / s.stiffness,
        lambda s: tuple(s.torque / s.stiffness * np.geomspace(1e-3, 2.0, 16)),
        multimodal=True,
        domains=AT_THE_SHAFT,
        excludes=frozenset({"extra_resonance"}),
        needs=(t.moves, t.torque_reverses, t.shaft_resonates),
        from_nothing=True,
        excited_by=("reversals", "random signal at standstill"),
    ),
    single(
        "hardening_stiffness", "coupling", "cubic_stiffness", lambda s: 1e-3 * s.stiffness**3 / s.torque**2,
        lambda s: 1e5 * s.stiffness**3 / s.torque**2,
        lambda s: tuple(s.stiffness**3 / s.torque**2 * np.geomspace(0.05, 500.0, 6)),
        multimodal=True,
        domains=AT_THE_SHAFT,
        excludes=frozenset({"extra_resonance"}),
        needs=(t.moves, t.torque_changes, t.shaft_resonates),
        excited_by=("reversals", "random signal at speed"),
        alike={ONE_SIZE: ("resonance",)},
    ),
    Cause(
        "hysteretic_coupling",
        "coupling",
        positive(0, 1),
        lambda p: np.log([max(p["torque"], 1e-300), p["stiffness"]]),
        lambda s: [ln(1e-4 * s.torque, 10.0 * s.torque), ln(1e-3 * s.stiffness, 1e2 * s.stiffness)],
        lambda s: grid(ln(*(s.torque * np.geomspace(3e-3, 0.3, 5))), ln(*(s.stiffness * np.geomspace(0.1, 3.0, 4)))),
        lambda s: (0.3, 0.3),
        multimodal=True,
        domains=AT_THE_SHAFT,
        excludes=frozenset({"extra_resonance"}),
        needs=(t.moves, t.torque_changes, t.shaft_resonates),
        excited_by=("reversals", "random signal at speed"),
        alike={ONE_SIZE: ("resonance",)},
    ),
)  # fmt: skip
