"""Measured torques behind the lag of a current loop, behind other gains, or only written late: which lag is shown.

The drive is tests/python/support/drive_rig.py, the lag is put behind its torque here.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from drive_rig import Plant, run_drive
from gaident.diagnosis.controller.measured_lag import lag_shown

__all__ = ["lag_found", "lags"]

T = 0.5e-3
PI = ga.PI(0.05, 2.0)
AXIS = Plant(J=1e-3, D=2e-3, kp=0.05, ki=2.0, dt=T, name="axis")
LAGS = (0.1, 0.3, 0.6, 1.5, 5.0, 20.0, 40.0, 80.0)  # samples
LATE = (0, 1, 2, 3, 4)
NOISE = (1e-3, 1e-2)  # N m
SURE = 0.1  # of a lag


def lags(count: int, seed: int) -> list[Case]:
    """A lag, a log that is only late, other gains: each with two noises."""
    made = [("lag", lag, noise) for lag in LAGS for noise in NOISE] + [("late", late, noise) for late in LATE for noise in NOISE]
    made += [(what, share, noise) for what in ("gains", "ki") for share in (0.8, 1.2) for noise in NOISE]
    return [Case("lags", f"{what}/{size:g}/{noise:g}/{seed}/{n}", (what, size, noise), n + 1000 * seed)
            for n in range(count) for what, size, noise in made]  # fmt: skip


def lag_found(case: Case) -> Result:
    what, size, noise = case.what
    rng = np.random.default_rng([case.number, round(100 * size), round(1e4 * noise)])
    levels = np.repeat(rng.permutation([0.0, 30.0, 60.0, 12.0, -24.0, -60.0, -18.0, 6.0, 42.0, 0.0, 3.0, -3.0]), 200)
    speed = np.zeros(len(levels))
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(levels[n] - speed[n - 1], -0.5, 0.5)
    log = run_drive(AXIS, speed, {"coulomb_friction": {"torque": 0.1}}, velocity_noise=0.01 * rng.standard_normal(len(speed)))
    late = int(size) if what == "late" else int(rng.integers(2))
    made = np.concatenate([np.zeros(late), log.torque[: len(speed) - late]])
    torque, a = np.zeros(len(speed)), float(np.exp(-1.0 / size)) if what == "lag" else 0.0
    for n in range(1, len(speed)):
        torque[n] = a * torque[n - 1] + (1.0 - a) * made[n]
    torque += noise * rng.standard_normal(len(speed))
    kp, ki = size if what == "gains" else 1.0, size if what in ("gains", "ki") else 1.0
    rec = ga.Record(T, command=speed, velocity=log.velocity, torque=torque, torque_is="measured")
    found = lag_shown([rec], ga.PI(kp * 0.05, ki * 2.0))
    if what != "lag":
        return Result("false alarm" if found else "right", "lag" if found else "none", digest(""))
    near = found is not None and abs(found.time_constant / T - size) < max(SURE * size, 3.0 * found.std / T)
    called = "missed" if found is None else "right" if near else "wrong"
    return Result(called, "lag" if found else "none", digest([f"{found.time_constant / T:.3g}"] if found else ""))
