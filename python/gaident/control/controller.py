"""What every controller answers, so that nobody has to ask for its class."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.between import jumps_between
from gaident.control.ticks import Ticks
from gaident.control.unknown import unknown_in
from gaident.errors import ControllerError, SettingsError

__all__ = ["Controller", "VelocityGains", "Limiting", "LoopSignals", "checked_controller"]

Vector = NDArray[np.float64]


class LoopSignals(Protocol):
    """What a log contains of a controller's signals; a `gaident.Record` is one."""

    @property
    def dt(self) -> float: ...
    @property
    def command(self) -> Vector | None: ...
    @property
    def position_command(self) -> Vector | None: ...
    @property
    def velocity(self) -> Vector: ...
    @property
    def position(self) -> Vector | None: ...


class VelocityGains(Protocol):
    """Gains of a velocity controller, and its limits."""

    @property
    def kp(self) -> float: ...
    @property
    def ki(self) -> float: ...
    @property
    def limits(self) -> tuple[float, float]: ...
    @property
    def unknown(self) -> tuple[str, ...]: ...


@dataclass(frozen=True)
class Limiting:
    """Limits beyond a controller's settings: of its integrator [N m], and of the velocity command's slope [rad/s^2]."""

    integrator: float = math.inf
    slope: float = math.inf

    def and_also(self, other: Limiting) -> Limiting:
        """Both."""
        return Limiting(min(self.integrator, other.integrator), min(self.slope, other.slope))


class Controller(ABC):
    """A controller of a servo axis: a `PI`, or the `Cascade` around one."""

    @property
    @abstractmethod
    def loop(self) -> str:
        """ "sampled" or "continuous"."""

    @property
    @abstractmethod
    def one_equation(self) -> bool:
        """Whether one difference equation describes controller and plant, limits left out: of the bare PI."""

    @property
    @abstractmethod
    def gains(self) -> VelocityGains:
        """kp, ki and the limits of the velocity controller."""

    @property
    @abstractmethod
    def driven_by(self) -> str:
        """The channel that drives it: "command" or "position_command"."""

    @property
    @abstractmethod
    def reads(self) -> tuple[str, ...]:
        """The channels that it reads beside the velocity."""

    @property
    @abstractmethod
    def parts(self) -> Sequence[tuple[str, object]]:
        """(beginning of the names, part whose numbers have them), itself first with ""."""

    @property
    def unknown(self) -> tuple[str, ...]:
        """The names of what is None: "kp" of a PI; "velocity.kp", "torque_filters[0].frequency", ... of a Cascade."""
        return unknown_in(self.parts)

    @abstractmethod
    def with_numbers(self, numbers: Mapping[str, float]) -> Controller:
        """The same with numbers by the names of `unknown`. Raises ControllerError where a part refuses its number."""

    @property
    def limits(self) -> tuple[float, float]:
        """(Torque limit, integrator limit) [N m], infinity for none."""
        return self.gains.limits

    @property
    def limited(self) -> bool:
        """True if torque or integrator have a limit: the loop is then linear only while no limit acts."""
        return any(map(math.isfinite, self.limits))

    @property
    def clock(self) -> float | None:
        """Its sample time [s] as it was given; None: that of the log, as far as anyone knows."""
        return None

    @property
    def delay(self) -> float:
        """Time from a sample to its torque at the motor [s]."""
        return 0.0

    def ahead(self, dt: float) -> int:
        """Lines at the end of a log with the sample time dt [s] that a feedforward makes of what would come behind them."""
        return 0

    @abstractmethod
    def log_every(self, dt: float) -> int:
        """Controller samples for each line of a log with the sample time dt [s]; ControllerError where it is no whole number."""

    def readings(self, dt: float) -> tuple[Controller, ...]:
        """This controller, and the same that reads its command in other ways: between lines dt [s] apart, and its slope."""
        return (self,)

    def command_of(self, log: LoopSignals) -> Vector | None:
        """The signal that drives it (n,): velocity command [rad/s] or position command [rad]; None where it is not logged."""
        signal: Vector | None = getattr(log, self.driven_by)
        return signal

    def source_of(self, log: LoopSignals) -> Vector | None:
        """The same at the controller's samples (n, r) where the log knows it there, r samples to a line; else of `command_of`."""
        between: Vector | None = getattr(log, "command_between", None) if self.driven_by == "command" else None
        return self.command_of(log) if between is None else between

    def steps_at(self, source: Vector) -> NDArray[np.intp]:
        """Numbers of the intervals between lines in which its torque steps with its command; source: of `source_of`.

        Behind an acceleration feedforward it does not step: it is a blow within one sample.
        """
        if self.driven_by != "command" or any(getattr(part, "acceleration_feedforward", 0.0) != 0.0 for _, part in self.parts):
            return np.zeros(0, dtype=np.intp)
        return jumps_between(source[:, 0] if source.ndim > 1 else source)

    def start_angle(self, source: Vector) -> float:
        """Angle [rad] at which its axis rests before a log without a position; source: of `command_of`, (n,)."""
        return float(source[0]) if self.driven_by == "position_command" else 0.0

    def told_by_torque(self, dt: float) -> bool:
        """Whether a log with the sample time dt [s] has a line for each sample of what is no bare PI: its torque tells all that
        this controller did."""
        return not self.one_equation and self.log_every(dt) == 1

    def line_equation(self, log: LoopSignals, poles: int) -> bool:
        """Whether one difference equation takes a log that starts at rest from line to line, although it samples faster.

        poles: of the plant beside it.
        Its commands are logged, and controller and plant together are linear and of an order that the core contains.
        """
        return False

    def line_record(self, log: LoopSignals) -> _core.Record:
        """The core's record of that equation; the log has a `line_equation`."""
        raise ControllerError(f"controller is {self!r}: it has a sample for each line of the log and no equation between them")

    def at_lines(self) -> Controller:
        """About the same with a sample for each line of a log: without filters and delay."""
        return self

    @abstractmethod
    def asked(self, log: LoopSignals) -> Vector:
        """The velocity command that reaches its velocity controller (n,) [rad/s]. The log is `replayable`."""

    @abstractmethod
    def replayable(self, log: LoopSignals) -> bool:
        """Whether the log contains every signal that it makes its torque of, at each of its samples."""

    @abstractmethod
    def torque_of(self, log: LoopSignals, also: Limiting | None = None, stored: float = 0.0) -> Vector:
        """The torque [N m] (n,) that it makes of the measured signals, from rest; `also`: with further limits.

        stored: what the integrator holds before the log begins [N m], for a load. The log is `replayable`.
        """

    @abstractmethod
    def with_limits(self, torque: float | None, integrator: float | None) -> Controller:
        """The same with these limits [N m]; None: no limit."""

    @abstractmethod
    def ticks(self, dt: float, command: Vector, position: Vector | None) -> Ticks:
        """What it is given at its own clock, in a log with the sample time dt [s]; command: of `command_of`, or `source_of`.

        position: at the lines (n,), or at its own clock (n, r).
        """

    @abstractmethod
    def core_loop(self, dt: float) -> _core.Loop:
        """The core's loop over it, in a log with the sample time dt [s]."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON or TOML."""


def checked_controller(controller: object) -> Controller | None:
    """What a public function was given as `controller=`; raises SettingsError for what is none."""
    if controller is None or isinstance(controller, Controller):
        return controller
    raise SettingsError(
        f"controller is {controller!r}: give a gaident.PI or a Cascade, or None for open loop, where the torque drives the model"
    )
