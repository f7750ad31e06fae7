"""What may be in the place of a cause that was found."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from gaident.diagnosis.experiments.excitation import Excitation
from gaident.diagnosis.library.equivalences import equivalents, impossible
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY, conditional_classes, level_of
from gaident.diagnosis.selection.offset import Offset
from gaident.diagnosis.selection.rivals import Replacement
from gaident.diagnosis.unlogged.other_gains import OTHER_GAINS
from gaident.estimation.dataset import DataSet
from gaident.models.effect_rows import SHAFT
from gaident.models.starts import starts_moving
from gaident.results.estimate import Estimate

__all__ = ["INTEGRATOR_START", "LOG_SHIFT", "alike_here", "alternatives_of", "impossible_here", "integrator_start"]

OF_THE_CONTROLLER = (OTHER_GAINS, "torque_filter")
"""What a controller that is not the drive's may lack, in words of the findings."""
LOG_SHIFT = "log_shift"
"""A log that wrote the torque whole lines early, in place of what makes a motion late."""
INTEGRATOR_START = "integrator_start"
"""What the controller's integrator held when a record began, in place of a constant load."""


def integrator_start(effect: str, data: DataSet) -> list[str]:
    """INTEGRATOR_START in place of a constant torque, where a record begins in motion with an integral that no channel shows."""
    controller = data.controller
    if controller is None or controller.gains.ki == 0.0 or data.torque_logged or not LIBRARY[effect].constant:
        return []
    return [INTEGRATOR_START] * any(starts_moving(r, controller) for r in data.records)


def alike_here(effect: str, excited: Excitation, torque_logged: bool) -> set[str]:
    """What these records cannot tell from an effect, whatever their noise, for lack of reversals or of sizes of steps."""
    # Speeds held in either direction, in whichever record, split what a reversal splits.
    turns = max(excited.reversals, int(min(excited.speeds, default=0.0) < 0.0 < max(excited.speeds, default=0.0)))
    effect = name_of(effect)
    return set().union(*(c for c in conditional_classes(turns, len(excited.steps), torque_logged) if effect in c)) - {effect}


def alternatives_of(
    effect: str,
    rivals: Sequence[Replacement],
    here: Sequence[str],
    shown: bool,
    offset: Offset | None,
    follows: bool,
    never: Collection[str] = (),
) -> list[str]:
    """Names of what these records cannot tell from an effect.

    here: what they cannot tell from it for lack of reversals or of sizes of steps.
    shown: whether the records show the torque's jump by themselves; then no effect without such a jump is an alternative, and
    no controller.
    offset: what an effect is not the same as.
    follows: whether the logged torque is what the controller makes, where a log is slower than it.
    If not, the logged torque drives the model, and is not known between the lines.
    The error of that looks like a delay, a filter or a resonance.
    It does not look like a torque on the shaft that is there from line to line, such as a constant load.
    never: equivalents that cannot be in its place with the sizes that were found.
    """
    names = [r.effect for r in rivals if not shown or LIBRARY[r.effect].levels]
    names += here
    if offset is None or effect != offset.effect:
        names += [name for name in equivalents(name_of(effect)) if name not in never]
    if not follows and not shown and LIBRARY[effect].place != SHAFT:
        names += OF_THE_CONTROLLER
    return list(dict.fromkeys(names))


def impossible_here(effect: str, found: Mapping[str, Mapping[str, Estimate]]) -> frozenset[str]:
    """Equivalents of an effect that are no friction with the sizes that were found; found: effect -> its parameters.

    A load of 250 N beside 25 N of dry friction is no friction of two levels: one of these would be -225 N.
    """
    if not LIBRARY[effect].constant:
        return frozenset()
    (constant,) = found[effect].values()
    levels = [level_of(own) for name, own in found.items() if LIBRARY[name].levels and not LIBRARY[name].beside]
    return impossible(name_of(effect), levels[0] if levels else Estimate(0.0, 0.0, constant.unit), constant)
