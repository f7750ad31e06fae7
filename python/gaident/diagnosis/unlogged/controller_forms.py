"""Forms of controller that a drive often has and the given PI has not, each with up to three numbers.

    u = N(z) u',   e = r' - w',   r' = L(z) r,   w' = L(z) w   or   u = kp (b r - w) + I

A search moves a number by its logarithm, or as it is.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.cascade import Cascade
from gaident.control.filters import LowPass, Notch
from gaident.control.pi import PI
from gaident.diagnosis.unlogged.other_gains import OTHER_GAINS
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["VARIANTS", "ControllerForm"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FormNumber:
    """A number of a form: name and unit for the finding; bounds and starts for (sample time, duration) [s].

    logarithm: whether it is searched by its logarithm.
    """

    name: str
    unit: str
    ends: Callable[[float, float], tuple[float, float]]
    starts: Callable[[float, float], Sequence[float] | Vector]
    logarithm: bool = True

    def moved(self, value: float) -> float:
        """The value as the search moves it."""
        return float(np.log(value)) if self.logarithm else float(value)

    def value(self, z: float) -> float:
        """The value of what the search moves."""
        return float(np.exp(z)) if self.logarithm else float(z)

    def estimate(self, z: float, std: float) -> Estimate:
        """The value with its deviation; std: of z."""
        value = self.value(z)
        return Estimate(value, std * value if self.logarithm else std, self.unit)


@dataclass(frozen=True, eq=False)
class ControllerForm:
    """A form with its numbers; controller: of the given PI and their values. words: what it has, for a sentence."""

    finding: str
    words: Text
    numbers: tuple[FormNumber, ...]
    controller: Callable[..., Cascade]

    def of(self, pi: PI, z: Vector) -> Cascade:
        """The controller with the numbers z as the search moves them."""
        return self.controller(pi, *(number.value(x) for number, x in zip(self.numbers, z, strict=True)))

    def named(self, z: Vector, covariance: Matrix) -> dict[str, dict[str, tuple[float, float]]]:
        """Finding -> parameter -> (value, standard deviation), of numbers as the search moves them."""
        found = zip(self.numbers, z, np.sqrt(np.diag(covariance)), strict=True)
        estimates = {n.name: n.estimate(float(x), float(std)) for n, x, std in found}
        return {self.finding: {name: (e.value, e.std) for name, e in estimates.items()}}

    def ends(self, dt: float, duration: float) -> tuple[Vector, Vector]:
        """(lowest, highest) z."""
        low, high = np.array([[n.moved(end) for end in n.ends(dt, duration)] for n in self.numbers]).T
        return low, high

    def starts(self, dt: float, duration: float) -> list[Vector]:
        """Every z that a search begins at."""
        grids = ([n.moved(start) for start in n.starts(dt, duration)] for n in self.numbers)
        return [np.array(z) for z in itertools.product(*grids)]


def _band(dt: float, duration: float) -> tuple[float, float]:
    return 1.0 / (POLICY.form_slowest * duration), POLICY.notch_highest * 0.5 / dt


REACH = (1.0 + POLICY.gain_doubt) / (1.0 - POLICY.gain_doubt)
"""Largest ratio of ki/kp to the given one."""

RATIO = FormNumber("integral_gain", "1", lambda dt, duration: (1.0 / REACH, REACH), lambda dt, duration: (1.0,))
WEIGHT = FormNumber(
    "weight", "1", lambda dt, duration: (0.0, POLICY.form_weight), lambda dt, duration: (0.0, 0.5), logarithm=False
)
TIME_CONSTANT = FormNumber(
    "time_constant",
    "s",
    lambda dt, duration: (POLICY.form_fastest * dt, POLICY.form_slowest * duration),
    # no decision: a start
    lambda dt, duration: np.geomspace(0.5 * dt, 0.1 * POLICY.form_slowest * duration, POLICY.form_starts),
)
FREQUENCY = FormNumber(
    "frequency", "Hz", _band, lambda dt, duration: np.geomspace(*_band(dt, duration), POLICY.form_starts + 3)[1:-1]
)
# From undamped zeros to real ones, with which a filter has no notch.
OF_ZEROS = FormNumber("numerator_damping", "1", lambda dt, duration: (0.0, 1.0), lambda dt, duration: (0.1,), logarithm=False)
OF_POLES = FormNumber(
    "denominator_damping",
    "1",
    lambda dt, duration: (POLICY.notch_least_damping, POLICY.notch_most_damping),
    lambda dt, duration: (0.7,),
)

VARIANTS: tuple[ControllerForm, ...] = (
    ControllerForm(OTHER_GAINS, Text("other gains"), (RATIO,), lambda pi, ratio: Cascade(replace(pi, ki=pi.ki * ratio))),
    ControllerForm(
        "command_weight", Text("a command weight"), (WEIGHT,), lambda pi, weight: Cascade(replace(pi, command_weight=weight))
    ),
    ControllerForm(
        "torque_filter",
        say("a low pass of the {torque}"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, torque_filters=(LowPass(time_constant=tau),)),
    ),
    ControllerForm(
        "torque_filter",
        say("a notch in the {torque}"),
        (FREQUENCY, OF_ZEROS, OF_POLES),
        lambda pi, *notch: Cascade(pi, torque_filters=(Notch(*notch),)),
    ),
    ControllerForm(
        "velocity_feedback_filter",
        Text("a low pass of the velocity that it reads"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, velocity_filters=(LowPass(time_constant=tau),)),
    ),
    ControllerForm(
        "command_filter",
        Text("a low pass of the command"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, command_filters=(LowPass(time_constant=tau),)),
    ),
)
"""Forms that a drive's controller often has, and other gains, which come first where they explain as much.

A rule of integration is none of them: it moves kp by ki T/2 and comes out as other gains.
"""
