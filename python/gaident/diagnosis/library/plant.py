"""What changes the mechanism linearly."""

from __future__ import annotations

import numpy as np

from gaident.diagnosis.library import triggers as t
from gaident.diagnosis.library.cause import ONE_SIZE, Cause
from gaident.diagnosis.library.coordinates import ln, positive
from gaident.estimation.term import Rows, Scales
from gaident.models.roots import quadratic_roots
from gaident.policy.table import POLICY

__all__ = ["CAUSES"]


def _resonance_starts(s: Scales) -> Rows:
    nyquist = np.pi / s.dt
    low = 2.0 * np.pi / s.duration * 4.0
    own = s.resonance if np.isfinite(s.resonance) else 0.0
    poles = [w for w in np.geomspace(max(low, 0.02 * nyquist), 0.7 * nyquist, 7) if abs(w - own) > 0.1 * own]
    return [(float(np.log(w)), 0.05, float(np.log(w * r)), 0.05) for w in poles for r in (0.75, 1.0 / 0.75)]


CAUSES: tuple[Cause, ...] = (
    Cause(
        "extra_resonance",
        "plant",
        positive(0, 2),
        lambda p: np.array([np.log(p["frequency"]), p["damping"], np.log(p["zero_frequency"]), p["zero_damping"]]),
        lambda s: 2 * [ln(2.0 / s.duration, 0.95 * np.pi / s.dt), (1e-4, POLICY.swing_damping)],
        _resonance_starts,
        lambda s: (0.1, 0.05, 0.1, 0.05),
        resonates=True,
        excludes=frozenset({"backlash", "hardening_stiffness", "hysteretic_coupling", "position_inertia"}),
        poles=lambda v: tuple(quadratic_roots(2.0 * float(v[1]) * float(v[0]), float(v[0]) ** 2)),
        needs=(t.torque_changes,),
        excited_by=("random signal at speed",),
        alike={ONE_SIZE: ("resonance",)},
        unseen=t.resonance_beyond,
    ),
)
