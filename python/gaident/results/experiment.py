"""An experiment: what it may do, and what it commands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import linear_sentences, restored
from gaident.checks import LARGEST, real_number
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import SettingsError
from gaident.providers import provided
from gaident.results.saved import undamaged

__all__ = ["Limits", "Proposal", "swept"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """What an experiment may do.

    Parameters
    ----------
    speed : float
        Highest speed [rad/s], > 0.
    torque : float
        Highest torque [N m], > 0.
    travel : float
        Highest minus lowest position [rad], > 0; inf: it may turn freely.
    duration : float
        Longest record [s], > 0.

    Raises
    ------
    SettingsError
        For a value that is no number above 0.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.Limits(speed=80.0, torque=2.4, travel=20.0)
    Limits(speed=80.0, torque=2.4, travel=20.0, duration=5.0)
    """

    speed: float
    torque: float
    travel: float = math.inf
    duration: float = 5.0

    def __post_init__(self) -> None:
        for limit in fields(self):
            value = getattr(self, limit.name)
            if limit.name == "travel" and isinstance(value, float) and value == math.inf:
                continue
            number = real_number(value, limit.name, SettingsError, "give one number > 0")
            if not 1.0 / LARGEST <= number <= LARGEST:
                raise SettingsError(f"{limit.name} is {number:g}: give one number > 0, {1.0 / LARGEST:g} to {LARGEST:g}")
            object.__setattr__(self, limit.name, number)

    @classmethod
    def of(cls, records: Record | Sequence[Record], controller: PI | None = None, axis: str = "rotary") -> Limits:
        """Return what records show to be allowed.

        Parameters
        ----------
        records : Record or sequence of Record
            Records of the axis.
        controller : PI, optional
            The velocity loop; its torque limit, if it has one, is the limit of the torque.
        axis : {"rotary", "linear"}
            Kind of the axis.

        Returns
        -------
        Limits
            Highest speed, torque and duration of the records.
            Their travel too, but for a rotary axis that has gone through a turn or more, which is taken to turn freely.

        Raises
        ------
        SettingsError
            Where nothing moves, or for another axis.
        """
        found: Limits = provided("limits_of")(records, controller, axis)
        return found


@dataclass(frozen=True, eq=False)
class Proposal:
    """An experiment to make.

    Attributes
    ----------
    command : ndarray, shape (n,)
        Velocity command [rad/s]; where a position drives the loop, the velocity of that.
    dt : float
        Time from value to value [s].
    separates : tuple of str
        Names of effects that it tells apart, or makes visible where there is no record yet; of such as no record tells apart one.
    margin : float
        BIC units by which the wrong one of two rivals would be worse (10 tell them apart); nan where nothing was compared.
    reason : str
        Why this experiment, in plain sentences.
    position_command : ndarray of shape (n,) or None
        Position command [rad] from the start, of a loop that a position drives; None for every other.
    alike : mapping of str to tuple of str
        One of `separates` -> the other explanations that act as it does on every record: this experiment tells them from the
        rest of `separates`, but not from each other.

    See Also
    --------
    first_experiment : Makes one, with an example.
    diagnose : Proposes one as `next_experiment`.
    """

    command: Vector
    dt: float
    separates: tuple[str, ...]
    margin: float
    reason: str
    position_command: Vector | None = None
    alike: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """Duration of the command [s]."""
        return len(self.command) * self.dt

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        place = {} if self.position_command is None else {"position_command": self.position_command.tolist()}
        return {
            "command": self.command.tolist(),
            **place,
            "dt": self.dt,
            "separates": list(self.separates),
            **({"alike": {name: list(others) for name, others in self.alike.items()}} if self.alike else {}),
            "margin": self.margin,
            "reason": self.reason,
            "linear_axis": linear_sentences([self.reason]),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Proposal:
        """Return the proposal of what `to_dict` gave; raises GaidentError where the data are something else."""
        with undamaged("proposal"):
            command = np.asarray(data["command"], dtype=np.float64)
            reason = restored(str(data["reason"]), data.get("linear_axis", {}))
            place = data.get("position_command")
            path = None if place is None else np.asarray(place, dtype=np.float64)
            alike = {name: tuple(others) for name, others in data.get("alike", {}).items()}
            return cls(command, float(data["dt"]), tuple(data["separates"]), float(data["margin"]), reason, path, alike)

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
