"""Counters of a log that run over: a position is continued and that is said, an overflown velocity, torque or command refused."""

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
        self._position = Unwrapper([] if turn is None else [turn])
        self._column = named.get("position")

    def passed(self, block: LogTable, channel: str, values: Vector) -> Vector:
        """The values, those of a position continued where they wrap. Raises ReadError for an integer that overflowed."""
        there = np.isfinite(values)  # cells are blank where topics have times of their own
        if not there.all():
            filled = values.copy()
            filled[there] = self.passed(block, channel, values[there])
            return filled
        if channel == "position":
            return self._position.push(values)
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
        wraps, period = self._position.wraps, self._position.period
        if not wraps or self._column is None:
            return ()
        unit = f" {self._column.unit}" if self._column.unit else ""
        assert period is not None
        return (wrapped_words(wraps, period, unit),)
