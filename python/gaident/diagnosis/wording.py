"""Findings in one plain sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gaident.diagnosis.stepwise import Rival
from gaident.identification.covariance import Estimate
from gaident.models.effects import table

__all__ = ["evidence_of", "value_text"]


def evidence_of(
    effect: str, parameters: Mapping[str, Estimate], gain: float, rivals: Sequence[Rival], alternatives: Sequence[str]
) -> str:
    """What speaks for a finding, and how far behind the next explanation is."""
    meaning = next(row.meaning for row in table() if row.name == effect)
    numbers = ", ".join(f"{name.replace('_', ' ')} {value_text(e)}" for name, e in parameters.items())
    text = f"{effect.replace('_', ' ')} ({meaning}): {numbers}; worth {gain:.0f} BIC units on whitened errors."
    if alternatives:
        names = " or ".join(a.replace("_", " ") for a in alternatives)
        return f"{text} These data cannot tell it from {names}."
    if rivals:
        nearest = rivals[0]
        return f"{text} The next explanation, {nearest.effect.replace('_', ' ')}, is {nearest.behind:.0f} worse."
    return text


def value_text(e: Estimate) -> str:
    """Value with its standard deviation, two digits of it, and the unit."""
    unit = "" if e.unit in ("", "1") else f" {e.unit}"
    if not 0.0 < e.std < float("inf"):
        return f"{e.value:.4g}{unit}"
    return f"{e.value:.4g} +- {e.std:.2g}{unit}"
