"""Logs of an independent drive under levels that begin between the lines of the log: `record(levels(4, 1), 4, loop)`."""

from __future__ import annotations

from typing import Any

import numpy as np

import gaident as ga
from drive_rig import Array, Plant, run_drive

__all__ = ["KI", "KP", "T", "levels", "record"]

T = 125e-6  # s, of the controller
KP, KI = 0.1, 6.0


def levels(every: int, seed: int, on_lines: bool = False) -> Array:
    """Levels [rad/s] that begin at any of a controller's samples, at least 60 lines each; (1000 every,)."""
    rng, whole, at = np.random.default_rng(seed), np.zeros(1000 * every), 100
    while at < 1000:
        whole[at * every + (0 if on_lines else int(rng.integers(every))) :] = rng.uniform(-40.0, 40.0)
        at += int(rng.integers(60, 150))
    return whole


def record(whole: Array, every: int, loop: ga.Cascade, **more: Any) -> ga.Record:
    """The log of two masses under this command at the controller's samples [rad/s], every so-many-th of them."""
    axis = Plant(J=4e-4, D=1e-3, JL=4e-4, DL=1e-3, KG=60.0, DG=5e-3, kp=KP, ki=KI, dt=every * T, cascade=loop)
    log = run_drive(axis, whole, more, encoder=2 * np.pi / 2**20, differenced=True)
    lines = {"velocity": log.velocity, "torque": log.torque, "command": whole}
    return ga.Record(every * T, **{name: x[::every] for name, x in lines.items()})
