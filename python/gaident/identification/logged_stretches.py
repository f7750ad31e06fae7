"""Logs of a controller, cut where a limit acts: what it makes of the logged signals, and what is left of the logged torque.

A stretch is what lies between two limits: what the integrator stored before it is free.
Of a record that starts in motion the first lines are left out, in which filters forget what was before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gaident.control import core
from gaident.control.between import at_lines, between_lines
from gaident.control.cascade import Cascade
from gaident.control.pi import PI
from gaident.control.ticks import push_of, smooth_between, straight_between
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN
from gaident.models.made_torque import stored_beside
from gaident.models.starts import starts_moving
from gaident.policy.table import POLICY

__all__ = ["Log", "centred", "correlation", "correlation_of", "log_of", "numbered", "plateau_of", "unlimited", "whitened"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Log:
    """Lines of a record; velocity: at the controller's samples. stretch (n,): number of the line's stretch; -1: none.

    position: at the controller's samples (n, r). between: the command at the controller's samples (n, r) where it is known
    there, see `Controller.source_of`; else `source`. moving: it starts in motion, and what the integrator stored before is not
    known. mean: of means since the line before. late: controller samples by which the torque of a line is older than its motion,
    as that is which was measured before the new one acts.
    """

    dt: float
    source: Vector
    velocity: Vector
    position: Matrix | None
    torque: Vector
    stretch: NDArray[np.intp]
    between: Vector
    moving: bool = False
    mean: bool = False
    late: int = 0

    @property
    def command(self) -> Vector:
        """A velocity command at the controller's samples (n r,)."""
        every = len(self.velocity) // len(self.source)
        return between_lines(self.source, every) if self.between.ndim == 1 else self.between.ravel()

    def made(self, cascade: Cascade, straight: bool = False) -> Vector:
        """What the lines contain of what the controller makes [N m] (n,); straight: of a velocity straight between the lines.

        Of a record that begins under load, with what the torque shows that the integrator stored.
        """
        every = len(self.velocity) // len(self.source)
        velocity = straight_between(self.velocity[::every], every) if straight else self.velocity
        ticks = cascade.ticks(self.dt, self.between, self.position)
        loop = cascade.core_loop(self.dt)
        torque = at_lines(self._written(core.servo_torque(self.dt, ticks, velocity, loop)), every, self.mean)
        if self.moving or not (stored := stored_beside(self.torque, torque, cascade)):
            return torque
        return at_lines(
            self._written(core.servo_torque(self.dt, ticks, velocity, loop, stored), stored), every, self.mean, stored
        )

    def _written(self, torque: Vector, before: float = 0.0) -> Vector:
        """The torque at the controller's samples [N m] (n r,) as the log has it there; before: the record."""
        return np.concatenate([np.full(self.late, before), torque[: len(torque) - self.late]]) if self.late else torque

    def asked(self, cascade: Cascade) -> tuple[Vector, Matrix]:
        """At the controller's samples: what a position controller asks for [rad/s] (n r,), slope and sign of v* (2, n r)."""
        assert cascade.position is not None and self.position is not None
        fed = [
            replace(cascade, acceleration_feedforward=a, friction_feedforward=f).ticks(self.dt, self.between, self.position)
            for a, f in ((1.0, 0.0), (0.0, 1.0))
        ]
        ticks, every = fed[0], cascade.position_every(self.dt)
        made = cascade.position.gain * (ticks.source - ticks.position)
        command = np.repeat(made[::every], every)[: len(made)]
        if len(ticks.velocity_feedforward):
            command = command + ticks.velocity_feedforward
        return command, np.stack([one.torque_feedforward for one in fed])

    def pushed(self, cascade: Cascade) -> Log:
        """The log with a velocity between the lines whose slope jumps where the command does, see `pushed_between`."""
        if cascade.driven_by != "command":
            return self
        every = len(self.velocity) // len(self.source)
        line, push = self.velocity[::every], np.multiply(*self.push(cascade))
        return replace(self, velocity=smooth_between(line - push[::every], every) + push)

    def push(self, cascade: Cascade) -> tuple[float, Vector]:
        """What the torque pushes of the velocity where the command jumps, see `push_of`."""
        every = len(self.velocity) // len(self.source)
        ticks, loop = cascade.ticks(self.dt, self.between, None), cascade.core_loop(self.dt)
        made = partial(core.servo_torque, self.dt, ticks, servo=loop)
        return push_of(self.velocity[::every], every, made, cascade.steps_at(self.source))


def log_of(rec: Record, share: int, cascade: Cascade, whole: bool) -> Log:
    part = rec[:share]
    every = cascade.log_every(rec.dt)
    source, between = cascade.command_of(part), cascade.source_of(part)
    assert source is not None and between is not None and part.torque is not None
    size = np.abs(part.torque)
    limit = cascade.velocity.torque_limit or plateau_of(size)
    mean = part.torque_log == MEAN and every > 1
    free = size < POLICY.at_limit * limit if not whole else np.ones(len(size), bool)
    if mean:  # a line beside a limited one is the mean of limited samples, too
        free = free & np.append(True, free[:-1]) & np.append(free[1:], True)
    begins = free & ~np.append(False, free[:-1])
    stretch = np.where(free, np.cumsum(begins) - 1, -1)
    stretch[len(stretch) - cascade.ahead(rec.dt) :] = -1
    moving = starts_moving(part, None)
    if moving:
        # no decision: a quarter of the memory, as where few lines are left, and of a short record a quarter of its lines
        stretch[: min(POLICY.filter_memory // 4, len(stretch) // 4)] = -1
    velocity = smooth_between(part.velocity, every)
    position = None
    if cascade.position is not None and part.position is not None:
        position = smooth_between(part.position, every).reshape(-1, every)
    return Log(rec.dt, source, velocity, position, part.torque, stretch, between, moving, mean)


def plateau_of(size: Vector) -> float:
    """A limit that was not given: the highest torque, where as many lines stand at it as a plateau has; else infinity."""
    highest = float(size.max())
    return highest if np.sum(size >= POLICY.at_limit * highest) >= POLICY.plateau else np.inf


def unlimited(pi: PI) -> PI:
    return replace(pi.winding_up, torque_limit=None, integrator_limit=None)


def numbered(parts: Sequence[NDArray[np.intp]]) -> NDArray[np.intp]:
    """The stretches of all records, numbered through."""
    parts_numbered, first = [], 0
    for part in parts:
        parts_numbered.append(np.where(part >= 0, part + first, -1))
        first = max(first, int(part.max(initial=-1)) + first + 1)
    return np.concatenate(parts_numbered)


def whitened(d: Vector, stretch: NDArray[np.intp], rho: float) -> tuple[Vector, NDArray[np.intp]]:
    """(c, stretch of each): d(k) - rho d(k-1) where both lie in one stretch; with rho = 0 every d in a stretch."""
    if rho == 0.0:
        used = stretch >= 0
        return d[used], stretch[used]
    used = (stretch[1:] >= 0) & (stretch[1:] == stretch[:-1])
    return (d[1:] - rho * d[:-1])[used], stretch[1:][used]


def centred(c: Vector, stretch: NDArray[np.intp], whole: bool) -> Vector:
    """c without the mean of its stretch, whose number is 0 or more; `whole`: as it is."""
    if whole or not len(c):
        return c
    means = np.bincount(stretch, c) / np.maximum(np.bincount(stretch), 1)
    left: Vector = c - means[stretch]
    return left


def correlation(left: Vector, stretch: NDArray[np.intp]) -> float:
    """rho of what is left at every line, from 0 to just below 1; stretch: of each line."""
    return correlation_of(left[stretch >= 0], stretch[stretch >= 0])


def correlation_of(left: Vector, own: NDArray[np.intp]) -> float:
    """The same of lines in stretches; own: the stretch of each."""
    d = centred(left, own, False)
    pairs = own[1:] == own[:-1]
    power = float(np.sum(d**2))
    together = float(np.sum((d[1:] * d[:-1])[pairs]))
    return float(np.clip(together / power, 0.0, 0.999)) if power > 0.0 else 0.0  # no decision: no division by 0
