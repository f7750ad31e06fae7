"""The PI run on a measured velocity (no plant).

e(n) = r(n) - w(n)
I(n) = I(n-1) + ki dt (e(n) + e(n-1))/2,  e(-1) = 0,  clamped to +-integrator_limit
u(n) = kp e(n) + I(n),                                clamped to +-torque_limit
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.axis import say
from gaident.control import core
from gaident.control.controller import VelocityGains
from gaident.control.filtering import clamped_sum
from gaident.control.unknown import known

__all__ = ["HOLDS", "held_torque", "pi_block", "pi_torque"]

Vector = NDArray[np.float64]


def pi_torque(command: Vector, velocity: Vector, dt: float, controller: VelocityGains, initial_integral: float = 0.0) -> Vector:
    """The torque [N m], shape (n,), that `controller` makes of command and measured velocity [rad/s], shape (n,) each.

    initial_integral: what the integrator stored before sample 0 [N m]. Both loops of `PI` share this rule.
    """
    return pi_block(command - velocity, dt, controller, 0.0, initial_integral)[0]


def pi_block(e: Vector, dt: float, controller: VelocityGains, last: float, integral: float) -> tuple[Vector, float]:
    """(torque, integral after it) [N m] for a block of errors [rad/s], with the last error and the integral before it."""
    known(controller)
    half = 0.5 * controller.ki * dt
    steps = half * (e + np.concatenate([[last], e[:-1]]))
    torque_limit, integrator_limit = controller.limits
    integrals = integral + np.cumsum(steps)
    if float(np.abs(integrals).max()) > integrator_limit:
        integrals = clamped_sum(steps, integrator_limit, integral)
    u: Vector = np.clip(controller.kp * e + integrals, -torque_limit, torque_limit)
    return u, float(integrals[-1])


HOLDS = {
    "held": say("the integrator held while the {torque} is limited"),
    "held_back": say("the integrator held while the {torque} is limited and the error would drive it further"),
    "tracked": say("the integrator set back to what the limited {torque} leaves of it"),
}
"""Ways in which a controller keeps its integrator from winding up at the torque limit."""


def held_torque(
    command: Vector,
    velocity: Vector,
    dt: float,
    controller: VelocityGains,
    rule: str,
    initial_integral: float = 0.0,
    share: float = 0.0,
) -> Vector:
    """`pi_torque` of a controller with a torque limit U whose integrator does not wind up there, by a rule of `HOLDS`:

    v(n) = kp e(n) + I(n),  u(n) = clip(v(n), +-U); where |v(n)| > U afterwards
    held       I(n) = I(n-1)
    held_back  I(n) = I(n-1) where e(n) v(n) > 0
    tracked    I(n) = u(n) - kp e(n)

    share: by how much of ki dt the newest error counts more than half, and the one before less: 0 a trapezoidal integral, 0.5 a
    rectangular one, -0.5 one that lacks the newest error.
    """
    newest, before = ((0.5 + s) * controller.ki * dt for s in (share, -share))
    return core.held_torque(command - velocity, controller, newest, before, rule, initial_integral)
