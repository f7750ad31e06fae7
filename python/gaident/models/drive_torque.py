"""The torque that drives a model on a record: the logged one, or what the controller makes of command and velocity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import Text, say
from gaident.control import core
from gaident.control.beside import beside_pi
from gaident.control.controller import Controller
from gaident.control.pi import PI, bare_pi
from gaident.control.pi_torque import pi_block
from gaident.control.ticks import at_the_clock, smooth_between
from gaident.data.record import Record
from gaident.data.signals.difference import is_backward_difference
from gaident.errors import RecordError
from gaident.models.starts import constant_beside, starts_moving
from gaident.policy.table import POLICY

__all__ = [
    "HALF",
    "Driven",
    "as_old_as_its_velocity",
    "driven_by",
    "follows_not",
    "late",
    "made_at_its_clock",
    "made_by",
    "straight_driven",
    "torque_blocks",
    "torque_driven",
    "torque_of",
]

Vector = NDArray[np.float64]

TWO_MASSES = 3  # no decision: how many poles two masses have
HALF = 0.5  # no decision: of a sample, the age of a mean over it


class Driven(NamedTuple):
    """Records as an estimation takes them under their controller; notes on that.

    doubts: notes on logged torques that do not follow from the controller. slower: whether the log has fewer lines than the
    controller samples.
    """

    records: tuple[Record, ...]
    controller: Controller | None
    notes: tuple[Text, ...] = ()
    doubts: tuple[Text, ...] = ()
    slower: bool = False

    @property
    def loop(self) -> PI | None:
        """What an identification closes the loop over; None: the torque drives the model."""
        return bare_pi(self.controller)


def torque_driven(records: Sequence[Record], controller: Controller | None) -> Driven:
    """The records as they are under a bare PI or in the open loop; under any other controller as driven by their torque."""
    if controller is None or controller.one_equation:
        return Driven(tuple(records), controller)
    every = max(controller.log_every(r.dt) for r in records)
    if every == 1:
        has = beside_pi(controller)
        text = "Your controller has {}; so the linear model is identified from its {torque}, not in a simulated loop."
        note = say(text, f"{has} beside kp and ki" if has else "a sample time of its own")
    else:
        text = (
            "The controller samples {} times for each line of the log. The linear model is identified from the logged "
            "{torque}, between the lines as this controller makes it; what it answered to noise there is lost."
        )
        note = say(text, every)
    doubts = []
    for rec in records:
        if rec.torque is None or not controller.replayable(rec):
            continue
        known = len(rec) - controller.ahead(rec.dt)
        left = (rec.torque - controller.torque_of(rec))[:known]
        left = left - constant_beside(left, float(np.abs(rec.torque).max()))
        off = float(np.sqrt(np.mean(left**2)))
        size = float(np.sqrt(np.mean(rec.torque**2)))
        if off > POLICY.negligible * size:
            doubts.append(follows_not(rec.name if len(records) > 1 else "", off, size))
    return Driven(tuple(driven_by(r, controller) for r in records), controller, (note,), tuple(doubts), every > 1)


def follows_not(name: str, off: float, size: float) -> Text:
    """What is said of a logged torque that a controller does not make; name: of the record, off, size: rms [N m]."""
    text = (
        "{}The logged {torque} does not follow from command and velocity through this controller: by {:.2g} {N m} rms, "
        "of {:.2g} {N m} rms. Is this the controller, and are these the signals it saw?"
    )
    return say(text, f"{name}: " if name else "", off, size)


def driven_by(rec: Record, controller: Controller) -> Record:
    """The record with the torque that drove the motor, held over each line of the log [N m], and no more than drives it.

    Where the log has a line for each of the controller's samples, that is the logged torque, or the one that the controller
    makes of the measured signals.
    Of a torque logged every r-th sample, it is the mean over its r samples between the lines, see `_at_its_clock`.

    A known delay of the controller is part of it: `late`. Raises RecordError where a torque is neither logged nor can be made.
    """
    every = controller.log_every(rec.dt)
    torque = made_by(rec, controller) if rec.torque is None else rec.torque
    before = torque[0] if starts_moving(rec.with_channels(torque=torque), None) else 0.0
    if every == 1:
        return rec.with_channels(torque=late(torque, controller.delay / rec.dt, before))
    mean = _at_its_clock(rec, torque, controller).reshape(len(rec), every).mean(axis=1)
    return rec.with_channels(torque=late(mean, controller.delay / rec.dt, before))


def straight_driven(rec: Record, controller: Controller) -> Record:
    """The record with a logged torque that goes straight between the lines: of the controller clock and delay alone are known.

    It is the mean over each line, as in `driven_by`: what a controller that is not the drive's makes between the lines is worse.
    """
    assert rec.torque is not None
    every = controller.log_every(rec.dt)
    before = rec.torque[0] if starts_moving(rec, None) else 0.0
    mean = at_the_clock(rec.torque, every).reshape(len(rec), every).mean(axis=1)
    return rec.with_channels(torque=late(mean, controller.delay / rec.dt, before))


def _at_its_clock(rec: Record, torque: Vector, controller: Controller) -> Vector:
    """A torque logged now and then [N m] (n,) at all of the controller's samples (n every,).

    Between the lines it goes as this controller makes it of command and velocity, and what it is off by on the lines goes
    straight. Where that changes more from line to line than the torque itself, the torque goes straight.
    """
    every = controller.log_every(rec.dt)
    made = made_at_its_clock(rec, controller)
    if made is not None:
        off = torque - made[::every]
        if np.sum(np.diff(off) ** 2) < np.sum(np.diff(torque) ** 2):
            between: Vector = made + at_the_clock(off, every)
            return between
    return at_the_clock(torque, every)


def made_at_its_clock(rec: Record, controller: Controller) -> Vector | None:
    """The torque that a controller makes from rest at all of its samples [N m] (n every,), of command and of the velocity smooth
    between the lines; None where the record lacks what it reads."""
    source = controller.command_of(rec)
    if source is None or any(getattr(rec, channel) is None for channel in controller.reads):
        return None
    ticks = controller.ticks(rec.dt, source, rec.position if controller.driven_by == "position_command" else None)
    velocity = smooth_between(rec.velocity, controller.log_every(rec.dt))
    return core.servo_torque(rec.dt, ticks, velocity, controller.core_loop(rec.dt))


def late(torque: Vector, delay: float, before: float) -> Vector:
    """The mean over each line of a torque (n,) that is held over each line and acts `delay` lines later; `before` the record.

    With delay = m + f, m whole: f u(n - m - 1) + (1 - f) u(n - m), exact in its mean and, for f = 0, everywhere.
    A delay below 0, down to -1/2, is of a torque that the log has now and then: it is on its way to that of the next line.
    """
    if delay < 0.0:
        return np.append((1.0 + delay) * torque[:-1] - delay * torque[1:], torque[-1])
    m = int(delay)
    f = delay - m
    padded = np.concatenate([np.full(m + 1, before), torque])
    return f * padded[: len(torque)] + (1.0 - f) * padded[1 : 1 + len(torque)] if delay > 0.0 else torque


def as_old_as_its_velocity(rec: Record) -> Record:
    """The record with a torque that is half a sample late where its velocity is the difference of its last two positions.

    Such a velocity is the mean over the last sample: under that torque a linear model gives it to second order in dt.
    """
    if rec.torque is None or not is_backward_difference(rec.velocity, rec.position, rec.dt):
        return rec
    before = rec.torque[0] if starts_moving(rec, None) else 0.0
    return rec.with_channels(torque=late(rec.torque, HALF, before))


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
