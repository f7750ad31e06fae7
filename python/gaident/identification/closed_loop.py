"""Over what an identification closes the loop: a controller, driven by its command; none, driven by the torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import Text
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.errors import RecordError
from gaident.identification.space import derive_space
from gaident.models.drive_torque import torque_driven
from gaident.models.search_space import SearchSpace
from gaident.models.starts import starts_moving

__all__ = ["Looped", "input_of", "line_equation", "looped_over", "space_of", "with_torque"]

Vector = NDArray[np.float64]

USUAL_POLES = 6  # no decision: p + q of the largest structure of a derived space


class Looped(NamedTuple):
    """Records, the controller that the loop is closed over, None where their torque drives the model, and notes on that."""

    records: list[Record]
    controller: Controller | None
    notes: tuple[Text, ...] = ()


def looped_over(records: Sequence[Record], controller: Controller | None, space: object) -> Looped:
    """What an identification of the records does under a controller; space: the search space, or None. Raises RecordError."""
    if line_equation(records, controller, space if isinstance(space, SearchSpace) else None):
        return Looped(list(records), controller)
    driven = torque_driven(records, controller)
    given = [r.with_channels(command=None) for r in driven.records] if driven.slower else list(driven.records)
    return Looped(given, driven.loop, (*driven.notes, *driven.doubts))


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
    source = rec.torque if controller is None else controller.command_of(rec)
    assert source is not None  # checked on entry
    return source
