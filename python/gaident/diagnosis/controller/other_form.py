"""The form that the logged torques show of a velocity controller that was given with more than its gains, and is not the drive's.

The search is that of a bare PI with the same gains: what else was given is left out of it.
Findings are what differs from the given controller.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from gaident.axis import Text, joined, say
from gaident.control.cascade import Cascade, Filter, cascade_of
from gaident.control.controller import Controller
from gaident.control.filters import LowPass
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.controller.form import FILTER_NAMES
from gaident.diagnosis.controller.form_findings import Driver, findings_of, notes_of, parts_of
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.identification.logged_torque import not_followed
from gaident.models.drive_torque import driven_by
from gaident.policy.table import POLICY

__all__ = ["other_form"]


def other_form(records: Sequence[Record], validation: Sequence[Record], given: Controller) -> Driver | None:
    """The form in which a log slower than the given velocity controller shows it; None where no form makes the torques.

    records, validation: as they were given.
    """
    cascade = cascade_of(given)
    pi = PI(kp=cascade.velocity.kp, ki=cascade.velocity.ki)
    every = {given.log_every(r.dt) for r in (*records, *validation)}
    bare = Cascade(pi, cascade.period, delay=cascade.delay)
    lacking = cascade.position is not None or any(r.torque is None or r.command is None for r in records)
    if lacking or cascade == bare or len(every) > 1 or every == {1}:
        return None
    shown = form_shown(records, pi, (), max(every))
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
