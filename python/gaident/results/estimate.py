"""A parameter and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Estimate"]


@dataclass(frozen=True)
class Estimate:
    """One parameter: value and standard deviation in `unit`.

    std is nan for a parameter at a bound of its search range (`at_bound`), inf where the record says nothing about it.
    identifiable: the record determines it to better than its own size.
    """

    value: float
    std: float
    unit: str
    at_bound: bool = False
    identifiable: bool = True
