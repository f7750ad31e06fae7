"""The torque that drives a model on a record: the logged one, or what the controller makes of command and velocity."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.control.pi import PI
from gaident.control.pi_torque import pi_block
from gaident.data.record import Record
from gaident.errors import RecordError

__all__ = ["torque_blocks", "torque_of"]

Vector = NDArray[np.float64]


def torque_of(rec: Record, controller: PI | None) -> Vector:
    """The record's torque [N m] (n,) or, where none was recorded, the controller's answer, its limits included.

    Raises RecordError where the record has neither a torque nor what makes one.
    """
    if rec.torque is not None:
        return rec.torque
    return np.concatenate([u for _, u, _ in torque_blocks(rec, controller)])


# no decision: samples of a block, for memory
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
