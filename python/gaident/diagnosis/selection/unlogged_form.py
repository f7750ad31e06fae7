"""Another form of controller than the given PI as a hypothesis, for records without a torque.

Without a logged torque the model is driven by what the given PI makes of command and velocity.
A filter or a command weight that the drive has and the PI has not is then missing in that torque,

    u = N(z) u',   e = r' - w',   r' = L(z) r,   w' = L(z) w   or   u = kp (b r - w) + I,

and looks like mechanics: a lag, a resonance, an inertia that is far off.
Each form has up to three numbers z, which are fitted with the model's (see `under_controller`).

A form is searched where the selected model leaves more than noise, or has an effect that is linear in series, as a filter of
the torque is.
It is judged by the criterion that selected the model.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import Cascade
from gaident.control.filters import LowPass, Notch
from gaident.control.found import NUMBER_STEP, FoundNumbers
from gaident.control.pi import PI
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.other_gains import OTHER_GAINS
from gaident.diagnosis.selection.under_controller import UnderController, out_of_reach
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import cost_of
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import project_out
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["UnloggedForm", "in_series", "leaves_noise", "unlogged_form"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Number:
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
class _Variant:
    """A form with its numbers; controller: of the given PI and their values. words: what it has, for a sentence."""

    finding: str
    words: Text
    numbers: tuple[_Number, ...]
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

RATIO = _Number("integral_gain", "1", lambda dt, duration: (1.0 / REACH, REACH), lambda dt, duration: (1.0,))
WEIGHT = _Number("weight", "1", lambda dt, duration: (0.0, POLICY.form_weight), lambda dt, duration: (0.0, 0.5), logarithm=False)
TIME_CONSTANT = _Number(
    "time_constant",
    "s",
    lambda dt, duration: (POLICY.form_fastest * dt, POLICY.form_slowest * duration),
    # no decision: a start
    lambda dt, duration: np.geomspace(0.5 * dt, 0.1 * POLICY.form_slowest * duration, POLICY.form_starts),
)
FREQUENCY = _Number(
    "frequency", "Hz", _band, lambda dt, duration: np.geomspace(*_band(dt, duration), 2 * POLICY.form_starts + 1)[1:-1]
)
# From undamped zeros to real ones, with which a filter has no notch.
OF_ZEROS = _Number("numerator_damping", "1", lambda dt, duration: (0.0, 1.0), lambda dt, duration: (0.1,), logarithm=False)
OF_POLES = _Number(
    "denominator_damping",
    "1",
    lambda dt, duration: (POLICY.notch_least_damping, POLICY.notch_most_damping),
    lambda dt, duration: (0.7,),
)

VARIANTS: tuple[_Variant, ...] = (
    _Variant(OTHER_GAINS, Text("other gains"), (RATIO,), lambda pi, ratio: Cascade(replace(pi, ki=pi.ki * ratio))),
    _Variant(
        "command_weight", Text("a command weight"), (WEIGHT,), lambda pi, weight: Cascade(replace(pi, command_weight=weight))
    ),
    _Variant(
        "torque_filter",
        say("a low pass of the {torque}"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, torque_filters=(LowPass(time_constant=tau),)),
    ),
    _Variant(
        "torque_filter",
        say("a notch in the {torque}"),
        (FREQUENCY, OF_ZEROS, OF_POLES),
        lambda pi, *notch: Cascade(pi, torque_filters=(Notch(*notch),)),
    ),
    _Variant(
        "velocity_feedback_filter",
        Text("a low pass of the velocity that it reads"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, velocity_filters=(LowPass(time_constant=tau),)),
    ),
    _Variant(
        "command_filter",
        Text("a low pass of the command"),
        (TIME_CONSTANT,),
        lambda pi, tau: Cascade(pi, command_filters=(LowPass(time_constant=tau),)),
    ),
)
"""Forms that a drive's controller often has, and other gains, which come first where they explain as much.

A rule of integration moves kp by less than a thousandth at a drive's clock.
"""


@dataclass(frozen=True)
class UnloggedForm:
    """A model under another form of controller.

    Its fit, the controller, what that has in words, its finding; its score, and that of the selected model under the given
    controller. found: the numbers of the form.
    """

    fit: Fit
    controller: Cascade
    words: Text
    finding: Finding
    score: float
    selected: float
    found: FoundNumbers

    def better(self, margin: float) -> bool:
        """Whether it explains the records better than the selected model does under the given controller."""
        return self.score < self.selected - margin

    def as_good(self, margin: float) -> bool:
        """Whether the records do not tell it from the selected model."""
        return self.score < self.selected + margin


def in_series(fit: Fit) -> tuple[str, ...]:
    """Effects of a model that are linear in series with the mechanism, as a filter of the torque is."""
    return tuple(t.name for t in fit.parameters.terms if t.in_series)


def unlogged_form(space: Moves, final: Fit) -> UnloggedForm | None:
    """The form of controller with which the selected model, with or without its effects in series, explains the records best.

    None where a torque is logged, or where the loop is not closed by a bare PI from rest.
    None also where the model leaves noise and contains no effect in series, which a filter could replace.
    """
    data, series = space.data, in_series(final)
    if data.pi is None or any(r.torque is not None or r.command is None for r in data.records):
        return None
    if data.loop_only or any(data.moving) or any(data.stored) or (leaves_noise(space, final) and not series):
        return None
    objective = replace(space.objective)  # with a memory of its own, because every controller makes another data set
    bases = [_without(space, final, series)]
    if not leaves_noise(space, final):
        bases += [final] * bool(series) + [_without(space, final, final.effects)] * (set(final.effects) > set(series))
    starts = _promising(space, objective, data.pi, [_opened(space, base) for base in bases])
    if not leaves_noise(space, final):
        starts += [(v, under, _with_friction(space, base), z) for v, under, base, z in starts if not _rubs(base)]
    beyond = max(out_of_reach(space, f) for f in (final, _opened(space, final)))
    found = [_fitted(space, objective, beyond, *one) for one in starts]
    known = [f for f in found if f is not None]
    best = min(known, key=lambda f: f[1], default=None)
    if best is None or any(f[2].finding == OTHER_GAINS and f[1] < best[1] + space.margin for f in known):
        return None
    fit, score, variant, numbers, stds = best
    z = numbers.at
    selected = min(space.score(final), space.score(_opened(space, final)))
    close = {f[2]: f[2].words for f in known if f[1] < score + space.margin and f[2].finding != variant.finding}
    finding = _finding(variant, z, stds, selected - score, list(close.values()))
    return UnloggedForm(fit, variant.of(data.pi, z), variant.words, finding, score, selected, numbers)


def leaves_noise(space: Moves, fit: Fit) -> bool:
    """Whether a fit leaves noise, and not only because a noise filter took a misfit for it."""
    return space.is_noise(fit) and space.small_unwhitened(fit)


def _without(space: Moves, fit: Fit, effects: tuple[str, ...]) -> Fit:
    for effect in effects:
        fit = space.without(fit, effect)
    return fit


def _rubs(fit: Fit) -> bool:
    """Whether a model has dry friction."""
    return any(term.levels for term in fit.parameters.terms)


def _with_friction(space: Moves, fit: Fit) -> Fit:
    """The fit with dry friction, which nearly every axis has, and which a torque that lacks a filter may hide."""
    term = next((t for t in space.allowed if t.levels and t.simplest), None)
    if term is None:
        return fit
    longer = fit.hypothesis.extended(term)
    starts = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in term.starts(longer.parameters.scales)])
    start = starts[int(np.argmin(space.objective.costs(longer, starts, WHITE)))]
    return ls.fit(space.objective, longer, start, WHITE, POLICY.short)


def _opened(space: Moves, fit: Fit) -> Fit:
    """The fit as driven by the torque."""
    return space.predicted_by(fit, OpenLoop(space.data, fit.predictor.own_angle)) if fit.predictor.closed else fit


_Start = tuple[_Variant, UnderController, Fit, Vector]
_End = tuple[Fit, float, _Variant, FoundNumbers, Vector]


def _promising(space: Moves, objective: Objective, pi: PI, bases: list[Fit]) -> list[_Start]:
    """Each form beside each model at its best start, the model refitted there to first order."""
    tried = sorted(_starts(space, objective, pi, bases), key=lambda one: one[0])
    chosen: dict[tuple[_Variant, Fit], _Start] = {}
    for _, start in tried:
        variant, _, base, _ = start
        chosen.setdefault((variant, base), start)
    return list(chosen.values())


def _starts(space: Moves, objective: Objective, pi: PI, bases: list[Fit]) -> Iterator[tuple[float, _Start]]:
    """(what is left there, start) of each form, at each of its starts."""
    dt, duration = space.data.dt, max(len(r) * r.dt for r in space.data.records)
    for base in bases:
        for variant in VARIANTS:
            low, high = variant.ends(dt, duration)
            under = UnderController(space.data, partial(variant.of, pi), low, high)
            for row in variant.starts(dt, duration):
                z = np.clip(row, low, high)
                v, J = objective.linearised(under.of(base.hypothesis, z), base.x, WHITE)
                left = project_out(J, v[None, :])[0]
                yield float(left @ left), (variant, under, base, z)


def _fitted(
    space: Moves, objective: Objective, beyond: float, variant: _Variant, under: UnderController, base: Fit, z: Vector
) -> _End | None:
    """(model, score, form, its numbers, their deviations) from one start; None where it diverges or ends at a bound.

    None also where its score stays too high to be followed (`beyond`).
    """
    end = under.fitted(space, objective, base, z, beyond)
    if end is None:
        return None
    z, found = end
    zero = (under.low == 0.0) & (z == 0.0)  # drives have a weight of 0, or zeros without damping
    at_end = (z > under.high - NUMBER_STEP) | ((z < under.low + NUMBER_STEP) & ~zero)
    if bool(at_end.any()):
        return None
    score = space.score(found) + cost_of(len(z), objective.information) + space.penalty
    return found, score, variant, replace(under.found(z), named=variant.named), under.deviations(objective, found, z)


def _finding(variant: _Variant, z: Vector, stds: Vector, gain: float, others: list[Text]) -> Finding:
    """What is reported of a form that takes the place of the given controller; others: forms that explain as much."""
    estimates = {n.name: n.estimate(x, float(std)) for n, x, std in zip(variant.numbers, z, stds, strict=True)}
    text = (
        "No {torque} is logged; under a controller with {} ({}) command and velocity agree with the axis, and the best model "
        "under the given one is {:.0f} BIC units worse{}. Log the {torque}, which shows what the controller does."
    )
    instead = say("; {} would explain as much", joined(" or ", others)) if others else ""
    shown = joined(", ", (_shown(name, e) for name, e in estimates.items()))
    return Finding(
        variant.finding, estimates, (), 0.0, gain, None, say(text, variant.words, shown, gain, instead), place="controller"
    )


def _shown(name: str, e: Estimate) -> Text:
    words = name.replace("_", " ")
    return say("{} {:.4g}", words, e.value) if e.unit == "1" else say("{} {:.4g} {}", words, e.value, unit_text(e.unit))
