"""A digital velocity controller as a frequency response and as a recurrence, without its limits.

r -> command filters -> r',  w -> velocity filters -> w',  e = r' - w'
I(n) = I(n-1) + ki T (share e(n) + (1 - share) e(n-1)),  u = kp (b r' - w') + I -> torque filters
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.cascade import Cascade
from gaident.control.pi import RULES

__all__ = ["ControllerStates", "controller_responses", "controller_states"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]


def controller_responses(cascade: Cascade, period: float, z: Complex) -> tuple[Complex, Complex]:
    """(C_r, C_w) at z: u = C_r r - C_w w, r the velocity command in front of the command filters."""
    pi, back = cascade.velocity, 1.0 / z
    share = RULES[pi.rule]
    with np.errstate(divide="ignore", invalid="ignore"):
        integral = pi.ki * period * (share + (1.0 - share) * back) / (1.0 - back)
    command, velocity, torque = (
        _filtered(filters, period, back)
        for filters in (cascade.command_filters, cascade.velocity_filters, cascade.torque_filters)
    )
    return torque * command * (pi.kp * pi.command_weight + integral), torque * velocity * (pi.kp + integral)


def _filtered(filters: Sequence[object], period: float, back: Complex) -> Complex | float:
    response: Complex | float = 1.0
    for b, a in _digital(filters, period):
        response = response * (b[0] + back * (b[1] + back * b[2])) / (1.0 + back * (a[1] + back * a[2]))
    return response


def _digital(filters: Sequence[object], period: float) -> list[tuple[Vector, Vector]]:
    made: list[_core.DigitalFilter] = [one.digital(period) for one in filters]  # type: ignore[attr-defined]
    return [(_three(f.b), _three(f.a)) for f in made]


def _three(values: Sequence[float]) -> Vector:
    return np.array([*values, 0.0, 0.0])[:3]  # no decision: a formula: a filter is of second order at most


class ControllerStates(NamedTuple):
    """x(n+1) = A x(n) + B [r, w], u(n) = C x(n) + D [r, w]."""

    A: Matrix
    B: Matrix
    C: Vector
    D: Vector


def controller_states(cascade: Cascade, period: float) -> ControllerStates:
    """The recurrence as matrices: the linear map that one step is, column by column."""
    step = _Step(cascade, period)
    columns = [step(x, r, w) for x, r, w in step.units()]
    after = np.array([next_state for next_state, _ in columns]).T
    out = np.array([u for _, u in columns])
    return ControllerStates(after[:, :-2], after[:, -2:], out[:-2], out[-2:])


@dataclass(frozen=True, eq=False)
class _Step:
    """One sample of the controller; its state: two numbers of each filter, I and e of the sample before."""

    cascade: Cascade
    period: float

    @cached_property
    def filters(self) -> list[list[tuple[Vector, Vector]]]:
        """Of command, velocity and torque, each as its coefficients."""
        c = self.cascade
        return [_digital(filters, self.period) for filters in (c.command_filters, c.velocity_filters, c.torque_filters)]

    def units(self) -> list[tuple[Vector, float, float]]:
        size = 2 * sum(map(len, self.filters)) + 2
        return [(row[:size], row[size], row[size + 1]) for row in np.eye(size + 2)]

    def __call__(self, state: Vector, r: float, w: float) -> tuple[Vector, float]:
        pi, share = self.cascade.velocity, RULES[self.cascade.velocity.rule]
        memory = list(state[:-2].reshape(-1, 2))
        integral, before = state[-2:]
        after: list[Vector] = []

        def through(filters: list[tuple[Vector, Vector]], x: float) -> float:
            for b, a in filters:
                one, two = memory.pop(0)
                y = b[0] * x + one
                after.append(np.array([b[1] * x - a[1] * y + two, b[2] * x - a[2] * y]))
                x = y
            return float(x)

        command, velocity, torque = self.filters
        r, w = through(command, r), through(velocity, w)
        error = r - w
        if pi.ki == 0.0:  # a proportional controller has no integral, which would be a state that stays as it is
            integral = 0.0
        integral = integral + pi.ki * self.period * (share * error + (1.0 - share) * before)
        u = through(torque, pi.kp * (pi.command_weight * r - w) + integral)
        return np.concatenate([*after, [integral, error]]), u
