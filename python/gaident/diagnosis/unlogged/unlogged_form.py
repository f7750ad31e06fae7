"""Another form of controller than the given PI as a hypothesis, for records without a torque.

Without a logged torque the model is driven by what the given PI makes of command and velocity.
A filter or a command weight that the drive has and the PI has not is then missing in that torque,

    u = N(z) u',   e = r' - w',   r' = L(z) r,   w' = L(z) w   or   u = kp (b r - w) + I,

and looks like mechanics: a lag, a resonance, an inertia that is far off.
Each form has up to three numbers z, which are fitted with the model's (see `under_controller`).

A form is searched where the selected model leaves more than noise, where it has an effect that is linear in series, as a filter
of the torque is, where its mechanism drives itself, as none does, and where other gains explain the records better.
It is judged by the criterion that selected the model.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import Cascade
from gaident.control.found import NUMBER_STEP, FoundNumbers
from gaident.control.pi import PI
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.unlogged.anew import dry_friction, mechanisms_under, with_term, with_usual_effects, with_wave
from gaident.diagnosis.unlogged.controller_forms import VARIANTS, ControllerForm
from gaident.diagnosis.unlogged.other_gains import OTHER_GAINS, OtherGains
from gaident.diagnosis.unlogged.under_controller import UnderController, out_of_reach
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


@dataclass(frozen=True)
class UnloggedForm:
    """A model under another form of controller.

    Its fit, the controller, what that has in words, its finding; its score, and that of the selected model under the given
    controller. found: the numbers of the form. gains: the score of the best model under other gains.
    """

    fit: Fit
    controller: Cascade
    words: Text
    finding: Finding
    score: float
    selected: float
    found: FoundNumbers
    gains: float = np.inf

    def better(self, margin: float) -> bool:
        """Whether it explains the records better than other gains do, and the selected model under the given controller."""
        return self.before_gains(margin) and self.score < self.selected - margin

    def as_good(self, margin: float) -> bool:
        """Whether the records do not tell it from the selected model, and prefer it to other gains."""
        return self.before_gains(margin) and self.score < self.selected + margin

    def before_gains(self, margin: float) -> bool:
        """Whether the records prefer it to other gains; what they do not tell from other gains comes after these."""
        return self.score <= self.gains - margin

    def rivals_of_gains(self, margin: float, mechanics: Callable[[Fit, Fit], dict[str, tuple[float, float]]]) -> dict[str, Text]:
        """{its finding: its numbers and the inertia of its model} where it explains as much as other gains, else {}.

        mechanics: of two fits, name -> values of both; without an inertia where a model is none of an axis.
        """
        if not self.score < self.gains + margin:
            return {}
        shown = joined(", ", (_shown(name, e) for name, e in self.finding.parameters.items()))
        both = mechanics(self.fit, self.fit).get("inertia")
        inertia = "" if both is None else say("; the {inertia} is then {:.4g} {kg m^2}", both[1])
        return {self.finding.effect: say("{} ({}){}", self.words, shown, inertia)}


def in_series(fit: Fit) -> tuple[str, ...]:
    """Effects of a model that are linear in series with the mechanism, as a filter of the torque is."""
    return tuple(t.name for t in fit.parameters.terms if t.in_series)


def unlogged_form(space: Moves, final: Fit, better: OtherGains | None = None, doubtful: bool = False) -> UnloggedForm | None:
    """The form of controller with which a model explains the records best.

    Searched beside the selected model, with or without its effects in series, and beside mechanisms that are found anew.
    None where a torque is logged, or where the loop is not closed by a bare PI from rest.
    None also where the model leaves noise and contains no effect in series, which a filter could replace.
    better: other gains that explain the records better; doubtful: whether there are such, or its mechanism is none of an axis.
    """
    data, series = space.data, in_series(final)
    settled = leaves_noise(space, final) and not doubtful
    if data.pi is None or any(r.torque is not None or r.command is None for r in data.records):
        return None
    if data.loop_only or any(data.moving) or any(data.stored) or (settled and not series):
        return None
    objective = replace(space.objective)  # with a memory of its own, because every controller makes another data set
    bases = [_without(space, final, series)]
    if not settled:
        bases += [final] * bool(series) + [_without(space, final, final.effects)] * (set(final.effects) > set(series))
    # Driven by the torque alone, what turns with the angle is off with it: what the selected model is led by counts too.
    bases = [*(_opened(space, base) for base in bases), *(base for base in bases if base.predictor.closed)]
    starts = _promising(space, objective, data.pi, bases)
    if not settled:
        starts += [
            (v, under, with_term(objective, base, friction), z)
            for v, under, base, z in starts
            for friction in dry_friction(space, base)
        ]
    beyond = max(out_of_reach(space, f) for f in (final, _opened(space, final)))
    known = _ends(space, objective, beyond, starts, [])
    if not any(_explains(space, end[0]) for end in known):
        starts = [(form, under, fit, z) for form in VARIANTS for under, fit, z in _anew(space, objective, final, form)]
        known = _ends(space, objective, beyond, starts, known)
    known = _ends(space, objective, beyond, _once_more(space, objective, data.pi, known), known)
    best = min((f for f in known if f[2].finding != OTHER_GAINS), key=lambda f: f[1], default=None)
    if best is None:
        return None
    gains = min((f[1] for f in known if f[2].finding == OTHER_GAINS), default=np.inf)
    gains = gains if better is None else min(gains, better.score)
    fit, score, variant, numbers, stds = best
    z = numbers.at
    selected = min(space.score(final), space.score(_opened(space, final)))
    close = {
        f[2]: f[2].words for f in known if f[1] < score + space.margin and f[2].finding not in (variant.finding, OTHER_GAINS)
    }
    finding = _finding(variant, z, stds, selected - score, list(close.values()))
    return UnloggedForm(fit, variant.of(data.pi, z), variant.words, finding, score, selected, numbers, gains)


def _explains(space: Moves, fit: Fit) -> bool:
    """Whether one mass under another controller leaves noise, without an effect in series that a form may stand for.

    Two masses that leave noise are not enough: another form, on a mechanism that is found anew, may be better by the criterion.
    """
    there = replace(space, objective=replace(space.objective, data=fit.predictor.data))
    return fit.parameters.masses == 1 and leaves_noise(there, fit) and not in_series(fit)


def leaves_noise(space: Moves, fit: Fit) -> bool:
    """Whether a fit leaves noise, and not only because a noise filter took a misfit for it."""
    return space.is_noise(fit) and space.small_unwhitened(fit)


def _without(space: Moves, fit: Fit, effects: tuple[str, ...]) -> Fit:
    for effect in effects:
        fit = space.without(fit, effect)
    return fit


def _opened(space: Moves, fit: Fit) -> Fit:
    """The fit as driven by the torque."""
    return space.predicted_by(fit, OpenLoop(space.data, fit.predictor.own_angle)) if fit.predictor.closed else fit


_Start = tuple[ControllerForm, UnderController, Fit, Vector]
_End = tuple[Fit, float, ControllerForm, FoundNumbers, Vector]


def _promising(space: Moves, objective: Objective, pi: PI, bases: list[Fit]) -> list[_Start]:
    """Each form beside each model at its best start, the model refitted there to first order."""
    tried = sorted(_starts(space, objective, pi, bases), key=lambda one: one[0])
    chosen: dict[tuple[ControllerForm, Fit], _Start] = {}
    for _, start in tried:
        variant, _, base, _ = start
        chosen.setdefault((variant, base), start)
    return list(chosen.values())


def _starts(space: Moves, objective: Objective, pi: PI, bases: list[Fit]) -> Iterator[tuple[float, _Start]]:
    """(what is left there, start) of each form, at each of its starts."""
    for base in bases:
        for variant in VARIANTS:
            for under, z in _grid(space, pi, variant):
                v, J = objective.linearised(under.of(base.hypothesis, z), base.x, WHITE)
                left = project_out(J, v[None, :])[0]
                yield float(left @ left), (variant, under, base, z)


def _grid(space: Moves, pi: PI, form: ControllerForm) -> list[tuple[UnderController, Vector]]:
    """Models under a form, with each of its starts."""
    under = _under(space, pi, form)
    return [(under, np.clip(z, under.low, under.high)) for z in form.starts(*_times(space))]


def _under(space: Moves, pi: PI, form: ControllerForm) -> UnderController:
    return UnderController(space.data, partial(form.of, pi), *form.ends(*_times(space)))


def _times(space: Moves) -> tuple[float, float]:
    """(sample time, duration of the longest record) [s]."""
    return space.data.dt, max(len(r) * r.dt for r in space.data.records)


def _anew(space: Moves, objective: Objective, final: Fit, form: ControllerForm) -> list[tuple[UnderController, Fit, Vector]]:
    """Mechanisms that are found anew under a form, the best of all its starts.

    The mechanism that was found under the given controller may be far off: its inertia by a multiple.
    """
    assert space.data.pi is not None
    found = [
        (under, fit, z)
        for under, z in _grid(space, space.data.pi, form)
        for fit in mechanisms_under(space, final.parameters.scales, objective, under.over(z))
    ]
    best = sorted(found, key=lambda one: space.score(one[1]))
    kept = [one for n in (1, 2) for one in [f for f in best if f[1].parameters.masses == n][: POLICY.starts]]
    return [(under, with_usual_effects(space, objective, fit), z) for under, fit, z in kept]


def _ends(space: Moves, objective: Objective, beyond: float, starts: Sequence[_Start], known: list[_End]) -> list[_End]:
    """The known ends, and those of the starts, the best start first.

    A start is not followed where it stays further behind the best end than a beam reaches, or beyond.
    """
    reach, ends = POLICY.beam_reach * space.penalty, list(known)
    for start in _begun(space, objective, starts):
        nearest = min((space.score(end[0]) + reach for end in ends), default=beyond)
        end = _fitted(space, objective, min(beyond, nearest), *start)
        ends += [end] if end is not None else []
    return ends


def _begun(space: Moves, objective: Objective, starts: Sequence[_Start]) -> list[_Start]:
    """The starts with their models fitted under their controllers, the best first; of equal ones the first."""
    begun: dict[tuple[object, ...], _Start] = {}
    for form, under, base, z in starts:
        hypothesis = under.of(base.hypothesis, z)
        fit = ls.scored(objective, ls.fit(objective, hypothesis, base.x, WHITE, POLICY.usual))
        begun.setdefault((id(form), z.tobytes(), *fit.effects, round(space.score(fit), 1)), (form, under, fit, z))
    return sorted(begun.values(), key=lambda start: space.score(start[2]))


def _once_more(space: Moves, objective: Objective, pi: PI, ends: Sequence[_End]) -> list[_Start]:
    """The best end of each form with usual effects that make it better, and with the torque over the angle that promises most.

    Wrong numbers of a form hide them: that torque may only be worth it with other numbers.
    """
    starts: list[_Start] = []
    both = len({end[0].predictor.closed for end in ends}) > 1  # else all were compared under one predictor
    for form in VARIANTS:
        best = min((end for end in ends if end[2] is form), key=lambda end: end[1], default=None)
        if best is not None:
            fit, under, z = with_usual_effects(space, objective, best[0]), _under(space, pi, form), best[3].at
            starts += [(form, under, fit, z)] * (len(fit.effects) > len(best[0].effects))
            starts += [(form, under, waved, z) for waved in with_wave(space, objective, fit)]
            if both:
                starts.append((form, under, _otherwise_predicted(space, best[0]), z))
    return starts


def _otherwise_predicted(space: Moves, fit: Fit) -> Fit:
    """The fit as led in the loop where the torque drives it, and as driven by the torque where it is led in the loop."""
    predictor = OpenLoop(space.data, fit.predictor.own_angle) if fit.predictor.closed else space.closed(fit.predictor)
    return replace(fit, hypothesis=fit.hypothesis.driven_by(predictor))


def _fitted(
    space: Moves, objective: Objective, beyond: float, variant: ControllerForm, under: UnderController, base: Fit, z: Vector
) -> _End | None:
    """(model, score, form, its numbers, their deviations) from one start; None where it diverges or ends at a bound.

    None also where its score stays too high to be followed (`beyond`).
    """
    end = under.fitted(space, objective, base, z, beyond)
    if end is None:
        return None
    z, found = end
    # Drives have a weight of 0, or zeros without damping: an end at 0 is a value.
    at_end = (z > under.high - NUMBER_STEP) | ((z < under.low + NUMBER_STEP) & (under.low != 0.0))
    if bool(at_end.any()):
        return None
    score = space.score(found) + cost_of(len(z), objective.information) + space.penalty
    return found, score, variant, replace(under.found(z), named=variant.named), under.deviations(objective, found, z)


def _finding(variant: ControllerForm, z: Vector, stds: Vector, gain: float, others: list[Text]) -> Finding:
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
