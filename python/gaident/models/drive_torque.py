"""The torque that drives a model on a record: the logged one, or what the controller makes of command and velocity."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.control.between import at_lines, at_the_clock
from gaident.control.controller import Controller
from gaident.control.pi import PI
from gaident.control.pi_torque import pi_block
from gaident.data.record import Record
from gaident.data.signals.difference import difference_at_clock, is_difference_at_clock, is_difference_of_lines
from gaident.data.torque_kind import HELD, MEAN, SAMPLE
from gaident.errors import RecordError
from gaident.models.held_torque import held_mean
from gaident.models.made_torque import late, made_at_its_clock, stored_torque
from gaident.models.starts import torque_before

__all__ = [
    "HALF",
    "as_late",
    "as_old_as_its_velocity",
    "as_read",
    "driven_by",
    "made_by",
    "on_lines",
    "straight_driven",
    "torque_blocks",
    "torque_of",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

TWO_MASSES = 3  # no decision: how many poles two masses have
HALF = 0.5  # no decision: of a sample, the age of a mean over it


def driven_by(rec: Record, controller: Controller, made: Vector | None = None) -> Record:
    """The record with the torque that drove the motor, held over each line of the log [N m], and no more than drives it.

    Where the log has a line for each of the controller's samples, that is the logged torque, or the one that the controller
    makes of the measured signals.
    Of a torque logged every r-th sample, it is the mean over its r samples between the lines, see `_at_its_clock`.
    A log of means has it but for the first of these samples, see `_mean_ahead`.
    made: the torque at its samples [N m] (n r,) where another law than this controller makes it.

    A known delay of the controller is part of it: `late`. Raises RecordError where a torque is neither logged nor can be made.
    """
    every = controller.log_every(rec.dt)
    torque = made_by(rec, controller) if rec.torque is None else rec.torque
    whole = rec.with_channels(torque=torque)
    from_rest = made_at_its_clock(whole, controller) if every > 1 else None
    stored = stored_torque(whole, controller, driven=False, at_clock=from_rest)
    before = torque_before(whole, stored)
    if every > 1:
        known = from_rest if made is None and stored == 0.0 else made
        at_clock = _at_its_clock(rec, torque, controller, stored, known).reshape(len(rec), every)
        torque = _mean_ahead(torque, at_clock) if rec.torque_log == MEAN else at_clock.mean(axis=1)
    return rec.with_channels(torque=late(torque, controller.delay / rec.dt, before), torque_log=HELD)


def on_lines(rec: Record, controller: Controller | None) -> Record:
    """The record with the torque of a log of means as a diagnosis takes it.

    Without a controller it is held over each line. Under one at the log's rate a mean over one sample is that sample.
    """
    if controller is None:
        return held_mean(rec)
    return rec.with_channels(torque_log=SAMPLE) if controller.one_equation and rec.torque_log == MEAN else rec


def straight_driven(rec: Record, controller: Controller) -> Record:
    """The record with a logged torque that goes straight between the lines: of the controller clock and delay alone are known.

    It is the mean over each line, as in `driven_by`: what a controller that is not the drive's makes between the lines is worse.
    """
    assert rec.torque is not None
    every = controller.log_every(rec.dt)
    before = torque_before(rec)
    straight = _straight(rec, rec.torque, every).reshape(len(rec), every)
    mean = _mean_ahead(rec.torque, straight) if rec.torque_log == MEAN else straight.mean(axis=1)
    return rec.with_channels(torque=late(mean, controller.delay / rec.dt, before), torque_log=HELD)


def _mean_ahead(logged: Vector, at_clock: Matrix) -> Vector:
    """The mean over each line [N m] (n,), of a log of means since the line before and the torque at the samples (n, r):

    m(k+1) = (u(k r + 1) + ... + u(k r + r))/r,   mean over line k = m(k+1) + (u(k r) - u(k r + r))/r
    """
    at_line = at_clock[:, 0]
    mean: Vector = np.append(logged[1:] + (at_line[:-1] - at_line[1:]) / at_clock.shape[1], at_clock[-1].mean())
    return mean


def _straight(rec: Record, line: Vector, every: int) -> Vector:
    """A signal that the log has as it has the torque (n,), straight from line to line at the controller's samples (n r,).

    A mean over r samples is that of their middle, (r - 1)/2 samples before its line.
    """
    if rec.torque_log != MEAN:
        return at_the_clock(line, every)
    middle = np.arange(len(line)) * every - 0.5 * (every - 1)  # no decision: a formula: the middle of r samples
    at = np.arange(len(line) * every, dtype=np.float64)
    slope = (line[-1] - line[-2]) / every
    made: Vector = np.interp(at, middle, line) + slope * np.maximum(at - middle[-1], 0.0)
    return made


def _at_its_clock(rec: Record, torque: Vector, controller: Controller, stored: float, made: Vector | None) -> Vector:
    """A torque logged now and then [N m] (n,) at all of the controller's samples (n every,).

    Between the lines it goes as this controller makes it of command and velocity, and what it is off by on the lines goes
    straight. Where that changes more from line to line than the torque itself, the torque goes straight.
    stored: what the integrator held before the record [N m]. made: see `driven_by`.
    """
    every = controller.log_every(rec.dt)
    made = made_at_its_clock(rec, controller, stored) if made is None else made
    if made is not None:
        off = torque - at_lines(made, every, rec.torque_log == MEAN, stored)
        if np.sum(np.diff(off) ** 2) < np.sum(np.diff(torque) ** 2):
            between: Vector = made + _straight(rec, off, every)
            return between
    return _straight(rec, torque, every)


def as_differenced(rec: Record, controller: Controller | None) -> Record:
    """The record with the velocity that its controller forms of its position, where the log's is a difference of its lines.

    That one is another velocity: the mean over the line before it, of several samples of the controller, or over two lines.
    """
    if rec.position is None or not is_difference_of_lines(rec.velocity, rec.position, rec.dt):
        return rec
    every = 1 if controller is None else controller.log_every(rec.dt)
    return rec.with_channels(velocity=difference_at_clock(rec.position, rec.dt, every))


def as_read(rec: Record, controller: Controller | None, shifts: Mapping[str, Mapping[str, int]]) -> Record:
    """The record with the velocity that its controller reads, and its channels on the same lines.

    shifts: digest of a record -> channel -> samples by which it is moved, see `Diagnosis.log_shifts`.
    """
    rec = on_lines(as_differenced(rec, controller), controller)
    return rec.shifted(**moves) if (moves := shifts.get(rec.digest)) else rec


def without_age(rec: Record) -> Record:
    """The record with the difference over two lines, which has no age, where its velocity is a difference of lines."""
    if rec.position is None or not is_difference_of_lines(rec.velocity, rec.position, rec.dt):
        return rec
    return rec.with_channels(velocity=np.gradient(rec.position, rec.dt))


def as_old_as_its_velocity(rec: Record, every: int) -> Record:
    """The record with a torque that is half a sample late where its velocity is the difference of the last two positions.

    every: samples of the controller for each line.

    Such a velocity is the mean over the last sample: under that torque a linear model gives it to second order in dt.
    """
    if rec.torque is None or not is_difference_at_clock(rec.velocity, rec.position, rec.dt, every):
        return rec
    return as_late(rec, HALF / every)


def as_late(rec: Record, lines: float) -> Record:
    """The record with its torque so many lines of the log later [1], or earlier: as its velocity is older, or younger."""
    if not lines or rec.torque is None:
        return rec
    before = torque_before(rec)
    return rec.with_channels(torque=late(rec.torque, lines, before))


def made_by(rec: Record, controller: Controller) -> Vector:
    """The torque [N m] (n,) that the controller makes of command and measured signals; RecordError where it cannot be made."""
    every = controller.log_every(rec.dt)
    if every > 1:
        linear = (
            "identify takes such a log as it is, but no diagnosis does. " if controller.line_equation(rec, TWO_MASSES) else ""
        )
        raise RecordError(
            f"the record has no torque, and the controller samples {every} times for each of its lines: what it made between "
            f"the lines of the velocity is lost; give {TORQUE}, or log each of its samples. {linear}"
            "Where there is neither, leave the controller's period out: it is then taken for one at the rate of the log. What is "
            "found is then approximate: an inertia may be off by 15 %, and a delay may be found that the drive has not"
        )
    if not controller.replayable(rec):
        needed = "a command" if controller.driven_by == "command" else "a position_command and a position"
        raise RecordError(f"the record has no torque and nothing to make it from: give {TORQUE}, or {needed}")
    return controller.torque_of(rec)


def torque_of(rec: Record, controller: PI | None) -> Vector:
    """The record's torque [N m] (n,) or, where none was recorded, the controller's answer, its limits included.

    Raises RecordError where the record has neither a torque nor what makes one.
    """
    if rec.torque is not None:
        return rec.torque
    return np.concatenate([u for _, u, _ in torque_blocks(rec, controller)])


# no decision: memory; samples of a block
def torque_blocks(rec: Record, controller: PI | None, length: int = 1 << 18) -> Iterator[tuple[int, Vector, Vector]]:
    """(first sample, torque [N m], velocity [rad/s]) a block at a time: of a long record no copy is made."""
    if rec.torque is None and (controller is None or rec.command is None):
        raise RecordError(f"the record has no torque and nothing to make it from: give {TORQUE}, or a command and PI(...)")
    integral = last = 0.0
    for first in range(0, len(rec), length):
        w = rec.velocity[first : first + length]
        if rec.torque is not None:
            yield first, rec.torque[first : first + length], w
        elif controller is not None and rec.command is not None:
            e = rec.command[first : first + length] - w
            torque, integral = pi_block(e, rec.dt, controller, last, integral)
            last = float(e[-1])
            yield first, torque, w
