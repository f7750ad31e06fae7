"""Logs of the referee (servo_referee.py): one axis under one PI, with what a test puts around it."""

from __future__ import annotations

from typing import Any

import numpy as np

import gaident as ga
import servo_referee as referee
from gaident.control.between import between_lines

__all__ = ["AXIS", "GIVEN", "KI", "KP", "NOTCH", "T", "command", "dip", "log", "low", "slower"]

T = 250e-6
KP, KI = 0.05, 2.0
GIVEN = ga.PI(KP, KI)
AXIS = referee.Axis(4e-4, 0.004, 9e-4, 0.006, 60.0, 0.02)
NOTCH = {"frequency": 80.0, "numerator_damping": 0.1, "denominator_damping": 0.7}


def command(samples: int = 2400, seed: int = 0) -> np.ndarray:
    """Steps and ramps between random speeds of both signs [rad/s]."""
    n = np.arange(samples)
    held = np.repeat(np.random.default_rng(seed).uniform(-30.0, 30.0, samples // 300 + 1), 300)[:samples]
    return np.where((n // 600) % 2 == 0, held, np.interp(n, n[::300], held[::300]))


def low(tau: float) -> referee.Filter:
    return referee.low_pass(tau, T)


def dip() -> referee.Filter:
    return referee.notch(*NOTCH.values(), T)


def log(seed: int = 0, digits: int = 0, noise: float = 0.0, **c: Any) -> ga.Record:
    """What the referee logs; digits of the torque, 0: all; noise: of a measured torque, share of its deviation."""
    r = command(seed=seed)
    w, u, _ = referee.simulate(AXIS, r, T, **{"kp": KP, "ki": KI, **c})
    u = u + noise * np.std(u) * np.random.default_rng(seed).standard_normal(len(u))
    if digits:
        u = np.array([float(f"{x:.{digits}g}") for x in u])
    return ga.Record(T, command=r, velocity=w, torque=u)


def slower(every: int = 4, noise: float = 0.02, samples: int = 1600, **c: Any) -> ga.Record:
    """A log with a line for every so many of the controller's samples, with noise that the controller reads."""
    lines = command(samples)
    r = between_lines(lines, every)
    sensor = noise * np.random.default_rng(2).standard_normal(len(r))
    reads = iter(sensor)
    filters = [lambda w: w + next(reads), *c.pop("velocity_filters", [])]
    w, u, _ = referee.simulate(AXIS, r, T, every, **{"kp": KP, "ki": KI, "velocity_filters": filters, **c})
    return ga.Record(every * T, command=lines, velocity=w + sensor[::every], torque=u)
