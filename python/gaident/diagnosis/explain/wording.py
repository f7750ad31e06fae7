"""Findings, and the errors that decided, in one plain sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.axis import AXES, Text, called, joined, say
from gaident.control.found import FoundNumbers
from gaident.diagnosis.explain.ends import NO_ENDS, Ends
from gaident.diagnosis.library.sides import called_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.offset import Offset
from gaident.diagnosis.selection.select import Selection
from gaident.estimation.dataset import DataSet
from gaident.estimation.objective import Fit
from gaident.identification.notes import slower_than_the_loop
from gaident.models.effect_rows import by_wave, end_words
from gaident.models.effects import row_of
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate, of_axis
from gaident.results.finding import Finding

__all__ = [
    "ON_A_SPRING",
    "basis_of",
    "closer_numbers",
    "closest",
    "evidence_of",
    "far_off",
    "hidden_by_torque_noise",
    "like_filters",
    "not_borne_out",
    "of_the_mechanics",
    "or_other_form",
    "or_other_gains",
    "period_seen",
    "torque_unlogged",
    "two_resonances",
]


ON_A_SPRING = Text("The axis is on a spring to the ground: its tension where the record starts is part of the constant load.")


def evidence_of(
    effect: str,
    gain: float,
    alternatives: Sequence[str],
    offset: Offset | None = None,
    ends: Ends = NO_ENDS,
    known: tuple[Mapping[str, Estimate], NDArray[np.float64]] | None = None,
    left: bool = False,
) -> Text:
    """What speaks for a finding: what it does, where, how sure that is, what these data cannot tell from it.

    known: its parameters and the velocity of the records [rad/s], of which a drag's torque is said.
    left: whether something significant is left by the model that has it.
    """
    from gaident.show.wording import certainty

    what = row_of(effect).says.begun()
    if known is not None:
        what = say("{}{}", what, _orders(known[0]))
    if ends.apart:
        what = say("{}, {}", what, end_words(ends.sides))
    there = f", with it {end_words((ends.other,))} {ends.worse:.0f}" if ends.worse > 0.0 else ""
    doubtful = known is not None and (any(e.at_bound for e in known[0].values()) or not _clear(known[0]))
    sure, worse = certainty(gain, left or doubtful), f"(the model without it is {gain:.0f} BIC units worse{there})"
    if alternatives:
        others = joined(" or ", map(called, alternatives))
        return say("{}, or {}: one of these is there, {} {}; these data do not say which.", what, others, sure, worse)
    if offset is not None and effect == offset.effect:
        return say("{}: {} {}. {}", what, sure, worse, offset.sentence)
    return say("{}: {} {}.{}", what, sure, worse, "" if known is None else _at_speed(effect, *known))


def _clear(parameters: Mapping[str, Estimate]) -> bool:
    """Whether one of an effect's sizes is not 0 by its deviation: of the parameters in the unit of the first one."""
    known = [e for e in parameters.values() if e.std > 0.0 and e.unit == next(iter(parameters.values())).unit]
    return not known or any(abs(e.value) > POLICY.check_deviations * e.std for e in known)


def _orders(parameters: Mapping[str, Estimate]) -> Text | str:
    """The orders of an effect with several waves; empty for others."""
    orders = [wave["order"] for wave in by_wave(parameters) if "order" in wave]
    if len(orders) < 2:
        return ""
    said_on = {axis: [f"{of_axis('order', order, axis).value:.4g}" for order in orders] for axis in AXES}
    *first, last = map(Text, said_on["rotary"], said_on["linear"])
    return say(", here n = {} and {}", joined(", ", first), last)


def _at_speed(effect: str, parameters: Mapping[str, Estimate], velocity: NDArray[np.float64]) -> Text | str:
    """What a drag makes at the largest speed of the records, velocity [rad/s]; empty for other effects."""
    curve = LIBRARY[effect].curve
    if curve is None or LIBRARY[effect].levels or LIBRARY[effect].constant:
        return ""
    top = float(np.max(np.abs(velocity)))
    torque = abs(float(curve(np.array([top]), {name: e.value for name, e in parameters.items()})[0]))
    return say(" At the largest speed of the records, {:.3g} {rad/s}, it makes {:.3g} {N m}.", top, torque)


def basis_of(found: Selection, left: bool) -> list[Text]:
    """Which errors the parameters rest on, where these are not whitened ones or the specification test speaks against them.

    left: whether something significant depends on a signal, as the verdict says.
    """
    test = found.specification
    if test is None:  # a measured torque, as the user says
        return []
    if test.contradicts:
        if found.space.whitens:
            meant = "the standard deviations of the parameters are too small"
        else:
            meant = "the parameters are those of least output error, not those that leave white noise"
        text = "What the model leaves is no stationary noise (specification test {:.0f}, bound {:.0f}): {}."
        return [say(text, test.statistic, test.bound, meant)]
    if found.space.whitens:
        return []
    before = found.whitened
    if before is not None and not before.space.is_noise(before.final):
        depends = "" if left else ", but depends on no signal of these records beyond chance"
        return [Text(f"What the model leaves is more than noise{depends}: the parameters are those of least output error.")]
    return [Text("A noise model would take a cause for noise here: the parameters are those of least output error.")]


def two_resonances(final: Fit) -> list[Text]:
    """Note on an extra resonance beside a shaft: either pair of poles may be the shaft's, and the model is the same."""
    if final.parameters.masses == 1 or not any(t.resonates for t in final.parameters.terms):
        return []
    text = (
        "No record of the motor's signals tells which of two resonances is that of the shaft and which the extra one: {inertia} "
        "of motor and of load, stiffness and damping of the shaft are those of one choice. "
        "The model, and {inertia} of the whole, are the same with the other."
    )
    return [say(text)]


def not_borne_out(named: Sequence[Finding], kept: Sequence[Finding]) -> Text:
    """Note on what the torque alone shows of the controller, and the model of the axis does not."""
    lost = [f.effect for f in named if f.effect not in {k.effect for k in kept}] or [f.effect for f in named]
    text = (
        "From the logged {torque} alone another controller came closer ({}), as what the log lost between its lines can look "
        "like that: no model of the axis leaves noise under it, or as little; one does under the controller that is used."
    )
    return say(text, joined(" and ", map(called, lost)))


def closest(effects: Sequence[str], driver: str | None, named: bool) -> Text:
    """Note on effects that fit best but are not named; driver: what the error that they leave depends on, if it shows.

    named: whether other causes are named.
    """
    on = "" if driver is None else say(" that depends on {}", called(driver))
    if named:
        text = "With {} the model would come closer still, but an error{} stays: this fits no effect of the library."
    else:
        text = "The closest description is {}, but it leaves an error{}: no effect of the library fits, so none is named."
    return say(text, joined(" and ", map(called_of, effects)), on)


def far_off(ratio: float) -> Text:
    """Note on a free run that misses the velocity by `ratio` times its noise."""
    text = (
        "The free run misses the velocity by {:.0f} times its noise. In these data that passes for a {torque} disturbance, but "
        "is far too large for noise: a controller or a limit that is not the one given here, or a load that changes in time."
    )
    return say(text, ratio)


def hidden_by_torque_noise(floor: float) -> Text:
    """Note on the rms error [rad/s] that the noise of a measured torque makes in the free run: smaller effects do not show."""
    text = (
        "The noise of the measured {torque} by itself lets a free run miss the velocity by about {:.2g} {rad/s}: "
        "an effect that moves it by much less does not show in these data."
    )
    return say(text, floor)


def _drives_itself(mechanics: Mapping[str, Estimate]) -> list[Text]:
    """Note on a negative viscous friction."""
    damping = mechanics.get("viscous_friction")
    if damping is None or damping.value >= -POLICY.contradiction * damping.std:
        return []
    text = (
        "The viscous friction comes out negative ({:.2g} {N m s/rad}), which no axis has: friction that falls with the speed or "
        "does not depend on it, or a lag, is in its place. {Inertia} and friction are not to be trusted."
    )
    return [say(text, damping.value)]


def _swings_up(mechanics: Mapping[str, Estimate]) -> list[Text]:
    """Notes on a pair of poles or zeros with a negative damping, which no shaft and no load has."""
    text = (
        "The {} has a damping ratio of {:.2g}, below 0 beyond its deviation; no shaft and no load has that. The pair stands for "
        "something else: load {inertia} and stiffness are not to be trusted."
    )
    pairs = (Text("resonance"), Text("antiresonance"))
    found = ((pair, mechanics.get(f"{pair}_damping")) for pair in pairs)
    return [say(text, pair, e.value) for pair, e in found if e is not None and e.value < -POLICY.contradiction * e.std]


def of_the_mechanics(mechanics: Mapping[str, Estimate], ages: Mapping[str, float], data: DataSet, left_open: bool) -> list[Text]:
    """Notes on what was estimated of the mechanism.

    ages: name -> the part of its deviation that the age of the velocity makes; left_open: whether the controller was given with
    numbers that are not known.
    """
    inertia = mechanics.get("inertia")
    slow = slower_than_the_loop(None if inertia is None else inertia.value, data.controller, data.dt)
    return _drives_itself(mechanics) + _swings_up(mechanics) + slow + _of_the_controller(mechanics, ages, data, left_open)


def torque_unlogged(data: DataSet) -> list[Text]:
    """Note on records without a torque: the given gains alone say which torque drove the motor."""
    if data.controller is None or any(r.torque is not None for r in data.read):
        return []
    text = (
        "No {torque} is logged: the given gains make it of command and velocity. Where both are wrong by one factor, every "
        "{inertia} and {torque} found here is wrong by that factor, and nothing shows it: log the {torque}."
    )
    return [say(text)]


def like_filters(data: DataSet, series: Sequence[str]) -> list[Text]:
    """Note on several effects in series, where no torque is logged: filters of a controller look like them."""
    if len(series) < 2 or not torque_unlogged(data):  # no decision: a current loop alone is usual
        return []
    text = (
        "No {torque} is logged, and the model needs {} in series. Filters of the controller, or a command weight, look like that "
        "and change {inertia} and friction: neither is proven. Log the {torque}, which shows what the controller does."
    )
    return [say(text, joined(" and ", [called(name) for name in series]))]


def period_seen(data: DataSet) -> list[Text]:
    """Note on a pitch of a linear axis that was not given and that the records show."""
    if not data.period_seen or data.period is None:
        return []
    text = (
        "No pitch is given, and the {torque} returns with every {:.6g} mm of the path: this was taken for it. Where it is that "
        "of the screw or of the poles, give it; orders are then exact."
    )
    return [say(text, 1e3 * data.period)]


def or_other_gains(effect: str) -> Text:
    """Note on a finding where other gains would explain as much."""
    text = "Other gains than the given ones would explain these records as well as the {}: log the {torque}, it shows the gains."
    return say(text, called_of(effect))


def or_other_form(words: Text) -> Text:
    """Note on another form of controller that comes closer, but does not explain the records either.

    words: what that controller has.
    """
    text = (
        "No {torque} is logged; a controller with {}, which the given one has not, would come closer to these records, but does "
        "not explain them by itself: {inertia} and causes are not to be trusted. Log the {torque}, it shows what the controller "
        "does."
    )
    return say(text, words)


def closer_numbers(torque: FoundNumbers, model: FoundNumbers) -> Text:
    """Note on numbers of the controller that the torque had shown and that the model of the axis changed."""
    if torque.covariance is None:  # no torque is logged
        return Text(
            "The model of the axis with its causes shows the controller's numbers closer than the one without: they were moved."
        )
    text = (
        "The model of the axis shows the controller's numbers closer than the {torque} alone: they were moved by up to {:.1f} of "
        "the deviations with which that shows them."
    )
    return say(text, float(np.abs(model.deviations_off).max(initial=0.0)))


def _of_the_controller(
    mechanics: Mapping[str, Estimate], ages: Mapping[str, float], data: DataSet, left_open: bool
) -> list[Text]:
    """What is said where most of the deviations of the mechanics comes from what the records had to show beside them.

    That is numbers of the controller, or how old the velocity is against the torque.
    """
    # no decision: a formula: more than half of a variance
    mostly = [name for name, e in mechanics.items() if 2.0 * e.of_controller**2 > e.std**2 > 0.0]
    # no decision: a formula: more than half of a variance
    by_age = [name for name in mostly if 2.0 * ages.get(name, 0.0) ** 2 > mechanics[name].of_controller ** 2]
    by_numbers = [name for name in mostly if name not in by_age]
    numbers = (
        "the numbers of the controller that were left open: give them."
        if left_open
        else "the numbers of the controller, which as given do not fit these records and were estimated: give those of the drive."
    )
    age = say("the age of the velocity against the {torque}, which these records do not show: {}.", _shows_the_age(data))
    text = "Most of the deviation of {} comes from {}"
    return [
        say(text, joined(", ", (Text(name.replace("_", " ")) for name in names)), why)
        for names, why in ((by_numbers, numbers), (by_age, age))
        if names
    ]


def _shows_the_age(data: DataSet) -> Text:
    """What to give or to log, so that the age of the velocity is known."""
    if data.controller is not None and not data.clocked:
        return Text("give the period of the controller, or log every one of its samples")
    if not data.known_between:
        return say("give the controller that makes this {torque}, or log every one of its samples")
    return say("log the encoder's {angle} too, at every sample of the controller")
