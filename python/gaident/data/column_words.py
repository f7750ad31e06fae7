"""The words in the names of a log's columns, English and German, and what they say of a column."""

from __future__ import annotations

import re

__all__ = ["COMMAND_WORDS", "FOREIGN_WORDS", "MEASURED_WORDS", "QUANTITY_WORDS", "words_of"]

COMMAND_WORDS = frozenset(
    {"r", "ref", "reference", "cmd", "command", "soll", "sollwert", "set", "setpoint", "sp", "target", "desired", "demand", "des"}
)
"""It is a command."""

MEASURED_WORDS = frozenset({"act", "actual", "ist", "istwert", "meas", "measured", "fb", "feedback", "real", "motor", "servo"})
"""It is of the motor, and what happened rather than what was asked for."""

QUANTITY_WORDS: dict[str, dict[str, int]] = {
    "velocity": {
        **dict.fromkeys(("velocity", "vel", "speed", "spd", "omega", "drehzahl", "geschwindigkeit", "rpm"), 4),
        **dict.fromkeys(("w", "wm", "n", "v", "dq", "qd"), 2),
    },
    "torque": {
        **dict.fromkeys(("torque", "trq", "moment", "drehmoment", "tau", "force", "kraft", "effort"), 4),
        **dict.fromkeys(("current", "strom", "iq", "thrust"), 3),
        **dict.fromkeys(("u", "m", "i"), 2),
    },
    "position": {
        **dict.fromkeys(("position", "pos", "angle", "theta", "phi", "lage", "winkel", "encoder"), 4),
        **dict.fromkeys(("q", "qm", "enc", "weg", "x"), 2),
    },
}
"""How much each speaks for a quantity."""

FOREIGN_WORDS = frozenset(
    (
        *("error", "err", "deviation", "droop", "following", "limit", "max", "min", "load", "ratio", "temp", "temperature"),
        *("status", "state", "seq", "id", "acc", "acceleration", "jerk", "counter", "digital", "selected", "power"),
    )
)
"""It is no channel of a record."""


def words_of(name: str) -> list[str]:
    """The words of a column's name, small; it is cut at capitals, digits and signs, and a unit in brackets is left out."""
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", re.sub(r"[\[(<{].*", "", name))
    return [word.casefold() for word in re.findall(r"[^\W\d_]+", spaced)]
