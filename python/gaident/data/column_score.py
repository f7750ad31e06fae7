"""How much the names and the unit of a log's column say that it is a channel."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.data.column_words import COMMAND_WORDS, FOREIGN_WORDS, MEASURED_WORDS, QUANTITY_WORDS, words_of
from gaident.data.formats.units import Constants, factor
from gaident.errors import ReadError

__all__ = ["COMMANDED_QUANTITY", "LEAST", "spoken_for"]

COMMANDED_QUANTITY = {"command": "velocity", "position_command": "position"}
"""Channel that is a command -> the quantity that it commands."""
LEAST = 2  # no decision: words that speak for a column


def spoken_for(names: Sequence[str], unit: str | None, channel: str) -> tuple[int, str]:
    """(how much speaks for a column of these names and this unit, why): words of the names, the unit."""
    quantity = COMMANDED_QUANTITY.get(channel, channel)
    words = [word for name in names for word in words_of(name)]
    if FOREIGN_WORDS & set(words):
        return 0, ""
    by_name = max((QUANTITY_WORDS[quantity].get(word, 0) for word in words), default=0)
    fits = _is_unit_of(unit, quantity)
    if unit is not None and not fits and not _converts(unit, quantity):
        return 0, ""
    others = (held for other, held in QUANTITY_WORDS.items() if other != quantity)
    if max((held.get(word, 0) for held in others for word in words), default=0) > max(by_name, LEAST):
        return 0, ""  # the set value of a position is no velocity command
    commands = COMMAND_WORDS & set(words)
    commanded = bool(commands) and (commands != {"r"} or len(set(words)) == 1)
    measured = bool(MEASURED_WORDS & set(words))
    score = by_name + (3 if fits else 0)
    if channel in COMMANDED_QUANTITY:
        score = score + 3 if commanded else 0
    elif channel in ("velocity", "position"):
        score = 0 if commanded else score + (1 if measured else 0)  # a command is no measurement, whatever its unit
    else:
        score += 1 if commanded else 0  # what the controller issued rather than what was measured
    why = [f"its name says {quantity}" if by_name else "", f"its unit is one of {quantity}" if fits else ""]
    if channel in COMMANDED_QUANTITY and commanded:
        why.append("its name says that it is a command")
    return score, ", ".join(filter(None, why))


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
