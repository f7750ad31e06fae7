"""What a cascade is given at its own clock, from a log that has a line for every so many of its samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.between import at_the_clock, between_lines
from gaident.control.profile import profile_between
from gaident.control.smoothing import expected_at
from gaident.errors import ControllerError

__all__ = [
    "INTERPOLATIONS",
    "SLOPES",
    "Feedforward",
    "Ticks",
    "multiple_of",
    "of_lines",
    "push_of",
    "pushed_between",
    "smooth_between",
    "straight_between",
    "ticks_of",
]

Vector = NDArray[np.float64]

AROUND = 5  # no decision: a formula: lines that a third difference and a spline take
PUSHES = 2  # no decision: of a solver: how many steps, a third one changes nothing
WHOLE = 1e-6  # no decision: rounding of two decimal numbers that divide; more is no whole multiple


@dataclass(frozen=True, eq=False)
class Ticks:
    """Signals at the controller's samples, `log_every` for each line of the log; shape (n log_every,)."""

    log_every: int
    source: Vector  # velocity command [rad/s], or with a position controller position command [rad]
    velocity_feedforward: Vector  # rad/s, or empty
    torque_feedforward: Vector  # N m, or empty
    position: Vector  # measured [rad], or empty


@dataclass(frozen=True)
class Feedforward:
    """velocity: share of the position command's slope; acceleration [N m s^2/rad]; friction [N m]; over: of SLOPES."""

    velocity: float
    acceleration: float
    friction: float
    over: str = "coming"


def of_lines(command: Vector, position: Vector | None) -> Ticks:
    """Of a log with a line for each of the controller's samples, without feedforward."""
    none = np.zeros(0)
    return Ticks(1, command, none, none, none if position is None else position)


def ticks_of(
    command: Vector, position: Vector | None, dt: float, every: int, placed: int, feed: Feedforward, between: str = "straight"
) -> Ticks:
    """dt: sample time of the log [s], which has a line for every `every`-th sample of the controller.

    command: velocity command [rad/s], or with a position controller position command [rad], shape (n,); or at the
    controller's samples, where these are known, shape (n, every). position: measured [rad], either shape, too.
    placed: samples from one of the position controller's to the next; 0: there is none.
    between: of INTERPOLATIONS, how a position command goes from line to line.
    """
    period = dt / every
    if not placed:
        source = between_lines(command, every) if command.ndim == 1 else command.ravel()
        velocity, step = source, 1
    else:
        source, step = INTERPOLATIONS[between](command, every), placed
        velocity = _slope(source, step, period, feed.over)
    fed = np.zeros(0)
    if feed.acceleration != 0.0 or feed.friction != 0.0:
        fed = feed.acceleration * _slope(velocity, step, period, feed.over) + feed.friction * np.sign(velocity)
    measured = np.zeros(0)
    if position is not None:
        measured = smooth_between(position, every) if position.ndim == 1 else position.ravel()
    return Ticks(
        every,
        source,
        feed.velocity * velocity if feed.velocity != 0.0 else np.zeros(0),
        fed,
        measured,
    )


def _slope(signal: Vector, step: int, period: float, over: str) -> Vector:
    """Slope over the coming or the past `step` samples, made at every step-th sample and held between.

    What the record does not have, before its first or behind its last sample, is the slope beside it.
    """
    made = signal[::step]
    slopes = np.diff(made) / (step * period) if len(made) > 1 else np.zeros(1)
    return np.repeat(np.pad(slopes, SLOPES[over], mode="edge"), step)[: len(signal)]


def smooth_between(line: Vector, every: int) -> Vector:
    """A velocity at the controller's samples: as logged on the lines, between them a cubic spline without their noise.

    See `control/smoothing.py`. It goes on behind the last line.
    """
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    from scipy.interpolate import make_interp_spline

    n = len(line)
    spline = make_interp_spline(np.arange(n), expected_at(line), k=3)
    at = np.minimum(np.arange(n * every) / every, n - 1.0)
    between = np.array(spline(at), dtype=np.float64)
    between[::every] = line
    return between


def straight_between(line: Vector, every: int) -> Vector:
    """The same where the velocity goes straight between what the lines have beside their noise."""
    between = at_the_clock(expected_at(line), every)
    between[::every] = line
    return between


def pushed_between(line: Vector, every: int, torque_of: Callable[[Vector], Vector], jumps: NDArray[np.intp]) -> Vector:
    """A velocity at the controller's samples, whose slope jumps with the torque within some intervals of its log.

    What the torque u pushes, see `push_of`, is not smooth there; what is left of the velocity w is:

        w(t) = c U(t) + spline through (w - c U) at the lines
    """
    push = np.multiply(*push_of(line, every, torque_of, jumps))
    return smooth_between(line - push[::every], every) + push


def push_of(line: Vector, every: int, torque_of: Callable[[Vector], Vector], jumps: NDArray[np.intp]) -> tuple[float, Vector]:
    """(c, U at the controller's samples): what the torque u pushes of a velocity w is c U [rad/s].

        U: sum of u,   c = sum d3(w) d3(U)/sum d3(U)^2

    d3: third differences of the lines around the jumps. c stands for the time between two samples over the motor's inertia.
    torque_of: the controller's torque at its samples for a velocity there; jumps: numbers of the intervals.
    """
    c, pushed = 0.0, np.zeros(len(line) * every)
    if every == 1 or len(jumps) == 0 or len(line) < AROUND:
        return c, pushed
    near = np.unique(np.clip(jumps[:, None] + np.arange(-3, 2), 0, len(line) - 4))  # no decision: a formula: of third differences
    rough = np.diff(line, 3)[near]
    for _ in range(PUSHES):
        velocity = smooth_between(line - c * pushed[::every], every) + c * pushed
        pushed = np.append(0.0, np.cumsum(torque_of(velocity))[:-1])
        bent = np.diff(pushed[::every], 3)[near]
        size = float(bent @ bent)
        c = max(float(rough @ bent) / size, 0.0) if size > 0.0 else 0.0
    return c, pushed


def multiple_of(long: float, short: float, name: str, of: str) -> int:
    """How many times the short time [s] goes into the long one; ControllerError where it is no whole number."""
    ratio = long / short
    whole = max(round(ratio), 1)
    if abs(ratio - whole) > WHOLE * ratio:
        raise ControllerError(
            f"{name} is {long:g} s and {of} {short:g} s, {ratio:.4g} times as long: it must be a whole multiple, such as "
            f"{whole * short:g} s; or give the {of} {long / whole:g} s"
        )
    return whole


INTERPOLATIONS: Mapping[str, Callable[[Vector, int], Vector]] = {"straight": at_the_clock, "smooth": profile_between}
"""How a position command may go between the lines of its log -> positions at the controller's samples."""

SLOPES: Mapping[str, tuple[int, int]] = {"coming": (0, 1), "past": (1, 0)}
"""The period that a feedforward's slopes are taken over -> slopes that a record lacks (before the first, behind the last)."""
