"""A given controller with one wrong number, which the logged torque shows: as a finding of place "controller"."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.diagnosis.controller.form_findings import Driver
from gaident.diagnosis.controller.slow_forms import run_error
from gaident.estimation.criterion import gained
from gaident.identification.logged_torque import Corrected
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["closer_form", "with_findings", "wrong_numbers"]

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


def closer_form(records: Sequence[Record], form: Driver | None, other: Corrected | None) -> Driver | None:
    """The form that the torques show of a given controller, where it leaves clearly less of them than another number does."""
    if form is None or other is None:
        return form
    left, with_number = (run_error(records, cascade_of(c)) for c in (form.controller, other.controller))
    return form if left < POLICY.each_number * with_number else None


def wrong_numbers(records: Sequence[Record], given: Controller, other: Corrected) -> tuple[Finding, ...]:
    """What differs from the given controller; nothing where only the way of its command between the lines does."""
    before, after = (_error(records, c) for c in (given, other.controller))
    n = sum(len(r) for r in records)
    rule = cascade_of(given).velocity.rule != cascade_of(other.controller).velocity.rule
    by_finding: dict[str, dict[str, Estimate]] = {"integration_rule": {}} if rule else {}
    for name, estimate in other.estimates.items():
        finding, parameter = PLACES[name]
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
            finding, parameter = PLACES[name]
            all_named[finding] = {**all_named.get(finding, {}), parameter: pair}
        return all_named

    return other._replace(found=replace(found, named=also))


def _error(records: Sequence[Record], controller: Controller) -> float:
    """Squared error of the made torques [(N m)^2]."""
    cascade: Cascade = cascade_of(controller)
    return sum(len(r) for r in records) * run_error(records, cascade) ** 2
