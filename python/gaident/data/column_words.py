"""The words in the names of a log's columns, and what they say of a column.

English, German, French, Italian, Spanish and romanised Japanese, as drives and their tools write them.
"""

from __future__ import annotations

import re
import unicodedata
from functools import cache

from gaident.policy.table import POLICY

__all__ = [
    "COMMAND_WORDS",
    "FOREIGN_WORDS",
    "LOAD_SENSORS",
    "MEASURED_WORDS",
    "NO_LOAD_SENSOR",
    "QUANTITY_WORDS",
    "UNSURE_AT_THE_END",
    "UNSURE_WORDS",
    "words_of",
]

COMMAND_WORDS = frozenset(
    (
        *("r", "ref", "reference", "cmd", "command", "soll", "sollwert", "set", "setpoint", "setpt", "sp", "target"),
        *("desired", "demand", "des", "demanded", "commanded", "vcmd", "pcmd", "icmd", "tcmd", "rvel", "rpos", "nominal"),
        *("vorgabe", "consigne", "référence", "riferimento", "richiesta", "richiesto", "comandata", "comandato", "nominale"),
        *("teorica", "consigna", "referencia", "comandada", "comandado", "shirei", "shireichi", "mokuhyou", "mokuhyo"),
    )
)
"""It is a command; r only as the whole name."""

MEASURED_WORDS = frozenset(
    (
        *("act", "actual", "actl", "ist", "istwert", "meas", "measured", "gemessen", "gemessene", "gemessenes", "fb", "fbk"),
        *("feedback", "est", "estimate", "estimated", "real", "motor", "servo", "vfb", "pfb", "fvel", "fpos", "active", "wirk"),
        *("aktuell", "aktuelle", "aktueller", "aktuelles", "mesure", "mesurée", "mesuré", "réelle", "réel", "reelle", "estimée"),
        *("retour", "actif", "attuale", "misurata", "misurato", "effettiva", "effettivo", "reale", "actuel", "actuelle"),
        *("medida", "medido", "jitsu", "jissokudo", "genzai", "kikan"),
    )
)
"""It is of the motor, and what happened rather than what was asked for."""


def _points(names: str, related: str, letters: str) -> dict[str, int]:
    """Word -> points; names of the quantity, of what comes with it, and of a letter or two."""
    listed = ((names, POLICY.name_points), (related, POLICY.related_points), (letters, POLICY.letter_points))
    return {word: points for words, points in listed for word in words.split()}


QUANTITY_WORDS: dict[str, dict[str, int]] = {
    "velocity": _points(
        "velocity velocities vel velo speed spd omega drehzahl geschwindigkeit winkelgeschwindigkeit rpm vitesse velocità "
        "velocita velocidad sokudo jissokudo kaitensuu kaitensu vcmd vfb fvel rvel",
        "",
        "w wm n v vl dq qd",
    ),
    "torque": _points(
        "torque trq moment momenten drehmoment tau force kraft effort couple coppia toruku tcmd",
        "current strom iq isq thrust icmd courant corrente corriente denryuu denryu",
        "u m i il par f",
    ),
    "position": _points(
        "position pos angle theta phi lage winkel posizione posición quota ichi pcmd pfb fpos rpos",
        "encoder codeur",
        "q qm enc weg x s pl",
    ),
}
"""How many points each speaks for a quantity by: its name, what comes with it, a letter or two.

f, a letter of many meanings, speaks only beside a word for a command or a measurement.
"""

FOREIGN_WORDS = frozenset(
    (
        *("error", "err", "deviation", "droop", "following", "limit", "max", "min", "load", "ratio", "temp", "temperature"),
        *("abweichung", "regelabweichung", "regeldifferenz", "differenz", "schleppfehler", "schleppabstand", "fehler", "grenze"),
        *("last", "temperatur", "beschleunigung", "diff", "difference", "lag", "erreur", "poursuite", "errore", "inseguimento"),
        *("seguimiento", "hensa", "pe", "feedforward", "ffw", "precontrol", "vorsteuerung", "setting", "window", "rated", "nenn"),
        *("status", "state", "seq", "id", "acc", "acceleration", "jerk", "qdd", "ddq", "counter", "digital", "selected", "power"),
        *("utilization", "utilisation", "auslastung", "flux", "field", "feldbildend", "reactive", "blind", "voltage", "tcp"),
    )
)
"""It is no channel of a record."""

LOAD_SENSORS = (
    *(frozenset((word,)) for word in ("load", "lastgeber", "lastseitig", "lastseitige", "lastseitiger")),
    *(frozenset((word,)) for word in ("lastdrehzahl", "lastgeschwindigkeit", "lastlage")),
    *(frozenset((which, "encoder")) for which in ("second", "secondary", "external", "ext")),
    *(frozenset((which, "geber")) for which in ("zweiter", "externer")),
)
"""Words that stand together in the name of what a sensor at the load shows."""

NO_LOAD_SENSOR = frozenset(
    ("motor", "servo", "no", "angle", "winkel", "theta", "phi", "master", "leit", "brake", "cell", "without", "ohne")
)
"""It shows something else, or may do so: a load angle is also that of a synchronous machine."""

UNSURE_WORDS = frozenset(("control", "input", "output", "limited", "ziel", "revolution"))
"""It may be commanded or measured, raw or folded: where no other word says which, nobody but the user knows."""

UNSURE_AT_THE_END = frozenset(("in", "out"))
"""The same, as the last word of a name."""


_NUMBERED = re.compile(
    r"^\s*[a-zA-Z](?:\d+(?:\[\d+\])?|(?:-\d+)+)(?=[\s:]+\S)"
)  # a parameter's number before its name: r63, S-0-0040
_IDN = re.compile(r"\b[SP](?:-\d+){2,}")  # S-0-0040 by itself
_CAPITAL = re.compile(r"([^\W\d_A-Z])([A-Z])")
_TYPE_PREFIX = re.compile(r"\b(?:f|lr)(?=[A-Z][a-z])")  # fActVelo, lrSetVelocity: a program's mark for the type of a number
LONGEST_NAME = 1000  # no decision: a format: characters in which the words of a name are looked for
_JOINTS = ("", "s", "en")  # Geschwindigkeit-s-sollwert, Moment-en-sollwert


def words_of(name: str) -> list[str]:
    """The words of a column's name, small; it is cut at capitals, digits and signs, and what stands in square brackets left out.

    A compound of known words is cut as well, as German writes them.

    >>> [words_of(name) for name in ("Motor speed [rpm]", "Solldrehzahl", "Geschwindigkeits-Istwert", "Torsion")]
    [['motor', 'speed'], ['soll', 'drehzahl'], ['geschwindigkeit', 'istwert'], ['torsion']]
    """
    plain = _NUMBERED.sub("", _IDN.sub("", unicodedata.normalize("NFC", name[:LONGEST_NAME])))
    spaced = _CAPITAL.sub(r"\1 \2", _TYPE_PREFIX.sub("", re.sub(r"\[[^\]]*\]?|[<{].*", " ", plain)))
    found = [word.casefold() for word in re.findall(r"[^\W\d_]+", spaced)]
    parts = [part for word in found for part in _parts(word) or _parts(word.removesuffix("s")) or (word,)]
    for k in reversed(range(len(parts) - 1)):
        if parts[k] == "i" and parts[k + 1] in ("q", "d"):  # the two currents of a motor, i_q and i_d
            parts[k : k + 2] = [parts[k] + parts[k + 1]]
    return parts


@cache
def _known() -> frozenset[str]:
    """Words that a compound may be made of."""
    quantities = (word for words in QUANTITY_WORDS.values() for word in words)
    return frozenset(
        w for w in (*quantities, *COMMAND_WORDS, *MEASURED_WORDS, *FOREIGN_WORDS, *UNSURE_WORDS) if len(w) >= POLICY.least_letters
    )


@cache
def _parts(word: str) -> tuple[str, ...]:
    """The known words that a word is made of, without a rest, the longest first; () where there are none."""
    if word in _known():
        return (word,)
    for end in range(len(word) - POLICY.least_letters, POLICY.least_letters - 1, -1):
        first = word[:end]
        if first not in _known():
            continue
        for joint in _JOINTS:
            rest = word[end + len(joint) :] if word.startswith(joint, end) else ""
            if rest and (parts := _parts(rest)):
                return (first, *parts)
    return ()
