"""An experiment: what it may do, and what it commands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.checks import real_number
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import SettingsError
from gaident.providers import provided

__all__ = ["Limits", "Proposal", "swept"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """What an experiment may do. Raises SettingsError.

    speed     highest speed [rad/s]; torque: highest torque [N m]
    travel    highest minus lowest position [rad]; inf: it may turn freely
    duration  longest record [s]
    """

    speed: float
    torque: float
    travel: float = math.inf
    duration: float = 5.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "travel" and value == math.inf:
                continue
            number = real_number(value, field.name, SettingsError, "give one number > 0")
            if number <= 0.0:
                raise SettingsError(f"{field.name} is {number:g}: give one number > 0")
            object.__setattr__(self, field.name, number)

    @classmethod
    def of(cls, records: Record | Sequence[Record], controller: PI | None = None) -> Limits:
        """What records show to be allowed: their highest speed, torque (the controller's limit, if it has one) and duration.

        Their travel too, but for an axis that has gone through a turn or more, which is taken to turn freely. Raises
        SettingsError where nothing moves.
        """
        found: Limits = provided("limits_of")(records, controller)
        return found


@dataclass(frozen=True, eq=False)
class Proposal:
    """An experiment to make.

    command    velocity command [rad/s], shape (n,), one value every dt [s]
    separates  names of effects that it tells apart, or makes visible where there is no record yet
    margin     BIC units by which the wrong one of two rivals would be worse (10 tell them apart); nan where nothing was compared
    reason     one plain sentence
    """

    command: Vector
    dt: float
    separates: tuple[str, ...]
    margin: float
    reason: str

    @property
    def duration(self) -> float:
        """[s]."""
        return len(self.command) * self.dt

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {
            "command": self.command.tolist(),
            "dt": self.dt,
            "separates": list(self.separates),
            "margin": self.margin,
            "reason": self.reason,
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Proposal:
        """The inverse of to_dict."""
        command = np.asarray(data["command"], dtype=np.float64)
        return cls(command, float(data["dt"]), tuple(data["separates"]), float(data["margin"]), str(data["reason"]))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Proposal):
            return NotImplemented
        return repr(self.to_dict()) == repr(other.to_dict())

    __hash__ = None  # type: ignore[assignment]

    @property
    def reach(self) -> tuple[float, float]:
        """Lowest and highest position [rad] relative to the start, of a drive that follows the command."""
        return swept(self.command, self.dt)


def swept(command: Vector, dt: float) -> tuple[float, float]:
    """Lowest and highest angle [rad] of a drive that follows the command exactly, from 0, each value held for a sample."""
    angle = dt * np.cumsum(command)
    return min(0.0, float(angle.min())), max(0.0, float(angle.max()))
