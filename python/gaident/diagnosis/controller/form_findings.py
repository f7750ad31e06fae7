"""The form of a controller that the logged torques show: as findings, and the records as that controller drives them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers
from gaident.control.pi import PI, bare_pi
from gaident.control.simplest import simplest
from gaident.data.record import Record
from gaident.diagnosis.controller.forms import Shown, form_shown
from gaident.diagnosis.controller.limit_not_given import left_by_a_limit
from gaident.diagnosis.controller.period_shown import FASTER, Period, period_shown
from gaident.diagnosis.controller.slow_forms import follow, run_error
from gaident.diagnosis.library.settings import ANTI_WINDUP, OF_SETTING
from gaident.identification.controller_numbers import Numbers, with_estimates
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.integral_schemes import scheme_shown
from gaident.identification.replay.replay import replay
from gaident.identification.replay.timed_record import plain_of
from gaident.models.drive_torque import driven_by
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["Driver", "Loop", "driver_of", "findings_of", "loop_of", "notes_of", "parts_of"]

UNITS = {
    "kp": "N m s/rad",
    "ki": "N m/rad",
    "inertia": "kg m^2",
    "torque": "N m",
    "time_constant": "s",
    "frequency": "Hz",
    "limit": "N m",
    "tracking_time": "s",
}
"""Of the findings' parameters; the others are numbers."""
RULES = {
    "backward": "a rectangular integral (backward)",
    "forward": "a rectangular integral that lacks the newest error (forward)",
}


@dataclass(frozen=True)
class Driver:
    """Records whose torque drives the model, because the logged torques show this controller; findings and notes on it.

    simulated: whether a simulated loop can have it; else its integral follows a law that no `PI` has.
    """

    records: tuple[Record, ...]
    validation: tuple[Record, ...]
    controller: Cascade
    findings: tuple[Finding, ...]
    notes: tuple[Text, ...]
    estimates: Mapping[str, Estimate]  # of gains that were not given
    found: FoundNumbers | None = None
    simulated: bool = True


def driver_of(
    records: Sequence[Record], validation: Sequence[Record], given: PI | None, unknown: tuple[str, ...] = ()
) -> Driver | None:
    """The controller that the logged torques show where a PI does not make them and nothing simple explains that; else None.

    unknown: gains of the PI that were not given but estimated.
    """
    if given is None or given.loop != "sampled" or any(r.torque is None or r.command is None for r in records):
        return None
    replays = [replay(r, given) for r in records]
    if all(r.follows or r.velocity_noise for r in replays) or any(r.cause not in ("", "initial_integral") for r in replays):
        return None
    shown = form_shown(records, given, tuple(name for name in unknown if name in ("kp", "ki")))
    if shown is None:
        return None
    driven, validation = (tuple(driven_by(r, shown.controller) for r in part) for part in (records, validation))
    said = findings_of(shown), notes_of(shown, records)
    return Driver(driven, validation, shown.controller, *said, _estimates(shown.estimated), shown.found)


@dataclass(frozen=True)
class Loop:
    """The controller that a diagnosis works with: the given one, with its numbers, or the one that a slower log shows.

    period_notes: on a sample time of it that was not given. found: its numbers that were not given, or differ.
    at_rate: whether the torque shows that the log has a line for each of its samples.
    simpler: the given one, or one that lacks a part of the form, from which a slow log's torque follows too, if not as closely.
    """

    controller: Controller | None
    numbers: Numbers
    findings: tuple[Finding, ...] = ()
    notes: tuple[Text, ...] = ()
    estimates: Mapping[str, Estimate] = field(default_factory=dict)
    period_notes: tuple[Text, ...] = ()
    found: FoundNumbers | None = None
    simpler: tuple[Loop, ...] = ()
    at_rate: bool = False


def loop_of(records: Sequence[Record], given: Controller | None) -> Loop:
    """The controller with estimates for what is None and, where a log has fewer lines than a bare PI in a Cascade has samples,
    in the form that the logged torque shows."""
    records = timed(records, given)
    if _noise_of_the_log(records, given) or _has_a_law(records, given):
        return replace(_loop_of(records, given), at_rate=True)
    period = period_shown(records, given)
    if period is None or period.controller is given:  # none, or no sure one
        period = _formed(records, given) or period
    found = _loop_of(records, given if period is None else period.controller)
    return found if period is None else replace(found, period_notes=(period.note,))


def _noise_of_the_log(records: Sequence[Record], given: Controller | None) -> bool:
    """Whether the torque of a bare PI follows from velocities off by white noise, where it does not from the logged ones.

    A form of controller, or a faster one, would fit that noise.
    """
    pi = bare_pi(given)
    if pi is None or pi.unknown or pi.loop != "sampled" or any(r.torque is None or r.command is None for r in records):
        return False
    replays = [replay(r, pi) for r in records]
    return not all(r.follows for r in replays) and all(r.follows or r.velocity_noise for r in replays)


def _has_a_law(records: Sequence[Record], given: Controller | None) -> bool:
    """Whether the integral of a bare PI follows a law, at the log's rate, that no `PI` has: the log has each of its samples."""
    pi = bare_pi(given)
    if pi is None or pi.unknown or pi.loop != "sampled" or any(r.torque is None for r in records):
        return False
    return scheme_shown(records, cascade_of(pi)) is not None


def _formed(records: Sequence[Record], given: Controller | None) -> Period | None:
    """A bare PI with a sample time that was not given, where only another form of it makes the logged torques, and a faster one.

    A form at the log's rate stands where none of a faster one leaves clearly less: a torque that follows to what its log could
    not tell may follow much closer with the right sample time.
    Other gains at the log's rate stand where none of a faster controller with the given ones comes as close, but for what each
    number has to take away: a rectangular integral of r samples to a line is, on the lines, one of kp + ki dt/(2 r).
    Of several sample times that of the fewest settings and, of these, the one that comes closest.
    """
    pi, dt = bare_pi(given), records[0].dt
    if (
        pi is None
        or pi.unknown
        or pi.loop != "sampled"
        or any(r.torque is None or r.command is None or r.dt != dt for r in records)
    ):
        return None
    unsaid = [(r, said) for r in records if (said := replay(r, pi)).follows is False]
    if not unsaid or any(said.cause not in ("", "gains") for _, said in unsaid):
        return None
    found = {every: shown for every in FASTER if (shown := form_shown(records, pi, (), every, between=False, most=1))}
    gains = [(r, said.controller) for r, said in unsaid if said.controller is not None and said.cause == "gains"]
    if len(gains) == len(unsaid):
        left = max(run_error([r], Cascade(c, dt)) / run_error([r], Cascade(pi, dt)) for r, c in gains)
        bare = {every: shown for every, shown in found.items() if not any(shown.numbers.values())}
        close = {every: shown for every, shown in bare.items() if POLICY.each_number * shown.rms < left * shown.before}
    elif gains:
        return None
    else:
        close = {every: shown for every, shown in found.items() if shown.rms < POLICY.replay_noise * shown.before}
        if close and (slow := form_shown(records, pi)) is not None:
            close = {every: shown for every, shown in close.items() if shown.rms < POLICY.each_number * slow.rms}
    if not close:
        return None
    every = min(close, key=lambda n: (len(close[n].numbers), close[n].rms))
    text = (
        "The logged {torque} follows from no form of this controller at the log's rate as from the one below, where that "
        "samples about {} times for each line: {:.4g} ms is taken for its sample time. Where that is not it, give period (s)."
    )
    return Period(Cascade(pi, period=dt / every), say(text, every, 1e3 * dt / every))


def _loop_of(records: Sequence[Record], given: Controller | None) -> Loop:
    """The same of a controller whose sample time is known."""
    numbers = with_estimates(records, given)
    numbers = replace(numbers, controller=simplest(numbers.controller, (r.dt for r in records)))
    as_given = Loop(numbers.controller, numbers, (), (), numbers.estimates, found=numbers.found)
    pi, every = _alone(numbers.controller, records)
    dt = records[0].dt
    if pi is None or every == 1 or any(r.torque is None or r.command is None for r in records):
        return as_given
    unknown = {f"velocity.{name}": name for name in ("kp", "ki")}
    # As they were logged: with another controller the torque may tell other times.
    shown = form_shown([plain_of(r) for r in records], pi, tuple(unknown[n] for n in numbers.estimates if n in unknown), every)
    if shown is None or (not numbers.estimates and left_by_a_limit(records, Cascade(pi, dt / every)) < shown.rms):
        return replace(as_given, numbers=numbers.trusted())  # or a single limit, which the simulated loop shows, explains more
    formed = [_shown_loop(one, numbers, records) for one in (shown, *shown.simpler)]
    as_it_is = not numbers.doubt and follow([plain_of(r) for r in records], Cascade(pi, dt / every))
    simpler = [replace(as_given, numbers=numbers.trusted())] if as_it_is else []
    return replace(formed[0], simpler=(*simpler, *formed[1:]))


def _shown_loop(shown: Shown, numbers: Numbers, records: Sequence[Record]) -> Loop:
    estimates = {f"velocity.{name}": e for name, e in _estimates(shown.estimated).items()}
    known = replace(numbers, doubt="")
    return Loop(shown.controller, known, findings_of(shown), notes_of(shown, records), estimates, found=shown.found)


def _alone(controller: Controller | None, records: Sequence[Record]) -> tuple[PI | None, int]:
    """(the PI of a cascade that has nothing else and no anti-windup, controller samples to a line of the log)."""
    if controller is None or len({r.dt for r in records}) > 1:
        return None, 1
    cascade = cascade_of(controller)
    pi = cascade.velocity
    bare = pi.bare and pi.integrator_limit is None and cascade == Cascade(pi, cascade.period)
    return (pi if bare else None), controller.log_every(records[0].dt)


def findings_of(shown: Shown) -> tuple[Finding, ...]:
    return tuple(
        Finding(name, _estimates(numbers), (), 0.0, max(shown.gains[name], 0.0), None, _evidence(shown, name), place="controller")
        for name, numbers in shown.numbers.items()
    )


def _evidence(shown: Shown, name: str) -> Text:
    if shown.gains[name] <= 0.0:  # another one comes a little closer, with more numbers
        text = (
            "The logged {torque} shows {}: of the controllers that leave no more than what the log lost between its lines it has "
            "the fewest numbers of its own. No model of the plant is involved."
        )
        return say(text, _part(shown, name))
    text = (
        "The logged {torque} shows {}: every controller without it is {:.0f} BIC units worse. No model of the plant is involved."
    )
    return say(text, _part(shown, name), shown.gains[name])


def _estimates(numbers: Mapping[str, tuple[float, float]]) -> dict[str, Estimate]:
    units = ((name, value, std, UNITS.get(name, "1")) for name, (value, std) in numbers.items())
    return {name: Estimate(value, std, unit, identifiable=std < abs(value) or value == 0.0) for name, value, std, unit in units}


def parts_of(shown: Shown) -> Text:
    """What differs from the bare PI."""
    return joined(", ", (_part(shown, name) for name in shown.numbers))


def _part(shown: Shown, name: str) -> Text:
    if name == "integration_rule":
        return Text(RULES[shown.controller.velocity.rule])
    if name == ANTI_WINDUP:
        return Text(_windup(shown.controller.velocity))
    numbers = ((key.replace("_", " "), value, _unit(key)) for key, (value, _) in shown.numbers[name].items())
    values = joined(", ", (say("{} {:.4g}{}", *number) for number in numbers))
    article = {"other_gains": "", "acceleration_feedforward": "an "}.get(name, "a ")
    return say("{}{} ({})", article, name.replace("_", " "), values)


def _windup(pi: PI) -> str:
    """What the integrator of a controller does at its torque limit."""
    if pi.anti_windup == "none":
        return "an integrator that winds up at the torque limit"
    does = {"hold": "held", "tracking": "set back"}[pi.anti_windup]
    how = repr(pi.anti_windup) if pi.tracking_time is None else f"{pi.anti_windup!r}, {1e3 * pi.tracking_time:.4g} ms"
    return f"an integrator that is {does} at the torque limit (anti-windup {how})"


def _unit(parameter: str) -> Text:
    return joined("", (" ", unit_text(UNITS[parameter]))) if parameter in UNITS else Text("")


def notes_of(shown: Shown, records: Sequence[Record]) -> tuple[Text, ...]:
    notes = [
        say(
            "The given gains alone do not make the logged {torque} (rms {:.2g} {N m}). A controller with {} does, "
            "to {:.1g} {N m} rms{}.",
            shown.before,
            parts_of(shown),
            shown.rms,
            say(": its {torque} drives the model") if shown.controller.period is None else "",
        )
    ]
    pi = shown.controller.velocity
    if OF_SETTING["torque_limit"] in shown.numbers and ANTI_WINDUP not in shown.numbers and pi.anti_windup != "none":
        notes.append(Text(f"With {_windup(pi)} the controller comes closest; the log hardly tells it from others."))
    if shown.rivals:
        others = "; ".join(" and ".join(name.replace("_", " ") for name in names) for names in shown.rivals)
        notes.append(Text(f"The log does not tell this from a controller with, instead: {others}."))
    highest = max(float(np.abs(r.torque).max()) for r in records if r.torque is not None)
    if shown.starts > POLICY.negligible * highest:
        notes.append(say("A record begins under load, with up to {:.4g} {N m} in the integrator.", shown.starts))
    return tuple(notes)
