"""A record that knows its velocity command at the controller's samples, between its lines too."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.data.record import CHANNELS, Record

__all__ = ["TimedRecord", "plain_of"]

Matrix = NDArray[np.float64]


class TimedRecord(Record):
    """A record whose command at the controller's samples is known, as `Controller.source_of` reads it.

    Its data, and so its digest, are those of the record that it was made of.
    """

    command_between: Matrix | None = None
    """[rad/s] (n, r), r of the controller's samples to a line; None: what its lines tell."""

    @classmethod
    def of(cls, rec: Record, between: Matrix) -> TimedRecord:
        """The record with this command between its lines."""
        made = object.__new__(cls)
        channels = {key: getattr(rec, key) for key in CHANNELS}
        between.setflags(write=False)
        made._fill(rec.dt, channels, command_between=between, **rec._about)
        return made

    @property
    def plain(self) -> Record:
        """The record that it was made of."""
        made = object.__new__(Record)
        channels = {key: getattr(self, key) for key in CHANNELS}
        made._fill(self.dt, channels, **self._about)
        return made

    def with_channels(
        self, *, dt: float | None = None, torque_is: str | None = None, torque_log: str | None = None, **changed: ArrayLike | None
    ) -> Record:
        """See `Record`; another command, or sample time, is one between whose lines nothing is known."""
        made = self.plain.with_channels(dt=dt, torque_is=torque_is, torque_log=torque_log, **changed)
        if dt is not None or "command" in changed or self.command_between is None:
            return made
        return TimedRecord.of(made, self.command_between)

    def _cut(self, start: int, stop: int, text: str) -> Record:
        part = self.plain._cut(start, stop, text)
        return part if self.command_between is None else TimedRecord.of(part, self.command_between[start:stop])

    def __reduce__(self) -> tuple[Any, ...]:
        return TimedRecord.of, (self.plain, self.command_between)


def plain_of(rec: Record) -> Record:
    """The record as it was logged."""
    return rec.plain if isinstance(rec, TimedRecord) else rec
