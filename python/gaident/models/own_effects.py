"""User-defined effects: a Python function of the loop's signals, with parameters and units, called by the core at its place.

    controller command    r' = command(s)                    the velocity command that is followed in place of the one given
    shaft      torque     T + torque(s)                      added to the torque at the motor, or at the load of two masses
               friction   abs(friction torque) <= level(s)   dry friction, which stops the motor or the load and holds it
    actuator              u' = actuator(s)                   the torque that acts in place of the one commanded
    sensor                w' = sensor(s)                     the velocity that is seen in place of the true one

Asked in the order of time: once per substep at the shaft (with the velocity in the middle of the substep, so that the answer is
of second order), once per step of the controller at command and actuator; `register` says what a function has to be like.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.checks import yes_or_no
from gaident.data.signals.arrays import is_number
from gaident.errors import ModelError
from gaident.policy.table import POLICY

__all__ = ["OWN", "PLACES", "Function", "Own", "Parameter", "Signals", "check_kinds", "checked", "starts"]

Signal = NDArray[np.float64]
Function = Callable[..., Any]

PLACES = {"command": "controller", "torque": "shaft", "friction": "shaft", "actuator": "actuator", "sensor": "sensor"}
"""Keyword of `register` -> place in the table."""

REPLACED = {"command": "command", "actuator": "torque", "sensor": "velocity"}
"""Keyword -> the signal that an effect there answers in place of; what another answers is added up."""


class Signals(NamedTuple):
    """What a user-defined effect may look at: arrays (m,), one number per drive that is simulated beside others, read only.

    Attributes
    ----------
    velocity : ndarray, shape (m,)
        Velocity of the motor [rad/s]; at the shaft that in the middle of the substep. Of an effect at the load the load's.
    angle : ndarray, shape (m,)
        Angle of the motor [rad]; of an effect at the load the load's.
    torque : ndarray, shape (m,)
        Torque [N m].
        At the shaft, at either end: what saturation, dead band, delay and lag left of the command, and what built-in effects at
        the motor add. At the actuator: the command.
        At command and sensor: the torque that is held until then.
    time : float
        Time since the record's start [s].
    command : ndarray, shape (m,)
        At the command: the velocity command as the controller is given it, under a position controller as that one gives it
        [rad/s]. Elsewhere nan.

    See Also
    --------
    register : Has an example.
    """

    velocity: Signal
    angle: Signal
    torque: Signal
    time: float
    command: Signal


class Parameter(NamedTuple):
    """One parameter of an effect.

    Attributes
    ----------
    name : str
        Name of the parameter.
    unit : str
        SI, angles in rad; "1" for none.
    neutral : float
        With every neutral value the effect does nothing; nan: with any value.
    lowest : float
        Lowest physical value; finite for a user-defined effect.
    highest : float
        Highest physical value; finite for a user-defined effect. A diagnosis looks between both.
    above_lowest : bool
        Whether the lowest value itself is excluded.
    logarithmic : bool
        Whether a diagnosis moves the parameter of a user-defined effect by its logarithm.
    starts : tuple of float
        Where a diagnosis begins with a user-defined effect; (): at values spread between the bounds.

    Examples
    --------
    >>> import gaident as ga
    >>> ga.effects.Parameter("coefficient", "N m s^3/rad^3", neutral=0.0, lowest=0.0, highest=1e-3).bounds
    '>= 0 and <= 0.001'
    """

    name: str
    unit: str
    neutral: float = math.nan
    lowest: float = -math.inf
    highest: float = math.inf
    above_lowest: bool = False
    logarithmic: bool = False
    starts: tuple[float, ...] = ()

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
        """Return the parameter for JSON; what is not finite (any value, no bound, no limit) is None."""
        numbers = {"neutral": self.neutral, "lowest": self.lowest, "highest": self.highest}
        return {"name": self.name, "unit": self.unit, **{k: v if math.isfinite(v) else None for k, v in numbers.items()}}


@dataclass(frozen=True)
class Own:
    """One registered effect."""

    name: str
    acts: str  # a key of PLACES
    function: Function
    parameters: tuple[Parameter, ...]
    meaning: str

    def ask(self, velocity: Signal, angle: Signal, torque: Signal, command: Signal, time: float, *values: Signal) -> Any:
        """As the core asks; what goes wrong in the function is told with the effect's name."""
        signals = Signals(velocity, angle, torque, time, command)
        try:
            return self.function(signals, **{p.name: v for p, v in zip(self.parameters, values, strict=True)})
        except Exception as reason:
            raise ModelError(
                f"the effect {self.name!r}: its function raised {type(reason).__name__}: {reason}; it is given arrays, so that "
                "choices are numpy's where(), minimum(), maximum()"
            ) from reason

    def refuse(self, answer: object, time: float) -> None:
        """What the core calls where a function answers what none may: nothing, or a friction that pushes."""
        if answer is None:
            raise ModelError(
                f"the effect {self.name!r}: its function returns None at {time:g} s: return an array of numbers always"
            )
        raise ModelError(
            f"the effect {self.name!r}: its friction is {answer:g} at {time:g} s: it is the size of a torque against the motion, "
            "return numbers >= 0, as numpy.abs() or maximum(..., 0) give"
        )

    def neutral(self, values: Sequence[float]) -> bool:
        """Whether these values make it the identity."""
        return all(math.isnan(p.neutral) or v == p.neutral for p, v in zip(self.parameters, values, strict=True))


OWN: dict[str, Own] = {}
"""The registered effects, in the order of their registration."""


def starts(p: Parameter, count: int = POLICY.own_values) -> tuple[float, ...]:
    """Where a search begins: as given, or spread between the bounds, the neutral value left out."""
    if p.starts:
        return p.starts
    shares = [(i + 0.5) / count for i in range(count)]
    if p.logarithmic:
        return tuple(p.lowest * (p.highest / p.lowest) ** share for share in shares)
    span = p.highest - p.lowest
    values = [p.lowest + span * share for share in shares]
    # no decision: a start
    kept = tuple(v for v in values if abs(v - p.neutral) > 0.01 * span or math.isnan(p.neutral))
    return kept or (p.lowest + 0.75 * span,)


def check_kinds(name: object, parameters: object, replace: object) -> None:
    """Raises ModelError where what `register` is given is of another kind."""
    if not isinstance(name, str):
        raise ModelError(f"name is {name!r:.80}: give the effect's name as text")
    if not isinstance(parameters, Iterable) or isinstance(parameters, str | bytes | Mapping):
        raise ModelError(f"parameters of {name} is {parameters!r:.80}: give a list of gaident.effects.Parameter")
    yes_or_no(replace, "replace", ModelError)


def checked(own: Own) -> Own:
    """The effect, if names, bounds and function are as they have to be; raises ModelError."""
    if not own.name.isidentifier():
        raise ModelError(f"the effect's name is {own.name!r}: give letters, digits and _, as of a variable")
    if not isinstance(own.meaning, str) or not own.meaning.strip():
        raise ModelError(f"meaning of {own.name} is {own.meaning!r}: say in one line what the effect does")
    if not callable(own.function):
        raise ModelError(f"{own.acts} of {own.name} is {own.function!r}: give a function of (signals, one keyword per parameter)")
    if not own.parameters:
        raise ModelError(f"{own.name} has no parameters: give at least one, without which it cannot be absent")
    for p in own.parameters:
        if not isinstance(p, Parameter):
            raise ModelError(f"a parameter of {own.name} is {p!r}: give gaident.effects.Parameter(name, unit, lowest=, highest=)")
        _check_parameter(own.name, p)
    names = [p.name for p in own.parameters]
    for p in own.parameters:
        if names.count(p.name) > 1:
            raise ModelError(f"{own.name} has two parameters {p.name!r}: give each a name of its own")
    if all(math.isnan(p.neutral) for p in own.parameters):
        raise ModelError(f"no parameter of {own.name} has a neutral value: give neutral= to those with which it does nothing")
    _check_function(own)
    return own


def _check_parameter(effect: str, p: Parameter) -> None:
    what = f"{p.name} of {effect}"
    if not (isinstance(p.name, str) and p.name.isidentifier()) or p.name == "side":
        raise ModelError(f"a parameter of {effect} is named {p.name!r}: give letters, digits and _, as of a variable, not side")
    if not isinstance(p.unit, str) or not p.unit:
        raise ModelError(f'the unit of {what} is {p.unit!r}: give its SI unit, "1" for none')
    for name, value in (("neutral", p.neutral), ("lowest", p.lowest), ("highest", p.highest)):
        if not _is_number(value):
            raise ModelError(f"{name} of {what} is {value!r:.80}: give one number")
    for name, flag in (("above_lowest", p.above_lowest), ("logarithmic", p.logarithmic)):
        yes_or_no(flag, f"{name} of {what}", ModelError)
    if not isinstance(p.starts, Sequence) or isinstance(p.starts, str | bytes) or not all(map(_is_number, p.starts)):
        raise ModelError(f"starts of {what} is {p.starts!r:.80}: give a tuple of numbers, () for some between the bounds")
    if not (math.isfinite(p.lowest) and math.isfinite(p.highest) and p.lowest < p.highest):
        raise ModelError(
            f"{what} is bound to {p.lowest:g} .. {p.highest:g}: give lowest < highest, both finite: a diagnosis looks there"
        )
    if p.logarithmic and p.lowest <= 0.0:
        raise ModelError(f"{what} is logarithmic with lowest {p.lowest:g}: give lowest > 0, or leave logarithmic out")
    inside = [("neutral", p.neutral)] if not math.isnan(p.neutral) else []
    for name, value in [*inside, *(("starts", s) for s in p.starts)]:
        if not p.lowest <= value <= p.highest:
            raise ModelError(f"{name} of {what} is {value:g}: give it within its bounds, {p.lowest:g} .. {p.highest:g}")


def _is_number(value: object) -> bool:
    """Whether a float64 takes it, infinity and nan too; a bool is none."""
    if not is_number(value):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def _check_function(own: Own) -> None:
    """Asks the function about 24 states of a drive: answers in shape, in range, one by one the same, nothing where neutral."""
    rng = np.random.default_rng(0)
    n = 24
    w, theta, u, r = (scale * rng.standard_normal(n) for scale in (30.0, 3.0, 0.5, 30.0))
    w[0], u[1], r[2] = 0.0, 0.0, 0.0
    if own.acts != "command":
        r = np.full(n, np.nan)
    signals = {"velocity": w, "angle": theta, "torque": u, "command": r}
    middle = [np.full(n, starts(p)[len(starts(p)) // 2]) for p in own.parameters]
    with np.errstate(all="ignore"):
        answer = _answer(own, signals, middle)
        each = ({name: s[i : i + 1] for name, s in signals.items()} for i in range(n))
        alone = [_answer(own, one, [v[:1] for v in middle])[0] for one in each]
        still = [np.full(n, v[0] if math.isnan(p.neutral) else p.neutral) for p, v in zip(own.parameters, middle, strict=True)]
        nothing = _answer(own, signals, still)
    if not np.allclose(answer, alone, rtol=1e-9, atol=0.0, equal_nan=True):
        raise ModelError(
            f"{own.acts} of {own.name} answers otherwise for one drive than for several side by side, or at the second time: its "
            "arguments are arrays, of which each entry stands for itself, and it may keep nothing from call to call"
        )
    if not np.all(np.isfinite(answer)):
        at = int(np.flatnonzero(~np.isfinite(answer))[0])
        raise ModelError(
            f"{own.acts} of {own.name} gives {answer[at]} at {', '.join(f'{name} {s[at]:g}' for name, s in signals.items())}: "
            "give a function that is finite everywhere; only a command= knows signals.command, which is nan elsewhere"
        )
    if own.acts == "friction" and np.any(answer < 0.0):
        raise ModelError(f"friction of {own.name} gives {answer.min():g}: it is the size of a torque against the motion, >= 0")
    replaced = REPLACED.get(own.acts)
    identity = np.zeros(n) if replaced is None else signals[replaced]
    if not np.array_equal(nothing, identity):
        values = ", ".join(f"{p.name} {v[0]:g}" for p, v in zip(own.parameters, still, strict=True))
        wanted = "0" if replaced is None else f"signals.{replaced}"
        raise ModelError(f"{own.acts} of {own.name} is not {wanted} where its parameters are neutral ({values}): correct either")


def _answer(own: Own, signals: Mapping[str, Signal], values: Sequence[Signal]) -> Signal:
    w, theta, u, r, *given = views = [a.copy() for a in (*signals.values(), *values)]
    for view in views:
        view.setflags(write=False)
    found = own.ask(w, theta, u, r, 0.25, *given)
    if found is None:
        own.refuse(None, 0.25)
    try:
        answer = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError):
        raise ModelError(f"{own.acts} of {own.name} gives {found!r}: give an array of numbers like signals.velocity") from None
    if answer.size not in (1, len(w)):
        raise ModelError(f"{own.acts} of {own.name} gives the shape {answer.shape}: give one like signals.velocity, {w.shape}")
    return np.broadcast_to(answer.ravel(), w.shape).copy()
