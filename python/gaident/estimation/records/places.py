"""Where windows of long records lie, and records cut to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from gaident.data.record import Record
from gaident.data.windows.window import window_of
from gaident.estimation.records.driven import angle_of

__all__ = ["Place", "cut"]


class Place(NamedTuple):
    """Lines `start` to `stop` - 1 of a record; at: its place among the records."""

    at: int
    start: int
    stop: int


def cut(records: Sequence[Record], turned: Sequence[Record], places: Sequence[Place]) -> tuple[Record, ...]:
    """Windows of records; turned: the same with the angle of the shaft."""
    return tuple(window_of(records[p.at], p.start, p.stop, angle_of(turned[p.at])) for p in places)
