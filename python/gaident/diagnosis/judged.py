"""What is reported of a search, before it becomes a result."""

from __future__ import annotations

from typing import NamedTuple

from gaident.diagnosis.check import Check
from gaident.diagnosis.gains import Gains
from gaident.diagnosis.selection.offset import Offset
from gaident.models.model import Model
from gaident.results.estimate import Estimate

__all__ = ["Judged"]


class Judged(NamedTuple):
    """Figures, what the error that is left depends on, effects that count, all numbers."""

    gains: Gains
    driver: str | None
    causes: list[str]
    estimates: dict[str, dict[str, Estimate]]
    offset: Offset | None
    mechanics: dict[str, Estimate]
    model: Model
    check: Check
