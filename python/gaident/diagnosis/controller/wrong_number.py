"""Which number of a given controller is not the drive's: with which other one does the logged torque follow.

One number at a time is estimated from command, measured signals and torque, as one that is not known; no plant is involved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import FEEDFORWARDS, Cascade, P, cascade_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.logged_torque import not_followed
from gaident.models.drive_torque import torque_driven
from gaident.results.estimate import Estimate

__all__ = ["Corrected", "corrected"]


class Corrected(NamedTuple):
    """The controller with another number, the estimate of it, and a sentence on that."""

    controller: Controller
    estimates: Mapping[str, Estimate]
    note: Text


def corrected(records: Sequence[Record], controller: Controller) -> Corrected | None:
    """The one number with which the torque of all records follows; None where there is none, or several are as good."""
    cascade, found = cascade_of(controller), []
    for given, one in _with_one_open(cascade):
        try:
            numbers = with_estimates(records, one)
        except GaidentError:  # the records lack what shows it
            continue
        if numbers.controller is None or numbers.doubt or _doubts(records, numbers.controller):
            continue
        values = [_value(name, e) for name, e in numbers.estimates.items()]
        text = "With {} (given: {}) it does: all simulations use this."
        found.append(Corrected(numbers.controller, numbers.estimates, say(text, joined(" and ", values), given)))
    return found[0] if len(found) == 1 else None


def _value(name: str, e: Estimate) -> Text:
    """ "position gain 40 1/s" of "position.gain", "kp 0.02 N m s/rad" of "velocity.kp"."""
    words = name.removeprefix("velocity.").replace(".", " ").replace("_", " ")
    return say("{} {:.4g}", words, e.value) if e.unit == "1" else say("{} {:.4g} {}", words, e.value, unit_text(e.unit))


def _doubts(records: Sequence[Record], controller: Controller | None) -> tuple[Text, ...]:
    return (*torque_driven(records, controller).doubts, *not_followed(records, controller))


def _with_one_open(cascade: Cascade) -> Iterator[tuple[Text, Cascade]]:
    """(what was given, the cascade with it as None)."""
    unknown: dict[str, Any] = {"kp": None, "ki": None}
    pi = cascade.velocity
    yield say("{:.4g} and {:.4g}", pi.kp, pi.ki), replace(cascade, velocity=replace(pi, **unknown))
    if cascade.position is not None:
        yield say("{:.4g}", cascade.position.gain), replace(cascade, position=P(None))
    for name in FEEDFORWARDS:
        if cascade.position is not None or name != "velocity_feedforward":
            open_one: dict[str, Any] = {name: None}
            yield say("{:.4g}", getattr(cascade, name)), replace(cascade, **open_one)
