"""The words in the names of a log's columns, and what they say of a column.

English and German, the commonest ones of French, Italian, Spanish and romanised Japanese.
"""

from __future__ import annotations

import re
from functools import cache

__all__ = ["COMMAND_WORDS", "FOREIGN_WORDS", "MEASURED_WORDS", "QUANTITY_WORDS", "words_of"]

COMMAND_WORDS = frozenset(
    (
        *("r", "ref", "reference", "cmd", "command", "soll", "sollwert", "set", "setpoint", "setpt", "sp", "target"),
        *("desired", "demand", "des", "demanded", "commanded", "vcmd", "pcmd", "icmd"),
        *("consigne", "riferimento", "consigna", "referencia", "shirei"),
    )
)
"""It is a command; r only as the whole name."""

MEASURED_WORDS = frozenset(
    (
        *("act", "actual", "ist", "istwert", "meas", "measured", "gemessen", "fb", "fbk", "feedback", "est", "estimate"),
        *("estimated", "real", "motor", "servo", "vfb", "pfb"),
        *("mesure", "mesurée", "mesuré", "réelle", "reelle", "attuale", "misurata", "actuel", "actuelle", "medida"),
    )
)
"""It is of the motor, and what happened rather than what was asked for."""

QUANTITY_WORDS: dict[str, dict[str, int]] = {
    "velocity": {
        **dict.fromkeys(("velocity", "vel", "velo", "speed", "spd", "omega", "drehzahl", "geschwindigkeit", "rpm"), 4),
        **dict.fromkeys(("vitesse", "velocità", "velocita", "velocidad", "sokudo", "vcmd", "vfb"), 4),
        **dict.fromkeys(("w", "wm", "n", "v", "vl", "dq", "qd"), 2),
    },
    "torque": {
        **dict.fromkeys(("torque", "trq", "moment", "momenten", "drehmoment", "tau", "force", "kraft", "effort"), 4),
        **dict.fromkeys(("couple", "coppia", "toruku"), 4),
        **dict.fromkeys(("current", "strom", "iq", "thrust", "icmd"), 3),
        **dict.fromkeys(("u", "m", "i", "il", "par"), 2),
    },
    "position": {
        **dict.fromkeys(
            ("position", "pos", "angle", "theta", "phi", "lage", "winkel", "posizione", "posición", "pcmd", "pfb"), 4
        ),
        **dict.fromkeys(("encoder",), 3),
        **dict.fromkeys(("q", "qm", "enc", "weg", "x", "pl"), 2),
    },
}
"""How much each speaks for a quantity."""

FOREIGN_WORDS = frozenset(
    (
        *("error", "err", "deviation", "droop", "following", "limit", "max", "min", "load", "ratio", "temp", "temperature"),
        *("abweichung", "regelabweichung", "schleppfehler", "fehler", "grenze", "last", "temperatur", "beschleunigung"),
        *("feedforward", "ffw", "precontrol", "vorsteuerung", "setting"),
        *("status", "state", "seq", "id", "acc", "acceleration", "jerk", "counter", "digital", "selected", "power"),
    )
)
"""It is no channel of a record."""


_NUMBERED = re.compile(
    r"^\s*[a-zA-Z](?:\d+(?:\[\d+\])?|(?:-\d+)+)(?=[\s:]+\S)"
)  # a parameter's number before its name: r63, S-0-0040
_JOINTS = ("", "s", "en")  # Geschwindigkeit-s-sollwert, Moment-en-sollwert
_LETTERS = 3  # no decision: shorter words would be found in any name


def words_of(name: str) -> list[str]:
    """The words of a column's name, small; it is cut at capitals, digits and signs, and a unit in brackets is left out.

    A compound of known words is cut as well, as German writes them.

    >>> [words_of(name) for name in ("Motor speed [rpm]", "Solldrehzahl", "Geschwindigkeitsistwert", "Torsion")]
    [['motor', 'speed'], ['soll', 'drehzahl'], ['geschwindigkeit', 'istwert'], ['torsion']]
    """
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", re.sub(r"[\[(<{].*", "", name))
    found = [word.casefold() for word in re.findall(r"[^\W\d_]+", _NUMBERED.sub("", spaced))]
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
