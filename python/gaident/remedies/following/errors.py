"""What the tables of feedforward bring in the simulated loop, as figures and curves."""

from __future__ import annotations

import math
import textwrap
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import percent, said, say, unit, word
from gaident.show.wording import WIDTH, number, table

__all__ = ["FollowingError", "LoopError"]

Vector = NDArray[np.float64]

MEASURED, BEFORE, AFTER, FED = "measured", "as it is, simulated", "with the tables", "and with the whole velocity feedforward"
TWICE = 2.0  # no decision: printed: what the sentence says
SIMULATED = (
    "Simulated from rest and without noise, with the command of {} and the model that the tables are made of: what that model "
    "lacks does not show. Friction is added by the velocity of the command, the {inertia} by its acceleration, gravity and "
    "cogging by the simulated {angle}."
)
REPLACED = "The tables stand in the place of the controller's own feedforward of acceleration and friction."
BLOW = (
    "With the tables the loop asks for more than twice the {torque} of before, for the acceleration of a command that jumps: "
    "where the drive cannot give that, it follows less well than this. Give the command a ramp that the drive can follow, or "
    "leave the acceleration out."
)
LAG = (
    "A position controller without the whole velocity feedforward lags behind a moving command by its velocity over the position "
    "gain, which no {torque} takes away: the last row is with that feedforward as well."
)


@dataclass(frozen=True)
class LoopError:
    """The following error of one simulated loop: command minus motion.

    Attributes
    ----------
    rms, largest : float
        Root mean square and largest size [rad/s], of a loop with a position controller [rad].
    torque : float
        Largest size of the torque that the loop asks for [N m]; not a number where the record has none.

    See Also
    --------
    FollowingError : Has one for each loop.
    """

    rms: float
    largest: float
    torque: float


@dataclass(frozen=True, eq=False)
class FollowingError:
    """The following error of a record's command in the simulated loop, without and with the tables. Made by `feedforward`.

    It is simulated from rest, without noise, with the model that the tables are made of.

    Attributes
    ----------
    record : str
        Name of the record.
    unit : {"rad/s", "rad"}
        Unit of the errors; "rad" of a loop with a position controller.
    measured : LoopError or None
        What the record itself has, with its noise; None where it lacks the motion that the command is one of.
    before : LoopError
        With the controller as it is.
    after : LoopError
        With the torque of the tables added behind it, in the place of its own feedforward of acceleration and friction.
    with_velocity : LoopError or None
        The same with the whole velocity feedforward; None without a position controller, and where it has that already.
    replaced : bool
        Whether the controller has a feedforward of acceleration or friction of its own.
    time : ndarray, shape (n,)
        Time of the record's lines [s].
    error_before, error_after : ndarray, shape (n,)
        Following error there.

    See Also
    --------
    feedforward : Makes it, with an example.
    """

    record: str
    unit: str
    measured: LoopError | None
    before: LoopError
    after: LoopError
    with_velocity: LoopError | None
    replaced: bool
    time: Vector
    error_before: Vector
    error_after: Vector

    @property
    def loops(self) -> tuple[tuple[str, LoopError, float | None], ...]:
        """The rows of the summary: what each is called, its errors, and the share by which its rms is less than `before`."""
        told = (
            (MEASURED, self.measured, False),
            (BEFORE, self.before, False),
            (AFTER, self.after, True),
            (FED, self.with_velocity, True),
        )
        return tuple((name, one, self._fall(one) if changed else None) for name, one, changed in told if one is not None)

    @property
    def notes(self) -> tuple[str, ...]:
        """How it was simulated, in plain sentences."""
        told = (
            (REPLACED, self.replaced),
            (BLOW, self.after.torque > TWICE * self.before.torque),
            (LAG, self.with_velocity is not None),
        )
        more = [say(text) for text, there in told if there]
        return (say(SIMULATED, self.record), *more)

    def _fall(self, loop: LoopError) -> float:
        return 1.0 - loop.rms / self.before.rms if self.before.rms > 0.0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain data for JSON, without the curves."""
        loops = {name: _plain(getattr(self, name)) for name in ("measured", "before", "after", "with_velocity")}
        return {"record": self.record, "unit": self.unit, **loops, "notes": list(self.notes)}

    def lines(self, axis: str) -> list[str]:
        """What the summary says; axis: "rotary" or "linear"."""
        si, torque = unit(self.unit, axis), unit("N m", axis)
        most = f"largest {word('torque', axis)} [{torque}]"
        rows: list[tuple[str, ...]] = [("following error", f"rms [{si}]", "less by [%]", f"largest [{si}]", most)]
        for name, loop, fall in self.loops:
            less = "" if fall is None else percent(fall).removesuffix(" %")
            rows.append((name, number(loop.rms), less, number(loop.largest), number(loop.torque)))
        return [*table(rows), *(line for note in self.notes for line in textwrap.wrap(said(note, axis), WIDTH))]


def _plain(loop: LoopError | None) -> dict[str, float] | None:
    return None if loop is None else {name: value for name, value in asdict(loop).items() if math.isfinite(value)}
