"""Arguments that messages name, kept apart from the text: Python and the command line each say them in their own words."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["A_CONTROLLER", "COMMAND", "CONTINUOUS_LOOP", "NO_CONTROLLER", "NO_TIME", "TORQUE", "Argument", "arg", "parts_of"]


@dataclass(frozen=True)
class Argument:
    """An argument that a message names.

    name: of the argument, value: as Python writes it ("" for none), key: where the argument is a mapping. python: how a message
    in Python names it; "" for name=value or name={key: value}.
    """

    name: str
    value: str = ""
    key: str = ""
    python: str = ""

    def __str__(self) -> str:
        if self.python:
            return self.python
        return f"{self.name}={{{self.key!r}: {self.value}}}" if self.key else f"{self.name}={self.value}"


_START, _NEXT, _END = "\x02", "\x1f", "\x03"  # control characters, which no message contains otherwise


def arg(name: str, value: str = "", key: str = "", python: str = "") -> str:
    """A reference to an `Argument`, for the text of a message: `raise ReadError(f"give {arg('dt')} [s]")`.

    The error's message says it as Python does, "give dt= [s]"; who speaks otherwise, as the command line does, finds the
    arguments among the error's `parts`.
    """
    return f"{_START}{_NEXT.join((name, value, key, python))}{_END}"


def parts_of(marked: str) -> tuple[str | Argument, ...]:
    """A message with references, as texts and arguments."""
    found: list[str | Argument] = []
    for i, piece in enumerate(marked.split(_START)):
        reference, end, text = piece.partition(_END)
        fields = reference.split(_NEXT)
        # no decision: a format: what `arg` writes; a text of a user's may contain the same characters
        found += [Argument(*fields), text] if i and end and len(fields) == 4 else [piece]
    return tuple(p for p in found if p)


NO_CONTROLLER, A_CONTROLLER = arg("controller", "None"), arg("controller", "PI(...)")
CONTINUOUS_LOOP = arg("loop", "'continuous'", python="PI(..., loop='continuous')")
TORQUE = arg("columns", "...", "torque", "Record(torque=...)")
COMMAND = arg("columns", "...", "command", "Record(command=...)")
NO_TIME = arg("columns", "None", "time")
