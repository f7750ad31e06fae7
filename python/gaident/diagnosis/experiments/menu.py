"""The menu of experiments: what each is good at, and its command within what the axis may do.

The shares of speed, time and jump below are shapes of commands.
They decide nothing about a record: a diagnosis is made before a command is proposed.
They do set which command is proposed: other shares make another menu, of which the one is taken that tells most in simulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.diagnosis.experiments.commands import dithered, rest, strokes, triangles
from gaident.diagnosis.library.terms import excited
from gaident.policy.table import POLICY

__all__ = ["MENU", "Bench", "Builder", "prbs_moving", "reversals", "slow_stairs", "speed_ladder", "steps"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Bench:
    """Limits in the terms of the builders: speed, stroke and slope that may be used, seconds for one item.

    top: the speed that ramps may go to, with room for the overshoot where they end.
    room: samples of an item at most.
    """

    dt: float
    speed: float
    top: float
    travel: float
    slope: float
    seconds: float
    torque: float
    kp: float | None
    room: int

    @property
    def jump(self) -> float:
        """Largest jump of the command [rad/s]; inf: kp is not known."""
        return math.inf if self.kp is None else POLICY.jump_torque * self.torque / self.kp


Builder = Callable[[Bench], Vector]


def speed_ladder(b: Bench) -> Vector:
    """Five speeds to the top, mixed in order, forwards and backwards, dithered on every other one."""
    shares = (0.5, 0.1, 1.0, 0.25, 0.75)
    dwell = b.seconds / (2.6 * len(shares))
    parts = []
    for i, share in enumerate(shares):
        stroke = strokes([share * b.top], dwell, b.travel, b.slope, b.dt, b.room)
        parts.append(_dither(stroke, b) if i % 2 else stroke)
    return np.concatenate(parts)


def _dither(command: Vector, b: Bench) -> Vector:
    size = 0.03 * b.speed if b.kp is None else min(0.05 * b.speed, 0.05 * b.torque / b.kp)
    return dithered(command, size, 4)


def slow_stairs(b: Bench) -> Vector:
    """Half to five per cent of the speed, rests between, both directions."""
    shares = (0.005, 0.01, 0.02, 0.05)
    dwell = b.seconds / (3.0 * len(shares))
    parts: list[Vector] = []
    for share in shares:
        parts += [strokes([min(share * b.speed, 0.5 * b.jump)], dwell, b.travel, math.inf, b.dt, b.room), rest(0.5 * dwell, b.dt)]
    return np.concatenate(parts)


def _triangles(b: Bench) -> Vector:
    return triangles((0.05 * b.speed, 0.2 * b.speed, 0.6 * b.speed), b.seconds / 3.0, b.travel, b.dt)


def reversals(b: Bench) -> Vector:
    """Square waves around zero, small and large."""
    parts = []
    for share in (0.02, 0.3):
        dwell = max(b.seconds / 16.0, 10 * b.dt)
        small = share < 0.1
        speed = min(share * b.speed, 0.5 * b.jump) if small else share * b.speed
        parts += [strokes([speed], dwell, b.travel, math.inf if small else b.slope, b.dt, b.room)] * 3
    return np.concatenate(parts)


def prbs_moving(b: Bench) -> Vector:
    """A binary signal on half the speed, three amplitudes, forwards and backwards."""
    stroke = strokes([0.5 * b.speed], b.seconds / 7.0, b.travel, b.slope, b.dt, b.room)
    largest = 0.1 * b.speed if b.kp is None else min(0.2 * b.speed, 0.25 * b.jump)
    parts = [dithered(stroke, f * largest, c) for f, c in ((0.3, 1), (0.6, 2), (1.0, 4))]
    return np.concatenate(parts)


def _prbs_standing(b: Bench) -> Vector:
    largest = 0.1 * b.speed if b.kp is None else min(0.2 * b.speed, 0.5 * b.jump)
    piece = rest(b.seconds / 3.0 - b.dt, b.dt)
    parts = [dithered(piece, f * largest, c) for f, c in ((0.1, 8), (0.4, 4), (1.0, 4))]
    return np.concatenate(parts)


def steps(b: Bench) -> Vector:
    """Steps of 10, 30 and 100 %: forwards, from there backwards, which is a jump of twice the speed, and back to rest."""
    # A jump overshoots more than a ramp: with kp there is room for a third of 2 v.
    full = 0.8 * b.speed if b.kp is None else min(0.65 * b.speed, 0.5 * b.jump)
    return np.concatenate(
        [strokes([share * full], b.seconds / 6.5, b.travel, math.inf, b.dt, b.room) for share in (0.1, 0.3, 1.0)]
    )


def _constant_slow(b: Bench) -> Vector:
    """Three slow speeds, each for five turns where travel and time allow."""
    dwell = b.seconds / 6.5
    wanted = 5.0 * math.tau / dwell
    shares = [min(f * b.speed, g * wanted) for f, g in ((0.1, 0.4), (0.3, 1.0), (0.6, 2.5))]
    return strokes(shares, dwell, b.travel, b.slope, b.dt, b.room)


def _holds(b: Bench) -> Vector:
    """Eight angles within a turn or the travel, approached from both sides, a hold at each.

    A move is half a wave of the sine, v sin(pi t/T), whose steepest slope v pi/T is that of the bench at most.
    """
    angle = min(b.travel, math.tau) / 8.0
    period = b.seconds / 16.0
    move, hold = 0.5 * period, rest(0.5 * period, b.dt)
    count = max(2, round(move / b.dt))
    shape = np.sin(np.pi * (np.arange(count) + 0.5) / count)
    highest = min(b.speed, angle / (b.dt * float(shape.sum())), b.slope * move / np.pi)
    move_once = highest * shape
    once = np.concatenate([move_once, hold])
    return np.concatenate([np.tile(once, 8), np.tile(-once, 8)])


def _repeat(b: Bench) -> Vector:
    """The same levels at start and end, a fast warm-up between."""
    segment = strokes([0.2 * b.top, 0.6 * b.top], b.seconds / 17.0, b.travel, b.slope, b.dt, b.room)
    warm = strokes([b.top] * 3, b.seconds / 13.0, b.travel, b.slope, b.dt, b.room)
    return np.concatenate([segment, warm, segment])


def _creep(b: Bench) -> Vector:
    """Tiny triangles: torque that rises and falls below break-away."""
    return triangles((0.001 * b.speed, 0.003 * b.speed, 0.01 * b.speed), b.seconds / 3.0, b.travel, b.dt)


MENU: tuple[tuple[str, Builder, tuple[str, ...], Text], ...] = tuple((name, build, excited(name), why) for name, build, why in (
    ("slow stairs", slow_stairs,
     say("slow levels with rests show how friction behaves from standstill on.")),
    ("triangle across zero", _triangles,
     say("a speed that sweeps through zero draws the whole friction curve, accelerating and decelerating.")),
    ("reversals", reversals,
     say("with small and with large {torque}, a gap takes time, a dead band {torque}, a bristle {}.", Text("angle", "travel"))),
    ("random signal at speed", prbs_moving,
     say("a binary signal on a constant speed, dry friction out of the way, shows the dynamics up to half the sampling rate.")),
    ("random signal at standstill", _prbs_standing,
     say("a binary signal around standstill, in three amplitudes: friction and play show as what changes with the amplitude.")),
    ("steps of three sizes", steps,
     say("a limit of {torque}, integral or slope holds the largest back, and the others not.")),
    ("slow constant speeds", _constant_slow,
     say("{} at three of them: a {torque} ripple keeps its {torque}, a sensor's ripple grows with speed.",
         Text("several turns", "long strokes"))),
    ("holds up and down", _holds,
     say("{angles} approached from both sides: the mean {torque} there is load or gravity, half the difference friction.")),
    ("repeated segment", _repeat,
     say("one motion, made cold and again after a warm-up: only what depends on time differs.")),
    ("speeds mixed in time", speed_ladder,
     say("up to the highest, in mixed order and both directions, they draw drag against speed.")),
    ("creep below break-away", _creep,
     say("a {torque} that rises slowly below break-away: a bristle gives way like a spring, dry friction holds.")),
))  # fmt: skip
"""(name, builder, effects that it is good at, why: a sentence that goes on from the name) of each command."""
