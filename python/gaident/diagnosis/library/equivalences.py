"""Which effects are the same to every record of command, velocity and torque, and what else would tell them apart."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from gaident.axis import Text, say
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["EQUIVALENT", "Composition", "Equivalence", "equivalents", "impossible"]

Parameters = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Composition:
    """One effect, `whole`, that is the same torque as several others together but for parameters which these do not have.

    parts: parameters of the whole -> parameters of each of the others, one of which is a constant torque.
    lowest: (level of dry friction, constant torque) [N m] -> the lowest level that the whole would have in their place.
    No friction has one below 0, which would drive the axis.
    different: what to say where the others leave the model worse: {} the constant torque fitted with them [N m], {} BIC units by
    which the model is worse, {} the constant torque of `parts` [N m].
    """

    whole: str
    parts: Callable[[Parameters], dict[str, dict[str, float]]]
    lowest: Callable[[float, float], float]
    different: str


@dataclass(frozen=True, eq=False)
class Equivalence:
    """effects: those that are the same; otherwise: how to tell them apart, a sentence; of: why one is the same as another."""

    effects: frozenset[str]
    otherwise: Text
    of: Composition | None = None


def _even(p: Parameters) -> dict[str, dict[str, float]]:
    positive, negative = p["torque_positive"], p["torque_negative"]
    return {"coulomb_friction": {"torque": 0.5 * (positive + negative)}, "load_torque": {"torque": 0.5 * (positive - negative)}}


EQUIVALENT: tuple[Equivalence, ...] = (
    Equivalence(
        frozenset({"torque_lag", "velocity_filter"}),
        say(
            "Torque lag and velocity filter act alike on every record of command, {torque} and velocity, whatever the command: "
            "log the measured motor current (it shows a lag) or the raw encoder {angle} (it shows a filter) beside them."
        ),
    ),
    Equivalence(
        frozenset({"load_torque", "asymmetric_friction"}),
        say(
            "A constant load and dry friction of two levels are the same {torque} while the axis {turns}, whatever the command: "
            "repeat the record with the load taken off or the axis turned over, only a load changes with that."
        ),
        Composition(
            whole="asymmetric_friction",
            parts=_even,
            lowest=lambda level, load: level - abs(load),
            different="Even dry friction with a constant load of {:.3g} {N m} in its place would leave the model {:.0f} BIC "
            "units worse: what looks like an offset is mostly viscous friction that depends on the direction, {:.2g} {N m} of "
            "it is left.",
        ),
    ),
)


def equivalents(effect: str) -> tuple[str, ...]:
    """The effects that no record of command, velocity and torque tells from this one."""
    return tuple(name for e in EQUIVALENT if effect in e.effects for name in sorted(e.effects - {effect}))


def impossible(effect: str, level: Estimate, constant: Estimate) -> frozenset[str]:
    """Of the equivalents of an effect, those that would need dry friction below 0 in its place, beyond both deviations.

    level: of the dry friction of the model, 0 without any; constant: the constant torque that the effect is [N m].
    """
    wholes = (e.of for e in EQUIVALENT if e.of is not None and effect in e.effects - {e.of.whole})
    room = POLICY.check_deviations * math.hypot(level.std, constant.std)
    return frozenset(of.whole for of in wholes if of.lowest(level.value, constant.value) < -room)
