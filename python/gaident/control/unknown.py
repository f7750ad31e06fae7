"""Parameters of a controller that are not known, None: their names, numbers in their places, and the refusal without them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from gaident.control.cascade import FEEDFORWARDS, FILTERS, Cascade, Controller, P
from gaident.control.filters import LowPass, Notch
from gaident.control.pi import PI
from gaident.errors import ControllerError

__all__ = ["UNITS", "field_of", "known", "unknown_of", "with_numbers"]

FIELDS: dict[type, tuple[str, ...]] = {
    PI: ("kp", "ki", "command_weight"),
    P: ("gain",),
    LowPass: ("time_constant",),
    Notch: ("frequency", "numerator_damping", "denominator_damping"),
    Cascade: FEEDFORWARDS,
}
"""What may be unknown of each part."""
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


def unknown_of(controller: Controller) -> tuple[str, ...]:
    """The names of what is None: "kp" of a PI; "velocity.kp", "torque_filters[0].frequency", ... of a Cascade."""
    return tuple(
        prefix + name for prefix, part in _parts(controller) for name in FIELDS[type(part)] if getattr(part, name) is None
    )


def with_numbers(controller: Controller, numbers: Mapping[str, float]) -> Controller:
    """The controller with numbers by the names of `unknown_of`. Raises ControllerError where a part refuses its number."""
    changed = {prefix: _changed(part, prefix, numbers) for prefix, part in _parts(controller)}
    if isinstance(controller, PI):
        pi: PI = changed[""]
        return pi
    parts = {
        "velocity": changed["velocity."],
        "position": changed.get("position."),
        **{name: tuple(changed[f"{name}[{i}]."] for i in range(len(getattr(controller, name)))) for name in FILTERS},
    }
    cascade: Cascade = replace(changed[""], **parts)
    return cascade


def field_of(name: str) -> str:
    """The last part of a name: "frequency" of "torque_filters[0].frequency"."""
    return name.rpartition(".")[2]


def known(controller: Controller) -> None:
    """Raises ControllerError where a parameter is None."""
    if names := unknown_of(controller):
        raise ControllerError(
            f"{names[0]} is None, not known: give a number here; identify and diagnose estimate it from records with the torque, "
            "and their result has the controller with its numbers"
        )


def _parts(controller: Controller) -> Iterator[tuple[str, Any]]:
    """(beginning of the names, part that has them)."""
    yield "", controller
    if isinstance(controller, Cascade):
        yield "velocity.", controller.velocity
        if controller.position is not None:
            yield "position.", controller.position
        for place in FILTERS:
            for i, one in enumerate(getattr(controller, place)):
                yield f"{place}[{i}].", one


def _changed(part: Any, prefix: str, numbers: Mapping[str, float]) -> Any:
    own = {name: numbers[prefix + name] for name in FIELDS[type(part)] if prefix + name in numbers}
    return replace(part, **own) if own else part
