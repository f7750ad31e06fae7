"""A window of a record that knows where it lies: when it begins, and at which angle the shaft stood there.

An effect of the time or of the angle has one phase in a record.
A window that began anew at the time 0 and at the angle 0 would have another one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import CHANNELS, Record

__all__ = ["Window", "angle_before", "began", "integrated", "window_of"]


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Window(Record):
    """Lines of a record. began: time of the first one in it [s]; turned: angle of the shaft there [rad], where none is logged."""

    began: float
    turned: float

    @property
    def _about(self) -> dict[str, Any]:
        return {**super()._about, "began": self.began, "turned": self.turned}

    def _cut(self, start: int, stop: int, text: str) -> Record:
        part = super()._cut(start, stop, text)
        return _placed(part, self.began + start * self.dt, float(integrated(self)[start]))


def window_of(rec: Record, start: int, stop: int, angle: NDArray[np.float64]) -> Record:
    """The lines `start` to `stop` - 1 of a record, at least 20; angle (n,): of the shaft in it [rad].

    From the first line on they are the record cut there, which begins as the record does.
    """
    return rec[start:stop] if start == 0 else _placed(rec[start:stop], began(rec) + start * rec.dt, float(angle[start]))


def _placed(rec: Record, began: float, turned: float) -> Window:
    made: Window = object.__new__(Window)
    made._fill(rec.dt, dict.fromkeys(CHANNELS) | dict(rec.channels()), **_told(rec), began=began, turned=turned)
    return made


def _told(rec: Record) -> dict[str, Any]:
    return {"name": rec.name, "torque_is": rec.torque_is, "torque_log": rec.torque_log, "notes": rec.notes}


def began(rec: Record) -> float:
    """Time of the first line in the record that was given [s]."""
    return rec.began if isinstance(rec, Window) else 0.0


def angle_before(rec: Record) -> float:
    """Angle of the shaft at the first line [rad]: the logged one, else what it had turned since the record's start."""
    if rec.position is not None:
        return float(rec.position[0])
    return rec.turned if isinstance(rec, Window) else 0.0


def integrated(rec: Record, velocity: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """The angle (n,) [rad] by the velocity, measured or another one (n,): trapezoidal rule, from that of the first line."""
    w = rec.velocity if velocity is None else velocity
    turned = np.concatenate([[0.0], np.cumsum(0.5 * rec.dt * (w[1:] + w[:-1]))])
    start = angle_before(rec)
    return turned + start if start else turned
