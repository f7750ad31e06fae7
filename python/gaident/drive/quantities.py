"""Numbers of a controller as a drive shows them, `"0.12 A s/rad"`, `"10 ms"`, `"300 %"`, and the word for one that is not known.

One table says for each key which units it may have, the factor to SI, and the constant of the axis that belongs to it.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from typing import Any

from gaident.checks import real_number
from gaident.control.unknown import UNITS
from gaident.control.words import UNKNOWN
from gaident.errors import ControllerError, GaidentError, ReadError

__all__ = ["INERTIA", "INTEGRAL_TIMES", "number_and_unit", "number_or_unit", "plain_number", "si_number"]

INTEGRAL_TIMES, INERTIA = ("tn", "ti"), "total_inertia"
"""Keys of the file that are no arguments of a controller: ki = kp/tn (or kp/ti), and the inertia of a gain in 1/s."""

Factor = tuple[float, str]  # to SI, and the constant that it is multiplied by, behind a space one that divides it; "": none
_LISTED = 10  # no decision: how many units a message names
_RPM = math.tau / 60.0  # no decision: a unit; rad/s
_CURRENTS: dict[str, Factor] = {"A": (1.0, "torque_constant"), "mA": (1e-3, "torque_constant")}
_SHARES_OF_RATED: dict[str, Factor] = {"%": (1e-2, "rated_torque"), "‰": (1e-3, "rated_torque")}
_TORQUES: dict[str, Factor] = {"N m": (1.0, ""), **_CURRENTS, **_SHARES_OF_RATED, "mN m": (1e-3, "")}
_FORCES: dict[str, Factor] = {"N": (1.0, ""), **_CURRENTS, **_SHARES_OF_RATED}
_TIMES: dict[str, Factor] = {"s": (1.0, ""), "ms": (1e-3, ""), "us": (1e-6, "")}
_SHARES: dict[str, Factor] = {"1": (1.0, ""), "%": (1e-2, "")}
_PER_SPEED = {" s/rad": 1.0, "/rpm": 1.0 / _RPM, "/(rad/s)": 1.0, "/(1/min)": 1.0 / _RPM}
_PER_ANGLE = {"/rad": 1.0, "/(rad/s s)": 1.0, "/(rpm s)": 1.0 / _RPM}
_PER_LINEAR_SPEED = {" s/m": 1.0, "/(m/s)": 1.0}


def _per(numerators: Mapping[str, Factor], denominators: Mapping[str, float]) -> dict[str, Factor]:
    """Each of these over each of those."""
    return {one + over: (size * per, name) for over, per in denominators.items() for one, (size, name) in numerators.items()}


_UNITS: dict[str, dict[str, Factor]] = {
    "kp": {
        **_per(_TORQUES, _PER_SPEED),
        **_per(_FORCES, _PER_LINEAR_SPEED),
        **{"%/%": (1.0, "rated_torque reference_speed"), "‰/‰": (1.0, "rated_torque reference_speed")},
        **{"1/s": (1.0, INERTIA), "rad/s": (1.0, INERTIA), "Hz": (math.tau, INERTIA)},
    },
    "ki": {**_per(_TORQUES, _PER_ANGLE), **_per(_FORCES, {"/m": 1.0})},
    **dict.fromkeys(INTEGRAL_TIMES, _TIMES),
    "command_weight": _SHARES,
    **{key: {**_TORQUES, **_FORCES} for key in ("torque_limit", "integrator_limit", "friction_feedforward")},
    **dict.fromkeys(("period", "position_period", "delay", "tracking_time", "time_constant"), _TIMES),
    "position_gain": {
        **{"1/s": (1.0, ""), "(rad/s)/rad": (1.0, ""), "1000/min": (1000.0 / 60.0, "")},
        **{"(m/min)/mm": (1000.0 / 60.0, ""), "m/min/mm": (1000.0 / 60.0, "")},
    },
    "velocity_feedforward": _SHARES,
    "acceleration_feedforward": {"kg m^2": (1.0, ""), "kg cm^2": (1e-4, ""), "kg": (1.0, "")},
    "frequency": {"Hz": (1.0, ""), "rad/s": (1.0 / math.tau, "")},
    INERTIA: {"kg m^2": (1.0, ""), "kg cm^2": (1e-4, ""), "kg": (1.0, "")},
    # What belongs to the axis: such a unit needs no constant.
    "rated_torque": {"N m": (1.0, ""), "mN m": (1e-3, ""), "N": (1.0, "")},
    "torque_constant": {"N m/A": (1.0, ""), "mN m/A": (1e-3, ""), "N/A": (1.0, "")},
    "torque_per_volt": {"N m/V": (1.0, ""), "N/V": (1.0, "")},
    "resistance": {"Ohm": (1.0, ""), "mOhm": (1e-3, ""), "\N{GREEK CAPITAL LETTER OMEGA}": (1.0, "")},
    "inductance": {"H": (1.0, ""), "mH": (1e-3, ""), "uH": (1e-6, "")},
    "back_emf_constant": {"V s/rad": (1.0, ""), "V/(rad/s)": (1.0, ""), "V/rpm": (1.0 / _RPM, ""), "V s/m": (1.0, "")},
    **dict.fromkeys(("dt", "resample", "from", "to", "duration"), _TIMES),
}
_OF_ONE_AXIS: dict[str, tuple[str, ...]] = {
    "rotary": ("N m", "mN m", "kg m^2", "kg cm^2", *_per(_TORQUES, _PER_SPEED), *_per(_TORQUES, _PER_ANGLE)),
    "linear": ("N", "kg", *_per(_FORCES, _PER_LINEAR_SPEED), *_per(_FORCES, {"/m": 1.0})),
}
"""Units that only gains, torques and inertias of such an axis have."""
_MAY_BE_UNKNOWN = frozenset({*UNITS, "position_gain"} - {"gain"})
_NUMBER = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(.*)")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}")  # 1,500 is one thing in one country and another in the next


def number_or_unit(value: object, name: str) -> float | str:
    """A number, or text that `si_number` reads: what a drive file takes. Raises ReadError."""
    if isinstance(value, str):
        return _checked(value, name, ReadError)
    return real_number(value, name, ReadError, "give one number, or a number with its unit in quotes")


def plain_number(value: str, name: str) -> float:
    """The number in SI of text with a unit that needs no constant of the axis. Raises ReadError."""
    number, unit = number_and_unit(_checked(value, name, ReadError))
    return number * _units(name)[_spelling(unit)][0]


def si_number(value: Any, name: str, constants: Mapping[str, Any]) -> float | None:
    """The number in SI of what stands below a key; None where it is not known.

    constants: what of torque_constant [N m/A], rated_torque [N m], reference_speed [rad/s] and total_inertia [kg m^2] is given.
    Raises ControllerError.
    """
    if not isinstance(value, str):
        return real_number(value, name, ControllerError)
    if _checked(value, name, ControllerError).strip() == UNKNOWN:
        return None
    number, unit = number_and_unit(value)
    if constants.get("screw") is not None and _of_axis(unit, "linear"):
        number *= _by_screw(unit, float(constants["screw"]))  # N per A is N m per A here, as of a motor
    else:
        _refuse_other_axis(value, name, unit, str(constants.get("axis", "rotary")))
    size, constant = _units(name)[_spelling(unit)]
    needed = constant.split()
    for one in needed:
        if constants.get(one) is None:
            where = "in [controller]" if one == INERTIA else "above the first section"
            raise ControllerError(f"{name} is {value!r}, which needs {one}: give it {where}")
    times, *over = [float(constants[one]) for one in needed] or [1.0]
    return number * size * times / (over[0] if over else 1.0)


def _of_axis(unit: str, axis: str) -> bool:
    """Whether only a gain, torque or inertia of such an axis has this unit."""
    return _spelling(unit) in map(_spelling, _OF_ONE_AXIS[axis])


def _by_screw(unit: str, lead: float) -> float:
    """What makes a number of the slide one of the motor, which moves the lead [m] in a turn: r = lead/(2 pi), v = r w, M = r F.

    A mass and a force over a speed or a length have r^2; a force has r, and so has a current over a speed or a length.
    """
    r, plain = lead / math.tau, _spelling(unit)
    over = plain == "kg" or plain.startswith("n/(") or plain in (_spelling("N s/m"), _spelling("N/m"))
    return r * r if over else r


def _refuse_other_axis(value: str, name: str, unit: str, axis: str) -> None:
    """Raises ControllerError for a unit that gains, torques and inertias of the other kind of axis have."""
    other = {"rotary": "linear", "linear": "rotary"}[axis]
    if not _of_axis(unit, other):
        return
    own = [u for u in _UNITS[name] if u in _OF_ONE_AXIS[axis]]
    screw = (
        'or, of a motor on a screw, axis = "rotary" and screw = "10 mm", which makes angles of the motor of what is logged in mm'
        if axis == "linear"
        else 'or axis = "linear" where the log is in m, m/s and N'
    )
    raise ControllerError(f'{name} is {value!r}, a unit of a {other} axis, and axis is "{axis}": give it in {own[0]}, {screw}')


def _checked(value: str, name: str, error: type[GaidentError]) -> str:
    """The text, where it is a number with a unit of the key, or the word for one that is not known."""
    if value.strip() == UNKNOWN and name in _MAY_BE_UNKNOWN:
        return value
    names = tuple(_UNITS.get(name, {}))
    listed = ", ".join(names) if len(names) <= _LISTED else f"{', '.join(names[:_LISTED])}, ..."
    word = f', or "{UNKNOWN}"' if name in _MAY_BE_UNKNOWN else ""
    number, unit = number_and_unit(value)
    if math.isnan(number):
        near = f" (did you mean {UNKNOWN!r}?)" if word and difflib.get_close_matches(value.strip().lower(), [UNKNOWN]) else ""
        near = " (write a decimal point, and none between thousands)" if _THOUSANDS.match(value.strip()) else near
        raise error(f"{name} is {value!r}{near}: give one number, a number with its unit ({listed}){word}")
    if _spelling(unit) not in _units(name):
        close = difflib.get_close_matches(_spelling(unit), _units(name), n=1)
        near = next(
            (f" (did you mean {known!r}?)" for known in _UNITS.get(name, {}) if close and _spelling(known) == close[0]), ""
        )
        raise error(f"{name} is {value!r}: {unit!r} is none of its units{near}; give one of {listed}")
    return value


def number_and_unit(text: str) -> tuple[float, str]:
    """(number, unit) of a number with a decimal point or comma; NaN where it begins with none, or has a comma of thousands."""
    found = _NUMBER.fullmatch(text.strip())
    if found is None or not found[2] or _THOUSANDS.fullmatch(found[1]):
        return math.nan, ""
    return float(found[1].replace(",", ".")), found[2]


def _units(name: str) -> dict[str, Factor]:
    return {_spelling(unit): factor for unit, factor in _UNITS.get(name, {}).items()}


def _spelling(unit: str) -> str:
    """One spelling of `N m s/rad`, `Nm s/rad`, `N·m·s/rad`, `N*m*s/rad`."""
    plain = unit.replace("\N{MICRO SIGN}", "u").replace("²", "^2")
    for mark in (" ", "*", "·", "⋅"):
        plain = plain.replace(mark, "")
    return plain.casefold()
