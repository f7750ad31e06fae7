"""A drive of one mass with its controller written out by hand, limits and friction as asked."""

from __future__ import annotations

import functools
import math

import numpy as np

import gaident as ga

__all__ = ["CONTROLLER", "DT", "LEVELS", "ONE_MASS", "TWO_MASS", "changed", "drive"]

DT = 1e-3
CONTROLLER = ga.PI(kp=0.02, ki=0.5)
ONE_MASS = ga.OneMass(J=2e-4, D=3e-3)
TWO_MASS = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
LEVELS = np.array([0, 20, -5, 60, -40, 3, -80, 10, 1, -20, 40, -60, 5, 80, -3, -10, -30, 30, -1, 0.0])


@functools.cache
def drive(
    Tc: float = 0.0,
    load: float = 0.0,
    clamp: float = math.inf,
    limit: float = math.inf,
    rate: float = math.inf,
    rectangular: bool = False,
    samples: int = 2000,
) -> ga.Record:
    """A one-mass drive, five substeps a sample, the PI written out by hand, noise 0.1 rad/s inside the loop."""
    rng = np.random.default_rng(7)
    command = np.repeat(LEVELS, samples // len(LEVELS))
    kp, ki, J, D, h = 0.02, 0.5, 2e-4, 3e-3, DT / 5
    w = integral = last = seen = 0.0
    velocity, torque = np.empty(samples), np.empty(samples)
    for n, r in enumerate(command):
        seen += min(max(r - seen, -rate * DT), rate * DT)
        velocity[n] = w + 0.1 * rng.standard_normal()
        e = seen - velocity[n]
        integral += ki * DT * (e if rectangular else (e + last) / 2.0)
        integral, last = min(max(integral, -clamp), clamp), e
        torque[n] = min(max(kp * e + integral, -limit), limit)
        for _ in range(5):
            free = w + h / J * (torque[n] - load - D * w)
            w = math.copysign(max(abs(free) - h * Tc / J, 0.0), free)
    return ga.Record(DT, command, velocity, torque=torque)


def changed(rec: ga.Record, velocity: np.ndarray | None = None, torque: np.ndarray | None = None) -> ga.Record:
    return ga.Record(rec.dt, rec.command, rec.velocity if velocity is None else velocity, torque=torque)
