"""What a cascade is given at its own clock, from a log that has a line for every so many of its samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY

__all__ = ["Ticks", "at_the_clock", "between_lines", "smooth_between", "ticks_of"]

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ticks:
    """Signals at the controller's samples, `log_every` for each line of the log; shape (n log_every,)."""

    log_every: int
    source: Vector  # velocity command [rad/s], or with a position controller position command [rad]
    velocity_feedforward: Vector  # rad/s, or empty
    torque_feedforward: Vector  # N m, or empty
    position: Vector  # measured [rad], or empty


def ticks_of(controller: Cascade, dt: float, command: Vector, position: Vector | None) -> Ticks:
    """command: velocity command [rad/s], or position command [rad] where the cascade has a position controller, shape (n,)."""
    every = controller.log_every(dt)
    period = dt / every
    if controller.position is None:
        source = between_lines(command, every)
        velocity, step = source, 1
    else:
        source, step = at_the_clock(command, every), controller.position_every(dt)
        velocity = _slope(source, step, period)
    fed = np.zeros(0)
    if controller.acceleration_feedforward != 0.0 or controller.friction_feedforward != 0.0:
        fed = controller.acceleration_feedforward * _slope(velocity, step, period) + controller.friction_feedforward * np.sign(
            velocity
        )
    return Ticks(
        every,
        source,
        controller.velocity_feedforward * velocity if controller.velocity_feedforward != 0.0 else np.zeros(0),
        fed,
        np.zeros(0) if position is None else at_the_clock(position, every),
    )


def at_the_clock(line: Vector, every: int) -> Vector:
    """A signal that goes straight from one line of the log to the next; after the last line it goes on."""
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    steps = np.diff(line)
    steps = np.append(steps, steps[-1])
    return (line[:, None] + steps[:, None] * (np.arange(every) / every)).ravel()


def between_lines(line: Vector, every: int) -> Vector:
    """A velocity command between the lines of its log: on a ramp it goes straight, at a jump it is held until the next line.

    An interval belongs to a ramp where the change over it is at most twice that over the interval before or after.
    """
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    steps = np.diff(line)
    size = np.abs(steps)
    near = np.maximum(np.append(0.0, size[:-1]), np.append(size[1:], 0.0))
    steps = np.append(np.where(size <= POLICY.ramp * near, steps, 0.0), 0.0)
    return (line[:, None] + steps[:, None] * (np.arange(every) / every)).ravel()


def _slope(signal: Vector, step: int, period: float) -> Vector:
    """Slope over the coming `step` samples, made at every step-th sample and held between; the last is repeated."""
    made = signal[::step]
    slopes = np.diff(made) / (step * period)
    slopes = np.append(slopes, slopes[-1:] if len(slopes) else 0.0)
    return np.repeat(slopes, step)[: len(signal)]


def smooth_between(line: Vector, every: int) -> Vector:
    """A velocity at the controller's samples: a cubic spline through the lines of its log, which goes on behind the last."""
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    from scipy.interpolate import make_interp_spline

    n = len(line)
    spline = make_interp_spline(np.arange(n), line, k=3)
    at = np.minimum(np.arange(n * every) / every, n - 1.0)
    return np.asarray(spline(at), dtype=np.float64)
