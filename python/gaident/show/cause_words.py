"""What a finding is called: its effect, what these data cannot tell from it, and how large it is."""

from __future__ import annotations

import math

from gaident.axis import identifier_words, unit
from gaident.results.finding import Finding
from gaident.show.wording import number

__all__ = ["either", "missing_words", "size_words", "words"]

_ANGULAR = ("frequency", "zero_frequency")  # angular frequencies in rad/s, which are read in Hz


def words(effect: str, axis: str = "rotary") -> str:
    """The name of an effect as a reader of the axis reads it: torque saturation, of a linear axis force saturation."""
    return identifier_words(effect, axis)


def either(finding: Finding, axis: str = "rotary") -> str:
    """ "a, b or c" of a finding and what these data cannot tell from it."""
    names = [words(name, axis) for name in (finding.effect, *finding.alternatives)]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def size_words(finding: Finding, axis: str) -> str:
    """How large it is, by its first parameter: "0.12 N m"; "" where that is not determined or has no unit."""
    name, e = next(iter(finding.parameters.items()), ("", None))
    if e is None or not e.identifiable or not math.isfinite(e.value) or e.unit == "1":
        return ""
    if name in _ANGULAR:
        return f"{number(e.value / math.tau, 3)} Hz"
    value, u = (1e3 * e.value, "ms") if e.unit == "s" else (e.value, unit(e.unit, axis))
    return f"{number(value, 3)} {u}"


def missing_words(finding: Finding, axis: str) -> str:
    """One of several explanations; where all are kinds of one thing, that with its size: friction, 0.119 N m; its kind is open.

    Kinds of one thing share the last word of their names.
    """
    names = [words(name, axis).split() for name in (finding.effect, *finding.alternatives)]
    size = size_words(finding, axis)
    if not size or len({name[-1] for name in names}) > 1 or min(map(len, names)) == 1:
        return ""
    kinds = [" ".join(name[:-1]) for name in names]
    return f"{names[0][-1]}, {size}; its kind is open ({', '.join(kinds[:-1])} or {kinds[-1]})"
