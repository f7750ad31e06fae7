"""The velocity controller: u = kp (b r - w) + ki integral of e, e = r - w (for b = 1 Fig. 3 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.arguments import NO_CONTROLLER, arg
from gaident.checks import known_keys, one_of, real_number
from gaident.control import core
from gaident.control.controller import Controller, Limiting, LoopSignals, checked_controller
from gaident.control.drive_parameters import kp_and_ki
from gaident.control.filtering import rate_limited
from gaident.control.pi_torque import pi_torque
from gaident.control.ticks import Ticks, of_lines
from gaident.control.unknown import known, with_own
from gaident.control.words import ANTI_WINDUP, LOOPS
from gaident.errors import ControllerError, SettingsError

Vector = NDArray[np.float64]

PI_OF_GAINS = arg("controller", "PI(kp=..., ki=...)", python="PI(kp=..., ki=...)")
RULES = {"trapezoidal": 0.5, "backward": 1.0, "forward": 0.0}
"""Rule of integration -> share of ki T that the newest error has in a step of the integral."""
DIGITAL = ("rule", "command_weight", "anti_windup", "tracking_time")
_NOT_GIVEN = float("nan")  # told from a given nan by identity


@dataclass(frozen=True)
class PI(Controller):
    """PI velocity controller, C(s) = kp + ki/s.

    kp, ki and command_weight may be None: not known, and estimated by `identify` and `diagnose` where the torque is logged.

    Parameters
    ----------
    kp : float
        Proportional gain [N m s/rad], >= 0; kp and ki are not both zero.
    ki : float
        Integral gain [N m/rad], >= 0.
    loop : {"sampled", "continuous"}
        "sampled": the digital controller
        I(n) = I(n-1) + ki dt (e(n) + e(n-1))/2, u(n) = kp e(n) + I(n), e(-1) = 0, with e = command - velocity.
        Its torque is held until the next sample (zero-order hold, plant discretised exactly).
        "continuous": controller and plant by the bilinear transformation, the algebraic loop between them solved exactly, as in
        the paper.
    torque_limit : float, optional
        u is clamped to +-torque_limit [N m]; None: no limit.
    integrator_limit : float, optional
        I is clamped to +-integrator_limit [N m] after each update; None: no limit.
    rule : {"trapezoidal", "backward", "forward"}
        How I is summed, T the controller's sample time: ki T (e(n) + e(n-1))/2, ki T e(n), or ki T e(n-1).
    command_weight : float
        b of the proportional part kp (b r - w), >= 0; 0: an IP controller.
    anti_windup : {"none", "hold", "tracking"}
        What keeps I from winding up where u is at `torque_limit`, which it needs.
        "hold": where e would drive u further, I keeps its last value, and u is formed again.
        "tracking": I changes by (u_limited - u) T/tracking_time after the clamp.
    tracking_time : float, optional
        [s], > 0, of "tracking".

    Raises
    ------
    ControllerError
        For a missing or negative gain, two gains of 0, another loop, a limit that is not above 0, an anti-windup without what it
        needs, and anything of a digital controller in the continuous loop.

    Notes
    -----
    For a linear axis read N for N m and m for rad.

    Examples
    --------
    >>> import gaident as ga
    >>> controller = ga.PI(kp=0.0232, ki=1.367, torque_limit=2.4)
    >>> controller.limited
    True
    >>> ga.PI(kp=None, ki=None).kp is None
    True
    """

    kp: float = _NOT_GIVEN
    ki: float = _NOT_GIVEN
    loop: str = "sampled"
    torque_limit: float | None = None
    integrator_limit: float | None = None
    rule: str = "trapezoidal"
    command_weight: float = 1.0
    anti_windup: str = "none"
    tracking_time: float | None = None

    if TYPE_CHECKING:  # None is what is not known; whoever simulates has asked for numbers before (`gaident.control.unknown`)

        def __init__(
            self,
            kp: float | None = ...,
            ki: float | None = ...,
            loop: str = ...,
            torque_limit: float | None = ...,
            integrator_limit: float | None = ...,
            rule: str = ...,
            command_weight: float | None = ...,
            anti_windup: str = ...,
            tracking_time: float | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        missing = [name for name in ("kp", "ki") if getattr(self, name) is _NOT_GIVEN]
        if missing:
            raise ControllerError(
                f"PI lacks {' and '.join(missing)}: give {PI_OF_GAINS}, {arg('ki', '0')} for a proportional controller"
            )
        for name in ("kp", "ki"):
            if getattr(self, name) is None:
                continue
            gain = real_number(getattr(self, name), name, ControllerError)
            if gain < 0.0:
                raise ControllerError(
                    f"{name} is {gain:g}: give a gain >= 0; if positive torque turns the axis backwards, "
                    "give the model a negative gain or change the sign of the record's signals"
                )
            object.__setattr__(self, name, gain)
        if self.kp == 0.0 and self.ki == 0.0:
            raise ControllerError(
                f"kp and ki are both 0: such a controller never gives a torque; for an open loop use {NO_CONTROLLER}"
            )
        object.__setattr__(self, "loop", one_of(self.loop, "loop", LOOPS, ControllerError))
        for name in ("torque_limit", "integrator_limit"):
            value = getattr(self, name)
            if value is None:
                continue
            remedy = "give a number > 0, or None for no limit"
            limit = real_number(value, name, ControllerError, remedy)
            if limit <= 0.0:
                raise ControllerError(f"{name} is {limit:g}: {remedy}")
            object.__setattr__(self, name, limit)
        self._check_digital()

    def _check_digital(self) -> None:
        object.__setattr__(self, "rule", one_of(self.rule, "rule", tuple(RULES), ControllerError))
        object.__setattr__(self, "anti_windup", one_of(self.anti_windup, "anti_windup", ANTI_WINDUP, ControllerError))
        if self.command_weight is not None:
            weight = real_number(self.command_weight, "command_weight", ControllerError)
            if weight < 0.0:
                raise ControllerError(f"command_weight is {weight:g}: give a number >= 0; 1 is a PI, 0 an IP controller")
            object.__setattr__(self, "command_weight", weight)
        if self.anti_windup != "none" and self.torque_limit is None:
            raise ControllerError(
                f'anti_windup is "{self.anti_windup}" without a torque_limit, at which it would act: give torque_limit='
            )
        if (self.anti_windup == "tracking") != (self.tracking_time is not None):
            raise ControllerError(
                f'anti_windup is "{self.anti_windup}" and tracking_time is {self.tracking_time}: "tracking" needs a '
                "tracking_time [s], the others have none"
            )
        if self.tracking_time is not None:
            time = real_number(self.tracking_time, "tracking_time", ControllerError, "give a number > 0")
            if time <= 0.0:
                raise ControllerError(f"tracking_time is {time:g}: give a number > 0")
            object.__setattr__(self, "tracking_time", time)
        if self.loop == "continuous" and not self.bare:
            raise ControllerError(
                'loop is "continuous", but rule, command_weight and anti_windup belong to a digital controller: leave them out, '
                'or give loop="sampled"'
            )

    @property
    def bare(self) -> bool:
        """True for the trapezoidal rule, a command weight of 1 and no anti-windup: the paper's controller, limits or not."""
        return self.rule == "trapezoidal" and self.command_weight == 1.0 and self.anti_windup == "none"

    @property
    def winding_up(self) -> PI:
        """The same without an anti-windup."""
        return replace(self, anti_windup="none", tracking_time=None)

    @property
    def one_equation(self) -> bool:
        """See `Controller`."""
        return self.bare

    @property
    def gains(self) -> PI:
        """See `Controller`: its own."""
        return self

    @property
    def driven_by(self) -> str:
        """ "command"."""
        return "command"

    @property
    def reads(self) -> tuple[str, ...]:
        """See `Controller`: the command."""
        return ("command",)

    @property
    def parts(self) -> tuple[tuple[str, object], ...]:
        """See `Controller`: itself alone."""
        return (("", self),)

    def with_numbers(self, numbers: Mapping[str, float]) -> PI:
        """See `Controller`."""
        return with_own(self, "", numbers)

    @property
    def limits(self) -> tuple[float, float]:
        """(Torque limit, integrator limit) [N m], infinity for none: as the core takes them."""
        torque = math.inf if self.torque_limit is None else self.torque_limit
        integrator = math.inf if self.integrator_limit is None else self.integrator_limit
        return torque, integrator

    def log_every(self, dt: float) -> int:
        """1: it runs at the log's sample time."""
        return 1

    def asked(self, log: LoopSignals) -> Vector:
        """The log's velocity command [rad/s]."""
        assert log.command is not None
        return log.command

    def replayable(self, log: LoopSignals) -> bool:
        """See `Controller`."""
        return log.command is not None

    def torque_of(self, log: LoopSignals, also: Limiting | None = None, stored: float = 0.0) -> Vector:
        """See `Controller`."""
        command, limited = self.asked(log), self
        if also is not None:
            command = command if math.isinf(also.slope) else rate_limited(command, also.slope, log.dt, 0.0)
            limited = self.with_limits(self.torque_limit, min(also.integrator, self.limits[1]))
        if self.bare:
            return pi_torque(command, log.velocity, log.dt, limited, stored)
        return core.servo_torque(log.dt, of_lines(command, None), log.velocity, limited.core_loop(log.dt), stored)

    def with_limits(self, torque: float | None, integrator: float | None) -> PI:
        """See `Controller`; without a torque limit there is nothing for an anti-windup to act at."""
        torque, integrator = (None if isinstance(x, float) and x == math.inf else x for x in (torque, integrator))
        limited = self.winding_up if torque is None else self
        return replace(limited, torque_limit=torque, integrator_limit=integrator)

    def ticks(self, dt: float, command: Vector, position: Vector | None) -> Ticks:
        """See `Controller`."""
        return of_lines(command, position)

    def core_loop(self, dt: float) -> _core.Loop:
        """See `Controller`; ControllerError where a number is None."""
        known(self)
        if self.bare:
            return _core.Loop(kind=self.loop, controller=core.core_controller(self))
        return _core.Loop(kind="servo", controller=core.core_controller(self), servo=self.servo_settings())

    def servo_settings(self, **around: Any) -> _core.ServoSettings:
        """The core's settings of what a digital controller has; around: what a cascade has beside it."""
        settings: dict[str, Any] = {
            "command_filters": [],
            "velocity_filters": [],
            "torque_filters": [],
            "position_gain": 0.0,
            "position_every": 1,
            **around,
        }
        return _core.ServoSettings(
            newest=RULES[self.rule],
            command_weight=self.command_weight,
            anti_windup=self.anti_windup,
            tracking_time=self.tracking_time or 0.0,
            **settings,
        )

    @classmethod
    def from_drive(cls, drive: str, **parameters: Any) -> PI:
        """Return the controller of gains as a drive shows them.

        Parameters
        ----------
        drive : str
            "sinamics", "el72xx", "ax5000", "ax8000", "sigma", "epos2", "odrive", "simplefoc" or "vesc".
        **parameters : float
            The drive's parameters in the drive's units, and what else `PI` takes but gains: torque_limit, rule, ...
            Names, units and formulas stand in the guide "Where to find it in your drive".

        Returns
        -------
        PI
            With kp [N m s/rad] and ki [N m/rad], where the drive has an integral time Tn, ki = kp/Tn.

        Raises
        ------
        ControllerError
            For a drive that is not known, a parameter that is missing, of another drive or not above 0.

        Examples
        --------
        >>> import gaident as ga
        >>> ga.PI.from_drive("sinamics", p1460=0.02, p1462=10.0, torque_limit=2.4).ki
        2.0
        """
        own = {name: parameters.pop(name) for name in cls.__dataclass_fields__ if name in parameters and name not in ("kp", "ki")}
        kp, ki = kp_and_ki(drive, parameters)
        return cls(kp, ki, **own)

    def to_dict(self) -> dict[str, float | str | None]:
        """Return the fields as a dictionary for JSON or TOML, without those of a digital controller that a bare one has not."""
        data = asdict(self)
        return {key: data[key] for key in data if key not in DIGITAL} if self.bare else data

    @classmethod
    def from_dict(cls, data: Mapping[str, object]) -> PI:
        """Return the controller of what `to_dict` gave; keys with a default may be left out. Raises ControllerError."""
        allowed = ("kp", "ki", "loop", "torque_limit", "integrator_limit", *DIGITAL)
        values: dict[str, Any] = known_keys(data, "the controller", allowed, ("kp", "ki"), ControllerError)
        return cls(**values)


def bare_pi(controller: Controller | None) -> PI | None:
    """The bare PI that a controller is, limits or not; None for every other, and for none."""
    pi = None if controller is None or not controller.one_equation else controller.gains
    assert pi is None or isinstance(pi, PI)
    return pi


def checked_pi(controller: object, what: str) -> PI | None:
    """The bare PI that a public function was given as `controller=`; SettingsError for all else, because of `what` it does."""
    given = checked_controller(controller)
    pi = bare_pi(given)
    if given is not None and pi is None:
        kind = f"a {type(given).__name__} with more than kp and ki"
        raise SettingsError(f"controller is {kind}: {what} of a bare PI only; give PI(kp, ki), or None for the drive alone")
    return pi
