"""--accuracy: how accurate the simulation has to be, in the user's units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from gaident.data.formats.units import Constants, factor, is_unit, known_units, of_other_axis
from gaident.drive.drive_file import CONSTANTS, Drive
from gaident.errors import ReadError, SettingsError

__all__ = ["accuracy_of"]

QUANTITIES = ("velocity", "torque")
_NUMBER = re.compile(r"\s*(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+)\s*(.*?)\s*")


def accuracy_of(texts: Sequence[str] | None, drive: Drive) -> tuple[dict[str, float], Drive]:
    """({"velocity": [rad/s], "torque": [N m]} of ["1 rpm", "2 %"], the drive, which shows its results in these units).

    A number alone is a velocity in the unit of [show], or in SI. What [show] says of a unit stays.
    """
    found: dict[str, float] = {}
    units: dict[str, str] = {}
    constants = Constants(**{key: drive.general[key] for key in CONSTANTS if key in drive.general})
    for text in texts or ():
        match = _NUMBER.fullmatch(text)
        if match is None or not float(match[1]) > 0.0:
            raise SettingsError(f"--accuracy {text!r}: give a number above 0 with its unit, '1 rpm' or '2 %'")
        unit = match[2] or drive.show.get("velocity", "")
        name, size = _meant(unit, constants, drive.axis, text)
        if name in found:
            raise SettingsError(f"--accuracy {text!r}: a second one of the {name}; give one of the velocity, one of the torque")
        found[name] = float(match[1]) * size
        units |= {name: unit} if unit else {}
    return found, replace(drive, show={**units, **drive.show})


def _meant(unit: str, constants: Constants, axis: str, text: str) -> tuple[str, float]:
    """(the quantity that is measured in a unit, its SI value)."""
    if not unit:
        return QUANTITIES[0], 1.0
    # What both are measured in (%) is of the torque, but where only the speed at 100 % is known.
    of_speed = constants.rated_torque is None and constants.reference_speed is not None
    both = all(is_unit(unit, name) for name in QUANTITIES)
    for name in QUANTITIES if of_speed or not both else reversed(QUANTITIES):
        if is_unit(unit, name) and not of_other_axis(name, unit, axis):
            try:
                return name, factor(name, unit, constants)
            except ReadError as error:
                raise SettingsError(f"--accuracy {text!r}: {error}") from error
    listed = ", ".join(unit for name in QUANTITIES for unit in known_units(name, axis))
    raise SettingsError(
        f"--accuracy {text!r}: {unit!r} is no unit of a velocity or a torque of a {axis} axis: give one of {listed}"
    )
