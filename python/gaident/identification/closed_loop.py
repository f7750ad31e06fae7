"""Over what an identification closes the loop: a controller, driven by its command; none, driven by the torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import Text, say
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.identification.logged_torque import corrected, not_followed
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.driven_records import torque_driven
from gaident.identification.space import derive_space
from gaident.models.drive_torque import as_old_as_its_velocity, straight_driven
from gaident.models.held_torque import held_torque
from gaident.models.search_space import SearchSpace
from gaident.models.starts import starts_moving
from gaident.results.estimate import Estimate

__all__ = ["Looped", "input_of", "line_equation", "looped_over", "space_of", "with_torque"]

Vector = NDArray[np.float64]

NOT_THE_LOOP = say(
    "So the loop is not closed over it: the logged {torque} drives the model. Give all of the controller, filters and limits "
    "too; a diagnosis looks for its form."
)
USUAL_POLES = 6  # no decision: p + q of the largest structure of a derived space


class Looped(NamedTuple):
    """Records, the controller that the loop is closed over, None where their torque drives the model, and notes on that.

    estimates: of numbers of the controller that are not the given ones.
    """

    records: list[Record]
    controller: Controller | None
    notes: tuple[Text, ...] = ()
    estimates: Mapping[str, Estimate] = {}


def looped_over(records: Sequence[Record], controller: Controller | None, space: object, from_rest: bool = True) -> Looped:
    """What an identification of the records does under a controller; space: the search space, or None. Raises RecordError.

    They are `timed`, and what leaves here knows when its command jumped.
    from_rest: False: every record has a start state of its own, which the equation from line to line has not.
    Where a logged torque shows that a controller faster than the log is not the drive's, one number of it is what the torque
    shows or, where it does not follow with any one, the torque drives the model, straight between the lines.
    """
    records = timed(records, controller)
    doubts = not_followed(records, controller)
    if from_rest and line_equation(records, controller, space if isinstance(space, SearchSpace) else None):
        if not doubts or any(r.torque is None for r in records):
            return Looped(list(records), controller, doubts)
        assert controller is not None  # else there were no doubt
        if (other := corrected(records, controller)) is not None:
            if line_equation(records, other.controller, space if isinstance(space, SearchSpace) else None):
                return Looped(list(records), other.controller, (*doubts, other.note), other.estimates)
            driven = torque_driven(records, other.controller)
            given = [r.with_channels(command=None) for r in driven.records]
            return Looped(given, None, (*driven.notes, *doubts, other.note), other.estimates)
        straight = [straight_driven(r, controller).with_channels(command=None) for r in records]
        return Looped(straight, None, (*torque_driven(records, controller).notes, *doubts, NOT_THE_LOOP))
    driven = torque_driven(records, controller)
    given = list(driven.records)
    if controller is not None and driven.loop is None:
        given = [r.with_channels(command=None, position_command=None) for r in given]
    if driven.loop is None:
        given = [as_old_as_its_velocity(r, 1 if controller is None else controller.log_every(r.dt)) for r in given]
    return Looped(given, driven.loop, (*driven.notes, *driven.doubts, *doubts))


def line_equation(records: Sequence[Record], controller: Controller | None, space: SearchSpace | None) -> bool:
    """Whether one difference equation takes each record from line to line of a log that is slower than its controller."""
    if controller is None or controller.one_equation:
        return False
    poles = USUAL_POLES if space is None else space.p[1] + space.q[1]
    return all(controller.line_equation(r, poles) and not starts_moving(r, controller) for r in records)


def with_torque(records: Sequence[Record], controller: Controller) -> list[Record]:
    """The records with the logged torque or, without one, with about the torque that the controller makes of the measured lines.

    For search ranges: filters and delay are left out, and the controller samples as often as the log.
    """
    plain = controller.at_lines()
    made = []
    for rec in records:
        if rec.torque is not None:
            made.append(rec)
        elif not plain.replayable(rec):
            raise RecordError(f"the record has no torque, and without a position none can be made: give {TORQUE}, or position=")
        else:
            made.append(rec.with_channels(torque=plain.torque_of(rec)))
    return made


def space_of(records: Sequence[Record], controller: Controller | None) -> SearchSpace:
    """Search ranges from the data; controller: what the loop is closed over."""
    pi = bare_pi(controller)
    return derive_space(records if controller is None or pi is not None else with_torque(records, controller), pi)


def input_of(rec: Record, controller: Controller | None) -> Vector:
    """What drives the loop, shape (n,): command [rad/s], position command [rad], or without a controller torque [N m]."""
    if controller is None:
        return held_torque(rec)
    source = controller.command_of(rec)
    assert source is not None  # checked on entry
    return source
