"""What was expected of the mechanism, beside what was found.

A diagnosis looks for the mechanism where the records show it: a range that is given bounds no search.
A value found outside of its range, beyond its deviation, is said: one of the two is wrong, and only the reader can tell which.
"""

from __future__ import annotations

from collections.abc import Mapping

from gaident.axis import Text, say, unit_text
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["FOUND_AS", "outside_of"]

FOUND_AS = {"inertia": "inertia", "resonance_hz": "resonance", "damping": "viscous_friction"}
"""Of what is expected -> its name among the mechanical parameters."""
CALLED = {"inertia": say("{inertia}"), "resonance_hz": Text("resonance"), "damping": Text("viscous friction")}


def outside_of(expected: Mapping[str, tuple[float, float]], mechanics: Mapping[str, Estimate]) -> list[Text]:
    """Notes on values that were found outside of what was expected; none where nothing of that name was found."""
    text = (
        "The {} was found as {:.4g} +- {:.2g} {}, outside of the range that was given ({:g} to {:g}): the mechanism is looked "
        "for where the records show it, and one of the two is wrong."
    )
    notes = []
    for name, (low, high) in expected.items():
        found = mechanics.get(FOUND_AS[name])
        if found is None:
            continue
        room = POLICY.contradiction * found.std
        if found.value < low - room or found.value > high + room:
            notes.append(say(text, CALLED[name], found.value, found.std, unit_text(found.unit), low, high))
    return notes
