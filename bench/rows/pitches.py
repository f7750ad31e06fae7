"""Linear axes whose force returns with the pitch of a screw or of the poles, which nobody gave; which length is taken.

20 kg with 15 N of dry friction and a force that returns with the length, under white noise of the force.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from gaident.estimation.period import period_of_place

__all__ = ["pitch_seen", "pitches"]

PITCHES = (0.005, 0.01, 0.0103, 0.012, 0.016, 0.024, 0.0254, 0.0317, 0.048, 0.0601, 0.0)
"""Lengths [m]; 0: no force returns."""
FORCES = ((8.0, 0.2), (8.0, 2.0), (2.0, 2.0), (2.0, 8.0))  # amplitude, noise [N]


def pitches(count: int, seed: int) -> list[Case]:
    return [Case("pitches", f"{1e3 * pitch:g} mm/{force:g} N/{noise:g} N/{seed}/{k}", (pitch, force, noise), k + 1000 * seed)
            for k in range(count) for pitch in PITCHES for force, noise in FORCES]  # fmt: skip


def pitch_seen(case: Case) -> Result:
    """The true length with all of its digits is right; one within a thousandth of it, with other digits, is in set."""
    pitch, force, noise = case.what
    rng = np.random.default_rng([case.number, round(1e4 * pitch), round(10.0 * noise)])
    t, hz, phase = 1e-3 * np.arange(4000), rng.uniform(0.2, 0.5, 2), rng.uniform(0.0, 6.0, 3)
    w = 0.08 * np.sin(2.0 * np.pi * hz[0] * t + phase[0]) + 0.05 * np.sin(2.0 * np.pi * hz[1] * t + phase[1])
    x = np.cumsum(1e-3 * w)
    wave = force * np.sin(2.0 * np.pi * x / pitch + phase[2]) if pitch else 0.0
    torque = 20.0 * np.gradient(w, 1e-3) + 100.0 * w + 15.0 * np.sign(w) + wave + noise * rng.standard_normal(len(t))
    found = period_of_place([ga.Record(1e-3, velocity=w, torque=torque, position=x)])
    said = "none" if found is None else f"{1e3 * found:.6g} mm"
    if found is None or not pitch:
        return Result("right" if found is None and not pitch else "missed" if pitch else "false alarm", said, "")
    return Result("right" if abs(found / pitch - 1.0) < 1e-9 else "in set" if abs(found / pitch - 1.0) < 1e-3 else "wrong",
                  said, digest([f"{found:.8g}"]))  # fmt: skip
