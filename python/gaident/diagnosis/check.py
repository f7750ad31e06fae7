"""The check by a second method: the inverse-dynamics regression of the same records, and the force error on held-out data.

The regression needs no start, no simulation and no noise model, so that errors of a search do not reach it.
Its inertia, dry friction, gravity and stiffness to ground are compared with those of the diagnosis.
They contradict each other where

    |a - b| > check_deviations sqrt(s_a^2 + s_b^2),   |a - b| > check_share max(|a|, |b|),

and, for a torque, |a - b| > check_torque of the torque's rms.
The second and third say that the difference matters.

By its filter, by a torque held over each sample, and by what it has no term for (friction that falls with the speed), the
regression is off on the records of a right model too.
So all of it must hold for b - (c - a) as well, c what the regression says of records that the model itself made, under the same
torques. Then a note names both; where only the first line holds, it is a weaker sentence.

The force errors of both are compared by the same rule: a note says that the diagnosed model, a, loses where

    a - b > 0 beyond the variation over blocks of the held-out data,   a > loses b,   a - b > check_torque of the torque's rms.

A right model has a force error too, by the noise and by the filter: filtering takes from the motion what friction answers to at
a reversal, and what two masses do that hit each other.
The second part is the force error of the extended model on records that the model itself made, under the same torques.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, joined, say, unit_text
from gaident.data.record import Record
from gaident.diagnosis.gains import Gains, interval_of_fall, start_state
from gaident.diagnosis.inertia_and_angle import inertia_rests_on
from gaident.diagnosis.library.terms import LIBRARY, level_of
from gaident.errors import GaidentError
from gaident.estimation.dataset import DataSet
from gaident.estimation.regression.force_error import FilteredRecords, ForceError, band_of, effects_before_the_shaft, in_pieces
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.term import Term
from gaident.models.model import Model
from gaident.models.own_effects import OWN
from gaident.models.simulate import run
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.fitness import Comparison, Fitness
from gaident.results.inverse_dynamics import InverseDynamics
from gaident.show.wording import with_std

__all__ = ["Check", "checked"]

Vector = NDArray[np.float64]

Effects = Mapping[str, Mapping[str, Estimate]]

NONE = {"inertia": "kg m^2", "dry friction": "N m", "gravity": "N m", "ground stiffness": "N m/rad"}
"""What is compared, and its unit."""
LIKELY = {
    "inertia": "a delay between the channels of the log, a load that swings on its shaft, or a misfit that passed for noise",
    "dry friction": "friction that depends on load, angle or temperature, or a constant load or gravity that took its place",
    "gravity": "too little of a turn, so that a load, a spring or friction of two levels stands in its place",
    "ground stiffness": "gravity, or friction that returns with every stroke, in its place",
}
"""The likely reason of each contradiction, in words."""


@dataclass(frozen=True)
class Check:
    """The second method's answer: what it found, its force error [N m], the comparison, before and after with their force errors.

    regression_better: whether the regression leaves less torque, beyond the variation over blocks of the held-out data, than the
    model leaves beyond what noise and filter make of it.
    notes: contradictions, and on what the inertia rests, in words.
    reason: why the force error is the figure to go by on this axis, in words; empty where the free run is as good a figure.
    loses: whether the regression leaves far less, by more than `loses`, and that matters.
    """

    regression: InverseDynamics | None
    force_error: float | None
    comparisons: tuple[Comparison, ...]
    before: Fitness
    after: Fitness
    notes: tuple[Text, ...]
    reason: Text
    regression_better: bool = False
    loses: bool = False


def checked(data: DataSet, gains: Gains, model: Model, mechanics: Mapping[str, Estimate], effects: Effects) -> Check:
    """The check of a diagnosis.

    data: the records as they were fitted; model: the extended one; mechanics: name -> Estimate; effects: effect -> parameters.
    """
    # A logged angle gives the motion as it was, and not as old as the velocity.
    records, driven = [data.as_old(r) if r.position is None else r for r in data.records], data.open_runs
    nothing = Check(None, None, (), gains.before, gains.after, (), Text(""))
    if not all(r.torque is not None for r in records):
        return nothing
    found = _regression(records, model, data.axis)
    before, after, second, better = _forces(records, gains, found)
    if found is None:
        return replace(nothing, before=before, after=after, reason=_reason(effects, driven))
    rows = _compared(_said(found, records, _has_friction(effects)), mechanics, effects)
    asked = any(_surely(c, c.diagnosis) for c in rows)
    own = _of_own_records(found, model, records, _has_friction(effects)) if asked else {}
    ahead, torque, reach = bool(effects_before_the_shaft(model)), after.torque_rms or 0.0, 0.5 * float(np.ptp(data.angle))
    rows = [replace(c, of_model=own.get(c.name)) for c in rows]
    comparable = [c.of_model is not None or not ahead for c in rows]  # the regression knows no effect ahead of the shaft
    comparisons = tuple(replace(c, differs=b and _contradicts(c, torque, reach)) for b, c in zip(comparable, rows, strict=True))
    verdict = _verdict(after.force_error, second)
    notes = tuple(_sentence(c) for c in comparisons if c.differs)
    lost = _lost(after, second, better)
    notes = (*notes[:-1], joined("", (notes[-1], verdict))) if notes else lost
    notes = notes if ahead else (*notes, *_smaller(comparisons))
    if not any(c.name in ("gravity", "ground stiffness") and c.diagnosis.value != 0.0 for c in comparisons):
        notes += inertia_rests_on(found, records)
    return Check(found, second, comparisons, before, after, notes, _reason(effects, driven), better, bool(lost))


def _regression(records: Sequence[Record], model: Model, axis: str) -> InverseDynamics | None:
    """None where the records do not show one."""
    try:
        return inverse_dynamics(list(records), cutoff_hz=band_of(model, records, below=POLICY.rigid_band), axis=axis)
    except GaidentError:
        return None


def _forces(
    records: Sequence[Record], gains: Gains, found: InverseDynamics | None
) -> tuple[Fitness, Fitness, float | None, bool]:
    """(before, after, force error of the regression, whether that is less beyond its variation over blocks and the noise).

    All over the same samples of the held-out data, through the same filter.
    """
    given = [(r, first) for r, first in gains.scored if r.torque is not None]
    scored = given
    if len(given) < len(gains.scored):
        return gains.before, gains.after, None, False
    if not any(e.name in OWN or LIBRARY[e.name].later is not None for e in gains.extended.effects):  # none knows the time
        scored = [piece for r, first in scored for piece in in_pieces(r, first)]
    rows, firsts = [r for r, _ in scored], [first for _, first in scored]
    filtered = FilteredRecords(tuple(rows), tuple(firsts), band_of(gains.extended, [r for r, _ in given]))

    def of(model: Model | InverseDynamics) -> tuple[ForceError, list[Vector]] | None:
        try:
            torques = filtered.torques(model)
            error = filtered.force_error(model, torques)
        except GaidentError:
            return None
        return (error, [e for e, _ in torques]) if error.rms <= POLICY.diverged * error.torque_rms else None

    def fitness(plain: Fitness, found: tuple[ForceError, list[Vector]] | None) -> Fitness:
        if found is None:
            return plain
        error = found[0]
        return replace(plain, force_error=error.rms, torque_rms=error.torque_rms, force_floor=error.noise_floor)

    second = None
    if found is not None:
        try:
            fitted = found
            if any(first for _, first in given):  # not of what is held out
                part = [piece for r, first in given for piece, _ in in_pieces(r[:first], 0)]
                part = part[:: max(len(part) // max(len(given), POLICY.windows), 1)]
                fitted = inverse_dynamics(part, terms=found.terms, cutoff_hz=found.cutoff_hz, axis=found.axis)
            second = of(fitted)
        except GaidentError:
            second = None
    own, better = of(gains.extended), False
    if own is not None and second is not None and second[0].rms < own[0].rms:
        better = interval_of_fall(own[1], second[1])[0] > 0.0
    linear = own if gains.mechanism == gains.extended else of(gains.mechanism)
    before, after = fitness(gains.before, linear), fitness(gains.after, own)
    if after.force_floor is not None:
        after = replace(after, force_floor=math.hypot(after.force_floor, _of_the_filter(gains.extended, filtered)))
        better = (
            better and own is not None and second is not None and own[0].rms > math.hypot(after.force_floor or 0.0, second[0].rms)
        )
    return before, after, None if second is None else second[0].rms, better


def _of_the_filter(model: Model, filtered: FilteredRecords) -> float:
    """The force error of a model on records that it made itself [N m]; 0 where these miss the motion, and are others.

    The torques drive it, so that one that falls another way is no measure.
    Its effects of the angle turn with the logged one, where there is one, and so they do where its motion is judged.
    """
    made = _made(model, filtered.records)
    if made is None:
        return 0.0
    try:
        own = replace(filtered, records=made, angles=tuple(rec.position for rec in filtered.records))
        return own.force_error(model, own.torques(model)).rms
    except GaidentError:
        return 0.0


def _made(model: Model, records: Sequence[Record]) -> tuple[Record, ...] | None:
    """The records that the model makes under the same torques; None where these miss the motion, and are others."""
    made = []
    try:
        for rec in records:
            with np.errstate(over="ignore", invalid="ignore"):
                done = run(model, rec, None, start_state(model, rec, None))
            if not np.std(done.velocity - rec.velocity) < np.std(rec.velocity):
                return None
            made.append(rec.with_channels(velocity=done.velocity, position=None if rec.position is None else done.position))
    except GaidentError:
        return None
    return tuple(made)


def _compared(other: Mapping[str, Estimate], mechanics: Mapping[str, Estimate], effects: Effects) -> list[Comparison]:
    """What both have, not judged yet; other: what the regression says."""
    own = _of_diagnosis(mechanics, effects)
    both = [(name, own[name], other[name]) for name in NONE if name in own and name in other]
    return [Comparison(name, a, b, False) for name, a, b in both if not a.value == b.value == 0.0]


def _surely(c: Comparison, of_model: Estimate) -> bool:
    """Whether the regression says something else than this, beyond the deviations of both methods."""
    return abs(c.regression.value - of_model.value) > POLICY.check_deviations * math.hypot(c.diagnosis.std, c.regression.std)


def _contradicts(c: Comparison, torque: float, reach: float) -> bool:
    """Whether the two contradict each other; torque: its rms [N m]; reach: half the travel [rad], to which a spring is turned."""
    in_torque = {"N m": 1.0, "N m/rad": reach}.get(NONE[c.name], math.inf)  # an inertia counts whatever it accelerates

    def apart(of_model: Estimate) -> bool:
        a, b = of_model.value, c.regression.value
        matters = abs(a - b) > POLICY.check_share * max(abs(a), abs(b)) and abs(a - b) * in_torque > POLICY.check_torque * torque
        return matters and _surely(c, of_model)

    # What the regression did not find it cannot say of the model's records either: it has no term for it there.
    of_model = None if c.regression.value == 0.0 else c.of_model
    return apart(c.diagnosis) and (of_model is None or apart(of_model))


def _of_diagnosis(mechanics: Mapping[str, Estimate], effects: Effects) -> dict[str, Estimate]:
    found = {name: Estimate(0.0, 0.0, NONE[name]) for name in ("dry friction", "gravity", "ground stiffness")}
    found |= {name.replace("_", " "): e for name, e in mechanics.items() if name.replace("_", " ") in NONE}
    for effect, parameters in effects.items():
        term = LIBRARY[effect]
        elsewhere = found.get("dry friction")  # of both ends of the shaft the sum shows
        if term.levels and (term.time_varying or term.beside):  # no one number: it changes in time, or with the load
            found.pop("dry friction", None)
        elif term.levels and elsewhere is not None:
            here = level_of(parameters)
            found["dry friction"] = replace(here, value=here.value + elsewhere.value, std=math.hypot(here.std, elsewhere.std))
        elif _is_gravity(term):
            found["gravity"] = parameters["amplitude"]
    return found


def _has_friction(effects: Effects) -> bool:
    """Whether a diagnosis names dry friction."""
    return any(LIBRARY[effect].levels for effect in effects)


def _said(found: InverseDynamics, records: Sequence[Record], friction: bool) -> dict[str, Estimate]:
    """What the regression says of these records: by its terms, and of dry friction that is asked for and is none of them.

    Its filter may leave so little of a friction that the term is not chosen: that is no friction of 0 without a deviation.
    """
    rows = _of_regression(found)
    if not friction or "coulomb" in found.terms_not_tried or any("coulomb" in name for name in found.terms):
        return rows
    try:
        more = inverse_dynamics(
            list(records), terms=(*found.terms, "coulomb"), cutoff_hz=found.cutoff_hz, axis=found.axis
        ).parameters["coulomb"]
    except GaidentError:
        return rows
    return {**rows, "dry friction": replace(more, unit=NONE["dry friction"])}


def _of_regression(found: InverseDynamics) -> dict[str, Estimate]:
    """Without what it could not try, and without gravity or a spring where the other of the two stands.

    In the units of a rotary axis, as all of a diagnosis is until it is shown.
    """
    parameters = found.parameters
    rows = {"inertia": parameters["inertia"]}
    untold = found.terms_not_tried
    if any(name.startswith("coulomb") for name in parameters):
        rows["dry friction"] = level_of({name.replace("coulomb", "torque"): e for name, e in parameters.items()})
    elif "coulomb" not in untold:
        rows["dry friction"] = Estimate(0.0, 0.0, NONE["dry friction"])
    pair = {"gravity": "gravity_amplitude", "ground stiffness": "spring"}
    there = [name for name, key in pair.items() if key in parameters]
    for name, key in pair.items():
        if key in parameters:
            rows[name] = parameters[key]
        elif not there and {"gravity": "gravity", "ground stiffness": "spring"}[name] not in untold:
            rows[name] = Estimate(0.0, 0.0, NONE[name])
    return {name: replace(e, unit=NONE[name]) for name, e in rows.items()}


def _is_gravity(term: Term) -> bool:
    return term.harmonic == "torque" and term.orders == (1, 1)


def _verdict(own: float | None, second: float | None) -> Text:
    """Which of the two explains the held-out torque better, in words."""
    if own is None or second is None:
        return Text("")
    better = "the regression" if second < own else "the diagnosed model"
    if abs(own - second) < POLICY.check_share * max(own, second):
        return say(" On the held-out data both leave about the same of the {torque} ({:.3g} and {:.3g} {N m}).", second, own)
    text = " On the held-out data {} leaves less of the {torque}: {:.3g} {N m} the regression, {:.3g} {N m} the model."
    return say(text, better, second, own)


def _of_own_records(found: InverseDynamics, model: Model, records: Sequence[Record], friction: bool) -> dict[str, Estimate]:
    """What the regression says of records that the model itself made; empty where there are none.

    Not where a torque turns with a logged angle: in records of the model it turns with that angle, and its motion has another.
    """
    turning = any(r.position is not None for r in records) and any(e.row.turns for e in model.effects)
    if turning:
        return {}
    made = _made(model, records)
    if made is None:
        return {}
    try:
        own = inverse_dynamics(list(made), terms=found.terms, cutoff_hz=found.cutoff_hz, axis=found.axis)
        return _said(replace(own, terms_not_tried=found.terms_not_tried), made, friction)
    except GaidentError:
        return {}


def _smaller(comparisons: Sequence[Comparison]) -> tuple[Text, ...]:
    """Notes on differences that do not matter, but are sure, and more than what the regression says of the model itself."""
    told = [(c, c.of_model) for c in comparisons if c.of_model is not None and not c.differs and _surely(c, c.diagnosis)]
    return tuple(_smaller_sentence(c, e) for c, e in told if _surely(c, e))


def _deviations(c: Comparison) -> float:
    """By how many of both deviations the two are apart."""
    deviation = math.hypot(c.diagnosis.std, c.regression.std)
    return abs(c.regression.value - c.diagnosis.value) / deviation if deviation > 0.0 else 0.0


def _smaller_sentence(c: Comparison, own: Estimate) -> Text:
    mine, other = _both(c)
    text = (
        "{}, the inverse-dynamics regression of the same records {}: {}{:.3g} times both deviations together. Of "
        "records that the model itself made it says {} {}, so that its filter is not the reason."
    )
    share = 100.0 * abs(c.diagnosis.value - c.regression.value) / max(abs(c.diagnosis.value), abs(c.regression.value))
    apart = Text("") if c.diagnosis.value == 0.0 or c.regression.value == 0.0 else say("{:.2g} % apart, ", share)
    said = with_std(own.value, own.std)
    return say(text, mine.begun(), other, apart, _deviations(c), said, unit_text(own.unit))


def _both(c: Comparison) -> tuple[Text, Text]:
    """What each of the two says, in words."""
    a, b = (say("{} {}", with_std(e.value, e.std), unit_text(e.unit)) for e in (c.diagnosis, c.regression))
    name = say("{inertia}") if c.name == "inertia" else Text(c.name)
    mine = say("the diagnosis has no {}", name) if c.diagnosis.value == 0.0 else say("the {} of the diagnosis is {}", name, a)
    return mine, Text("finds none of it") if c.regression.value == 0.0 else say("says {}", b)


def _sentence(c: Comparison) -> Text:
    mine, other = _both(c)
    text = (
        "Two methods disagree: {}, the inverse-dynamics regression of the same records {}, which is more than both deviations. "
        "Likely: {}."
    )
    return say(text, mine, other, LIKELY[c.name])


def _lost(after: Fitness, second: float | None, better: bool) -> tuple[Text, ...]:
    """A note where the regression explains the held-out torque far better than the diagnosed model, and that matters.

    better: whether it does so beyond the variation over blocks of the held-out data.
    """
    own, torque = after.force_error, after.torque_rms or 0.0
    if own is None or second is None or not better or own < POLICY.loses * max(second, after.force_floor or 0.0):
        return ()
    if own - second < POLICY.check_torque * torque:
        return ()
    shares = [f"{100.0 * x / after.torque_rms:.3g} %" for x in (own, second)] if after.torque_rms else ["more", "less"]
    text = (
        "Two methods disagree: on the held-out data the diagnosed model leaves {} of the {torque}, the inverse-dynamics "
        "regression of the same records {}. Where the parameters differ, trust those of the regression."
    )
    return (say(text, *shares),)


def _reason(effects: Effects, driven: bool) -> Text:
    if any(_is_gravity(LIBRARY[e]) for e in effects):
        return Text("gravity acts on this axis, and a free run that is a little off falls to another side")
    if not driven:
        return Text("")
    return say("the {torque} drives the simulation, and a free run adds up what is small in every sample")
