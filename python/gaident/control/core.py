"""The core's functions that take a controller: the only file that writes a PI as the numbers of their signatures.

controller: None for the open loop, where the torque drives the model.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.pi import PI

__all__ = ["discrete", "effect_record", "experiment", "held_torque", "loop_name", "recurrence", "simulate"]

Vector = NDArray[np.float64]
Roots = NDArray[np.complex128]


def loop_name(controller: PI | None) -> str:
    """ "sampled", "continuous" or "open"."""
    return "open" if controller is None else controller.loop


def simulate(
    gain: float, poles: Roots, zeros: Roots, dt: float, source: Vector, controller: PI | None, start: Vector, arithmetic: str
) -> tuple[Vector, Vector]:
    """(velocity [rad/s], torque [N m]) of a linear model in its loop; source: command [rad/s], in the open loop torque [N m]."""
    return _core.simulate(gain, poles, zeros, dt, source, *_loop(controller), *_limits(controller), start, arithmetic)


def discrete(gain: float, poles: Roots, zeros: Roots, dt: float, controller: PI | None) -> tuple[Vector, Vector]:
    """(alpha, beta) of equation (7), without limits."""
    return _core.discrete(gain, poles, zeros, dt, *_loop(controller))


def effect_record(
    dt: float, source: Vector, position: Vector, velocity: Vector, start_angle: float, controller: PI | None
) -> _core.EffectRecord:
    """A record and its loop, for models with effects."""
    return _core.EffectRecord(dt, source, position, velocity, start_angle, *_loop(controller), *_limits(controller))


def experiment(
    records: Sequence[tuple[Vector, Vector, float, str, float]], controller: PI | None, kernels: str = ""
) -> _core.Experiment:
    """Records (input, velocity, dt, start, first velocity) and their loop, for the genetic search and the local fit."""
    return _core.Experiment(records, *_loop(controller), *_limits(controller), kernels)


def recurrence(model: _core.EffectModel, dt: float, controller: PI | None, substeps: int, top_speed: float) -> dict[str, Any]:
    """The numbers of the recurrence that simulates a model."""
    return _core.recurrence(model, dt, *_loop(controller), *_limits(controller), substeps, top_speed)


def held_torque(error: Vector, controller: PI, newest: float, before: float, rule: str, integral: float) -> Vector:
    """Torque [N m] of a PI whose integrator does not wind up; it adds newest e(n) + before e(n-1)."""
    return _core.held_torque(error, controller.kp, newest, before, *_limits(controller), rule, integral)


def _loop(controller: PI | None) -> tuple[str, float, float]:
    return ("open", 0.0, 0.0) if controller is None else (controller.loop, controller.kp, controller.ki)


def _limits(controller: PI | None) -> tuple[float, float]:
    return (math.inf, math.inf) if controller is None else controller.limits
