"""A loop that is simulated from its command although its controller is faster than the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gaident.arguments import TORQUE
from gaident.control import core
from gaident.control.cascade import Cascade, Controller, cascade_of
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.models.search_space import SearchSpace
from gaident.models.starts import starts_moving

__all__ = ["closed_cascade", "with_torque"]

USUAL_POLES = 6  # no decision: p + q of the largest structure of a derived space


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
