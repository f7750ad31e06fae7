"""The effects a model can carry beyond its linear part: a view of the core's registry (csrc/gaident/effects).

ga.effects.table() lists them: place in the loop, parameters with units, one line of meaning.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

from gaident import _core
from gaident.errors import ModelError
from gaident.models._checks import known_keys, one_of, real_number

__all__ = ["Effect", "Parameter", "Row", "Table", "table"]


class Parameter(NamedTuple):
    """One parameter of an effect."""

    name: str
    unit: str  # SI, rad
    neutral: float  # with every neutral value the effect is the identity; nan: any value
    lowest: float  # physical bounds
    highest: float
    above_lowest: bool  # the lowest value itself is not allowed

    @property
    def bounds(self) -> str:
        """The physical bounds in words, empty where there are none."""
        parts = []
        if self.lowest > -math.inf:
            parts.append(f"{'>' if self.above_lowest else '>='} {self.lowest:g}")
        if self.highest < math.inf:
            parts.append(f"<= {self.highest:g}")
        return " and ".join(parts)

    def to_dict(self) -> dict[str, Any]:
        """For JSON: what is not finite (any value, no bound, no limit) is None."""
        numbers = {"neutral": self.neutral, "lowest": self.lowest, "highest": self.highest}
        return {"name": self.name, "unit": self.unit, **{k: v if math.isfinite(v) else None for k, v in numbers.items()}}


class Row(NamedTuple):
    """One effect of the table."""

    name: str
    place: str  # shaft, coupling, actuator, controller, sensor, plant or record
    parameters: tuple[Parameter, ...]
    meaning: str
    simulated: bool  # False: found in records, but not part of a model
    needs_two_masses: bool
    relation: str  # what the parameters have to meet among themselves, empty if nothing

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        parameters = [p.to_dict() for p in self.parameters]
        return {"name": self.name, "place": self.place, "parameters": parameters, "meaning": self.meaning}


class Table(tuple[Row, ...]):
    """All effects, in the order of the documentation; prints as a table."""

    __slots__ = ()

    def __str__(self) -> str:
        rows = [("effect", "place", "parameters", "meaning")]
        for row in self:
            units = ", ".join(f"{p.name} [{p.unit}]" for p in row.parameters)
            rows.append((row.name, row.place, units, row.meaning))
        widths = [max(len(row[i]) for row in rows) for i in range(3)]
        lines = ["  ".join([*(cell.ljust(w) for cell, w in zip(row, widths, strict=False)), row[3]]) for row in rows]
        return "\n".join(lines)


@lru_cache(maxsize=1)
def table() -> Table:
    """Name, place, parameters with units and meaning of every effect; `print(ga.effects.table())` shows it."""
    rows = []
    for name, place, meaning, parameters, simulated, two, relation in _core.effect_table():
        rows.append(Row(name, place, tuple(Parameter(*p) for p in parameters), meaning, simulated, two, relation))
    return Table(rows)


@lru_cache(maxsize=1)
def _by_name() -> dict[str, tuple[int, Row]]:
    return {row.name: (i, row) for i, row in enumerate(table())}


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect with its parameters (name -> value in SI units), checked; equal where both are equal.

    Raises ModelError for an unknown name, unknown or missing parameters and values outside the physical bounds.
    """

    name: str
    parameters: Mapping[str, float]

    def __post_init__(self) -> None:
        one_of(self.name, "the effect's name", _by_name(), ModelError)
        _, row = _by_name()[self.name]
        if not row.simulated:
            raise ModelError(
                f"{self.name} describes a record, not a drive, and cannot be simulated: mask such samples, or let "
                "gaident.diagnose find them"
            )
        names = [p.name for p in row.parameters]
        given = known_keys(dict(self.parameters), f"effect {self.name}", names, names, ModelError)
        values = {p.name: _value(row, p, given[p.name]) for p in row.parameters}
        if row.relation:
            broken = _core.broken_relation(self.name, list(values.values()))
            if broken:
                shown = ", ".join(f"{k} {v:g}" for k, v in values.items())
                raise ModelError(f"effect {self.name} has {shown}: {broken}")
        object.__setattr__(self, "parameters", MappingProxyType(values))

    @property
    def row(self) -> Row:
        """The effect's row in the table."""
        return _by_name()[self.name][1]

    @property
    def values(self) -> tuple[float, ...]:
        """The parameters in the order of the table."""
        return tuple(self.parameters.values())

    def to_dict(self) -> dict[str, Any]:
        """{"name": ..., "parameters": {...}} for JSON; an infinite limit is None."""
        return {"name": self.name, "parameters": {k: v if math.isfinite(v) else None for k, v in self.parameters.items()}}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Effect:
        """The inverse of `to_dict`."""
        keys = ("name", "parameters")
        values: dict[str, Any] = known_keys(data, "an effect", keys, keys, ModelError)
        if not isinstance(values["parameters"], Mapping):
            raise ModelError(f"the parameters of an effect are {values['parameters']!r}: give a dictionary, name -> value")
        return cls(values["name"], {k: math.inf if v is None else v for k, v in values["parameters"].items()})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Effect):
            return NotImplemented
        return self.name == other.name and self.values == other.values

    def __hash__(self) -> int:
        return hash((self.name, self.values))

    def __repr__(self) -> str:
        return f"Effect({self.name!r}, {dict(self.parameters)!r})"

    def __reduce__(self) -> tuple[type[Effect], tuple[Any, ...]]:
        return type(self), (self.name, dict(self.parameters))


def ordered(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects in the order of the table, a later one of the same name in place of an earlier."""
    latest = {effect.name: effect for effect in effects}
    return tuple(sorted(latest.values(), key=lambda effect: _by_name()[effect.name][0]))


def _value(row: Row, parameter: Parameter, value: object) -> float:
    unit = "without unit" if parameter.unit == "1" else f"in {parameter.unit}"
    bounds = f" {parameter.bounds}" if parameter.bounds else ""
    what = f"{parameter.name} of {row.name}"
    if parameter.neutral == math.inf and isinstance(value, float) and value == math.inf:
        return value
    number = real_number(value, what, ModelError, f"give one finite number{bounds} {unit}")
    low = number <= parameter.lowest if parameter.above_lowest else number < parameter.lowest
    if low or number > parameter.highest:
        raise ModelError(f"{what} is {number:g}: give a number{bounds} {unit}")
    return number
