"""Over what an identification closes the loop: a PI or a cascade, driven by the command; none, driven by the torque."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.arguments import TORQUE
from gaident.axis import Text
from gaident.control import core
from gaident.control.cascade import Cascade, Controller, cascade_of
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.identification.space import derive_space
from gaident.models.drive_torque import torque_driven
from gaident.models.search_space import SearchSpace
from gaident.models.starts import starts_moving

__all__ = ["Looped", "closed_cascade", "input_of", "line_record", "looped_over", "space_of", "with_torque"]

Vector = NDArray[np.float64]

USUAL_POLES = 6  # no decision: p + q of the largest structure of a derived space


class Looped(NamedTuple):
    """Records, the controller that the loop is closed over, None where their torque drives the model, and notes on that."""

    records: Sequence[Record]
    controller: Controller | None
    notes: tuple[Text, ...] = ()


def looped_over(records: Sequence[Record], controller: Controller | None, space: object) -> Looped:
    """What an identification of the records does under a controller; space: the search space, or None. Raises RecordError."""
    cascade = closed_cascade(records, controller, space if isinstance(space, SearchSpace) else None)
    if cascade is not None:
        return Looped(records, cascade)
    driven = torque_driven(records, controller)
    given = [r.with_channels(command=None) for r in driven.records] if driven.cascade is not None else driven.records
    return Looped(given, driven.controller, driven.notes)


def closed_cascade(records: Sequence[Record], controller: Controller | None, space: SearchSpace | None) -> Cascade | None:
    """The controller, where one difference equation takes each record from line to line of its log; None otherwise.

    That is: the log has fewer lines than the controller samples, the command is logged, the record starts at rest, and
    controller and plant together are linear and of an order that the core holds.
    """
    cascade = None if controller is None else cascade_of(controller)
    if cascade is None or cascade.limited or cascade.friction_feedforward != 0.0:
        return None
    if cascade.position is not None and cascade.acceleration_feedforward != 0.0:
        return None
    poles = USUAL_POLES if space is None else space.p[1] + space.q[1]
    return cascade if all(_is_one_equation(r, cascade, poles) for r in records) else None


def _is_one_equation(rec: Record, cascade: Cascade, poles: int) -> bool:
    every = cascade.log_every(rec.dt)
    source = rec.command if cascade.position is None else rec.position_command
    if every == 1 or source is None or starts_moving(rec, cascade):
        return False
    if cascade.position is None:
        # What stood before a record is not known: a jump at its first line would be one of the command's slope.
        fits = cascade.acceleration_feedforward == 0.0 or float(source[0]) == 0.0
    else:
        fits = every % cascade.position_every(rec.dt) == 0
    return fits and core.is_one_equation(rec.dt, cascade, poles)


def with_torque(records: Sequence[Record], cascade: Cascade) -> list[Record]:
    """The records with the logged torque or, without one, with about the torque that the controller makes of the measured lines.

    For search ranges: filters and delay are left out, and the controller samples as often as the log.
    """
    plain = replace(
        cascade, period=None, position_period=None, torque_filters=(), velocity_filters=(), command_filters=(), delay=0.0
    )
    made = []
    for rec in records:
        source = rec.command if cascade.position is None else rec.position_command
        if rec.torque is not None:
            made.append(rec)
        elif source is None or (cascade.position is not None and rec.position is None):
            raise RecordError(f"the record has no torque, and without a position none can be made: give {TORQUE}, or position=")
        else:
            made.append(rec.with_channels(torque=core.servo_torque(rec.dt, source, rec.velocity, rec.position, plain)))
    return made


def space_of(records: Sequence[Record], controller: Controller | None) -> SearchSpace:
    """Search ranges from the data; controller: what the loop is closed over."""
    if isinstance(controller, Cascade):
        return derive_space(with_torque(records, controller), None)
    return derive_space(records, controller)


def input_of(rec: Record, controller: Controller | None) -> Vector:
    """What drives the loop, shape (n,): command [rad/s], position command [rad], or without a controller torque [N m]."""
    placed = isinstance(controller, Cascade) and controller.position is not None
    source = rec.torque if controller is None else rec.position_command if placed else rec.command
    assert source is not None  # checked on entry
    return source


def line_record(rec: Record, cascade: Cascade) -> _core.Record:
    """The core's record, from rest, of a loop whose controller is faster than the log."""
    start = 0.0 if rec.position is None else float(rec.position[0])
    return core.line_record(rec.dt, input_of(rec, cascade), rec.velocity, start, cascade)
