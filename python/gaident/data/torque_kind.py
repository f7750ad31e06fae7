"""What a logged torque is, as far as its name tells: the controller's command, or what was measured behind the actuator."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import pairwise

from gaident.data.column_words import COMMAND_WORDS, FOREIGN_WORDS, MEASURED_WORDS, QUANTITY_WORDS, words_of

__all__ = [
    *("COMMANDED", "HELD", "MEAN", "MEASURED", "SAMPLE", "SMOOTH", "TORQUE_KINDS", "TORQUE_LOGS"),
    *("kind_of_torque", "kind_of_column"),
]

COMMANDED, MEASURED = "commanded", "measured"
TORQUE_KINDS = (COMMANDED, MEASURED)
"""What a logged torque may be: the controller's command, or a measured current times a constant."""
SAMPLE, MEAN, HELD, SMOOTH = "sample", "mean", "held", "smooth"
TORQUE_LOGS = (SAMPLE, MEAN, HELD, SMOOTH)
"""What a line of the log contains of it: its value there, its mean since the line before, or its value there and how it goes on:
held until the next line, or smoothly, without steps."""

_BEHIND_ACTUATOR = (MEASURED_WORDS - {"motor", "servo", "real", "est", "estimate", "estimated"}) | {"sensor"}
_CURRENT = frozenset({"current", "strom", "courant", "corrente", "corriente", "denryu", "denryuu"})
_QUADRATURE = frozenset({"iq", "isq"})  # a drive's name for the torque-forming current that its transducers see
_SYMBOL = re.compile(r"(?:current|torque|strom|moment|trq|tau|iq|i|m|t)(?=\w\w)")


def kind_of_torque(names: Iterable[str]) -> str | None:
    """ "commanded" or "measured", from a torque column's names; None where they do not say.

    A word for a command (reference, set point, Soll) counts before one for a measurement (actual, feedback, Ist): the actual
    set point is a set point. `I_q` alone is the measured current, and so is the motor's current; a motor's torque may be either.

    >>> [kind_of_torque([name]) for name in ("Iq_ref", "M_ist", "Iist", "I_q", "Motor current [A]", "Motor torque")]
    ['commanded', 'measured', 'measured', 'measured', 'measured', None]
    """
    words = {word for name in names for word in _split(name)}
    if words & COMMAND_WORDS:
        return COMMANDED
    of_motor = "motor" in words and bool(words & _CURRENT)
    return MEASURED if of_motor or words & (_BEHIND_ACTUATOR | _QUADRATURE) else None


def kind_of_column(names: Iterable[str]) -> str | None:
    """The same for any column: None where its name speaks of no torque and no current."""
    all_names = tuple(names)
    words = {word for name in all_names for word in _split(name)}
    return kind_of_torque(all_names) if words & QUANTITY_WORDS["torque"].keys() and not words & FOREIGN_WORDS else None


def _split(name: str) -> list[str]:
    """The words, with what stands behind a symbol as a word of its own: `Iist` is I and ist, `I_q` is iq."""
    words = words_of(name)
    cut = [(symbol[0], word[symbol.end() :]) for word in words if (symbol := _SYMBOL.match(word)) is not None]
    behind = [part for symbol, rest in cut if rest in COMMAND_WORDS | _BEHIND_ACTUATOR for part in (symbol, rest)]
    joined = ["iq" for pair in pairwise([word for word in words if word != "axis"]) if pair == ("q", "current")]
    return [*words, *behind, *joined]
