"""Watched numbers: one run of a case shows for every row of the policy how far it can be moved before any decision changes.

A watched policy contains, instead of each number that decides, a `Watched`: the number, and beside it what it would be if its row
were moved by each of some steps. Arithmetic and NumPy's functions carry all of them along.
Where a comparison, a rounding or another conversion ends in a plain value, the run goes on with the value of the policy,
and every step for which the plain value would be another is noted in `Watch.turned`.

So a step that is not in `turned` at the end is proven: with the row there, every decision is the same, and the result with it,
but for texts and figures that quote the row itself.
A step that is in `turned` may still lead to the same result; `bench/policy.py` runs the case again to see.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gaident.policy.table import Policy, PolicyRow, rows

__all__ = ["STEPS", "Watch", "Watched", "moved", "neighbours", "watched"]

STEPS = tuple(s / 4 for s in range(-8, 9) if s)
"""Steps by which a row is moved: 1 is twice its value, -1 half."""

Key = tuple[str, float]


def moved(row: PolicyRow, step: float) -> float | None:
    """The value of a row after some steps, by its unit; None: there is none.

    A number is doubled by a step, a probability taken times ten.
    Of a share between one half and 1, what is missing to 1 is halved by a step upwards: 0.9 becomes 0.95 or 0.8.
    What is counted stays a whole number, and at least 1.

    >>> found = {r.name: r for r in rows()}
    >>> [moved(found["swap"], s) for s in (-1, 1)], [round(moved(found["stands"], s), 3) for s in (-1, 1)]
    ([1.0, 4.0], [0.8, 0.95])
    >>> moved(found["fitted_share"], -2) is None  # 0.7 would become -0.2
    True
    """
    if row.unit == "probability":
        value = row.value * 10.0**step
    elif row.unit == "1" and 0.5 < row.value < 1.0:
        value = 1.0 - (1.0 - row.value) * 2.0**-step
    else:
        value = row.value * 2.0**step
    if isinstance(row.value, int):
        value = max(round(value), 1)
    return None if value <= 0.0 or value == row.value else value


def neighbours(row: PolicyRow) -> tuple[float, float]:
    """The two values that a row is measured at, below and above its own.

    >>> {r.name: neighbours(r) for r in rows() if r.name in ("harm", "plateau", "test_level")}
    {'harm': (0.01, 0.04), 'plateau': (2, 10), 'test_level': (1e-05, 0.001)}
    """
    below, above = moved(row, -1), moved(row, 1)
    if below is None or above is None:
        raise ValueError(f"{row.name} = {row.value:g} has no neighbours at half and at twice")
    return below, above


@dataclass
class Watch:
    """What the watched numbers of a policy noted: rows that were used, steps for which something came out otherwise."""

    used: set[str] = field(default_factory=set)
    turned: set[Key] = field(default_factory=set)

    def clear(self) -> None:
        self.used.clear()
        self.turned.clear()

    def note(self, plain: Any, others: Mapping[Key, Any]) -> None:
        """A plain value that the run goes on with, and what it would be."""
        for key, value in others.items():
            self.used.add(key[0])
            if not _same(plain, value):
                self.turned.add(key)


class Watched:
    """A number (or an array of numbers) of the policy, or made of some, and what it would be with a row at another value."""

    __slots__ = ("others", "plain", "watch")

    def __init__(self, plain: Any, others: Mapping[Key, Any], watch: Watch) -> None:
        self.plain, self.others, self.watch = plain, others, watch

    def __float__(self) -> float:
        return self.noted(float)

    def __int__(self) -> int:
        return self.noted(int)

    def __index__(self) -> int:
        return self.noted(operator.index)

    def __bool__(self) -> bool:
        return self.noted(bool)

    def __hash__(self) -> int:
        return self.noted(hash)  # a key of a memory, or a member of a set

    def __len__(self) -> int:
        return len(self.plain)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return self.noted(lambda value: np.array(value, dtype=dtype))

    def __format__(self, spec: str) -> str:
        return format(self.plain, spec)  # a text decides nothing

    def __repr__(self) -> str:
        return f"Watched({self.plain!r})"

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        (out,) = options.get("out") or (None,)
        if method == "__call__" and (out is None or isinstance(out, Watched)):
            options.pop("out", None)
            found = carried(functools.partial(ufunc, **options), *inputs)
            return found if out is None else np.asarray(found)  # what is worked on in place, such as errors of a fit, ends plain
        return getattr(ufunc, method)(*(np.asarray(i) if isinstance(i, Watched) else i for i in inputs), **options)

    def noted(self, function: Callable[[Any], Any]) -> Any:
        """A plain value made of this one."""
        plain = function(self.plain)
        self.watch.note(plain, {key: function(value) for key, value in self.others.items()})
        return plain


def carried(function: Callable[..., Any], *arguments: Any) -> Any:
    """A function of watched numbers: watched again, or a plain value where it is a decision or nothing depends on a row."""
    watch = next(a.watch for a in arguments if isinstance(a, Watched))
    keys = {key for a in arguments if isinstance(a, Watched) for key in a.others}
    watch.used.update(row for row, _ in keys)
    plain = function(*(a.plain if isinstance(a, Watched) else a for a in arguments))
    others = {}
    for key in keys - watch.turned:
        try:
            value = function(*(a.others.get(key, a.plain) if isinstance(a, Watched) else a for a in arguments))
        except ArithmeticError:  # a division by 0 there: the run would go another way
            watch.turned.add(key)
            watch.used.add(key[0])
            continue
        if not _same(plain, value):
            others[key] = value
    if isinstance(plain, (bool, np.bool_)) or getattr(plain, "dtype", None) == np.bool_:
        watch.note(plain, others)
        return plain
    return Watched(plain, others, watch) if others else plain


def _same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(one, other, equal_nan=isinstance(one, (float, np.floating, np.ndarray))))


def _method(function: Callable[..., Any], reflected: bool = False) -> Callable[..., Any]:
    if reflected:
        return lambda self, other: carried(function, other, self)
    return lambda self, *others: carried(function, self, *others)


for _name in ("add", "sub", "mul", "truediv", "floordiv", "mod", "pow"):
    setattr(Watched, f"__{_name}__", _method(getattr(operator, _name)))
    setattr(Watched, f"__r{_name}__", _method(getattr(operator, _name), reflected=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne", "neg", "pos", "abs", "getitem"):
    setattr(Watched, f"__{_name}__", _method(getattr(operator, _name)))
for _name, _function in {"floor": math.floor, "ceil": math.ceil, "trunc": math.trunc, "round": round}.items():
    setattr(Watched, f"__{_name}__", _method(_function))


def watched(policy: Policy, watch: Watch) -> Policy:
    """A policy whose numbers that decide are watched."""
    numbers = {}
    for row in rows():
        if not row.command:
            continue
        plain = getattr(policy, row.name)
        own = row._replace(value=plain)
        others = {(row.name, step): value for step in STEPS if (value := moved(own, step)) is not None}
        numbers[row.name] = Watched(plain, others, watch)
    return replace(policy, **numbers)  # type: ignore[arg-type]
