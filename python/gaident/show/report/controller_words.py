"""A controller in words: gains, limits, and what it has beside a bare PI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gaident.axis import identifier_words, unit, velocity_unit, word
from gaident.control.controller import Controller
from gaident.show.wording import number

__all__ = ["controller_words"]

SAID = ("kp", "ki", "loop", "torque_limit", "integrator_limit", "kind", "velocity")
UNUSED = {"rule": "trapezoidal", "command_weight": 1.0, "anti_windup": "none"}
"""Settings that a controller has in any case, as in a bare PI."""
UNITS = {
    **dict.fromkeys(("period", "position_period", "tracking_time", "delay", "time_constant"), "s"),
    "position_gain": "1/s",
    "frequency": "Hz",
    "acceleration_feedforward": "kg m^2",
    "friction_feedforward": "N m",
}
"""Of the settings that have one."""


def controller_words(controller: Controller | None, axis: str) -> str:
    """What closed the loop."""
    if controller is None:
        kind = word("torque", axis)
        return f"none: open loop, {kind} [{unit('N m', axis)}] to velocity [{velocity_unit(axis)}]"
    parts = [
        f"{controller.loop} PI, kp {number(controller.gains.kp)} {unit('N m s/rad', axis)}",
        f"ki {number(controller.gains.ki)} {unit('N m/rad', axis)}",
    ]
    data = controller.to_dict()
    pi = data.get("velocity", data)
    for name in ("torque_limit", "integrator_limit"):
        if pi[name] is not None:
            parts.append(f"{identifier_words(name, axis)} {number(pi[name])} {unit('N m', axis)}")
    parts += _settings(pi, axis)
    if "velocity" in data:
        parts += _settings(data, axis)
    return ", ".join(parts)


def _settings(data: Mapping[str, object], axis: str) -> Iterator[str]:
    """Each setting that differs from that of a bare PI."""
    for name, value in data.items():
        if name in SAID or value is None or value == UNUSED.get(name, 0.0) or value == []:
            continue
        if isinstance(value, list):
            filters = (f"{one['kind']} ({', '.join(_settings(one, axis))})" for one in value)
            yield f"{identifier_words(name, axis)}: {' and '.join(filters)}"
        else:
            size = number(value) if isinstance(value, int | float) else value
            yield f"{identifier_words(name, axis)} {size} {unit(UNITS[name], axis) if name in UNITS else ''}".rstrip()
