"""Findings in one plain sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.axis import Text, say
from gaident.diagnosis.library.terms import TWO_LEVELS
from gaident.diagnosis.selection.offset import Offset
from gaident.models.effects import table

__all__ = ["evidence_of"]


def evidence_of(effect: str, gain: float, alternatives: Sequence[str], offset: Offset | None = None) -> Text:
    """What speaks for a finding: what it does, how sure that is, what these data cannot tell from it."""
    from gaident.show.wording import certainty

    what = next(row.says for row in table() if row.name == effect).begun()
    sure, worse = certainty(gain), f"(the model without it is {gain:.0f} BIC units worse)"
    if alternatives:
        others = " or ".join(a.replace("_", " ") for a in alternatives)
        return say("{}, or {}: one of these is there, {} {}; these data do not say which.", what, others, sure, worse)
    if effect == TWO_LEVELS.name and offset is not None:
        return say("{}: {} {}. {}", what, sure, worse, offset.sentence)
    return say("{}: {} {}.", what, sure, worse)
