"""Numbers of a controller that are not known, None: their names, numbers in their places, and the refusal without them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, Protocol, TypeVar

from gaident.errors import ControllerError

__all__ = ["UNITS", "field_of", "known", "unknown_in", "with_own"]

UNITS = {
    "kp": "N m s/rad",
    "ki": "N m/rad",
    "command_weight": "1",
    "gain": "1/s",
    "time_constant": "s",
    "frequency": "Hz",
    "numerator_damping": "1",
    "denominator_damping": "1",
    "velocity_feedforward": "1",
    "acceleration_feedforward": "kg m^2",
    "friction_feedforward": "N m",
}
"""Field of a part of a controller that may be unknown -> its unit."""
Part = TypeVar("Part", bound=Any)


class Numbered(Protocol):
    """What names its unknown numbers; a `Controller` does."""

    @property
    def unknown(self) -> tuple[str, ...]: ...


def unknown_in(parts: Iterable[tuple[str, object]]) -> tuple[str, ...]:
    """The names of what is None; parts: (beginning of the names, part of a controller that has them)."""
    return tuple(prefix + name for prefix, part in parts for name in UNITS if getattr(part, name, 0.0) is None)


def with_own(part: Part, prefix: str, numbers: Mapping[str, float]) -> Part:
    """The part with its own of all numbers; prefix: beginning of their names. ControllerError where it refuses one."""
    own = {name: numbers[prefix + name] for name in UNITS if prefix + name in numbers}
    changed: Part = replace(part, **own) if own else part
    return changed


def field_of(name: str) -> str:
    """The last part of a name: "frequency" of "torque_filters[0].frequency"."""
    return name.rpartition(".")[2]


def known(controller: Numbered) -> None:
    """Raises ControllerError where a number is None."""
    if names := controller.unknown:
        raise ControllerError(
            f"{names[0]} is None, not known: give a number here; identify and diagnose estimate it from records with the torque, "
            "and their result has the controller with its numbers"
        )
