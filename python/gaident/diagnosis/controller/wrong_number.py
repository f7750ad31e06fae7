"""A given controller with one wrong number, which the logged torque shows: as a finding of place "controller".

Or with another rule of its integral, where the log does not tell rules apart and what a model of the axis leaves does.
On the lines of a slow log a rectangular integral is a trapezoidal one with kp +- ki T/2, T the controller's sample time.
That is often less than the torque is known by: behind a filter, which was found, or beside the noise of a measured torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gaident.axis import say
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers
from gaident.control.pi import RULES
from gaident.data.record import Record
from gaident.diagnosis.controller.form_findings import Driver
from gaident.diagnosis.controller.slow_forms import follow, run_error
from gaident.estimation.criterion import gained
from gaident.identification.logged_stretches import centred, correlation, log_of, numbered, whitened
from gaident.identification.logged_torque import Corrected
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["OtherRule", "closer_form", "other_rules", "with_findings", "wrong_numbers"]

Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]

PLACES: Mapping[str, tuple[str, str]] = {
    "velocity.kp": ("other_gains", "kp"),
    "velocity.ki": ("other_gains", "ki"),
    "position.gain": ("other_gains", "position_gain"),
    "velocity_feedforward": ("velocity_feedforward", "share"),
    "acceleration_feedforward": ("acceleration_feedforward", "inertia"),
    "friction_feedforward": ("friction_feedforward", "torque"),
}
"""Name of a number (`Controller.unknown`) -> (finding, parameter)."""


def _place(name: str) -> tuple[str, str]:
    """(finding, parameter) of a number by its name; of a filter of the command, whichever of them it is."""
    return ("command_filter", "time_constant") if name.startswith("command_filters[") else PLACES[name]


def closer_form(records: Sequence[Record], form: Driver | None, other: Corrected | None) -> Driver | None:
    """The form that the torques show of a given controller, where it leaves clearly less of them than another number does."""
    if form is None or other is None:
        return form
    left, with_number = (run_error(records, cascade_of(c)) for c in (form.controller, other.controller))
    return form if left < POLICY.each_number * with_number else None


@dataclass(frozen=True)
class OtherRule:
    """A controller with another rule of its integral, its numbers that were found anew, and the finding of it."""

    controller: Controller
    found: FoundNumbers | None
    finding: Finding


def other_rules(records: Sequence[Record], controller: Controller, found: FoundNumbers | None) -> list[OtherRule]:
    """The controller of a slow log with each other rule with which the torques follow too, the closest first.

    found: its numbers that the torques show; they are fitted to the torques again with each rule. None where one of them is kp.
    """
    given = cascade_of(controller)
    if not given.velocity.ki or not follow(records, given) or (found is not None and _moves_kp(found)):
        return []
    others = []
    for rule in (rule for rule in RULES if rule != given.velocity.rule):
        numbers = None if found is None else _closest(records, found.then(partial(_ruled, rule=rule)))
        one = _ruled(given, rule) if numbers is None else numbers.controller
        if one is not None and follow(records, cascade_of(one)):
            text = (
                "The logged {torque} follows with the rule {} of the integral, as with {}, and with it a model of the axis "
                "leaves noise."
            )
            finding = Finding(
                "integration_rule", {}, (), 0.0, 0.0, None, say(text, repr(rule), repr(given.velocity.rule)), place="controller"
            )
            others.append((run_error(records, cascade_of(one)), OtherRule(one, numbers, finding)))
    return [one for _, one in sorted(others, key=lambda pair: pair[0])]


def _ruled(controller: Controller, rule: str) -> Cascade:
    cascade = cascade_of(controller)
    return replace(cascade, velocity=replace(cascade.velocity, rule=rule))


def _moves_kp(found: FoundNumbers) -> bool:
    kp = [cascade_of(one).velocity.kp for d in found.directions if (one := found.moved(d).controller) is not None]
    return any(value != cascade_of(found.made(found.at)).velocity.kp for value in kp)


def _closest(records: Sequence[Record], found: FoundNumbers) -> FoundNumbers:
    """The numbers with which the made torques come closest to the logged ones, without their correlation from line to line."""
    from scipy.optimize import least_squares

    def left(by: Vector, rho: float) -> Vector:
        one = found.moved(by @ found.directions).controller
        if one is None:
            return np.full(count, np.inf)
        off, stretch = _left(records, cascade_of(one))
        return centred(*whitened(off, stretch, rho), False)

    if not len(found.directions):
        return found
    off, stretch = _left(records, cascade_of(found.made(found.at)))
    rho = correlation(off, stretch)
    count = len(whitened(off, stretch, rho)[0])
    best = least_squares(left, np.zeros(len(found.directions)), args=(rho,))
    return found.moved(best.x @ found.directions)


def _left(records: Sequence[Record], cascade: Cascade) -> tuple[Vector, NDArray[np.intp]]:
    """(logged minus made torque [N m] at the lines of all records, their stretches)."""
    logs = [log_of(r, len(r), cascade, cascade.velocity.anti_windup == "none") for r in records]
    return np.concatenate([log.torque - log.made(cascade) for log in logs]), numbered([log.stretch for log in logs])


def wrong_numbers(records: Sequence[Record], given: Controller, other: Corrected) -> tuple[Finding, ...]:
    """What differs from the given controller; nothing where only the way of its command between the lines does."""
    before, after = (_error(records, c) for c in (given, other.controller))
    n = sum(len(r) for r in records)
    rule = cascade_of(given).velocity.rule != cascade_of(other.controller).velocity.rule
    by_finding: dict[str, dict[str, Estimate]] = {"integration_rule": {}} if rule else {}
    for name, estimate in other.estimates.items():
        finding, parameter = _place(name)
        by_finding.setdefault(finding, {})[parameter] = estimate
    return tuple(
        Finding(name, numbers, (), 0.0, gained(before, after, n, len(numbers)), None, other.note, place="controller")
        for name, numbers in by_finding.items()
    )


def with_findings(other: Corrected) -> Corrected:
    """The same with its numbers under the names of their findings, too: where they move, the findings do."""
    found = other.found
    if found is None or found.named is None:
        return other
    named = found.named

    def also(at: Vector, spread: Matrix) -> dict[str, Mapping[str, tuple[float, float]]]:
        all_named: dict[str, Mapping[str, tuple[float, float]]] = dict(named(at, spread))
        for name, pair in all_named.get("", {}).items():
            finding, parameter = _place(name)
            all_named[finding] = {**all_named.get(finding, {}), parameter: pair}
        return all_named

    return other._replace(found=replace(found, named=also))


def _error(records: Sequence[Record], controller: Controller) -> float:
    """Squared error of the made torques [(N m)^2]."""
    cascade: Cascade = cascade_of(controller)
    return sum(len(r) for r in records) * run_error(records, cascade) ** 2
