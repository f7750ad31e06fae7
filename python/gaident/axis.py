"""A rotary and a linear axis: what each calls the same thing, and sentences that are written for both at once.

Inside, a linear axis has m, m/s and N in the places of rad, rad/s and N m.
What it is called is decided where a sentence is made: the words and units that differ stand in braces,
and both sentences are made from the same numbers.

    >>> limit = say("a limit above {:.3g} {N m} would not have shown: no more {torque} was asked for", 1.25)
    >>> print(limit)
    a limit above 1.25 N m would not have shown: no more torque was asked for
    >>> print(limit.linear)
    a limit above 1.25 N would not have shown: no more force was asked for
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from gaident.arguments import arg, parts_of
from gaident.errors import GaidentError, SettingsError

__all__ = [
    "AXES",
    "TURN",
    "Text",
    "called",
    "checked_axis",
    "identifier_words",
    "joined",
    "linear_sentences",
    "message_of",
    "order",
    "percent",
    "period_of",
    "restored",
    "said",
    "say",
    "turns",
    "unit",
    "unit_text",
    "velocity_unit",
    "word",
]

AXES = ("rotary", "linear")
TURN = math.tau  # no decision: rad, and on a linear axis the same number of m; rad

UNITS: dict[str, str] = {
    "rad": "m",
    "rad/s": "m/s",
    "rad/s^2": "m/s^2",
    "N m": "N",
    "N m/rad": "N/m",
    "N m/rad^3": "N/m^3",
    "N m s/rad": "N s/m",
    "N m s^0.5/rad^0.5": "N s^0.5/m^0.5",
    "N m s^2/rad": "N s^2/m",
    "N m s^2/rad^2": "N s^2/m^2",
    "kg m^2": "kg",
    "1/turn": "1/m",
    "N m/A": "N/A",
    "N m/V": "N/V",
    "rad/s/(N m)": "m/s/N",
    **{f"rad/s^{k}/(N m)": f"m/s^{k}/N" for k in range(2, 30)},  # gains of models, one more than poles in excess of zeros
}
"""Unit of a rotary axis -> of a linear one. An angular frequency or a phase is no motion of the axis: its rad stays rad."""

WORDS: dict[str, str] = {
    "torque": "force",
    "torques": "forces",
    "inertia": "mass",
    "inertias": "masses",
    "angle": "position",
    "angles": "positions",
    "turns": "moves",
    "rotation": "motion",
    "twist": "deflection",
    "per turn": "per metre",
    "once per turn": "once every 6.28 m",
}
"""Word of a rotary axis -> of a linear one."""


def _vocabulary() -> tuple[dict[str, str], dict[str, str]]:
    capitals = {r.capitalize(): m.capitalize() for r, m in WORDS.items()}
    linear = {**UNITS, **WORDS, **capitals}
    return {name: name for name in linear}, linear


_ROTARY, _LINEAR = _vocabulary()


class Text(str):
    """A sentence in the words of a rotary axis, which says the same of a linear axis too; `say` makes it.

    Words that only one place needs are a Text for a field of `say`: Text("several turns", "long strokes").

    What a string method gives is a plain string and has lost the other sentence: build with `say` and `joined`.
    """

    linear: str

    def __new__(cls, rotary: str, linear: str | None = None) -> Text:
        """rotary: the sentence; linear: the same on a linear axis, None where nothing differs."""
        text = super().__new__(cls, rotary)
        text.linear = str(rotary) if linear is None else linear
        return text

    def begun(self) -> Text:
        """With a capital at its beginning."""
        return Text(self[:1].upper() + self[1:], self.linear[:1].upper() + self.linear[1:])


def say(template: str, *values: object, **named: object) -> Text:
    """The sentence of both axes: the fields of `template` are values as in str.format, and words and units in braces.

    values, named: numbers, words, or a `Text`, which keeps its two sentences.
    Raises KeyError for a word in braces that stands neither in `WORDS` nor in `UNITS`.
    """
    return Text(
        template.format(*values, **(_ROTARY | named)),
        template.format(*map(_of_linear, values), **(_LINEAR | {name: _of_linear(value) for name, value in named.items()})),
    )


def _of_linear(value: object) -> object:
    return value.linear if isinstance(value, Text) else value


def joined(between: str, texts: Iterable[str]) -> Text:
    """`between.join(texts)` that keeps both sentences of each."""
    listed = list(texts)
    return Text(between.join(listed), between.join(said(t, "linear") for t in listed))


def said(text: str, axis: str) -> str:
    """The sentence for a reader of this axis; a plain string is the same for both.

    Raises SettingsError for an axis that is neither "rotary" nor "linear".
    """
    return text.linear if checked_axis(axis) == "linear" and isinstance(text, Text) else str(text)


def message_of(error: GaidentError) -> Text:
    """What an error says, for a sentence of a result."""
    told = error.message
    return Text(str(error), "".join(map(str, parts_of(told.linear)))) if isinstance(told, Text) else Text(str(error))


def checked_axis(axis: str) -> str:
    """`axis`, where it is "rotary" or "linear"; else raises SettingsError."""
    if not isinstance(axis, str) or axis not in AXES:
        raise SettingsError(f"axis is {axis!r}: it must be one of {', '.join(map(repr, AXES))}")
    return axis


def period_of(axis: str, pitch: float | None) -> float | None:
    """What is tied to the place returns with: a turn [rad], the pitch of a linear axis [m], None where that is not known.

    Raises SettingsError for a pitch that is no positive length, and for one of a rotary axis.
    """
    if pitch is None:
        return TURN if checked_axis(axis) == "rotary" else None
    remedy = "give the length in m with which a force returns, for example 0.024"
    if isinstance(pitch, bool) or not isinstance(pitch, int | float) or not 0.0 < pitch < math.inf:
        raise SettingsError(f"pitch is {pitch!r}: {remedy}")
    if checked_axis(axis) == "rotary":
        raise SettingsError(
            f"pitch is {pitch!r}, which belongs to a linear axis: say {arg('axis', repr('linear'))}, or leave it out"
        )
    return float(pitch)


def unit(rotary: str, axis: str = "rotary") -> str:
    """The unit of the axis for that of a rotary one; one that is not in the table, of an effect of one's own, stays.

    Raises SettingsError for an axis that is neither "rotary" nor "linear".
    """
    return UNITS.get(rotary, rotary) if checked_axis(axis) == "linear" else rotary


def called(name: str) -> Text:
    """A name of the library such as torque, static_torque or load_inertia, in words for a field of `say`."""
    return Text(identifier_words(name, "rotary"), identifier_words(name, "linear"))


def unit_text(rotary: str) -> Text:
    """A unit for a field of `say`, where its name is no constant."""
    return Text(rotary, unit(rotary, "linear"))


def velocity_unit(axis: str = "rotary") -> str:
    """rad/s or m/s."""
    return unit("rad/s", axis)


def word(rotary: str, axis: str) -> str:
    """ "torque" or "Torque" and other words of the table, as the axis calls it. Raises KeyError for another one."""
    return (_LINEAR if checked_axis(axis) == "linear" else _ROTARY)[rotary]


def identifier_words(name: str, axis: str) -> str:
    """A name of the library such as static_torque or load_inertia, as a reader of the axis reads it: load mass."""
    words = name.split("_")
    return " ".join(WORDS.get(w, w) for w in words) if checked_axis(axis) == "linear" else " ".join(words)


def turns(travel: float, digits: int = 2) -> Text:
    """A travel [rad], in turns; of a linear axis in m."""
    return Text(f"{travel / TURN:.{digits}g} turns", f"{travel:.{digits}g} m")


def order(per_turn: float) -> Text:
    """An order [1/turn]; on a linear axis in 1/m."""
    return Text(f"{per_turn:g}", f"{per_turn / TURN:.2g} 1/m")


def percent(share: float) -> str:
    """A share [1] in whole percent: "70 %"."""
    return f"{100.0 * share:.0f} %"


def linear_sentences(texts: Iterable[str]) -> dict[str, str]:
    """Sentence -> the same on a linear axis, of those that differ: what a saved result contains beside its sentences."""
    return {str(t): t.linear for t in texts if isinstance(t, Text) and t.linear != t}


def restored(text: str, linear: Mapping[str, str]) -> str:
    """A saved sentence with what `linear_sentences` contains of it."""
    return Text(text, linear[text]) if text in linear else text
