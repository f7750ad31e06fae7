"""Position commands between the lines of a log that is slower than the controller: straight, or as the profile goes.

Profiles with corners of their velocity (constant accelerations), with limited jerk and without corners, computed at the
controller's samples; and commands that do go straight from line to line. The drive is tests/python/support/drive_rig.py.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from rows.case import Case, Result, digest

import gaident as ga
from drive_rig import Plant, between_lines, run_drive
from gaident.control.profile import profile_between
from gaident.identification.logged_torque import corrected, not_followed

__all__ = ["interpolated", "profiles"]

Vector = NDArray[np.float64]
T, LINES = 250e-6, 1600
KINDS = ("corners", "jerk", "cosine", "sine", "straight")
EVERY = (2, 4, 8)
PRINTED = ("12 decimals", "7 decimals", "counts")
COUNT = 2.0 * np.pi / 2**20  # rad, of an encoder's angle in a log


def profiles(count: int, seed: int) -> list[Case]:
    made = [(kind, every, printed) for kind in KINDS for every in EVERY for printed in PRINTED]
    return [Case("profiles", f"{kind}/{every}/{printed}/{seed}/{n}", (kind, every, printed), n + 1000 * seed)
            for n in range(count) for kind, every, printed in made]  # fmt: skip


def speeds(kind: str, n: int, rng: np.random.Generator) -> Vector:
    """Velocities at the controller's samples [rad/s]: from one level to the next."""
    t = T * np.arange(n)
    if kind == "sine":
        return np.asarray(60.0 * np.sin(20.0 * t) * rng.uniform(0.5, 1.0) + 40.0 * np.sin(90.0 * t) * rng.uniform(0.2, 1.0))
    levels = rng.permutation([0.0, 60.0, 120.0, 25.0, -50.0, -120.0, -35.0, 40.0])
    at = np.sort(rng.uniform(0.02, t[-1] - 0.15, len(levels)))
    rise = rng.uniform(0.04, 0.08, len(levels))  # s
    made, before = np.zeros(n), 0.0
    for start, level, lasts in zip(at, levels, rise, strict=True):
        x = np.clip((t - start) / lasts, 0.0, 1.0)
        if kind == "cosine":
            x = 0.5 - 0.5 * np.cos(np.pi * x)
        elif kind == "jerk":  # the acceleration rises, is held and falls, a third of the time each
            rises, held, falls = (np.clip(3.0 * x - k, 0.0, 1.0) for k in range(3))
            x = (0.5 * rises**2 + held + falls - 0.5 * falls**2) / 2.0
        made, before = made + (level - before) * x, level
    return made


def interpolated(case: Case) -> Result:
    kind, every, printed = case.what
    rng = np.random.default_rng([case.number, len(kind), every])
    true = ga.Cascade(ga.PI(0.3, 15.0), T, position=ga.P(30.0), velocity_feedforward=1.0)
    axis = Plant(J=1.5e-3, D=2e-3, kp=0.3, ki=15.0, dt=every * T, cascade=true)
    whole = np.cumsum(speeds(kind, LINES * every // 2, rng)) * T
    if kind == "straight":
        whole = between_lines(axis, whole[::every])
    noise = 0.002 * rng.standard_normal(len(whole))
    log = run_drive(axis, np.ascontiguousarray(whole), {"coulomb_friction": {"torque": 0.3}}, velocity_noise=noise)
    command = whole[::every]
    command = np.round(command / COUNT) * COUNT if printed == "counts" else np.round(command, int(printed.split()[0]))
    lines = {name: getattr(log, name)[::every] for name in ("velocity", "torque", "position")}
    rec = ga.Record(every * T, position_command=command, **lines)
    found = corrected([rec], true)
    taken = "straight" if found is None or not isinstance(found.controller, ga.Cascade) else found.controller.interpolation
    follows = not not_followed([rec], replace(true, interpolation=taken))
    expected = "straight" if kind == "straight" else "smooth"
    off = float(np.sqrt(np.mean((profile_between(command, every)[: len(whole)] - whole) ** 2)))
    called = "right" if taken == expected else "missed" if expected == "smooth" else "false alarm"
    return Result(called, f"{taken}, the torque {'follows' if follows else 'does not follow'}", digest(f"{off:.2g}"))
