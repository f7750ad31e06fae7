"""The loop of a diagnosis with the tables' torque added behind the controller, as a drive adds it.

    u(n) = controller(n) + f(v*(n)) + D v*(n) + c + J a*(n) + sum over waves of  s sin(k theta(n)) + b cos(k theta(n))

v*, a*: velocity of the command and its slope (docs/controllers.md), theta: the motor's angle, at the controller's samples n.
All but theta is known before the loop runs.
theta(n) depends on the torque before n alone, so that the runs

    u_0: theta = angle of the command,   u_i+1: theta = angle of the run with u_i

agree with the loop at one sample more each, and at all of them where u no longer changes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import say
from gaident.control import core
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.differencing import older
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.identification.replay.command_timing import timed_record
from gaident.models.model import Model
from gaident.models.simulate_many import simulated_with_effects
from gaident.remedies.following.errors import FollowingError, LoopError
from gaident.remedies.tables import FeedforwardTables
from gaident.results.diagnosis import Diagnosis

__all__ = ["NOT_THE_LOOP", "NO_COMMAND", "NO_CONTROLLER", "RUNS_AWAY", "following_error"]

Vector = NDArray[np.float64]

NO_CONTROLLER = say("no controller is simulated in this result: its {torque} drives the model")
NO_RECORD = say("the result is a loaded one and has no records")
NOT_THE_LOOP = say("the logged {torque} does not follow from the controller, so that the simulated loop is not the drive's")
CONTINUOUS = say("the controller has the continuous loop of the paper, in which nothing is added at samples")
NO_COMMAND = say("the record has no command that the loop follows")
RUNS_AWAY = say("the simulated loop runs away on this record")
UNSETTLED = say("the {torque} by {angle} does not settle in the simulated loop")

MOST_RUNS = 200  # no decision: of a solver: a loop that follows needs some 10
SETTLED = 1e-9  # no decision: of a solver: of the waves' amplitudes


def following_error(
    result: Diagnosis, tables: FeedforwardTables, rec: Record | None = None, controller: Controller | None = None
) -> FollowingError:
    """What the tables bring; raises GaidentError with the reason why that cannot be simulated.

    rec: None: the longest of the result. controller: the loop that they are added in; None: that of the result.
    """
    given = result.controller if controller is None else controller
    if given is None:
        raise GaidentError(NO_CONTROLLER)
    if rec is None and not result.records:
        raise GaidentError(NO_RECORD)
    if controller is None and not result.loop_follows:
        raise GaidentError(NOT_THE_LOOP)
    if given.loop == "continuous":
        raise GaidentError(CONTINUOUS)
    rec = timed_record(max(result.records, key=len) if rec is None else rec, given)
    loop = _Loop.of(result, rec, given)
    bare = replace(loop.cascade, acceleration_feedforward=0.0, friction_feedforward=0.0)
    before = loop.run(loop.cascade, None)
    after = loop.run_with(bare, tables)
    fed = None
    if loop.placed and bare.velocity_feedforward < 1.0:
        fed = loop.figures(loop.run_with(replace(bare, velocity_feedforward=1.0), tables))
    return FollowingError(
        record=rec.name or "the record",
        unit="rad" if loop.placed else "rad/s",
        measured=_measured(rec, loop.placed),
        before=loop.figures(before),
        after=loop.figures(after),
        with_velocity=fed,
        replaced=bare != loop.cascade,
        time=rec.time,
        error_before=loop.error(before),
        error_after=loop.error(after),
    )


def _measured(rec: Record, placed: bool) -> LoopError | None:
    """The record's own following error."""
    command, motion = (rec.position_command, rec.position) if placed else (rec.command, rec.velocity)
    return None if command is None or motion is None else _figures(command - motion, rec.torque)


def _figures(error: Vector, torque: Vector | None) -> LoopError:
    most = math.nan if torque is None else float(np.max(np.abs(torque)))
    return LoopError(float(np.sqrt(np.mean(error**2))), float(np.max(np.abs(error))), most)


@dataclass(frozen=True, eq=False)
class _Motion:
    velocity: Vector
    torque: Vector
    angle: Vector


@dataclass(frozen=True, eq=False)
class _Loop:
    """A command at the controller's samples, `every` to a line of the log; period [s], start: angle [rad]."""

    model: Model
    cascade: Cascade
    command: Vector
    start: float
    period: float
    every: int

    @classmethod
    def of(cls, result: Diagnosis, rec: Record, controller: Controller) -> _Loop:
        cascade = cascade_of(older(controller, result.velocity_age))
        source = cascade.source_of(rec)
        if source is None:
            raise GaidentError(NO_COMMAND)
        every = cascade.log_every(rec.dt)
        command = np.ascontiguousarray(cascade.ticks(rec.dt, source, None).source)
        start = cascade.start_angle(command) if rec.position is None else float(rec.position[0])
        return cls(result.model, cascade, command, start, rec.dt / every, every)

    @property
    def placed(self) -> bool:
        """Whether a position command drives it."""
        return self.cascade.position is not None

    def motion(self) -> tuple[Vector, Vector, Vector]:
        """Velocity, acceleration and angle of the command at the controller's samples."""
        share = 1.0 if self.placed else 0.0
        asked = replace(self.cascade, velocity_feedforward=share, acceleration_feedforward=1.0, friction_feedforward=0.0)
        ticks = asked.ticks(self.period, self.command, None)
        if self.placed:
            return ticks.velocity_feedforward, ticks.torque_feedforward, self.command
        turned = self.start + self.period * np.append(0.0, np.cumsum(self.command)[:-1])
        return self.command, ticks.torque_feedforward, turned

    def run(self, cascade: Cascade, added: Vector | None) -> _Motion:
        """From rest, with a torque added at each of the controller's samples [N m]."""
        none = np.zeros(len(self.command))
        loaded = core.effect_record(self.period, self.command, None, none, self.start, cascade, added=added)
        found = simulated_with_effects(loaded, [self.model], np.zeros((0, 0)), 0, 1, True)[:3]  # no decision: how many
        if not all(np.all(np.isfinite(signal)) for signal in found):
            raise GaidentError(RUNS_AWAY)
        return _Motion(*(signal[0] for signal in found))

    def run_with(self, cascade: Cascade, tables: FeedforwardTables) -> _Motion:
        """With the tables' torque; that by angle is looked up at the angle of the run itself."""
        velocity, acceleration, angle = self.motion()
        size = sum(float(np.hypot(wave.sine, wave.cosine)) for wave in tables.waves)
        added = tables.torque(velocity, angle, acceleration)
        for _ in range(MOST_RUNS):
            found = self.run(cascade, added)
            if size == 0.0:
                return found
            looked_up = tables.torque(velocity, found.angle, acceleration)
            if float(np.max(np.abs(looked_up - added))) <= SETTLED * size:
                return found
            added = looked_up
        raise GaidentError(UNSETTLED)

    def error(self, run: _Motion) -> Vector:
        """Command minus motion at the lines of the log."""
        return (self.command - (run.angle if self.placed else run.velocity))[:: self.every]

    def figures(self, run: _Motion) -> LoopError:
        return _figures(self.error(run), run.torque)
