"""What a report draws, worked out before: plain arrays, no model and no search behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gaident.results.frequency import Responses
from gaident.results.retuning import Retuning
from gaident.results.what_if import Stability
from gaident.show.units import Scales

__all__ = ["Beforehand", "Curve", "LoopCurves", "Mended", "RecordView", "Remedies", "Vector", "View"]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]


@dataclass(frozen=True, eq=False)
class RecordView:
    """One record and what the models make of it; arrays (n,), None where it is not there.

    name and digest of the record; used: "fitted", "held out" or "new" (not the record of this result).
    time [s]; measured velocity, command, linear and extended model's velocity [rad/s]; torque of the controller and missing
    torque dhat with its typical deviation std [N m]; position [rad]. torque_logged: False where it was worked out.
    held_out_from: first sample that no parameter of the figures "before and after" was fitted to; None: all were used.
    notes: what could not be worked out, in plain sentences.
    """

    name: str
    digest: str
    used: str
    time: Vector
    measured: Vector
    position: Vector
    linear: Vector
    command: Vector | None = None
    torque: Vector | None = None
    torque_logged: bool = True
    extended: Vector | None = None
    dhat: Vector | None = None
    std: float = 0.0
    held_out_from: int | None = None
    notes: tuple[str, ...] = ()

    @property
    def dt(self) -> float:
        """[s]."""
        return float(self.time[1] - self.time[0])


@dataclass(frozen=True, eq=False)
class LoopCurves:
    """A velocity loop under one controller.

    name: "before" or "after"; frequency [Hz] (f,); loop: broken at the torque (f,).
    time [s] and velocity [rad/s] of a unit step of the command (k,), None where the loop is not stable.
    """

    name: str
    frequency: Vector
    loop: NDArray[np.complex128]
    time: Vector | None
    velocity: Vector | None


class OneWave(Protocol):
    """Of the torque by angle: the effect behind it, periods per turn, coefficients of sine and cosine [N m]."""

    @property
    def effect(self) -> str: ...
    @property
    def order(self) -> float: ...
    @property
    def sine(self) -> float: ...
    @property
    def cosine(self) -> float: ...


class OneLoop(Protocol):
    """The following error of a simulated loop, as `gaident.LoopError` has it."""

    @property
    def rms(self) -> float: ...
    @property
    def largest(self) -> float: ...
    @property
    def torque(self) -> float: ...


class Followed(Protocol):
    """What a page shows of `gaident.FollowingError`."""

    @property
    def record(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def loops(self) -> Sequence[tuple[str, OneLoop, float | None]]: ...
    @property
    def time(self) -> Vector: ...
    @property
    def error_before(self) -> Vector: ...
    @property
    def error_after(self) -> Vector: ...
    @property
    def notes(self) -> Sequence[str]: ...


class Beforehand(Protocol):
    """What a page shows of `gaident.FeedforwardTables`, which says what each is."""

    @property
    def velocity(self) -> Vector: ...
    @property
    def friction(self) -> Vector: ...
    @property
    def viscous(self) -> float: ...
    @property
    def constant(self) -> float: ...
    @property
    def inertia(self) -> float: ...
    @property
    def waves(self) -> Sequence[OneWave]: ...
    @property
    def notes(self) -> Sequence[str]: ...
    @property
    def following(self) -> Followed | None: ...
    @property
    def no_following(self) -> str: ...


@dataclass(frozen=True)
class Mended:
    """The following error of a simulated record, rms, in `unit`.

    record: its name; now: as the drive is; retuned: under the proposed gains, None without them.
    without: effect, side -> the error without it.
    """

    record: str
    unit: str
    now: float
    retuned: float | None
    without: Mapping[tuple[str, str], float]


@dataclass(frozen=True, eq=False)
class Remedies:
    """What to do; what is None is not there, and no_gains, no_tables, no_mended say why.

    doubts: why the model behind all of it is not to be trusted. retuning: other gains, with the loops before and after.
    """

    doubts: tuple[str, ...] = ()
    retuning: Retuning | None = None
    loops: tuple[LoopCurves, ...] = ()
    tables: Beforehand | None = None
    mended: Mended | None = None
    no_gains: str = ""
    no_tables: str = ""
    no_mended: str = ""


@dataclass(frozen=True, eq=False)
class View:
    """All that a report knows beside the result.

    runs: one per record, those that were fitted first. curve: (velocity, torque, label) of named effects. response: of the
    longest record, see `gaident.results.frequency.Responses`; without it no_response says why. made_with: what computed
    and drew the page -> version. axis: "rotary" or "linear". scales: to the user's units. about: what stands below the title.
    remedies: what to do with a diagnosis; None where that is not worked out. to_do: whether the page has that chapter.
    stability: what variations of its records say, likewise.
    """

    runs: tuple[RecordView, ...] = ()
    curve: Curve | None = None
    response: Responses | None = None
    no_response: str = ""
    axis: str = "rotary"
    made_with: Mapping[str, str] = field(default_factory=dict)
    scales: Scales = field(default_factory=dict)
    about: Mapping[str, str] = field(default_factory=dict)
    remedies: Remedies | None = None
    to_do: bool = True
    stability: Stability | None = None

    @property
    def fitted(self) -> tuple[RecordView, ...]:
        """The records that parameters were fitted to; where none of them is at hand, those that are."""
        return tuple(r for r in self.runs if r.used == "fitted") or self.runs

    @property
    def longest(self) -> RecordView | None:
        """The longest of the fitted ones: what is wrong is shown on it."""
        return max(self.fitted, key=lambda r: len(r.time), default=None)
