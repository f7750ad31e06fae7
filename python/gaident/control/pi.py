"""The velocity controller: u = kp e + ki integral of e, e = command - velocity (Fig. 3 of the paper)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from gaident.arguments import NO_CONTROLLER, arg
from gaident.checks import known_keys, one_of, real_number
from gaident.errors import ControllerError

PI_OF_GAINS = arg("controller", "PI(kp=..., ki=...)", python="PI(kp=..., ki=...)")
LOOPS = ("sampled", "continuous")
_NOT_GIVEN = float("nan")  # told from a given nan by identity


@dataclass(frozen=True)
class PI:
    """PI velocity controller, C(s) = kp + ki/s.

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

    Raises
    ------
    ControllerError
        For a missing or negative gain, two gains of 0, another loop, and a limit that is not above 0.

    Notes
    -----
    For a linear axis read N for N m and m for rad.

    Examples
    --------
    >>> import gaident as ga
    >>> controller = ga.PI(kp=0.0232, ki=1.367, torque_limit=2.4)
    >>> controller.limited
    True
    """

    kp: float = _NOT_GIVEN
    ki: float = _NOT_GIVEN
    loop: str = "sampled"
    torque_limit: float | None = None
    integrator_limit: float | None = None

    def __post_init__(self) -> None:
        missing = [name for name in ("kp", "ki") if getattr(self, name) is _NOT_GIVEN]
        if missing:
            raise ControllerError(
                f"PI lacks {' and '.join(missing)}: give {PI_OF_GAINS}, {arg('ki', '0')} for a proportional controller"
            )
        for name in ("kp", "ki"):
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

    @property
    def limited(self) -> bool:
        """True if torque or integrator have a limit: the loop is then linear only while no limit acts."""
        return self.torque_limit is not None or self.integrator_limit is not None

    @property
    def limits(self) -> tuple[float, float]:
        """(Torque limit, integrator limit) [N m], infinity for none: as the core takes them."""
        torque = math.inf if self.torque_limit is None else self.torque_limit
        integrator = math.inf if self.integrator_limit is None else self.integrator_limit
        return torque, integrator

    def to_dict(self) -> dict[str, float | str | None]:
        """Return the fields as a dictionary for JSON or TOML."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, object]) -> PI:
        """Return the controller of what `to_dict` gave; keys with a default may be left out. Raises ControllerError."""
        allowed = ("kp", "ki", "loop", "torque_limit", "integrator_limit")
        values: dict[str, Any] = known_keys(data, "the controller", allowed, ("kp", "ki"), ControllerError)
        return cls(**values)
