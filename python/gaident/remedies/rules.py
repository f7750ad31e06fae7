"""Classical rules for the gains of a velocity loop: named starts of the search.

Of the axis as one inertia J with a damping D, and the sum of small times Ts (half a sample of the held torque, delays, lags,
filters):

    symmetrical optimum    kp = J/(2 Ts),  ki = kp/(4 Ts)          Kessler 1958
    magnitude optimum      kp = J/(2 Ts),  ki = kp D/J             the integral's time is that of the axis

Of two masses with the inertia ratio R = JL/JM and the antiresonance wa, both pairs of poles with the damping z (Zhang and Furusho
2000):

    s^4 + kp/JM s^3 + (wa^2 (1 + R) + ki/JM) s^2 + kp wa^2/JM s + ki wa^2/JM = (s^2 + 2 z w1 s + w1^2) (s^2 + 2 z w2 s + w2^2)
    ki = JM wa^2,  kp = 2 z JM wa sqrt(R + 4 - 4 z^2)
"""

from __future__ import annotations

import math

from gaident.control.cascade import Cascade
from gaident.control.filters import LowPass
from gaident.errors import ModelError
from gaident.models.effects_linear import LINEAR
from gaident.models.model import Model

__all__ = ["resonances", "rule_gains"]

DAMPED = math.sqrt(0.5)  # no decision: a start


def rule_gains(model: Model, cascade: Cascade, period: float, differenced: bool) -> dict[str, tuple[float, float]]:
    """Rule -> (kp, ki) for the linear part of a model."""
    inertia, damping = rigid_axis(model)
    small = small_times(model, cascade, period, differenced)
    kp = inertia / (2.0 * small)
    found = {
        "symmetrical optimum": (kp, kp / (4.0 * small)),  # no decision: a start
        "magnitude optimum": (kp, kp * max(damping, 0.0) / inertia),
    }
    swings = sorted(abs(zero) for zero in model.mechanism.zeros if zero.imag > 0.0)
    if swings:
        motor, wa = 1.0 / abs(model.mechanism.gain), swings[0]
        ratio = max(inertia / motor - 1.0, 0.0)
        reach = math.sqrt(ratio + 4.0 - 4.0 * DAMPED**2)
        found["two masses, equally damped"] = (2.0 * DAMPED * motor * wa * reach, motor * wa**2)
    return found


def rigid_axis(model: Model) -> tuple[float, float]:
    """(inertia, damping) of the axis below its resonances: G(s) = 1/(J (s + a)) there, a its slowest real pole."""
    mechanism = model.mechanism
    reals = sorted((pole for pole in mechanism.poles if pole.imag == 0.0), key=abs)
    if not reals:
        return 1.0 / abs(mechanism.gain), 0.0
    slow = reals[0]
    others = list(mechanism.poles)
    others.remove(slow)
    above = math.prod((abs(pole) for pole in others), start=1.0)
    below = math.prod((abs(zero) for zero in mechanism.zeros if zero != 0.0), start=1.0)
    inertia = above / (abs(mechanism.gain) * below) if below else math.inf
    if not 0.0 < inertia < math.inf:
        raise ModelError(
            f"model is {model!r:.200}: its roots are so far apart that no axis has their inertia; leave out the far ones"
        )
    return inertia, -slow.real * inertia


def small_times(model: Model, cascade: Cascade, period: float, differenced: bool) -> float:
    """Sum of what makes the loop late beside the axis [s]."""
    late = sum(LINEAR[e.name](e.values).late for e in model.effects if e.name in LINEAR and e.row.place != "plant")
    for one in (*cascade.torque_filters, *cascade.velocity_filters):
        if isinstance(one, LowPass):
            late += one.time_constant
        else:
            late += (one.denominator_damping - one.numerator_damping) / (math.pi * one.frequency)
    return max(late, 0.0) + cascade.delay + 0.5 * period * (1 + differenced)


def resonances(model: Model) -> list[float]:
    """Frequencies of the pairs of poles of the mechanism [Hz], ascending."""
    return sorted(abs(pole) / math.tau for pole in model.mechanism.poles if pole.imag > 0.0)
