"""The controller of a servo axis: velocity controller, filters, position controller and feedforward, at its own clock."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.checks import known_keys, one_of, real_number
from gaident.control import core
from gaident.control.controller import Controller, Limiting, LoopSignals
from gaident.control.filtering import filtered, rate_limited
from gaident.control.filters import Filter, filter_of, filters_of
from gaident.control.pi import PI
from gaident.control.position import P
from gaident.control.ticks import INTERPOLATIONS, SLOPES, Feedforward, Ticks, multiple_of, ticks_of
from gaident.control.unknown import known, with_own
from gaident.control.words import UNKNOWN
from gaident.errors import ControllerError

__all__ = ["Cascade", "Filter", "cascade_of", "controller_of"]

Vector = NDArray[np.float64]

FEEDFORWARDS = ("velocity_feedforward", "acceleration_feedforward", "friction_feedforward")
FILTERS = ("torque_filters", "velocity_filters", "command_filters")
WAYS = ("interpolation", "feedforward_over")
LONGEST_DELAY = 1.0  # no decision: s, as of the effect transport_delay; what an argument may be


@dataclass(frozen=True)
class Cascade(Controller):
    """The controller of a servo axis at its own clock T.

        r(n) = gain (q*(n) - q(n)) + velocity_feedforward v*(n)        every position_period, held between; without `position`
                                                                       r is the record's velocity command
        r -> command_filters -> r',   measured velocity -> velocity_filters -> w,   e = r' - w
        u(n) = kp (b r' - w) + I(n) + acceleration_feedforward a*(n) + friction_feedforward sign(v*(n))
        u, limited as `velocity` says -> torque_filters -> the torque that is logged, and after `delay` held for T

    q* is the position command; v* is its slope over the coming position period, or the velocity command; a* the slope of v*.
    A controller that knows no coming command takes the past period: `feedforward_over`.

    Parameters
    ----------
    velocity : PI
        The velocity controller, with loop="sampled".
    period : float, optional
        T [s]; None: the log's sample time. The log's is a whole multiple of T.
    position : P, optional
        The position controller. The record's position_command drives it.
    position_period : float, optional
        Its sample time [s], a whole multiple of T; None: T.
    velocity_feedforward : float
        Share of v* that is added to the velocity command of the position controller.
    acceleration_feedforward : float
        [N m s^2/rad], an inertia.
    friction_feedforward : float
        [N m]. Each feedforward may be None: not known, and estimated by `identify` and `diagnose` where the torque is logged.
    torque_filters, velocity_filters, command_filters : sequence of LowPass and Notch
        At most eight each; they act in their order.
    delay : float
        [s], from 0 to 1: the torque acts at the motor so long after its sample, and is held for T then. Any part of T.
        The logged torque is the one before it.
    interpolation : {"straight", "smooth"}
        How a position command goes between the lines of a log that is slower than the controller.
    feedforward_over : {"coming", "past"}
        The position period whose slopes v* and a* are.

    Raises
    ------
    ControllerError
        For a velocity controller of another kind, times that are not above 0 or no whole multiples, a delay beyond its range, an
        interpolation of another name, and a feedforward of the position loop without one.

    Examples
    --------
    >>> import gaident as ga
    >>> drive = ga.Cascade(
    ...     velocity=ga.PI(0.02, 1.4, rule="backward"), period=125e-6, torque_filters=(ga.LowPass(time_constant=0.4e-3),)
    ... )
    >>> drive.log_every(dt=1e-3)
    8
    """

    velocity: PI
    period: float | None = None
    position: P | None = None
    position_period: float | None = None
    velocity_feedforward: float = 0.0
    acceleration_feedforward: float = 0.0
    friction_feedforward: float = 0.0
    torque_filters: Sequence[Filter] = ()
    velocity_filters: Sequence[Filter] = ()
    command_filters: Sequence[Filter] = ()
    delay: float = 0.0
    interpolation: str = "straight"
    feedforward_over: str = "coming"

    if TYPE_CHECKING:  # None is what is not known; whoever simulates has asked for numbers before (`gaident.control.unknown`)

        def __init__(
            self,
            velocity: PI,
            period: float | None = ...,
            position: P | None = ...,
            position_period: float | None = ...,
            velocity_feedforward: float | None = ...,
            acceleration_feedforward: float | None = ...,
            friction_feedforward: float | None = ...,
            torque_filters: Sequence[Filter] = ...,
            velocity_filters: Sequence[Filter] = ...,
            command_filters: Sequence[Filter] = ...,
            delay: float = ...,
            interpolation: str = ...,
            feedforward_over: str = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.velocity, PI) or self.velocity.loop != "sampled":
            raise ControllerError(f'velocity is {self.velocity!r}: give a PI with loop="sampled", the digital controller')
        if self.position is not None and not isinstance(self.position, P):
            raise ControllerError(f"position is {self.position!r}: give P(gain), or None without a position controller")
        for name in ("period", "position_period"):
            value = getattr(self, name)
            if value is None:
                continue
            time = real_number(value, name, ControllerError, "give seconds")
            if time <= 0.0:
                raise ControllerError(f"{name} is {time:g}: give seconds, > 0")
            object.__setattr__(self, name, time)
        for name in FEEDFORWARDS:
            if getattr(self, name) is None:
                continue
            object.__setattr__(self, name, real_number(getattr(self, name), name, ControllerError))
        delay = real_number(self.delay, "delay", ControllerError, "give seconds")
        if not 0.0 <= delay <= LONGEST_DELAY:
            raise ControllerError(f"delay is {delay:g}: give seconds, from 0 to {LONGEST_DELAY:g}")
        object.__setattr__(self, "delay", delay)
        one_of(self.interpolation, "interpolation", INTERPOLATIONS, ControllerError)
        one_of(self.feedforward_over, "feedforward_over", SLOPES, ControllerError)
        if self.position is None and (self.velocity_feedforward != 0.0 or self.position_period is not None):
            given = "velocity_feedforward" if self.velocity_feedforward != 0.0 else "position_period"
            raise ControllerError(
                f"{given} belongs to a position controller, and there is none: give position=P(gain) or leave it out"
            )
        if self.period is not None and self.position_period is not None:
            multiple_of(self.position_period, self.period, "position_period", "period")
        for name in FILTERS:
            object.__setattr__(self, name, filters_of(getattr(self, name), name))

    @property
    def loop(self) -> str:
        """ "sampled": a cascade is a digital controller."""
        return "sampled"

    @property
    def one_equation(self) -> bool:
        """See `Controller`."""
        return False

    @property
    def gains(self) -> PI:
        """See `Controller`: the velocity controller's."""
        return self.velocity

    @property
    def driven_by(self) -> str:
        """ "command", or "position_command" where it has a position controller."""
        return "command" if self.position is None else "position_command"

    @property
    def reads(self) -> tuple[str, ...]:
        """See `Controller`: the command, or position command and position."""
        return ("command",) if self.position is None else ("position_command", "position")

    @property
    def parts(self) -> tuple[tuple[str, object], ...]:
        """See `Controller`: itself for the feedforward, the two controllers, the filters."""
        placed = () if self.position is None else (("position.", self.position),)
        filters = ((f"{name}[{i}].", one) for name in FILTERS for i, one in enumerate(getattr(self, name)))
        return ("", self), ("velocity.", self.velocity), *placed, *filters

    def with_numbers(self, numbers: Mapping[str, float]) -> Cascade:
        """See `Controller`."""
        filters: dict[str, Any] = {
            name: tuple(with_own(one, f"{name}[{i}].", numbers) for i, one in enumerate(getattr(self, name))) for name in FILTERS
        }
        position = None if self.position is None else with_own(self.position, "position.", numbers)
        velocity = with_own(self.velocity, "velocity.", numbers)
        return replace(with_own(self, "", numbers), velocity=velocity, position=position, **filters)

    @property
    def clock(self) -> float | None:
        """See `Controller`: its period."""
        return self.period

    def ahead(self, dt: float) -> int:
        """See `Controller`."""
        return 1 if self.position is None else -(-2 * self.position_every(dt) // self.log_every(dt))

    def log_every(self, dt: float) -> int:
        """Controller samples for each line of a log with the sample time dt [s]; ControllerError where it is no whole number."""
        return 1 if self.period is None else multiple_of(dt, self.period, "the record's dt", "period")

    def readings(self, dt: float) -> tuple[Cascade, ...]:
        """See `Controller`: each interpolation of a position command, with each slope of it that is fed forward."""
        between = INTERPOLATIONS if self.position is not None and self.log_every(dt) > 1 else (self.interpolation,)
        over = SLOPES if any(getattr(self, name) != 0.0 for name in FEEDFORWARDS) else (self.feedforward_over,)
        ways = [(i, o) for o in over for i in between if (i, o) != (self.interpolation, self.feedforward_over)]
        return self, *(replace(self, interpolation=i, feedforward_over=o) for i, o in ways)

    def position_every(self, dt: float) -> int:
        """Velocity controller's samples for each of the position controller's, in a log with the sample time dt [s]."""
        if self.position_period is None:
            return 1
        return multiple_of(self.position_period, dt if self.period is None else self.period, "position_period", "period")

    def line_equation(self, log: LoopSignals, poles: int) -> bool:
        """See `Controller`: with a position controller that samples at each line, and without acceleration feedforward there."""
        source, every = self.command_of(log), self.log_every(log.dt)
        if every == 1 or source is None or self.limited or self.friction_feedforward != 0.0:
            return False
        if self.feedforward_over != "coming" and any(getattr(self, name) != 0.0 for name in FEEDFORWARDS):
            return False  # the equation has the command's slope over the coming period
        if self.acceleration_feedforward != 0.0 and self.source_of(log) is not source:
            return False  # of what the command did between the lines the equation takes the mean alone
        if self.position is not None:
            at_lines = self.interpolation == "straight" and every % self.position_every(log.dt) == 0
            fits = at_lines and self.acceleration_feedforward == 0.0
        else:
            # What stood before a record is not known: a jump at its first line would be one of the command's slope.
            fits = self.acceleration_feedforward == 0.0 or float(source[0]) == 0.0
        return fits and core.is_one_equation(log.dt, self, poles)

    def line_record(self, log: LoopSignals) -> _core.Record:
        """See `Controller`."""
        source, between, placed = self.command_of(log), self.source_of(log), self.position is not None
        assert source is not None and between is not None
        start = float(log.position[0]) if placed and log.position is not None else self.start_angle(source)
        feed = self.velocity_feedforward, self.acceleration_feedforward
        known = between if between.ndim > 1 else None
        return core.line_record(log.dt, source - start, log.velocity, self.log_every(log.dt), placed, *feed, known)

    def at_lines(self) -> Cascade:
        """See `Controller`."""
        none: dict[str, Any] = dict.fromkeys(FILTERS, ())
        return replace(self, period=None, position_period=None, delay=0.0, **none)

    def asked(self, log: LoopSignals) -> Vector:
        """See `Controller`: behind position controller and command filters."""
        source = self.command_of(log)
        assert source is not None
        command, period = source, log.dt / self.log_every(log.dt)
        if self.position is not None:
            assert log.position is not None
            every, fed = self.position_every(log.dt), self.ticks(log.dt, source, log.position).velocity_feedforward
            made = self.position.gain * (source - log.position) + (fed[:: self.log_every(log.dt)] if len(fed) else 0.0)
            command = np.repeat(made[::every], every)[: len(source)]
        for one in self.command_filters:
            digital = one.digital(period)
            command = filtered(np.array(digital.b), np.array(digital.a), command[None, :], [len(command)])[0]
        return command

    def replayable(self, log: LoopSignals) -> bool:
        """See `Controller`."""
        read = self.position is None or log.position is not None
        return read and self.command_of(log) is not None and self.log_every(log.dt) == 1

    def torque_of(self, log: LoopSignals, also: Limiting | None = None, stored: float = 0.0) -> Vector:
        """See `Controller`."""
        source, dt = self.source_of(log), log.dt
        assert source is not None
        ticks, limited = self.ticks(dt, source, log.position), self
        if also is not None:
            limited = self.with_limits(self.limits[0], min(also.integrator, self.limits[1]))
            if np.isfinite(also.slope):
                followed = rate_limited(self.asked(log), also.slope, dt, 0.0)
                ticks = replace(ticks, source=followed, velocity_feedforward=np.zeros(0), position=np.zeros(0))
                limited = replace(limited, position=None, position_period=None, velocity_feedforward=0.0, command_filters=())
        return core.servo_torque(dt, ticks, log.velocity, limited.core_loop(dt), stored)

    def with_limits(self, torque: float | None, integrator: float | None) -> Cascade:
        """See `Controller`."""
        return replace(self, velocity=self.velocity.with_limits(torque, integrator))

    def ticks(self, dt: float, command: Vector, position: Vector | None) -> Ticks:
        """See `Controller`; ControllerError where a number is None."""
        known(self)
        placed = 0 if self.position is None else self.position_every(dt)
        feed = Feedforward(
            self.velocity_feedforward, self.acceleration_feedforward, self.friction_feedforward, self.feedforward_over
        )
        return ticks_of(command, position, dt, self.log_every(dt), placed, feed, self.interpolation)

    def core_loop(self, dt: float) -> _core.Loop:
        """See `Controller`; ControllerError where a number is None."""
        known(self)
        period = dt / self.log_every(dt)
        filters = {name: [f.digital(period) for f in getattr(self, name)] for name in FILTERS}
        settings = self.velocity.servo_settings(
            position_gain=0.0 if self.position is None else self.position.gain,
            position_every=self.position_every(dt),
            delay=self.delay,
            **filters,
        )
        return _core.Loop(kind="servo", controller=core.core_controller(self.velocity), servo=settings)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON or TOML; position_gain: None without a position controller, "unknown" of P(None)."""
        filters = {name: [f.to_dict() for f in getattr(self, name)] for name in FILTERS}
        numbers = {name: getattr(self, name) for name in ("period", "position_period", *FEEDFORWARDS, "delay")}
        position = None if self.position is None else UNKNOWN if self.position.gain is None else self.position.gain
        between = {name: value for name in WAYS if (value := getattr(self, name)) != getattr(type(self), name)}
        return {"velocity": self.velocity.to_dict(), "position_gain": position, **numbers, **between, **filters}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Cascade:
        """Return the controller of what `to_dict` gave; raises ControllerError."""
        allowed = ("velocity", "position_gain", "period", "position_period", *FEEDFORWARDS, *FILTERS, "delay", *WAYS)
        values: dict[str, Any] = known_keys(data, "the cascade", allowed, ("velocity",), ControllerError)
        gain = values.pop("position_gain", None)
        position = None if gain is None else P(None if isinstance(gain, str) and gain == UNKNOWN else gain)
        values["velocity"] = PI.from_dict(values["velocity"])
        for name in FILTERS:
            given = values.get(name, ())
            if not isinstance(given, Sequence) or isinstance(given, str | bytes):
                raise ControllerError(f"{name} is {given!r:.80}: give a list of the dictionaries that to_dict gave")
            values[name] = tuple(filter_of(one) for one in given)
        return cls(position=position, **values)


def cascade_of(controller: Controller) -> Cascade:
    """The controller as a digital servo: a Cascade is one, a PI stands in one with nothing around it."""
    if isinstance(controller, Cascade):
        return controller
    assert isinstance(controller, PI)
    return Cascade(replace(controller, loop="sampled"))


def controller_of(data: Mapping[str, Any]) -> Controller:
    """The controller of what `to_dict` of a PI or a Cascade gave; raises ControllerError."""
    return Cascade.from_dict(data) if "velocity" in data else PI.from_dict(data)
