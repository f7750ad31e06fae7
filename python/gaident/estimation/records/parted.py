"""Windows of the records of a data set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gaident.estimation.dataset import DataSet
from gaident.estimation.records.places import Place, cut

__all__ = ["parted"]


def parted(data: DataSet, places: Sequence[Place]) -> DataSet:
    """Windows of these records, under the torques and at the angles that the whole records have there.

    A window that begins later than its record begins in motion: its start state is fitted.
    """
    channels = (data.records, data.driven, data.turned, data.free, data.read)
    records, driven, turned, free, read = (cut(part, data.turned, places) for part in channels)
    moving = tuple(p.start > 0 or data.moving[p.at] for p in places)
    parts = replace(data, records=records, driven=driven, turned=turned, free=free, read=read, moving=moving)
    return replace(parts, places=tuple(places), whole=data)
