"""A form of controller: constraints on the regression's numbers, and one that was fitted with its filters."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade
from gaident.control.filters import LowPass
from gaident.control.found import FoundNumbers, loosened
from gaident.control.pi import PI, RULES
from gaident.diagnosis.controller.form_filters import at_places
from gaident.diagnosis.controller.form_regression import Law, Shape

__all__ = [
    "FEEDS",
    "FILTER_NAMES",
    "FIRST_FEED",
    "GAINS",
    "KI",
    "KP_R",
    "KP_W",
    "WEIGHTS",
    "FormCandidate",
    "Form",
    "controller_of",
    "found_of",
    "named",
]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

WEIGHTS = ("one", "none", "free")
FEEDS = ("acceleration_feedforward", "friction_feedforward")
FILTER_NAMES = {
    "torque_filters": "torque_filter",
    "velocity_filters": "velocity_feedback_filter",
    "command_filters": "command_filter",
}
"""Argument of `Cascade` -> name of the finding."""
KP_W, KP_R, KI, FIRST_FEED = 0, 1, 2, 3  # no decision: a formula: places in (kp, kp b, ki, a_ff, f_ff, starts)
GAINS = {"kp": KP_W, "ki": KI}


@dataclass(frozen=True)
class Form:
    """Constraints on the regression's numbers. free: of the gains; feeds: feedforwards; starts: an integral before the record."""

    rule: str = "trapezoidal"
    free: tuple[str, ...] = ()
    weight: str = "one"
    feeds: tuple[str, ...] = ()
    starts: bool = False
    unknown: tuple[str, ...] = ()  # gains that were not given: free, and no finding
    given_rule: str = "trapezoidal"

    @property
    def chosen(self) -> int:
        """Settings that differ without a number of their own."""
        return int(self.rule != self.given_rule) + int(self.weight == "none")

    def names(self, shape: Shape) -> tuple[str, ...]:
        """What differs from the bare PI with the given gains and rule, in words of the findings."""
        names = ["integration_rule"] * (self.rule != self.given_rule) + ["other_gains"] * bool(set(self.free) - set(self.unknown))
        names += ["command_weight"] * (self.weight != "one")
        return (*names, *self.feeds, *dict.fromkeys(FILTER_NAMES[place] for place, _ in shape.places))

    def constraints(self, given: PI, law: Law) -> tuple[Vector, Matrix]:
        """(P0, D) of the numbers P = P0 + D z in (kp, kp b, ki, a_ff, f_ff, starts)."""
        fixed = np.zeros(FIRST_FEED + len(FEEDS) + len(law.lengths))
        if law.around is not None:
            fed = [0.0 if name in self.feeds else float(getattr(law.around, name)) for name in FEEDS]
            fixed[FIRST_FEED : FIRST_FEED + len(FEEDS)] = fed
        unit = np.eye(len(fixed))
        moved: list[Vector] = []
        if "kp" in self.free:
            moved.append(unit[KP_W] + (unit[KP_R] if self.weight == "one" else 0.0))
        else:
            fixed[KP_W] = given.kp
            fixed[KP_R] = given.kp if self.weight == "one" else 0.0
        if self.weight == "free":
            moved.append(unit[KP_R])
        if "ki" in self.free:
            moved.append(unit[KI])
        else:
            fixed[KI] = given.ki
        moved += [unit[FIRST_FEED + FEEDS.index(name)] for name in self.feeds]
        if self.starts:
            moved += list(unit[FIRST_FEED + len(FEEDS) :])
        return fixed, np.array(moved).reshape(len(moved), len(fixed)).T

    def of_columns(self, size: int, period: float) -> Matrix:
        """B of the columns' coefficients c = B P: a rectangular integral is the trapezoidal one and +-ki T/2 of the error."""
        B = np.eye(size)
        B[[KP_W, KP_R], KI] = (RULES[self.rule] - RULES["trapezoidal"]) * period
        return B


@dataclass(frozen=True, eq=False)
class FormCandidate:
    """A form with the filters of a shape of this regression; free: its numbers; count of them; criterion: less is better."""

    form: Form
    shape: Shape
    law: Law
    free: Vector  # z, then by how much the filters' numbers move
    count: int
    criterion: float

    @property
    def names(self) -> tuple[str, ...]:
        return self.form.names(self.shape)


def named(
    best: FormCandidate, numbers: Vector, filters: Vector, cov: Matrix, period: float
) -> dict[str, dict[str, tuple[float, float]]]:
    """Name of what differs -> parameter -> (value, standard deviation), in the units of `Cascade`."""
    std = np.sqrt(np.maximum(np.diag(cov), 0.0))
    kp, kp_b = float(numbers[KP_W]), float(numbers[KP_R])
    named: dict[str, dict[str, tuple[float, float]]] = {name: {} for name in best.names}
    if "other_gains" in named:
        gains = {"kp": (kp, float(std[KP_W])), "ki": (float(numbers[KI]), float(std[KI]))}
        named["other_gains"] = {name: gains[name] for name in best.form.free if name not in best.form.unknown}
    if "command_weight" in named and kp > 0.0:
        slope = np.array([-kp_b / kp**2, 1.0 / kp])
        named["command_weight"] = {"weight": (kp_b / kp, float(np.sqrt(max(slope @ cov[:2, :2] @ slope, 0.0))))}
    for name in best.form.feeds:
        at = FIRST_FEED + FEEDS.index(name)
        named[name] = {"inertia" if name == FEEDS[0] else "torque": (float(numbers[at]), float(std[at]))}
    at = 0
    for place, kind in best.shape.places:
        into, known = named[FILTER_NAMES[place]], std[len(numbers) + at :]
        if kind is LowPass:
            into["time_constant"] = _of_logarithm(filters[at], known[0], period)
        else:
            into["frequency"] = _of_logarithm(filters[at], known[0], 1.0 / period)
            into["numerator_damping"] = (float(filters[at + 1]), float(known[1]))
            into["denominator_damping"] = _of_logarithm(filters[at + 2], known[2], 1.0)
        at += 1 if kind is LowPass else 3
    return named


def _of_logarithm(logarithm: float, std: float, unit: float) -> tuple[float, float]:
    return (value := float(np.exp(logarithm)) * unit), value * float(std)


def controller_of(best: FormCandidate, numbers: Vector, filters: Vector, given: PI, period: float) -> Cascade:
    """The controller of a form with these numbers."""
    kp, kp_b, ki = (max(float(x), 0.0) for x in numbers[:FIRST_FEED])
    pi = PI(
        kp=kp,
        ki=ki,
        torque_limit=given.torque_limit,
        integrator_limit=given.integrator_limit,
        rule=best.form.rule,
        command_weight=kp_b / kp if kp else 1.0,
    )
    feeds = {name: float(numbers[FIRST_FEED + FEEDS.index(name)]) for name in best.form.feeds}
    return best.law.whole(pi, **feeds, **at_places(best.shape.places, filters, period))


def found_of(
    best: FormCandidate, fitted: tuple[Vector, Vector, Matrix], given: PI, whole: Cascade, period: float, slow: bool
) -> FoundNumbers:
    """The numbers of a form with their covariance; whole: the controller, with what is no number of the form.

    slow: whether the log has fewer lines than the controller samples.
    """
    numbers, filters, cov = fitted
    gains = len(numbers)

    def made(at: Vector) -> Cascade:
        one = controller_of(best, at[:gains], at[gains:], given, period)
        own = one.velocity
        velocity = replace(whole.velocity, kp=own.kp, ki=own.ki, command_weight=own.command_weight)
        return replace(one, period=whole.period, velocity=velocity)

    def said(at: Vector, spread: Matrix) -> dict[str, dict[str, tuple[float, float]]]:
        unknown = {name: (float(at[k]), float(np.sqrt(spread[k, k]))) for name, k in GAINS.items() if name in best.form.unknown}
        return {**named(best, at[:gains], at[gains:], spread, period), "": unknown}

    at = np.concatenate([numbers, filters])
    low = np.full(len(at), -np.inf)
    low[:FIRST_FEED] = 0.0
    dampings, k = [], gains
    for _, kind in best.shape.places:
        dampings += [] if kind is LowPass else [k + 1]
        k += 1 if kind is LowPass else 3
    low[dampings] = 0.0
    return FoundNumbers(made, at, loosened(cov) if slow else cov, low, named=said)
