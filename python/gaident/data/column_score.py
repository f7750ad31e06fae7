"""How much the names and the unit of a log's column say that it is a channel."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.data.column_names import load_says, name_says
from gaident.data.formats.units import Constants, factor, is_any_unit
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["COMMANDED_QUANTITY", "LOAD_QUANTITY", "spoken_for"]

COMMANDED_QUANTITY = {"command": "velocity", "position_command": "position"}
"""Channel that is a command -> the quantity that it commands."""
LOAD_QUANTITY = {"load_position": "position", "load_velocity": "velocity"}
"""Channel of a sensor at the load -> the quantity that it measures."""
CALLED = {"torque": "torque or current"}
"""Quantity -> what a column of it may be called, where that is more."""


def spoken_for(names: Sequence[str], unit: str | None, channel: str) -> tuple[int, str, bool]:
    """How much speaks for a column of these names and this unit (words, the unit), why, and whether the user has to be asked."""
    if channel in LOAD_QUANTITY:
        return _spoken_for_load(names, unit, channel)
    quantity = COMMANDED_QUANTITY.get(channel, channel)
    said = name_says(names, unit)
    by_name, fits = said.quantities.get(quantity, 0), _is_unit_of(unit, quantity)
    elsewhere = unit is not None and not fits and not _converts(unit, quantity) and is_any_unit(unit)
    if said.foreign or elsewhere or not (by_name or fits):
        return 0, "", False
    if max((much for other, much in said.quantities.items() if other != quantity), default=0) > max(by_name, POLICY.words_needed):
        return 0, "", False  # the set value of a position is no velocity command
    score = by_name + (POLICY.unit_points if fits else 0)
    if channel in COMMANDED_QUANTITY:
        score = score + POLICY.command_points if said.commanded else 0
    elif channel in ("velocity", "position"):
        score = 0 if said.commanded else score + (1 if said.measured else 0)  # a command is no measurement, whatever its unit
    else:
        score += 1 if said.commanded else 0  # what the controller issued rather than what was measured
    called = CALLED.get(quantity, quantity)
    why = [f"its name says {called}" if by_name else "", f"its unit is one of {called}" if fits else ""]
    if channel in COMMANDED_QUANTITY and said.commanded:
        why.append("its name says that it is a command")
    return score, ", ".join(filter(None, why)), said.unsure


def _spoken_for_load(names: Sequence[str], unit: str | None, channel: str) -> tuple[int, str, bool]:
    """See `spoken_for`: the name has to say it, and the unit must not speak against it."""
    quantity = LOAD_QUANTITY[channel]
    by_name = load_says(names, unit).get(quantity, 0)
    against = unit is not None and not _converts(unit, channel) and is_any_unit(unit)
    if not by_name or against:
        return 0, "", False
    return by_name, f"its name says {quantity}, of a sensor at the load", False


def _is_unit_of(unit: str | None, quantity: str) -> bool:
    if unit is None or not _converts(unit, quantity):
        return False
    # V and 1 stand for many things.
    return unit.strip().casefold() not in ("v", "mv", "m", "1", "-") or quantity == "position"


def _converts(unit: str, quantity: str) -> bool:
    try:
        factor(quantity, unit, Constants(1.0, 1.0, 1.0, 1.0))
    except ReadError:
        return False
    return True
