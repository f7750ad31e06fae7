"""Findings in one plain sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.diagnosis.offset import Offset
from gaident.models.effects import table

__all__ = ["evidence_of"]


def evidence_of(effect: str, gain: float, alternatives: Sequence[str], offset: Offset | None = None) -> str:
    """What speaks for a finding: what it does, the BIC units that it is worth, what these data cannot tell from it."""
    meaning = next(row.meaning for row in table() if row.name == effect).split(";")[0].replace(" (Dahl)", "")
    worth = f"{meaning[0].upper()}{meaning[1:]}: without it the model is {gain:.0f} BIC units worse"
    if alternatives:
        return f"{worth}, but these data cannot tell it from {' or '.join(a.replace('_', ' ') for a in alternatives)}."
    if effect == "asymmetric_friction" and offset is not None:
        return f"{worth}. {offset.sentence}"
    return f"{worth}."
