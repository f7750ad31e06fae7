"""The PI run on a measured velocity (no plant).

e(n) = r(n) - w(n)
I(n) = I(n-1) + ki dt (e(n) + e(n-1))/2,  e(-1) = 0,  clamped to +-integrator_limit
u(n) = kp e(n) + I(n),                                clamped to +-torque_limit
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.models.controller import PI

__all__ = ["HOLDS", "held_torque", "pi_torque", "rate_limited"]

Vector = NDArray[np.float64]


def pi_torque(command: Vector, velocity: Vector, dt: float, controller: PI, initial_integral: float = 0.0) -> Vector:
    """The torque [N m], shape (n,), that `controller` makes of command and measured velocity [rad/s], shape (n,) each.

    initial_integral: what the integrator held before sample 0 [N m]. Both loops of `PI` share this rule.
    """
    e = command - velocity
    half = 0.5 * controller.ki * dt * e
    steps = half.copy()
    steps[1:] += half[:-1]
    torque_limit, integrator_limit = controller.limits
    integral = initial_integral + np.cumsum(steps)
    if float(np.abs(integral).max()) > integrator_limit:
        integral = _core.clamped_sum(steps, integrator_limit, initial_integral)
    u: Vector = np.clip(controller.kp * e + integral, -torque_limit, torque_limit)
    return u


HOLDS = {
    "held": "the integrator held while the torque is limited",
    "held_back": "the integrator held while the torque is limited and the error would drive it further",
    "tracked": "the integrator set back to what the limited torque leaves of it",
}
"""Ways in which a controller keeps its integrator from winding up at the torque limit."""


def held_torque(command: Vector, velocity: Vector, dt: float, controller: PI, rule: str, initial_integral: float = 0.0) -> Vector:
    """`pi_torque` of a controller with a torque limit U whose integrator does not wind up there, by a rule of `HOLDS`:

    v(n) = kp e(n) + I(n),  u(n) = clip(v(n), +-U); where |v(n)| > U afterwards
    held       I(n) = I(n-1)
    held_back  I(n) = I(n-1) where e(n) v(n) > 0
    tracked    I(n) = u(n) - kp e(n)
    """
    limit, clamp = controller.limits
    kp, half = controller.kp, 0.5 * controller.ki * dt
    out, integral, last = [], initial_integral, 0.0
    for e in (command - velocity).tolist():
        new = min(max(integral + half * (e + last), -clamp), clamp)
        v = kp * e + new
        u = min(max(v, -limit), limit)
        if u == v or (rule == "held_back" and e * v <= 0.0):
            integral = new
        elif rule == "tracked":
            integral = u - kp * e
        last = e
        out.append(u)
    return np.array(out)


def rate_limited(command: Vector, rate: float, dt: float, start: float) -> Vector:
    """`command` [rad/s] followed from `start` with a slope of at most `rate` [rad/s^2], shape (n,)."""
    return _core.rate_limited(command, rate * dt, start)
