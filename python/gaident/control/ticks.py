"""What a cascade is given at its own clock, from a log that has a line for every so many of its samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.profile import profile_between
from gaident.errors import ControllerError
from gaident.policy.table import POLICY

__all__ = [
    "INTERPOLATIONS",
    "Feedforward",
    "Ticks",
    "at_the_clock",
    "between_lines",
    "multiple_of",
    "of_lines",
    "smooth_between",
    "straight_part",
    "ticks_of",
]

Vector = NDArray[np.float64]

AROUND = 5  # no decision: a formula: an interval, two before and two after
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
    """velocity: share of the position command's slope; acceleration [N m s^2/rad]; friction [N m]."""

    velocity: float
    acceleration: float
    friction: float


def of_lines(command: Vector, position: Vector | None) -> Ticks:
    """Of a log with a line for each of the controller's samples, without feedforward."""
    none = np.zeros(0)
    return Ticks(1, command, none, none, none if position is None else position)


def ticks_of(
    command: Vector, position: Vector | None, dt: float, every: int, placed: int, feed: Feedforward, between: str = "straight"
) -> Ticks:
    """dt: sample time of the log [s], which has a line for every `every`-th sample of the controller.

    command: velocity command [rad/s], or with a position controller position command [rad], shape (n,).
    placed: samples from one of the position controller's to the next; 0: there is none.
    between: of INTERPOLATIONS, how a position command goes from line to line.
    """
    period = dt / every
    if not placed:
        source = between_lines(command, every)
        velocity, step = source, 1
    else:
        source, step = INTERPOLATIONS[between](command, every), placed
        velocity = _slope(source, step, period)
    fed = np.zeros(0)
    if feed.acceleration != 0.0 or feed.friction != 0.0:
        fed = feed.acceleration * _slope(velocity, step, period) + feed.friction * np.sign(velocity)
    return Ticks(
        every,
        source,
        feed.velocity * velocity if feed.velocity != 0.0 else np.zeros(0),
        fed,
        np.zeros(0) if position is None else smooth_between(position, every),
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
    Where a ramp begins, ends or bends between two lines, the ramp before goes over into the one after where they meet:

        x0 + b t = x1 - a (1 - t),   t = (x1 - x0 - a)/(b - a)

    x0, x1 are the lines of the interval, b and a the changes over the intervals before and after, t from 0 to 1.
    """
    if every == 1:
        return np.ascontiguousarray(line, dtype=np.float64)
    steps = np.append(_ramps(line), 0.0)
    t = np.arange(every) / every
    made = line[:, None] + steps[:, None] * t
    at, before, after = _bends(np.diff(line))
    meeting = (line[at + 1] - line[at] - after) / (before - after)
    rise, fall = line[at, None] + before[:, None] * t, line[at + 1, None] - after[:, None] * (1.0 - t)
    made[at] = np.where(t < meeting[:, None], rise, fall)
    return np.asarray(made).ravel()


def _bends(steps: Vector) -> tuple[NDArray[np.intp], Vector, Vector]:
    """Intervals within which one ramp goes over into another one, and the changes over the intervals before and after them.

    Each of the ramps goes straight over two intervals, and the change over the interval is between theirs.
    """
    if len(steps) < AROUND:
        return np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0)
    earlier, before, here, after, later = np.lib.stride_tricks.sliding_window_view(steps, AROUND).T
    bend = np.abs(after - before)
    straight = np.maximum(np.abs(before - earlier), np.abs(later - after)) <= POLICY.ramp_straight * bend
    between = (np.minimum(before, after) < here) & (here < np.maximum(before, after))
    (at,) = np.nonzero(straight & between)
    return at + AROUND // 2, before[at], after[at]


def _ramps(line: Vector) -> Vector:
    """Change over each interval of a velocity command that belongs to a ramp, otherwise 0; shape (n - 1,)."""
    steps = np.diff(line)
    size = np.abs(steps)
    near = np.maximum(np.append(0.0, size[:-1]), np.append(size[1:], 0.0))
    return np.where(size <= POLICY.ramp * near, steps, 0.0)


def straight_part(line: Vector, is_position: bool) -> tuple[str, Vector]:
    """How a command goes from line to line, and the part of it that goes straight where it is mixed; shape (n,) or (0,).

    "held": it changes at the lines only; "straight"; "mixed": the sum of two such commands.
    A part that goes straight is 0 at the first line, so that nothing of it lies before the record.
    """
    steps = np.diff(line) if is_position else _ramps(line)
    if not np.any(steps):
        return "held", np.zeros(0)
    if line[0] == 0.0 and np.array_equal(steps, np.diff(line)):
        return "straight", np.zeros(0)
    return "mixed", np.concatenate([[0.0], np.cumsum(steps)])


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
