"""Small drives of one mass, simulated by the library.

A staircase; and a loop whose controller has a filter of the velocity, of which the log shows the number more or less closely.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import gaident as ga
from gaident.control.found import FoundNumbers
from gaident.estimation.dataset import DataSet

__all__ = [
    "CONTROLLER", "DT", "PI", "STEPS", "TAU", "TRUTH", "D", "J", "data_of", "filtered", "loop_record", "one_mass_record",
]  # fmt: skip

Vector = NDArray[np.float64]

TRUTH = ga.OneMass(J=2e-4, D=0.004)
CONTROLLER = ga.PI(kp=0.02, ki=0.5)


def one_mass_record(samples: int = 300) -> tuple[ga.Record, ga.PI]:
    """A staircase of a one-mass drive with noise."""
    command = np.repeat([20.0, -10.0, 30.0], samples // 3)
    still = ga.Record(1e-3, command=command, velocity=0.0 * command, torque=0.0 * command)
    done = ga.run(TRUTH, still, CONTROLLER)
    velocity = done.velocity + 0.2 * np.random.default_rng(5).standard_normal(command.size)
    return ga.Record(1e-3, command, velocity, torque=done.torque, name="staircase"), CONTROLLER


DT, TAU = 1e-3, 3e-3
PI = ga.PI(0.05, 1.5)
J, D = 3e-4, 2e-3
STEPS = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25], 90)  # rad/s


def filtered(z: Vector) -> ga.Cascade:
    """The PI behind a low pass of the velocity; z: the logarithm of its time constant."""
    return ga.Cascade(PI, velocity_filters=(ga.LowPass(float(np.exp(z[0]))),))


def loop_record(friction: float = 0.0, noise: float = 0.03) -> ga.Record:
    """One mass in that loop, without a torque in the log. friction: level [N m]; noise: of the velocity [rad/s]."""
    off = noise * np.random.default_rng(3).standard_normal(len(STEPS))
    model = ga.OneMass(J=J, D=D).model()
    if friction:
        model = model.with_effect("coulomb_friction", torque=friction)
    still = ga.Record(DT, command=STEPS - off, velocity=np.zeros(len(STEPS)))
    return ga.Record(DT, command=STEPS, velocity=ga.run(model, still, filtered(np.log([TAU]))).velocity + off)


def data_of(record: ga.Record, found: FoundNumbers) -> DataSet:
    """The record as driven by the controller with the found numbers."""
    controller = found.controller
    assert controller is not None
    whole = record.with_channels(torque=controller.torque_of(record), command=None)
    return replace(DataSet.of([whole], controller, read=[record]), found=found)
