"""What the name of a log's column says: of which quantity it is, whether it was commanded or measured, what leaves a doubt."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gaident.data.column_words import (
    COMMAND_WORDS,
    FOREIGN_WORDS,
    LOAD_SENSORS,
    MEASURED_WORDS,
    NO_LOAD_SENSOR,
    QUANTITY_WORDS,
    UNSURE_AT_THE_END,
    UNSURE_WORDS,
    words_of,
)
from gaident.policy.table import POLICY

__all__ = ["NameSays", "load_says", "name_says"]

_BETWEEN = re.compile(r"[/!]|::|\.(?!\s)")  # what separates the parts of a path
_BRACKET = re.compile(r"\[[^\]]*\]?")  # [rad/s], [0]
_FIELD_CURRENT = frozenset(("current", "strom"))  # beside d: the current that forms the field
_ENCODERS = frozenset(("encoder", "geber", "lastgeber"))
_OF_A_PATH = frozenset(("state", "field"))  # foreign as a signal's own name, not as a folder of signals


@dataclass(frozen=True)
class NameSays:
    """quantities: how much speaks for each; commanded, measured: whether a word says so; foreign: no channel of a record.

    unsure: whether nobody but the user knows which channel it is.
    """

    quantities: Mapping[str, int]
    commanded: bool
    measured: bool
    foreign: bool
    unsure: bool


def name_says(names: Iterable[str], unit: str | None = None) -> NameSays:
    """What the names of one column say together; unit: the column's, which may stand at the end of a name.

    >>> said = name_says(["Model Root/Speed Controller/Torque Command/Out1"])
    >>> dict(said.quantities), said.commanded
    ({'torque': 4}, True)
    >>> name_says(["axis0.controller.input_vel"]).unsure
    True
    """
    found = [_one(_without_unit(name, unit)) for name in names]
    quantities: dict[str, int] = {}
    for said in found:
        for quantity, much in said.quantities.items():
            quantities[quantity] = max(much, quantities.get(quantity, 0))
    commanded, measured = any(s.commanded for s in found), any(s.measured for s in found)
    tied = sorted(quantities.values())[-2:]
    unsure = len(tied) > 1 and tied[0] == tied[1]
    return NameSays(
        quantities, commanded, measured, any(s.foreign for s in found), unsure or any(s.unsure for s in found if s.quantities)
    )


def load_says(names: Iterable[str], unit: str | None = None) -> Mapping[str, int]:
    """How much speaks for a position and for a velocity that a sensor at the load measured; {} where anything leaves a doubt.

    >>> [dict(load_says([name])) for name in ("Load position", "load speed actual", "Lastgeber", "Load torque", "load_pos_ref")]
    [{'position': 4}, {'velocity': 4}, {'position': 3}, {}, {}]
    """
    found: dict[str, int] = {}
    for name in names:
        bare = _BRACKET.sub("", _without_unit(name, unit))
        plain = {word for part in _BETWEEN.split(bare) for word in re.findall(r"[^\W\d_]+", part.casefold())}
        words = plain | {word for part in _BETWEEN.split(bare) for word in words_of(part)}
        marks = next((marks for marks in LOAD_SENSORS if marks <= words), frozenset[str]())
        if not marks or words & (NO_LOAD_SENSOR | COMMAND_WORDS | UNSURE_WORDS | (FOREIGN_WORDS - {"load", "last"})):
            continue
        said = _quantities([word for word in words if len(word) > 1], True, False)
        if not said and not marks.isdisjoint(_ENCODERS):
            said = {"position": POLICY.related_points}
        if said.get("velocity"):
            said.pop("position", None)  # a velocity of an encoder
        if said.keys() <= {"position", "velocity"}:
            found = {**found, **said}
    return found if len(found) == 1 else {}


def _one(name: str) -> NameSays:
    """What one name says. Of a path the last part that names a quantity counts, and the last that says commanded or measured."""
    parts = [words for part in _BETWEEN.split(_BRACKET.sub("", name)) if (words := words_of(part))]
    every = {word for words in parts for word in words}
    if name.strip().casefold() != "r":
        parts = [[word for word in words if word != "r"] for words in parts]
    kind = next((k for words in reversed(parts) if (k := _kind(words))), "")
    quantities: dict[str, int] = {}
    own: list[str] = []
    letters = True
    for words in reversed(parts):
        quantities = _quantities(words, letters, bool(kind))
        if quantities:
            own = words
            break
        letters = letters and bool(_kind(words))  # pid.x.output: x is the axis, not what the signal is
    if not quantities and parts and kind == "commanded" and set(parts[-1]) <= COMMAND_WORDS:
        quantities, own = {"velocity": 1}, parts[-1]  # "command", "setpoint": of what, nobody says
    foreign = bool((FOREIGN_WORDS & every) - (_OF_A_PATH - set(own))) or ("d" in own and bool(_FIELD_CURRENT & set(own)))
    plain = parts[-1:] in ([["r"]], [["command"]])
    open_word = bool(UNSURE_WORDS & set(own)) or bool(UNSURE_AT_THE_END & set(own[-1:]))
    unsure = (open_word and not kind) or "d" in own or (quantities == {"velocity": 1} and not plain)
    return NameSays(quantities, kind == "commanded", kind == "measured", foreign, unsure)


def _kind(words: Iterable[str]) -> str:
    """ "commanded", "measured" or "": the actual set point is a set point."""
    there = set(words)
    return "commanded" if there & COMMAND_WORDS else "measured" if there & MEASURED_WORDS else ""


def _quantities(words: list[str], letters: bool, said: bool) -> dict[str, int]:
    """How much speaks for each quantity; letters: whether single letters count; said: whether it is commanded or measured."""
    found = {
        quantity: max((known.get(word, 0) for word in words if word != "f" or said), default=0)
        for quantity, known in QUANTITY_WORDS.items()
    }
    return {quantity: much for quantity, much in found.items() if much > (0 if letters else POLICY.letter_points)}


def _without_unit(name: str, unit: str | None) -> str:
    """The name without a unit at its end: "n in 1/min", "n / 1/min", "speed_rpm", "n (1/min)"."""
    if unit is None:
        return name
    bare = re.sub(rf"\s*[(]{re.escape(unit)}[)]", "", name)
    return re.sub(rf"(?:\s+in\s+|\s*[/,]\s*|[\s_-]+){re.escape(unit)}\s*$", "", bare)
