"""Another form of controller than the given PI as a hypothesis, for records without a torque.

Without a logged torque the model is driven by what the given PI makes of command and velocity. A filter or a command weight that
the drive has and the PI has not is then missing in that torque,

    u = N(z) u',   e = r' - w',   r' = L(z) r,   w' = L(z) w   or   u = kp (b r - w) + I,

and looks like mechanics: a lag, a resonance, an inertia that is far off. Each form has up to three numbers z, which are fitted
with the model's (see `under_controller`).

A form is looked for where the selected model leaves more than noise, or holds an effect that is linear in series, as a filter of
the torque is. What it is worth is judged by the criterion that selected the model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import Cascade
from gaident.control.filters import LowPass, Notch
from gaident.control.pi import PI
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.other_gains import OTHER_GAINS
from gaident.diagnosis.selection.under_controller import STEP, UnderController
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import cost_of
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import WORST, project_out
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["UnloggedForm", "in_series", "leaves_noise", "unlogged_form"]

Vector = NDArray[np.float64]

NYQUIST = 0.95  # no decision: of the Nyquist frequency, the highest notch
SLOWEST = 0.1  # no decision: of the record's duration, the longest time constant and the longest period of a notch
GRID = 6  # no decision: starts of a frequency or a time constant
DAMPING = (0.05, 2.0)  # no decision: denominators of notches that drives have


@dataclass(frozen=True, eq=False)
class _Variant:
    """A form with numbers z: their ends and starts for (sample time, duration) [s], the controller, and z as parameters.

    parameters: name -> (place in z, unit, whether z is its logarithm).
    """

    finding: str
    words: Text
    ends: Callable[[float, float], list[tuple[float, float]]]
    starts: Callable[[float, float], list[tuple[float, ...]]]
    controller: Callable[[PI, Vector], Cascade]
    parameters: Mapping[str, tuple[int, str, bool]]


def _time_ends(dt: float, duration: float) -> list[tuple[float, float]]:
    return [(float(np.log(0.1 * dt)), float(np.log(SLOWEST * duration)))]


def _time_starts(dt: float, duration: float) -> list[tuple[float, ...]]:
    return [(float(np.log(tau)),) for tau in np.geomspace(0.5 * dt, 0.1 * SLOWEST * duration, GRID)]


def _notch_ends(dt: float, duration: float) -> list[tuple[float, float]]:
    low, high = 1.0 / (SLOWEST * duration), NYQUIST * 0.5 / dt
    return [(float(np.log(low)), float(np.log(high))), (0.0, 1.0), (float(np.log(DAMPING[0])), float(np.log(DAMPING[1])))]


def _notch_starts(dt: float, duration: float) -> list[tuple[float, ...]]:
    (low, high), *_ = _notch_ends(dt, duration)
    return [(float(f), 0.1, float(np.log(0.7))) for f in np.linspace(low, high, 2 * GRID + 1)[1:-1]]


def _notch(z: Vector) -> Notch:
    return Notch(frequency=float(np.exp(z[0])), numerator_damping=float(z[1]), denominator_damping=float(np.exp(z[2])))


def _low_pass(z: Vector) -> LowPass:
    return LowPass(time_constant=float(np.exp(z[0])))


REACH = float(np.log((1.0 + POLICY.gain_doubt) / (1.0 - POLICY.gain_doubt)))
"""Largest logarithm of the ratio ki/kp over the given one."""

VARIANTS: tuple[_Variant, ...] = (
    _Variant(
        OTHER_GAINS,
        Text("other gains"),
        lambda dt, duration: [(-REACH, REACH)],
        lambda dt, duration: [(0.0,)],
        lambda pi, z: Cascade(replace(pi, ki=pi.ki * float(np.exp(z[0])))),
        {"ki": (0, "N m/rad", True)},
    ),
    _Variant(
        "command_weight",
        Text("a command weight"),
        lambda dt, duration: [(0.0, 2.0)],
        lambda dt, duration: [(0.0,), (0.5,)],
        lambda pi, z: Cascade(replace(pi, command_weight=float(z[0]))),
        {"weight": (0, "1", False)},
    ),
    _Variant(
        "torque_filter",
        Text("a low pass of the torque"),
        _time_ends,
        _time_starts,
        lambda pi, z: Cascade(pi, torque_filters=(_low_pass(z),)),
        {"time_constant": (0, "s", True)},
    ),
    _Variant(
        "torque_filter",
        Text("a notch in the torque"),
        _notch_ends,
        _notch_starts,
        lambda pi, z: Cascade(pi, torque_filters=(_notch(z),)),
        {"frequency": (0, "Hz", True), "numerator_damping": (1, "1", False), "denominator_damping": (2, "1", True)},
    ),
    _Variant(
        "velocity_feedback_filter",
        Text("a low pass of the velocity that it reads"),
        _time_ends,
        _time_starts,
        lambda pi, z: Cascade(pi, velocity_filters=(_low_pass(z),)),
        {"time_constant": (0, "s", True)},
    ),
    _Variant(
        "command_filter",
        Text("a low pass of the command"),
        _time_ends,
        _time_starts,
        lambda pi, z: Cascade(pi, command_filters=(_low_pass(z),)),
        {"time_constant": (0, "s", True)},
    ),
)
"""Forms that a drive's controller often has, and other gains, which come first where they explain as much.

A rule of integration moves kp by less than a thousandth at a drive's clock.
"""


@dataclass(frozen=True)
class UnloggedForm:
    """A model under another form of controller.

    Its fit, the controller, its finding; its score, and that of the selected model under the given controller.
    """

    fit: Fit
    controller: Cascade
    finding: Finding
    score: float
    selected: float

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
    """The form of controller with which the selected model, or what it is without effects in series, explains the records best.

    None where a torque is logged, where no bare PI from rest closes the loop, or where nothing asks for one: the model leaves
    noise and holds nothing that a filter could be.
    """
    data, series = space.data, in_series(final)
    if data.pi is None or any(r.torque is not None or r.command is None for r in data.records):
        return None
    if data.loop_only or any(data.moving) or any(data.stored) or (leaves_noise(space, final) and not series):
        return None
    objective = replace(space.objective)  # with a memory of its own: every controller tried makes a data set
    bases = [_without(space, final, series)]
    if not leaves_noise(space, final):
        bases += [final] * bool(series) + [_without(space, final, final.effects)] * (set(final.effects) > set(series))
    starts = _promising(space, objective, data.pi, [_opened(space, base) for base in bases])
    if not leaves_noise(space, final):
        starts += [(v, under, _with_friction(space, base), z) for v, under, base, z in starts if not _rubs(base)]
    found = [_fitted(space, objective, *one) for one in starts]
    known = [f for f in found if f is not None]
    best = min(known, key=lambda f: f[1], default=None)
    if best is None or any(f[2].finding == OTHER_GAINS and f[1] < best[1] + space.margin for f in known):
        return None
    fit, score, variant, z, stds = best
    selected = min(space.score(final), space.score(_opened(space, final)))
    close = {f[2]: f[2].words for f in known if f[1] < score + space.margin and f[2].finding != variant.finding}
    finding = _finding(variant, z, stds, selected - score, list(close.values()))
    return UnloggedForm(fit, variant.controller(data.pi, z), finding, score, selected)


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
_End = tuple[Fit, float, _Variant, Vector, Vector]


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
            low, high = np.array(variant.ends(dt, duration)).T
            under = UnderController(space.data, lambda z, made=variant.controller: made(pi, z), low, high)  # type: ignore[misc]
            for row in variant.starts(dt, duration):
                z = np.clip(np.array(row), low, high)
                v, J = objective.linearised(under.of(base.hypothesis, z), base.x, WHITE)
                left = project_out(J, v[None, :])[0]
                yield float(left @ left), (variant, under, base, z)


def _fitted(space: Moves, objective: Objective, variant: _Variant, under: UnderController, base: Fit, z: Vector) -> _End | None:
    """(model, score, form, its numbers, their deviations) from one start; None where it diverges or ends at a bound."""
    z, found = under.closest(objective, base, WHITE, z)
    if space.whitens:
        z, found = under.closest(objective, found, objective.own_noise(found), z)
    found = ls.reestimated(objective, found)
    zero = (under.low == 0.0) & (z == 0.0)  # a weight of 0, or zeros without damping, are what drives have
    at_end = (z > under.high - STEP) | ((z < under.low + STEP) & ~zero)
    if found.cost >= WORST or bool(at_end.any()):
        return None
    score = space.score(found) + cost_of(len(z), objective.information) + space.penalty
    return found, score, variant, z, under.deviations(objective, found, z)


def _finding(variant: _Variant, z: Vector, stds: Vector, gain: float, others: list[Text]) -> Finding:
    """What is reported of a form that takes the place of the given controller; others: forms that come as close."""
    estimates = {}
    for name, (at, unit, logarithm) in variant.parameters.items():
        value = float(np.exp(z[at])) if logarithm else float(z[at])
        estimates[name] = Estimate(value, float(stds[at]) * (value if logarithm else 1.0), unit)
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
