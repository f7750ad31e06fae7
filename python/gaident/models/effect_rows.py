"""The rows of the table of effects, what they allow, and the table as it prints.

A shaft effect may act at either side of an elastic shaft.
What acts at the load has a key of its own, "coulomb_friction@load": the core's name for it, and what fits, searches and exports
tell effects apart by.

An effect may have several waves of the angle, whose torques or ripples add up: the parameters of the first wave have their plain
names, those of the second amplitude_2, order_2, phase_2, and so on.
The core takes several waves as an effect of its own, "cogging_waves", with as many as it can have; those of amplitude 0 are none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from html import escape
from numbers import Real
from typing import Any, NamedTuple, TypeVar

import numpy as np

from gaident import _core
from gaident.axis import Text
from gaident.checks import LARGEST, known_keys, one_of, real_number
from gaident.errors import ModelError
from gaident.models.own_effects import Parameter

__all__ = [
    *("AT_LOAD", "SHAFT", "SIDES", "Row", "Table", "checked_parameters", "checked_side", "checked_value"),
    *("by_wave", "core_key", "effect_and_side", "end_words", "key_of", "of_one_wave", "wave_of"),
]

Value = TypeVar("Value")

SHAFT = "shaft"
"""The place of effects that add a torque."""
SIDES = ("motor", "load")
AT_LOAD = "@load"
WAVES = "_waves"


def effect_and_side(key: str) -> tuple[str, str]:
    """(name, side) of a key; the side is "motor" for effects that have none, too."""
    name, at, _ = key.partition(AT_LOAD)
    return name, SIDES[1] if at else SIDES[0]


def key_of(name: str, side: str) -> str:
    """The key of an effect at a side."""
    return f"{name}{AT_LOAD}" if side == SIDES[1] else name


def core_key(key: str) -> str:
    """The core's name of an effect of this key with several waves."""
    name, side = effect_and_side(key)
    return key_of(f"{name}{WAVES}", side)


def of_one_wave(key: str) -> str:
    """The key of the effect whose several waves the core calls so; another key as it is."""
    name, side = effect_and_side(key)
    return key_of(name.removesuffix(WAVES), side)


def numbered(name: str, wave: int) -> str:
    """The name of a parameter of a wave, the first one being 1."""
    return name if wave == 1 else f"{name}_{wave}"


def wave_of(name: str) -> tuple[str, int]:
    """(plain name, wave) of a parameter's name."""
    plain, _, number = name.rpartition("_")
    return (plain, int(number)) if plain and number.isascii() and number.isdigit() and int(number) > 1 else (name, 1)


def by_wave(parameters: Mapping[str, Value]) -> tuple[dict[str, Value], ...]:
    """The parameters of each wave of an effect, under their plain names; all of them at once where it has one."""
    if numbered("order", 2) not in parameters:
        return (dict(parameters),)
    waves: dict[int, dict[str, Value]] = {}
    for name, value in parameters.items():
        plain, wave = wave_of(name)
        waves.setdefault(wave, {})[plain] = value
    return tuple(waves.values())


def end_words(sides: Sequence[str]) -> str:
    """Where on an elastic shaft an effect acts, for behind its name: at the load; "" where it has no side."""
    if len(sides) > 1:
        return f"at the {' or at the '.join(sides)} (these data do not say which)"
    return f"at the {sides[0]}" if sides else ""


class Row(NamedTuple):
    """One effect of the table.

    Attributes
    ----------
    name : str
        Name of the effect.
    place : {"shaft", "mechanism", "coupling", "actuator", "controller", "sensor", "plant", "record"}
        Where it acts.
    parameters : tuple of Parameter
        Its parameters with units and bounds.
    meaning : str
        What it does, one line.
    simulated : bool
        False: found in records, but not part of a model.
    needs_two_masses : bool
        Whether it acts between two masses, p = 1 and q = 2.
    relation : str
        What the parameters have to meet among themselves; empty if nothing.
    own : bool
        Whether it is user-defined, registered from Python.
    says : Text
        The meaning without what the table says after it, for sentences.
    turns : bool
        Whether it depends on the shaft's angle; False for a user-defined effect, of which it is not known.
    sides : tuple of {"motor", "load"}
        The sides at which it may act; () where it has none. See `Model.with_effect`.
    at_load : bool
        Whether it is the row of a shaft effect at the load; False for all rows of the table.
    waves : int
        How many waves it may have, each with these parameters; 1 for most effects. See `Model.with_effect`.

    See Also
    --------
    table : All rows, with an example.
    """

    name: str
    place: str  # shaft, mechanism, coupling, actuator, controller, sensor, plant or record
    parameters: tuple[Parameter, ...]
    meaning: str
    simulated: bool  # False: found in records, but not part of a model
    needs_two_masses: bool
    relation: str  # what the parameters have to meet among themselves, empty if nothing
    own: bool = False  # registered from Python
    says: Text = Text("")  # the meaning without what the table says after it, for sentences
    turns: bool = False  # depends on the shaft's angle
    at_load: bool = False  # the row of a shaft effect at the load, which is none of the table
    waves: int = 1  # at most

    @property
    def sides(self) -> tuple[str, ...]:
        """The sides at which the effect may act; () where it has none."""
        return SIDES if self.place == SHAFT else ()

    @property
    def key(self) -> str:
        """What tells it from all others: its name, at the load with that behind it."""
        return key_of(self.name, SIDES[self.at_load])

    def there(self) -> Row:
        """The row of the same effect at the load."""
        return self._replace(at_load=True, needs_two_masses=True)

    def of_waves(self, count: int) -> Row:
        """The row of the effect with so many waves."""
        return self._replace(
            parameters=tuple(p._replace(name=numbered(p.name, k + 1)) for k in range(count) for p in self.parameters)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the row for JSON."""
        parameters = [p.to_dict() for p in self.parameters]
        return {"name": self.name, "place": self.place, "parameters": parameters, "meaning": self.meaning}


class Table(tuple[Row, ...]):
    """All effects, in the order of the documentation; prints as a table.

    See Also
    --------
    table : Makes it, with an example.
    """

    __slots__ = ()

    def __str__(self) -> str:
        rows = [("effect", "place", "parameters", "meaning")]
        for row in self:
            units = ", ".join(f"{p.name} [{p.unit}]" for p in row.parameters)
            rows.append((row.name, row.place, units, row.meaning))
        widths = [max(len(row[i]) for row in rows) for i in range(3)]
        lines = ["  ".join([*(cell.ljust(w) for cell, w in zip(row, widths, strict=False)), row[3]]) for row in rows]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        rows = [(r.name, r.place, ", ".join(f"{p.name} [{p.unit}]" for p in r.parameters), r.meaning) for r in self]
        left = 'style="text-align:left"'
        head = "".join(f"<th {left}>{title}</th>" for title in ("effect", "place", "parameters", "meaning"))
        body = "".join("<tr>" + "".join(f"<td {left}>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def checked_parameters(row: Row, given: object) -> dict[str, float]:
    """The parameters of an effect in the order of the table, one wave's after the other's; raises ModelError.

    given: name -> value; of an effect that may have several waves also name -> list with an entry for each wave.
    """
    row, parameters = _one_by_one(row, given)
    names = [p.name for p in row.parameters]
    known = known_keys(parameters, f"effect {row.name}", names, names, ModelError)
    values = {p.name: checked_value(row, p, known[p.name]) for p in row.parameters}
    broken = _core.broken_relation(row.name, list(values.values())) if row.relation else ""
    if broken:
        shown = ", ".join(f"{k} {v:g}" for k, v in values.items())
        raise ModelError(f"effect {row.name} has {shown}: {broken}")
    return values


def _one_by_one(row: Row, given: object) -> tuple[Row, object]:
    """(row of as many waves as are given, parameters with those of each wave under names of their own); raises ModelError."""
    if row.waves == 1 or not isinstance(given, Mapping):
        return row, given
    given = {name: value[()] if isinstance(value, np.ndarray) and value.ndim == 0 else value for name, value in given.items()}
    lists = {name: list(value) for name, value in given.items() if isinstance(value, list | tuple | np.ndarray)}
    if lists:
        lengths = {name: len(value) for name, value in lists.items()}
        what = ", ".join(f"{name} {lengths.get(name, value)}" for name, value in given.items())
        count = next(iter(lengths.values()))
        if len(lists) < len(given) or {*lengths.values()} != {count} or not 1 <= count <= row.waves:
            raise ModelError(
                f"the waves of {row.name} are given by lists with so many entries: {what}; give each of its parameters as a list "
                f"with an entry for each wave, from 1 to {row.waves}"
            )
        given = {numbered(name, k + 1): value[k] for k in range(count) for name, value in lists.items()}
    plain = {p.name for p in row.parameters}
    named = {name: wave_of(name) for name in given if isinstance(name, str)}
    orders = {n: given[n] for n, (of, _) in named.items() if of == "order" and isinstance(given[n], Real)}
    for name, value in orders.items():
        first = next((n for n, other in orders.items() if other == value), name)  # a value that is no number equals none
        if first != name:
            raise ModelError(f"{name} of {row.name} is {value:g}, as {first} is: give one wave of each order")
    count = max((wave for of, wave in named.values() if of in plain), default=1)
    return row.of_waves(min(count, row.waves)), given


def checked_side(row: Row, side: object) -> str:
    """The side; "" of an effect that has none."""
    one_of(side, f"side of {row.name}", SIDES, ModelError)
    if side in row.sides:
        return str(side)
    if side == SIDES[1]:
        raise ModelError(f"side of {row.name} is {side!r}: it is in the {row.place} and has no other side; leave side out")
    return SIDES[0] if row.sides else ""


def checked_value(row: Row, parameter: Parameter, value: object) -> float:
    """The value of a parameter, within its bounds; raises ModelError."""
    unit = "without unit" if parameter.unit == "1" else f"in {parameter.unit}"
    bounds = f" {parameter.bounds}" if parameter.bounds else ""
    what = f"{parameter.name} of {row.name}"
    if parameter.neutral == math.inf and isinstance(value, float) and value == math.inf:
        return value
    number = real_number(value, what, ModelError, f"give one finite number{bounds} {unit}")
    low = number <= parameter.lowest if parameter.above_lowest else number < parameter.lowest
    if low or number > parameter.highest:
        raise ModelError(f"{what} is {number:g}: give a number{bounds} {unit}")
    if abs(number) > LARGEST:
        raise ModelError(f"{what} is {number:g}, which no drive has ({LARGEST:g} at most): give a number{bounds} {unit}")
    return number
