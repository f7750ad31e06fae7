"""The form that the logged torques show of a velocity controller that was given with more than its gains, and is not the drive's.

The search is that of a PI with the same gains and rule: what else was given is left out of it.
Findings are what differs from the given controller.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from gaident.axis import Text, joined, say
from gaident.control.cascade import Cascade, Filter, cascade_of
from gaident.control.controller import Controller
from gaident.control.filters import LowPass
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.controller.form import FEEDS, FILTER_NAMES
from gaident.diagnosis.controller.form_findings import Driver, findings_of, notes_of, parts_of
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.controller.slow_forms import torque_spread
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.estimation.criterion import gained
from gaident.identification.logged_torque import comparable, not_followed
from gaident.identification.replay.integral_schemes import DEAD_BAND, DECAY, RESET, scheme_shown
from gaident.models.drive_torque import driven_by, straight_driven
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["other_form", "other_scheme"]

SCHEMES = {
    DECAY: (ANTI_WINDUP, "kept", "1", "its integral keeps the share {:.4g} in each sample at the {torque} limit{}"),
    DEAD_BAND: ("error_dead_band", "width", "rad/s", "a control error within {:.4g} {rad/s} counts as 0{}"),
    RESET: ("integral_reset", "", "", "its integral begins at 0 wherever {}"),
}
"""Kind of a law -> (finding, parameter, its unit, words)."""
HELD = "its integral stays as it is in each sample at the {torque} limit"
OF_VARIANT = {
    "": "",
    "whole": "",
    "beyond": ", and a larger one by what it is beyond that",
    "command reverses": "the command changes its sign",
    "command is 0": "the command is 0",
    "error reverses": "the control error changes its sign",
}


def other_form(records: Sequence[Record], validation: Sequence[Record], given: Controller) -> Driver | None:
    """The form in which a log slower than the given velocity controller shows it; None where no form makes the torques.

    records, validation: as they were given.
    """
    cascade = cascade_of(given)
    pi = PI(kp=cascade.velocity.kp, ki=cascade.velocity.ki, rule=cascade.velocity.rule)
    none: dict[str, Any] = dict.fromkeys(FILTER_NAMES, ())
    around = None if cascade.position is None else replace(cascade, velocity=pi, period=None, delay=0.0, **none)
    every = {given.log_every(r.dt) for r in (*records, *validation)}
    bare = replace(around or Cascade(pi), period=cascade.period, delay=cascade.delay)
    lacking = any(getattr(r, channel) is None for r in records for channel in ("torque", *cascade.reads))
    searched = around is None and cascade == replace(bare, velocity=replace(pi, rule="trapezoidal"))  # as a bare PI, before
    if lacking or searched or len(every) > 1 or every == {1}:
        return None
    shown = form_shown(records, pi, (), max(every), around=around)
    if shown is None and not_followed(records, bare):
        return None
    found = bare if shown is None else replace(shown.controller, delay=cascade.delay)
    if not_followed(records, found):
        return None
    whole = shown
    if shown is not None:
        differs = {name: x for name, x in shown.numbers.items() if _differs(name, found, cascade, x)}
        shown = replace(shown, numbers=differs)
    findings = () if shown is None else findings_of(shown)
    words = (
        "The logged {torque} does not follow from the given controller, but from one with the same gains{}{}: this one is used."
    )
    absent = _left_out(found, cascade)
    without = say(" without its {}", joined(", ", [Text(name) for name in absent])) if absent else ""
    beside = say("{} with {}", " and" if absent else "", parts_of(shown)) if shown is not None and shown.numbers else ""
    notes = (say(words, without, beside), *(() if whole is None else notes_of(whole, records)[1:]))
    driven, later = (tuple(driven_by(r, found) for r in part) for part in (records, validation))
    numbers = None if shown is None else shown.found.then(lambda one: replace(cascade_of(one), delay=cascade.delay))
    return Driver(driven, later, found, findings, notes, {}, numbers)


def other_scheme(
    records: Sequence[Record], validation: Sequence[Record], given: Controller, findings: Sequence[Finding]
) -> Driver | None:
    """The law of its integral that no `PI` has, where the torques follow from it alone; else None.

    records, validation: as they were given. findings: of the controller's form, which `given` is already.
    """
    cascade = cascade_of(given)
    shown = scheme_shown(records, cascade)
    if shown is None:
        return None
    scheme, pi, limit = shown.scheme, shown.controller.velocity, shown.controller.velocity.torque_limit
    name, parameter, unit, words = SCHEMES[scheme.kind]
    law = say(words, *(() if scheme.kind == RESET else (scheme.number,)), OF_VARIANT[scheme.variant])
    if scheme.kind == DECAY and scheme.number == 1.0:
        law = say(HELD)
    text = (
        "The logged {torque} does not follow from the given controller (rms {:.2g} {N m}), but where {} (to {:.2g} {N m} rms). "
        "No model of the plant is involved."
    )
    if shown.closer:
        text = (
            "The logged {torque} follows from an integral that is held at the limit (rms {:.2g} {N m}), and closer where "
            "{} (to {:.2g} {N m} rms). No model of the plant is involved."
        )
    evidence = say(text, shown.before, law, shown.left)
    gain = gained(shown.samples * shown.before**2, shown.samples * shown.left**2, shown.samples, 1)
    numbers = {parameter: Estimate(scheme.number, shown.std, unit)} if parameter else {}
    kept = [f for f in findings if f.effect != ANTI_WINDUP]
    has = {f.effect for f in kept}
    if pi.rule != cascade.velocity.rule and "integration_rule" not in has:
        kept.append(Finding("integration_rule", {}, (), 0.0, 0.0, None, evidence, place="controller"))
    if limit is not None and limit != cascade.velocity.torque_limit and OF_SETTING["torque_limit"] not in has:
        at_limit = {"limit": Estimate(limit, torque_spread(records, limit), "N m")}
        kept.append(Finding(OF_SETTING["torque_limit"], at_limit, (), 0.0, gain, None, evidence, place="controller"))
    new = Finding(name, numbers, (), 0.0, gain, None, evidence, place="controller")

    slower = any(shown.controller.log_every(r.dt) > 1 for r in records)

    def driven(rec: Record) -> Record:
        if not slower:
            return driven_by(rec, shown.controller)
        if not comparable(rec, shown.controller):
            return straight_driven(rec, shown.controller)
        return driven_by(rec, shown.controller, shown.made(rec))

    driving, later = (tuple(map(driven, part)) for part in (records, validation))
    drives = "{torque} that it makes between the lines" if slower else "logged {torque}"
    notes = (evidence, say("No simulated loop has this law: the " + drives + " drives the models."))
    return Driver(driving, later, shown.controller, (*kept, new), notes, {}, None, simulated=False)


def _differs(name: str, found: Cascade, given: Cascade, numbers: Mapping[str, tuple[float, float]]) -> bool:
    """Whether a part of the found controller is not that of the given one; numbers: it, with their deviations."""
    here, there = found.velocity, given.velocity
    if name == "integration_rule":
        return here.rule != there.rule
    if name == "command_weight":
        return not _same(here.command_weight, there.command_weight)
    if name == ANTI_WINDUP:
        time, std = numbers.get("tracking_time", (0.0, 0.0))
        given_time = there.tracking_time or 0.0
        same = _same(time, given_time) or abs(time - given_time) <= POLICY.check_deviations * std
        return here.anti_windup != there.anti_windup or not same
    if name == OF_SETTING["torque_limit"]:
        return not _same(here.limits[0], there.limits[0])
    if name in FEEDS:
        return not _same(getattr(found, name), getattr(given, name))
    place = next((place for place, finding in FILTER_NAMES.items() if finding == name), "")
    if place:
        return not _same_filters(getattr(found, place), getattr(given, place))
    return True


def _left_out(found: Cascade, given: Cascade) -> list[str]:
    """What the given controller has and the found one has not, in words of the findings."""
    filters = [place for place in FILTER_NAMES if getattr(given, place) and not getattr(found, place)]
    windup = found.velocity.anti_windup == "none" != given.velocity.anti_windup
    return [*(FILTER_NAMES[place].replace("_", " ") for place in filters), *(["anti-windup"] if windup else [])]


def _same_filters(found: Sequence[Filter], given: Sequence[Filter]) -> bool:
    if [type(f) for f in found] != [type(f) for f in given]:
        return False
    return all(_same(_place_of(a), _place_of(b)) for a, b in zip(found, given, strict=True))


def _place_of(f: Filter) -> float:
    """What says where a filter acts: time constant [s] or frequency [Hz]."""
    value = f.time_constant if isinstance(f, LowPass) else f.frequency
    assert value is not None
    return float(value)


def _same(found: float, given: float) -> bool:
    return found == given or abs(found - given) <= POLICY.same_gains * max(abs(found), abs(given))
