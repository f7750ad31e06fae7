"""What the torque of an axis is made of, as columns of a regression, and which sets of them are compared.

    u = J a + B w + C sign(w) + T + D w|w| + A sin(theta + phase) + K theta

    by direction:  B w = B+ w (w > 0) + B- w (w < 0),   C sign(w) = C+ (w > 0) - C- (w < 0)
    gravity:       A sin(theta + phase) = A cos(phase) sin(theta) + A sin(phase) cos(theta)

Friction by direction and a constant T are the same columns: C+ = C + T, C- = C - T. Either stands in a model, not both.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.regression.motion import Motion
from gaident.results.estimate import Estimate

__all__ = ["CHOICES", "COLUMNS", "STEEP_DRAG", "TERMS", "TorqueTerm", "columns_of", "estimates_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


class Coefficient(NamedTuple):
    name: str
    rotary: str  # unit
    linear: str


@dataclass(frozen=True)
class TorqueTerm:
    """One term: `columns(motion, sign)` gives an array (n,) for each coefficient."""

    columns: Callable[[Motion, Vector], list[Vector]]
    parameters: tuple[Coefficient, ...]


INERTIA = Coefficient("inertia", "kg m^2", "kg")


def _viscous(name: str) -> Coefficient:
    return Coefficient(name, "N m s/rad", "N s/m")


def _force(name: str) -> Coefficient:
    return Coefficient(name, "N m", "N")


TERMS: dict[str, TorqueTerm] = {
    "inertia": TorqueTerm(lambda m, _: [m.acceleration], (INERTIA,)),
    "viscous": TorqueTerm(lambda m, _: [m.velocity], (_viscous("viscous"),)),
    "viscous_by_direction": TorqueTerm(
        lambda m, _: [np.maximum(m.velocity, 0.0), np.minimum(m.velocity, 0.0)],
        (_viscous("viscous_positive"), _viscous("viscous_negative")),
    ),
    "coulomb": TorqueTerm(lambda _, sign: [sign], (_force("coulomb"),)),
    "coulomb_by_direction": TorqueTerm(
        lambda _, sign: [np.maximum(sign, 0.0), np.minimum(sign, 0.0)],
        (_force("coulomb_positive"), _force("coulomb_negative")),
    ),
    "offset": TorqueTerm(lambda m, _: [np.ones_like(m.velocity)], (_force("offset"),)),
    "drag": TorqueTerm(lambda m, _: [m.velocity * np.abs(m.velocity)], (Coefficient("drag", "N m s^2/rad^2", "N s^2/m^2"),)),
    "gravity": TorqueTerm(
        lambda m, _: [np.sin(m.position), np.cos(m.position)],
        (_force("gravity_amplitude"), Coefficient("gravity_phase", "rad", "rad")),
    ),
    "spring": TorqueTerm(lambda m, _: [m.position], (Coefficient("spring", "N m/rad", "N/m"),)),
}

STEEP_DRAG = "steep_drag"
"""A drag cbrt(w) that no choice of terms contains: beside it a jump at the reversal is dry friction (`reversal.py`)."""

COLUMNS: dict[str, TorqueTerm] = TERMS | {
    STEEP_DRAG: TorqueTerm(lambda m, _: [np.cbrt(m.velocity)], (Coefficient("steep_drag", "N m (s/rad)^(1/3)", "N (s/m)^(1/3)"),))
}
"""The terms that a user can ask for, and those of tests."""

FRICTION = ((), ("viscous",), ("coulomb",), ("viscous", "coulomb"))
BY_DIRECTION = ("viscous_by_direction", "coulomb_by_direction")
WITH_CONSTANT = (*((*f, "offset") for f in FRICTION), BY_DIRECTION)
LOADS: tuple[tuple[tuple[str, ...], tuple[tuple[str, ...], ...]], ...] = (
    ((), (*FRICTION, *WITH_CONSTANT)),
    (("gravity",), (*FRICTION, *WITH_CONSTANT)),
    (("spring",), WITH_CONSTANT),
)
CHOICES: tuple[tuple[str, ...], ...] = (
    *(("inertia", *f, *load) for load, frictions in LOADS for f in frictions),
    *(("inertia", *f, "drag", *load) for load, frictions in LOADS for f in frictions if f != BY_DIRECTION),
)
"""The sets of terms that the criterion compares: friction and a constant alone, with gravity, or with a spring to ground, whose
rest angle needs the constant; each without a drag and with one, which friction by direction has no room for."""


def columns_of(terms: tuple[str, ...], motion: Motion) -> Matrix:
    """The columns of the terms (n, k).
    Below the threshold of standstill the sign runs as a straight line from -1 to 1: such samples are no rows of a regression, and
    a predicted torque shall not jump with the noise."""
    sign = np.clip(motion.velocity / motion.threshold, -1.0, 1.0) if motion.threshold > 0.0 else np.sign(motion.velocity)
    return np.column_stack([column for name in terms for column in COLUMNS[name].columns(motion, sign)])


def estimates_of(terms: tuple[str, ...], theta: Vector, cov: Matrix, axis: str) -> dict[str, Estimate]:
    """The parameters by name; gravity as amplitude and phase, to first order in the deviations."""
    found: dict[str, Estimate] = {}
    k = 0
    for name in terms:
        parameters = COLUMNS[name].parameters
        here = slice(k, k + len(parameters))
        values, block = theta[here], cov[here, here]
        k += len(parameters)
        sizes = np.abs(values)
        if name == "gravity":
            amplitude = math.hypot(*values)
            gradient = np.array([values, [-values[1], values[0]]]) / np.array([[amplitude], [amplitude**2]])
            values = np.array([amplitude, math.atan2(values[1], values[0])])
            sizes = np.array([amplitude, 1.0])
            finite = bool(np.all(np.isfinite(block)))
            block = gradient @ block @ gradient.T if finite else np.diag([np.inf, np.inf])
        for parameter, value, variance, size in zip(parameters, values, np.diag(block), sizes, strict=True):
            std = float(np.sqrt(variance))
            unit = parameter.linear if axis == "linear" else parameter.rotary
            found[parameter.name] = Estimate(float(value), std, unit, identifiable=bool(std < size))
    return found
