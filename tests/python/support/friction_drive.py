"""A small drive with dry friction, simulated by the library: what a diagnosis hands out is tested with it."""

from __future__ import annotations

import numpy as np

import gaident as ga

__all__ = ["CONTROLLER", "DRIVE", "DT", "command", "drive_record"]

DT = 1e-3
LEVELS = (20.0, -20.0, 5.0, -5.0, 40.0, -40.0, 10.0, -10.0)  # rad/s
CONTROLLER = ga.PI(kp=0.05, ki=1.5)
DRIVE = ga.Model(1.0 / 5e-4, [-4.0]).with_effect("coulomb_friction", torque=0.05)


def command() -> np.ndarray:
    dither = np.repeat(np.random.default_rng(1).choice([-1.0, 1.0], 400), 4)
    return np.repeat(LEVELS, 200) + dither


def drive_record(seed: int = 0) -> ga.Record:
    """The drive of DRIVE, noise inside its loop: the controller acts on r - (w + noise) = (r - noise) - w."""
    asked = command()
    noise = 0.05 * np.random.default_rng(seed).standard_normal(len(asked))
    done = ga.run(DRIVE, ga.Record(DT, command=asked - noise, velocity=np.zeros(len(asked))), CONTROLLER)
    return ga.Record(DT, command=asked, velocity=done.velocity + noise, torque=done.torque, name="levels")
