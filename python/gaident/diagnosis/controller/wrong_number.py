"""Which number of a given controller is not the drive's: with which other one does the logged torque follow.

One number at a time is estimated from command, measured signals and torque, as one that is not known; no plant is involved.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gaident.axis import Text, joined, say, unit_text
from gaident.control.cascade import FEEDFORWARDS, Cascade, P, cascade_of
from gaident.control.controller import Controller
from gaident.control.filtering import rate_limited
from gaident.data.record import Record
from gaident.diagnosis.controller.slow_forms import run_error
from gaident.errors import GaidentError
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.logged_torque import not_followed
from gaident.models.drive_torque import torque_driven
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["Corrected", "by_a_limit", "corrected"]

SEARCHED = (1e-3, 40)  # no decision: of the largest value, where a limit is looked for from, and starts of that search


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


def by_a_limit(records: Sequence[Record], controller: Controller) -> bool:
    """Whether the torque follows with a clamp of the integrator, or a slope of the command, that was not given.

    Then the loop is the drive's but for that, and a simulation of it shows the limit. As in a replay at each sample, it leaves at
    most `replay_left` of the squared error.
    """
    cascade = cascade_of(controller)
    torque = max(float(np.abs(r.torque).max()) for r in records if r.torque is not None)

    def clamped(limit: float) -> float:
        return run_error(records, cascade.with_limits(cascade.limits[0], limit))

    def followed(limit: float) -> float:
        slow = [r.with_channels(command=rate_limited(command, limit, r.dt, 0.0)) for r, command in asked]
        return run_error(slow, cascade)

    most = POLICY.replay_left * run_error(records, cascade) ** 2
    asked = [(r, r.command) for r in records if r.command is not None and cascade.position is None]
    slope = max((float(np.abs(np.diff(command, prepend=0.0)).max()) / r.dt for r, command in asked), default=0.0)
    searches = ((clamped, torque), (followed, slope))
    return any(top > 0.0 and _least(error, top) ** 2 < most for error, top in searches)


def _least(error: Callable[[float], float], top: float) -> float:
    """The least error of a limit up to `top`: the best of a grid, and the minimum beside it."""
    from scipy.optimize import minimize_scalar

    grid = np.linspace(np.log(SEARCHED[0] * top), np.log(top), SEARCHED[1])
    values = [error(float(np.exp(x))) for x in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(lambda x: error(float(np.exp(x))), bounds=(low, high), method="bounded", options={"xatol": 1e-6})
    return min(values[best], float(found.fun))


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
