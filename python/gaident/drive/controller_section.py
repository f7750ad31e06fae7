"""[controller] of a drive file: gains in SI or as a drive shows them, and what stands around the velocity controller."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gaident.control.cascade import FEEDFORWARDS, FILTERS, WAYS, Cascade
from gaident.control.controller import Controller
from gaident.control.drive_parameters import CONSTANTS, DRIVES, drive_row
from gaident.control.filters import LowPass, Notch, filter_of
from gaident.control.pi import DIGITAL, PI
from gaident.control.position import P
from gaident.control.words import UNKNOWN
from gaident.drive.kinds import Check, number, text
from gaident.drive.quantities import INERTIA, INTEGRAL_TIMES, number_or_unit, si_number
from gaident.errors import ControllerError, ReadError

__all__ = ["CONTROLLER_KEYS", "controller_of", "proportional_gain_of"]

Values = Mapping[str, Any]


def _filters(value: object, name: str) -> tuple[Mapping[str, Any], ...]:
    if not isinstance(value, Sequence) or not all(isinstance(one, Mapping) for one in value):
        example = '[{ kind = "low pass", time_constant = 0.4e-3 }]'
        raise ReadError(f"{name} is {value!r}: give a list of filters, {name} = {example}")
    try:
        for one in value:
            _filter(one)
    except ControllerError as error:
        raise ReadError(f"{name}: {error}") from None
    return tuple(value)


def _filter(data: Mapping[str, Any]) -> LowPass | Notch:
    """A filter; a low pass by its time constant or by the frequency at which it is 3 dB down, 1/(2 pi time_constant)."""
    numbers = {key: value if key == "kind" else si_number(value, key, {}) for key, value in data.items()}
    if isinstance(data.get("frequency"), bool):
        raise ControllerError(f"frequency is {data['frequency']!r}: give one number in Hz")
    if numbers.get("kind") == "low pass" and "frequency" in numbers:
        if "time_constant" in numbers:
            raise ControllerError("the low pass has time_constant and frequency: give the one or the other")
        frequency = numbers.pop("frequency")
        if frequency is not None and not frequency > 0.0:
            raise ControllerError(f"frequency is {data['frequency']!r}: give one > 0")
        numbers["time_constant"] = None if frequency is None else 1.0 / (math.tau * frequency)
    return filter_of(numbers)


PI_KEYS: dict[str, Check] = {
    "kp": number_or_unit,
    "ki": number_or_unit,
    "loop": text,
    "torque_limit": number_or_unit,
    "integrator_limit": number_or_unit,
    **{key: text if key in ("rule", "anti_windup") else number_or_unit for key in DIGITAL},
}
AROUND: dict[str, Check] = {
    **dict.fromkeys(("period", "position_gain", "position_period", *FEEDFORWARDS, "delay"), number_or_unit),
    **dict.fromkeys(FILTERS, _filters),
    **dict.fromkeys(WAYS, text),
}
# What the motor has stands above the first section, where the units of the log need it too.
OF_DRIVES = tuple(
    dict.fromkeys(p.name for row in DRIVES.values() for p in (*row.velocity, *row.position) if p.name not in CONSTANTS)
)
CONTROLLER_KEYS: dict[str, Check] = {
    **PI_KEYS,
    **dict.fromkeys((*INTEGRAL_TIMES, INERTIA), number_or_unit),
    "drive": text,
    **AROUND,
    **dict.fromkeys(OF_DRIVES, number),
}


def controller_of(given: Values, general: Values) -> Controller:
    """The controller of a section's values; general: the keys above the first section. Raises ControllerError."""
    values = _in_si(given, general)
    velocity = _velocity(values, general)
    position = _position(values)
    around = {key: values[key] for key in AROUND if key in values and key != "position_gain"}
    if position is None and not around:
        return velocity
    return Cascade(velocity, position=position, **around)


def _in_si(given: Values, general: Values) -> dict[str, Any]:
    """The values with units taken off, filters made, and ki of the integral time; what is not known is None."""
    constants = {**general, INERTIA: si_number(given[INERTIA], INERTIA, general) if INERTIA in given else None}
    values: dict[str, Any] = {
        key: tuple(map(_filter, value))
        if key in FILTERS
        else si_number(value, key, constants)
        if (PI_KEYS | AROUND).get(key) is number_or_unit
        else value
        for key, value in given.items()
        if key not in (*INTEGRAL_TIMES, INERTIA)
    }
    times = [key for key in INTEGRAL_TIMES if key in given]
    if times:
        key, *second = times
        if second or "ki" in values or "drive" in values:
            other = second[0] if second else "ki" if "ki" in values else "the gains of a drive"
            raise ControllerError(f"the controller has {key} and {other}: give the one or the other")
        kp, time = values.get("kp"), si_number(given[key], key, constants)
        assert time is not None
        if kp is None:
            raise ControllerError(f'{key} is given without kp, of which ki = kp/{key}: give kp, or ki = "{UNKNOWN}"')
        if not time > 0.0:
            raise ControllerError(f"{key} is {given[key]!r}: give a time > 0, or ki = 0 without an integral")
        values["ki"] = kp / time
    return values


def proportional_gain_of(values: Values, general: Values) -> float | None:
    """kp [N m s/rad] of a section's values, None where they say nothing of it; raises ControllerError."""
    found = _in_si(values, general)
    return _velocity(found, general).kp if "drive" in found else found.get("kp")


def _velocity(values: Values, general: Values) -> PI:
    pi = {key: values[key] for key in PI_KEYS if key in values}
    if "drive" not in values:
        foreign = [key for key in OF_DRIVES if key in values]
        if foreign:
            raise ControllerError(f'the controller has {foreign[0]}, which is a drive\'s: say which, drive = "..."')
        missing = [name for name in ("kp", "ki") if name not in values]
        if missing:
            raise ControllerError(
                f"the controller lacks {' and '.join(missing)}: give --kp and --ki (or [controller] in the drive file; "
                f'"{UNKNOWN}" where a torque is logged), or --loop open to work from torque to velocity'
            )
        return PI(**pi)
    twice = [name for name in ("kp", "ki") if name in pi]
    if twice:
        raise ControllerError(
            f"the controller has {twice[0]} and the gains of a drive, {values['drive']!r}: give the ones or the others"
        )
    row = drive_row(values["drive"])
    used = {p.name: general[p.name] for p in row.velocity if p.name in CONSTANTS and p.name in general}
    own = {key: values[key] for key in OF_DRIVES if key in values and key not in {p.name for p in row.position}}
    return PI.from_drive(values["drive"], **own, **used, **pi)


def _position(values: Values) -> P | None:
    """The position controller, of its gain or of the drive's parameter."""
    own = {}
    if "drive" in values:
        own = {p.name: values[p.name] for p in drive_row(values["drive"]).position if p.name in values}
    if own and "position_gain" in values:
        raise ControllerError(f"the controller has position_gain and {next(iter(own))}: give the one or the other")
    if own:
        return P.from_drive(values["drive"], **own)
    return P(values["position_gain"]) if "position_gain" in values else None
