"""The effects a model can carry beyond its linear part: the core's registry (csrc/gaident/effects), and user-defined ones.

ga.effects.table() lists them: place in the loop, parameters with units, one line of meaning. ga.effects.register(...) adds one
that is a Python function; it then takes part in simulation, diagnosis and report like the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from html import escape
from types import MappingProxyType
from typing import Any, NamedTuple

from gaident import _core
from gaident.axis import Text, say
from gaident.checks import known_keys, one_of, real_number
from gaident.errors import ModelError
from gaident.models.own_effects import OWN, PLACES, Function, Own, Parameter, Signals, checked

__all__ = ["Effect", "Parameter", "Row", "Signals", "Table", "register", "table", "unregister"]


class Row(NamedTuple):
    """One effect of the table.

    Attributes
    ----------
    name : str
        Name of the effect.
    place : {"shaft", "coupling", "actuator", "controller", "sensor", "plant", "record"}
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

    See Also
    --------
    table : All rows, with an example.
    """

    name: str
    place: str  # shaft, coupling, actuator, controller, sensor, plant or record
    parameters: tuple[Parameter, ...]
    meaning: str
    simulated: bool  # False: found in records, but not part of a model
    needs_two_masses: bool
    relation: str  # what the parameters have to meet among themselves, empty if nothing
    own: bool = False  # registered from Python
    says: Text = Text("")  # the meaning without what the table says after it, for sentences
    turns: bool = False  # depends on the shaft's angle

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


@lru_cache(maxsize=1)
def _built_in() -> tuple[Row, ...]:
    rows = []
    for name, place, meaning, parameters, simulated, two, relation, remark, turns in _core.effect_table():
        says = say(meaning)
        whole = say("{}; {}", says, say(remark)) if remark else says
        own = tuple(Parameter(*p) for p in parameters)
        rows.append(Row(name, place, own, whole, simulated, two, relation, says=says, turns=turns))
    return tuple(rows)


@lru_cache(maxsize=1)
def table() -> Table:
    """Return all effects with name, place, parameters with units, and meaning.

    Returns
    -------
    Table
        A tuple of `Row`, user-defined effects last; `print` shows it as a table.

    Examples
    --------
    >>> import gaident as ga
    >>> row = next(row for row in ga.effects.table() if row.name == "coulomb_friction")
    >>> row.place, [(p.name, p.unit, p.bounds) for p in row.parameters]
    ('shaft', [('torque', 'N m', '>= 0')])
    """
    own = (
        Row(o.name, PLACES[o.acts], o.parameters, o.meaning, True, False, "", own=True, says=Text(o.meaning))
        for o in OWN.values()
    )
    return Table((*_built_in(), *own))


@lru_cache(maxsize=1)
def _by_name() -> dict[str, tuple[int, Row]]:
    return {row.name: (i, row) for i, row in enumerate(table())}


def place_of(name: str) -> int:
    """Row of an effect in the table, which is the order in which the core takes effects."""
    return _by_name()[name][0]


def register(
    name: str,
    parameters: Sequence[Parameter],
    *,
    meaning: str,
    torque: Function | None = None,
    friction: Function | None = None,
    actuator: Function | None = None,
    sensor: Function | None = None,
    replace: bool = False,
) -> Row:
    """Add a user-defined effect to the table, for this Python session.

    Exactly one of the four functions says what it does.
    Each takes (signals, one keyword per parameter), see `Signals`; arguments and answer are arrays, an entry per drive simulated
    side by side.
    It is called at every (sub)step, may be asked about anything that a search tries, and keeps nothing from call to call.
    A torque is stable where it changes with the velocity by less than the drive's inertia J over a substep h allows:
    abs(d torque/d velocity) < J/h.

    Parameters
    ----------
    name : str
        Name of the effect, as of a variable, not that of a built-in effect. Saved results name it and load only where it is
        registered.
    parameters : sequence of Parameter
        Their bounds are needed: between them `gaident.diagnose` looks, from `starts` or values spread between the bounds.
        With the neutral values the effect has to do nothing.
    meaning : str
        One line for tables and reports.
    torque : callable, optional
        What is added to the motor's torque [N m]; a brake is negative for positive velocity.
    friction : callable, optional
        Level >= 0 of a dry friction [N m], which stops the motor and keeps it at standstill.
        (A torque that jumps with the direction of the velocity would oscillate about standstill instead.)
    actuator : callable, optional
        The torque that acts [N m] in place of signals.torque, before saturation, dead band, delay and lag.
    sensor : callable, optional
        The velocity that is measured [rad/s] in place of signals.velocity, before ripple, filter and quantisation.
    replace : bool
        Whether a user-defined effect of this name is replaced.

    Returns
    -------
    Row
        The effect's row of the table.

    Raises
    ------
    ModelError
        For a name in use, bounds or neutral values that contradict each other, and a function that does not answer as it has to.

    See Also
    --------
    unregister : Takes it out again.

    Examples
    --------
    >>> import gaident as ga
    >>> def fan(signals, coefficient):
    ...     return -coefficient * signals.velocity**3
    >>> parameter = ga.effects.Parameter("coefficient", "N m s^3/rad^3", neutral=0.0, lowest=0.0, highest=1e-3)
    >>> ga.effects.register("fan", [parameter], meaning="air drag of a fan", torque=fan).place
    'shaft'
    >>> ga.OneMass(J=1e-3, D=0.01).model().with_effect("fan", coefficient=1e-6).effects
    (Effect('fan', {'coefficient': 1e-06}),)
    >>> ga.effects.unregister("fan")
    """
    given = {"torque": torque, "friction": friction, "actuator": actuator, "sensor": sensor}
    chosen = {acts: function for acts, function in given.items() if function is not None}
    if len(chosen) != 1:
        raise ModelError(f"{name} is given {' and '.join(chosen) or 'no function'}: give exactly one of {', '.join(given)}")
    if any(row.name == name for row in _built_in()):
        raise ModelError(f"{name!r} is a built-in effect, which cannot be replaced: give another name")
    if name in OWN and not replace:
        raise ModelError(f"{name!r} is registered already: unregister it first, or give replace=True")
    ((acts, function),) = chosen.items()
    OWN[name] = checked(Own(name, acts, function, tuple(parameters), meaning))
    _forget()
    return _by_name()[name][1]


def unregister(name: str) -> None:
    """Take a user-defined effect out of the table.

    Parameters
    ----------
    name : str
        Name of the effect.

    Raises
    ------
    ModelError
        Where there is no user-defined effect of that name.

    Examples
    --------
    >>> import gaident as ga
    >>> def push(signals, size):
    ...     return size + 0.0 * signals.velocity
    >>> parameter = ga.effects.Parameter("size", "N m", neutral=0.0, lowest=-1.0, highest=1.0)
    >>> row = ga.effects.register("push", [parameter], meaning="a constant push", torque=push)
    >>> ga.effects.unregister("push")
    """
    if name not in OWN:
        raise ModelError(f"{name!r} is no effect of your own: those are {', '.join(OWN) or 'none'}; built-in ones stay")
    del OWN[name]
    _forget()


def _forget() -> None:
    table.cache_clear()
    _by_name.cache_clear()


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect with its parameters, checked; equal where name and parameters are.

    Parameters
    ----------
    name : str
        Name of the effect in `gaident.effects.table()`.
    parameters : mapping of str to float
        All its parameters, name -> value in SI units.

    Attributes
    ----------
    own : bool
        Whether the effect is user-defined, registered from Python.

    Raises
    ------
    ModelError
        For an unknown name, unknown or missing parameters and values outside the physical bounds.

    Examples
    --------
    >>> import gaident as ga
    >>> effect = ga.Effect("transport_delay", {"delay": 2e-3})
    >>> effect.row.place, effect.values
    ('actuator', (0.002,))
    """

    name: str
    parameters: Mapping[str, float]
    own: bool = field(init=False, repr=False)  # one's own, registered from Python

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
        object.__setattr__(self, "own", row.own)

    @property
    def row(self) -> Row:
        """The effect's row in the table; raises ModelError for a user-defined effect that is no longer registered."""
        if self.name not in _by_name():
            raise ModelError(_unknown(self.name))
        return _by_name()[self.name][1]

    @property
    def neutral(self) -> bool:
        """Whether a user-defined effect has parameters with which it does nothing; False for a built-in effect."""
        return self.row.own and OWN[self.name].neutral(self.values)

    @property
    def values(self) -> tuple[float, ...]:
        """The parameters in the order of the table, SI units."""
        return tuple(self.parameters.values())

    def to_dict(self) -> dict[str, Any]:
        """Return {"name": ..., "parameters": {...}} for JSON.

        An infinite limit is None, a user-defined effect has "own": true.
        """
        data = {"name": self.name, "parameters": {k: v if math.isfinite(v) else None for k, v in self.parameters.items()}}
        return {**data, "own": True} if self.own else data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Effect:
        """Return the effect of what `to_dict` gave; raise ModelError for a user-defined effect that is not registered."""
        keys = ("name", "parameters")
        values: dict[str, Any] = known_keys(data, "an effect", (*keys, "own"), keys, ModelError)
        if values.get("own") and values["name"] not in OWN:
            raise ModelError(_unknown(values["name"]))
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


def _unknown(name: object) -> str:
    return f"{name!r} is an effect of your own that is not registered here: call gaident.effects.register({name!r}, ...) first"


def ordered(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects in the order of the table, a later one of the same name in place of an earlier."""
    latest = {effect.name: effect for effect in effects}
    return tuple(sorted(latest.values(), key=lambda effect: (effect.row, place_of(effect.name))[1]))


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
