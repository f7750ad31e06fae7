"""The words in the names of a log's columns, English and German, and what they say of a column."""

from __future__ import annotations

import re
from functools import cache

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
        *("abweichung", "regelabweichung", "schleppfehler", "fehler", "grenze", "last", "temperatur", "beschleunigung"),
        *("status", "state", "seq", "id", "acc", "acceleration", "jerk", "counter", "digital", "selected", "power"),
    )
)
"""It is no channel of a record."""


_JOINTS = ("", "s", "en")  # Geschwindigkeit-s-sollwert, Moment-en-sollwert
_LETTERS = 3  # no decision: shorter words would be found in any name


def words_of(name: str) -> list[str]:
    """The words of a column's name, small; it is cut at capitals, digits and signs, and a unit in brackets is left out.

    A compound of known words is cut as well, as German writes them.

    >>> [words_of(name) for name in ("Motor speed [rpm]", "Solldrehzahl", "Geschwindigkeitsistwert", "Torsion")]
    [['motor', 'speed'], ['soll', 'drehzahl'], ['geschwindigkeit', 'istwert'], ['torsion']]
    """
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", re.sub(r"[\[(<{].*", "", name))
    found = [word.casefold() for word in re.findall(r"[^\W\d_]+", spaced)]
    return [part for word in found for part in _parts(word) or (word,)]


@cache
def _known() -> frozenset[str]:
    """Words that a compound may be made of."""
    quantities = (word for words in QUANTITY_WORDS.values() for word in words)
    return frozenset(w for w in (*quantities, *COMMAND_WORDS, *MEASURED_WORDS, *FOREIGN_WORDS) if len(w) >= _LETTERS)


@cache
def _parts(word: str) -> tuple[str, ...]:
    """The known words that a word is made of, without a rest, the longest first; () where there are none."""
    if word in _known():
        return (word,)
    for end in range(len(word) - _LETTERS, _LETTERS - 1, -1):
        first = word[:end]
        if first not in _known():
            continue
        for joint in _JOINTS:
            rest = word[end + len(joint) :] if word.startswith(joint, end) else ""
            if rest and (parts := _parts(rest)):
                return (first, *parts)
    return ()
