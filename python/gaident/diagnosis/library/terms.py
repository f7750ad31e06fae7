"""The library of effects as the diagnosis sees it: one row for each, in the file of its place.

This room is the only one of the diagnosis that names an effect: what another room has to know of one is data of its row, and is
asked for by property.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from gaident.axis import Text
from gaident.diagnosis.library import actuator, controller, coupling, friction, harmonic, load, plant, sensor
from gaident.diagnosis.library.cause import NO_REVERSAL, ONE_SIZE, ONE_SIZE_UNLOGGED, Cause
from gaident.diagnosis.library.triggers import Motions
from gaident.diagnosis.library.user_defined import Library
from gaident.results.estimate import Estimate

__all__ = [
    "LIBRARY",
    "conditional_classes",
    "excited",
    "in_controller",
    "level_of",
    "not_testable",
    "of_inverse_dynamics",
    "one_sided",
]

PLACES = (plant, friction, load, harmonic, coupling, actuator, sensor, controller)
"""The files with the rows of the library, in its order."""

LIBRARY = Library({row.name: row for place in PLACES for row in place.CAUSES})
"""Every effect that a diagnosis can name; user-defined ones last."""


def in_controller() -> tuple[Cause, ...]:
    """Effects at the controller that a replay of it decides: the built-in ones."""
    return tuple(t for t in LIBRARY.values() if t.replayable)


def not_testable(motions: Motions) -> dict[str, Text]:
    """Effect -> why these records say nothing about it; effects that were triggered are not in it."""
    return {name: why for name, row in LIBRARY.items() if (why := row.why_not_testable(motions)) is not None}


def one_sided(motions: Motions) -> dict[str, Text]:
    """Effect -> which sizes of it could not have shown in these records; what stands there is tested, but not beyond."""
    bounded = ((name, row.unseen(motions)) for name, row in LIBRARY.items() if row.unseen is not None)
    return {name: text for name, text in bounded if text is not None}


def level_of(parameters: Mapping[str, Estimate]) -> Estimate:
    """Of dry friction: its torque, or the mean of its two levels."""
    if "torque" in parameters:
        return parameters["torque"]
    up, down = parameters["torque_positive"], parameters["torque_negative"]
    return Estimate(0.5 * (up.value + down.value), 0.5 * math.hypot(up.std, down.std), up.unit)


def excited(command: str) -> tuple[str, ...]:
    """The effects that a command of the menu of experiments is good at: those that it excites and tells from others."""
    return tuple(name for name, row in LIBRARY.items() if command in row.excited_by)


def conditional_classes(reversals: int, step_sizes: int, torque_logged: bool) -> tuple[frozenset[str], ...]:
    """Classes that records without reversals, or with a single size of step, cannot split."""
    one_size = step_sizes <= 1
    lacking = {NO_REVERSAL: reversals == 0, ONE_SIZE: one_size, ONE_SIZE_UNLOGGED: one_size and not torque_logged}
    classes: dict[tuple[str, str], set[str]] = {}
    for name, row in LIBRARY.items():
        for condition, kinds in row.alike.items():
            for kind in kinds if lacking[condition] else ():
                classes.setdefault((condition, kind), set()).add(name)
    return tuple(frozenset(names) for names in classes.values())


def of_inverse_dynamics(values: Mapping[str, float]) -> dict[Cause, dict[str, float]]:
    """The effects that the parameters of an inverse-dynamics regression stand for, each with its own parameters.

    values: name -> value, as `gaident.InverseDynamics.parameters` has them.
    Viscous friction common to both directions belongs to the mechanism and is no effect.
    """
    read = ((row, row.regressed(values)) for row in LIBRARY.values() if row.regressed is not None)
    return {row: own for row, own in read if own is not None}
