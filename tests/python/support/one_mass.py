"""A staircase of a small drive of one mass, simulated by the library."""

from __future__ import annotations

import numpy as np

import gaident as ga

__all__ = ["CONTROLLER", "TRUTH", "one_mass_record"]

TRUTH = ga.OneMass(J=2e-4, D=0.004)
CONTROLLER = ga.PI(kp=0.02, ki=0.5)


def one_mass_record(samples: int = 300) -> tuple[ga.Record, ga.PI]:
    """A staircase of a one-mass drive with noise."""
    command = np.repeat([20.0, -10.0, 30.0], samples // 3)
    still = ga.Record(1e-3, command=command, velocity=0.0 * command, torque=0.0 * command)
    done = ga.run(TRUTH, still, CONTROLLER)
    velocity = done.velocity + 0.2 * np.random.default_rng(5).standard_normal(command.size)
    return ga.Record(1e-3, command, velocity, torque=done.torque, name="staircase"), CONTROLLER
