"""The effects a model can carry beyond its linear part: the core's registry (csrc/gaident/effects), and user-defined ones.

ga.effects.table() lists them: place in the loop, parameters with units, one line of meaning. ga.effects.register(...) adds one
that is a Python function; it then takes part in simulation, diagnosis and report like the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Any

from gaident import _core
from gaident.axis import TURN, Text, say, unit
from gaident.checks import known_keys, one_of
from gaident.errors import ModelError
from gaident.models.effect_rows import SIDES, Row, Table, checked_parameters, checked_side, core_key, of_one_wave
from gaident.models.own_effects import OWN, PLACES, Function, Own, Parameter, Signals, check_kinds, checked

__all__ = ["Effect", "Parameter", "Row", "Signals", "Table", "register", "table", "unregister"]


@lru_cache(maxsize=1)
def _built_in() -> tuple[Row, ...]:
    rows = []
    for name, place, meaning, parameters, simulated, two, relation, remark, turns, waves in _core.effect_table():
        says = say(meaning)
        whole = say("{}; {}", says, say(remark)) if remark else says
        own = tuple(Parameter(*p) for p in parameters)
        rows.append(Row(name, place, own, whole, simulated, two, relation, says=says, turns=turns, waves=waves))
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


@lru_cache(maxsize=1)
def _by_key() -> dict[str, tuple[int, Row]]:
    at_load = (row.there() for row in table() if SIDES[1] in row.sides)
    return {row.key: (i, row) for i, row in enumerate((*table(), *at_load))}


def place_of(key: str) -> int:
    """Where an effect stands among all: in the order of the table, those at the load behind them."""
    return _by_key()[key][0]


def row_of(key: str) -> Row:
    """The row of an effect's key (`Row.key`)."""
    return _by_key()[key][1]


def parameter_count(key: str) -> int:
    """How many parameters an effect has, by the core's name of several waves those of all; 0 of what is none."""
    one = of_one_wave(key)
    if one not in _by_key():
        return 0
    row = _by_key()[one][1]
    return len(row.parameters) * (1 if one == key else row.waves)


def register(
    name: str,
    parameters: Sequence[Parameter],
    *,
    meaning: str,
    command: Function | None = None,
    torque: Function | None = None,
    friction: Function | None = None,
    actuator: Function | None = None,
    sensor: Function | None = None,
    replace: bool = False,
) -> Row:
    """Add a user-defined effect to the table, for this Python session.

    Exactly one of the five functions says what it does.
    Each takes (signals, one keyword per parameter), see `Signals`; arguments and answer are arrays, an entry per drive simulated
    side by side.
    The core asks in the order of time, once at every (sub)step, and gives a function no state that would belong to one drive and
    begin anew with each run: it keeps nothing from call to call.
    So no function of yours can be a dynamic actuator or sensor, or a friction with a memory; nor can it be a coupling of two
    masses, whose twist is no signal and whose step is solved implicitly. docs/how-to/own-effects.md goes through all hooks.
    A torque or a friction may act at the load of two masses, `with_effect(name, side="load", ...)`.
    A torque is stable where it changes with the velocity by less than the drive's inertia J over a substep h allows:
    abs(d torque/d velocity) < J/h.

    Parameters
    ----------
    name : str
        Name of the effect, as of a variable, not that of a built-in effect.
        Saved results name it and load only where it is registered.
    parameters : sequence of Parameter
        Their bounds are needed: between them `gaident.diagnose` looks, from `starts` or values spread between the bounds.
        With the neutral values the effect has to do nothing.
    meaning : str
        One line for tables and reports.
    command : callable, optional
        The velocity command that the controller follows [rad/s] in place of signals.command, behind its filters and before the
        limit of its slope.
        Where the torque drives the model no controller is simulated, and it does nothing.
    torque : callable, optional
        What is added to the motor's torque [N m], or acts on the load; a brake is negative for positive velocity.
    friction : callable, optional
        Level >= 0 of a dry friction [N m], which stops the motor, or the load, and keeps it at standstill.
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
    check_kinds(name, parameters, replace)
    given = {"command": command, "torque": torque, "friction": friction, "actuator": actuator, "sensor": sensor}
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
    if not isinstance(name, str) or name not in OWN:
        raise ModelError(f"{name!r:.80} is no effect of your own: those are {', '.join(OWN) or 'none'}; built-in ones stay")
    del OWN[name]
    _forget()


def _forget() -> None:
    table.cache_clear()
    _by_name.cache_clear()
    _by_key.cache_clear()


@dataclass(frozen=True, eq=False)
class Effect:
    """One effect with its parameters, checked; equal where name, parameters and side are.

    Parameters
    ----------
    name : str
        Name of the effect in `gaident.effects.table()`.
    parameters : mapping of str to float
        All its parameters, name -> value in SI units.
    side : {"motor", "load"}
        Where a shaft effect acts; "" in the effect made where it has no side.

    Attributes
    ----------
    own : bool
        Whether the effect is user-defined, registered from Python.

    Raises
    ------
    ModelError
        For an unknown name, unknown or missing parameters, values outside the physical bounds, and a side that it cannot have.

    Examples
    --------
    >>> import gaident as ga
    >>> effect = ga.Effect("transport_delay", {"delay": 2e-3})
    >>> effect.row.place, effect.values
    ('actuator', (0.002,))
    """

    name: str
    parameters: Mapping[str, float]
    side: str = SIDES[0]
    own: bool = field(init=False, repr=False)  # one's own, registered from Python

    def __post_init__(self) -> None:
        one_of(self.name, "the effect's name", _by_name(), ModelError)
        _, row = _by_name()[self.name]
        if not row.simulated:
            raise ModelError(
                f"{self.name} describes a record, not a drive, and cannot be simulated: mask such samples, or let "
                "gaident.diagnose find them"
            )
        object.__setattr__(self, "parameters", MappingProxyType(checked_parameters(row, self.parameters)))
        object.__setattr__(self, "side", checked_side(row, self.side))
        object.__setattr__(self, "own", row.own)

    @property
    def row(self) -> Row:
        """The effect's row in the table; raises ModelError for a user-defined effect that is no longer registered."""
        if self.name not in _by_name():
            raise ModelError(_unknown(self.name))
        row = _by_name()[self.name][1]
        row = row.of_waves(self.waves) if self.waves > 1 else row
        return row.there() if self.at_load else row

    @property
    def at_load(self) -> bool:
        """Whether it acts at the load."""
        return self.side == SIDES[1]

    @property
    def key(self) -> str:
        """What tells it from the other effects of a model: its name, at the load with that behind it."""
        return self.row.key

    @property
    def neutral(self) -> bool:
        """Whether a user-defined effect has parameters with which it does nothing; False for a built-in effect."""
        return self.row.own and OWN[self.name].neutral(self.values)

    @property
    def values(self) -> tuple[float, ...]:
        """The parameters in the order of the table, one wave's after the other's, SI units."""
        return tuple(self.parameters.values())

    @property
    def waves(self) -> int:
        """How many waves of the angle it has; 1 where it can have no more."""
        return 1 if self.own else len(self.parameters) // len(row_of(self.name).parameters)

    def of_core(self) -> tuple[str, tuple[float, ...]]:
        """(name, parameters) as the core takes it; the waves that it has not have amplitude 0."""
        if self.waves == 1:
            return self.key, self.values
        name = core_key(self.key)
        return name, self.values + (0.0,) * (parameter_count(name) - len(self.values))

    def to_dict(self) -> dict[str, Any]:
        """Return {"name": ..., "parameters": {...}} for JSON.

        An infinite limit is None, a user-defined effect has "own": true, one at the load "side": "load".
        """
        parameters = {k: v if math.isfinite(v) else None for k, v in self.parameters.items()}
        data: dict[str, Any] = {"name": self.name, "parameters": parameters}
        if self.at_load:
            data["side"] = self.side
        return {**data, "own": True} if self.own else data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Effect:
        """Return the effect of what `to_dict` gave; raise ModelError for a user-defined effect that is not registered.

        "units", which results of a linear axis have beside: an order in 1/m is one of periods to a metre.
        """
        keys = ("name", "parameters")
        values: dict[str, Any] = known_keys(data, "an effect", (*keys, "own", "side", "units"), keys, ModelError)
        if values.get("own") and values["name"] not in OWN:
            raise ModelError(_unknown(values["name"]))
        if not isinstance(values["parameters"], Mapping):
            raise ModelError(f"the parameters of an effect are {values['parameters']!r}: give a dictionary, name -> value")
        parameters = {k: math.inf if v is None else v for k, v in values["parameters"].items()}
        per_metre = [k for k, u in values.get("units", {}).items() if u == unit("1/turn", "linear")]
        parameters |= {k: TURN * parameters[k] for k in per_metre if k in parameters}
        return cls(values["name"], parameters, values.get("side", SIDES[0]))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Effect):
            return NotImplemented
        return (self.name, self.values, self.side) == (other.name, other.values, other.side)

    def __hash__(self) -> int:
        return hash((self.name, self.values, self.side))

    def __repr__(self) -> str:
        side = f", side={self.side!r}" if self.at_load else ""
        return f"Effect({self.name!r}, {dict(self.parameters)!r}{side})"

    def __reduce__(self) -> tuple[type[Effect], tuple[Any, ...]]:
        return type(self), (self.name, dict(self.parameters), self.side or SIDES[0])


def _unknown(name: object) -> str:
    return f"{name!r} is an effect of your own that is not registered here: call gaident.effects.register({name!r}, ...) first"


def without(effects: Sequence[Effect], name: object, side: object) -> tuple[Effect, ...]:
    """The effects but for those of this name, at this side where one is given; raises ModelError where there is none."""
    if not isinstance(name, str):
        raise ModelError(f"name is {name!r:.80}: give the name of an effect of the model")
    if side is not None and not isinstance(side, str):
        raise ModelError(f"side is {side!r:.80}: give 'motor' or 'load', or None for both")
    rest = tuple(effect for effect in effects if effect.name != name or side not in (None, effect.side))
    if len(rest) == len(effects):
        names = ", ".join(e.name + " at the load" * e.at_load for e in effects) or "none"
        there = "" if side is None else f" with side={side!r}"
        raise ModelError(f"the model has no effect {name!r}{there}: its effects are {names}")
    return rest


def ordered(effects: Iterable[Effect]) -> tuple[Effect, ...]:
    """Effects in the order of the table, those at the load behind them; of the same name and side the last one given."""
    latest = {effect.key: effect for effect in effects}
    return tuple(sorted(latest.values(), key=lambda effect: place_of(effect.key)))


def checked_effects(effects: Iterable[Effect], p: int, q: int) -> tuple[Effect, ...]:
    """Effects in their order, where a model with p and q can carry them; raises ModelError."""
    given = list(effects) if isinstance(effects, Iterable) and not isinstance(effects, str | bytes | Mapping) else None
    if given is None or not all(isinstance(effect, Effect) for effect in given):
        raise ModelError(f"effects is {effects!r:.80}: give a list of gaident.Effect, or use with_effect(name, ...)")
    found = ordered(given)
    in_series = next((effect.name for effect in found if effect.row.place == "plant"), None)
    if found and p == 0:
        raise ModelError(
            f"the model has p = 0 (as many zeros as poles) and cannot carry {found[0].name}: effects need a drive "
            "with inertia; use a model with more poles than zeros"
        )
    changed = next((effect.name for effect in found if effect.row.place == "mechanism"), None)
    if changed is not None and in_series is not None and (p, q) == (1, 2):
        raise ModelError(f"{changed} and {in_series} cannot be simulated together: take one of them out with without_effect")
    for effect in found:
        if not effect.row.needs_two_masses:
            continue
        what = f"{effect.name} at the load" if effect.at_load else effect.name
        if (p, q) != (1, 2):
            acts = "needs two masses" if effect.at_load else "acts between two masses"
            raise ModelError(
                f"the model has p = {p}, q = {q}, but {what} {acts}: use a model "
                "with p = 1 and q = 2, for example TwoMass(...).model()"
            )
        if in_series is not None:
            raise ModelError(f"{what} and {in_series} cannot be simulated together: take one of them out with without_effect")
    return found
