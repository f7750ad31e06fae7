"""A record as its torque drives a model, with an angle, measured or integrated from the velocity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.windows.window import integrated
from gaident.estimation.term import Term, limiting_of

__all__ = ["angle_of", "driven_under", "freed", "replayed", "torque_in"]

Vector = NDArray[np.float64]


def replayed(rec: Record, controller: Controller | None, effects: Mapping[Term, Vector], stored: float) -> Vector:
    """What the controller makes of command and measured velocity, with effects of its own [N m]; stored: before the record."""
    assert controller is not None and controller.replayable(rec)
    return controller.torque_of(rec, limiting_of(effects) if effects else None, stored)


def freed(records: Sequence[Record], driven: Sequence[Record]) -> tuple[Record, ...]:
    """Torque-driven records without an angle that was not measured."""
    return tuple(a if r.position is not None else a.with_channels(position=None) for r, a in zip(records, driven, strict=True))


def driven_under(rec: Record, torque: Vector) -> Record:
    """The record under a torque (n,) [N m] that drives a model."""
    angle = integrated(rec) if rec.position is None else rec.position
    return rec.with_channels(command=None, torque=torque, position=angle)


def torque_in(rec: Record) -> Vector:
    """The torque of a record that has one [N m]."""
    assert rec.torque is not None
    return rec.torque


def angle_of(rec: Record) -> Vector:
    """The angle of a record that has one [rad]."""
    assert rec.position is not None
    return rec.position
