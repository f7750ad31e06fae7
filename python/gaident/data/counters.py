"""Counters of a log that run over: positions are continued and that is said, an overflown velocity, torque or command refused."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.table import Column, LogTable
from gaident.data.signals.wraps import Unwrapper, overflow, wrapped_words
from gaident.data.wanted import Wanted
from gaident.errors import ReadError

__all__ = ["Counters"]

Vector = NDArray[np.float64]


class Counters:
    """Looks at the channels as they are read, in the log's own units."""

    def __init__(self, table: LogTable, wanted: Wanted, named: Mapping[str, Column]) -> None:
        turn = wanted.constants.counts_per_turn
        self._positions = {"position": Unwrapper([] if turn is None else [turn]), "load_position": Unwrapper()}
        self._columns = {channel: named.get(channel) for channel in self._positions}

    def passed(self, block: LogTable, channel: str, values: Vector) -> Vector:
        """The values, those of a position continued where they wrap. Raises ReadError for an integer that overflowed."""
        there = np.isfinite(values)  # cells are blank where topics have times of their own
        if not there.all():
            filled = values.copy()
            filled[there] = self.passed(block, channel, values[there])
            return filled
        if channel in self._positions:
            return self._positions[channel].push(values)
        if (found := overflow(values)) is not None:
            n, period = found
            raise ReadError(
                f"{block.path}, {block.place(n + 1)}: the {channel} jumps from {values[n]:g} to {values[n + 1]:g} between steady "
                f"values: an integer of {period:g} overflowed there; log it with more bits or in a coarser unit, or repair it "
                f"with read_columns and numpy.unwrap(values, period={period:g}) and make a Record of that"
            )
        return values

    def notes(self) -> tuple[str, ...]:
        """What was done, in the log's units."""
        said = []
        for channel, one in self._positions.items():
            column = self._columns[channel]
            if one.wraps and one.period is not None and column is not None:
                unit = f" {column.unit}" if column.unit else ""
                said.append(wrapped_words(one.wraps, one.period, unit, channel.replace("_", " ")))
        return tuple(said)
