"""Checks that several rooms share: a number, a name out of a list, the keys of a dictionary, a library that is there."""

from __future__ import annotations

import difflib
import importlib.util
import math
import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from numbers import Integral
from pathlib import Path
from typing import TypeGuard, TypeVar

from gaident.errors import GaidentError

T = TypeVar("T")

LARGEST = 1e30  # no decision: what an argument may be: far beyond counters of 64 bits, far below where squares overflow
SHORTEST, LONGEST = 1e-12, 1e9  # no decision: what an argument may be: sample times [s]


def real_number(value: object, name: str, error: type[GaidentError], remedy: str = "give one finite number") -> float:
    """`value` as a finite float; raises `error` naming `name`, the value and the remedy."""
    if not _is_one_real(value):
        raise error(f"{name} is {value!r}: {remedy}")
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise error(f"{name} is {value!r}: {remedy}") from None
    if not math.isfinite(number):
        raise error(f"{name} is {value!r}: {remedy}")
    return number


def _is_one_real(value: object) -> bool:
    """Whether float() may be asked: of a complex number it would drop a part, and a string is mostly a forgotten conversion."""
    if isinstance(value, str | bytes) or getattr(value, "ndim", False) or getattr(value, "mask", False):
        return False
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    if kind == "O":  # an array of one object
        return _is_one_real(value.item())  # type: ignore[attr-defined]
    return kind in ("b", "i", "u", "f")


def is_whole(value: object) -> TypeGuard[int]:
    """Whether it is a whole number; a bool is none, nor is a time difference, which NumPy counts among them."""
    if isinstance(value, bool) or not isinstance(value, Integral):
        return False
    try:
        operator.index(value)
    except TypeError:
        return False
    return True


def above_zero(value: object, name: str, error: type[GaidentError], remedy: str) -> float:
    """`value` as a finite float above 0, a bool left out; raises `error` naming `name`, the value and the remedy."""
    if isinstance(value, bool) or not (number := real_number(value, name, error, remedy)) > 0.0:
        raise error(f"{name} is {value!r}: {remedy}")
    return number


def size_of_drive(value: object, name: str, error: type[GaidentError], remedy: str) -> float:
    """`value` as a float above 0 that a drive can have, a bool left out: a number beyond all sizes is mostly a wrong unit."""
    if isinstance(value, bool):
        raise error(f"{name} is {value}: {remedy}")
    number = real_number(value, name, error, remedy)
    if number <= 0.0:
        raise error(f"{name} is {number:g}: {remedy}")
    if not 1.0 / LARGEST <= number <= LARGEST:
        raise error(f"{name} is {number:g}, which no drive has ({1.0 / LARGEST:g} to {LARGEST:g}): {remedy}")
    return number


def time_of_sample(value: object, error: type[GaidentError], what: str = "the sample time") -> float:
    """`value` of an argument dt [s], where a drive can have it; raises `error`."""
    remedy = f"give {what} in s, from {SHORTEST:g} to {LONGEST:g}"
    dt = above_zero(value, "dt", error, remedy)
    if not SHORTEST <= dt <= LONGEST:
        raise error(f"dt is {dt:g}: {remedy}")
    return dt


def yes_or_no(value: object, name: str, error: type[GaidentError]) -> bool:
    """`value`, where it is True or False."""
    if not isinstance(value, bool):
        raise error(f"{name} is {value!r:.80}: give True or False")
    return value


def checked_path(value: object, name: str = "path", error: type[GaidentError] = GaidentError) -> Path:
    """`value` as a Path; raises `error` naming `name`, the value and the remedy where it is no path."""
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str):
        raise error(f"{name} is {value!r:.80}: give the file's name as str or pathlib.Path")
    if not text:
        raise error(f"{name} is '', which names no file or folder: give its name")
    if "\0" in text:
        raise error(f"{name} is {text!r:.80}: no file's name contains the character NUL; correct it")
    try:
        os.fsencode(text)
    except UnicodeEncodeError as reason:
        raise error(f"{name} is {text!r:.80}: no file's name contains the character {text[reason.start]!r}; correct it") from None
    return Path(text)


def check_installed(modules: Iterable[str], extra: str, what: str) -> None:
    """Raise GaidentError where one of the modules that `what` needs is not there; imports none of them."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        needed = f"{what} needs {' and '.join(missing)}, which {'are' if len(missing) > 1 else 'is'} not installed"
        raise GaidentError(f'{needed}: pip install "gaident[{extra}]"')


def one_of(value: object, name: str, allowed: Iterable[str], error: type[GaidentError]) -> str:
    """`value` if it is one of the `allowed` names; raises `error` with the nearest name."""
    names = list(allowed)
    if isinstance(value, str) and value in names:
        return value
    raise error(f"{name} is {value!r}: it must be one of {', '.join(names)}{_nearest(value, names)}")


def known_keys(
    data: object, what: str, allowed: Iterable[str], needed: Iterable[str], error: type[GaidentError]
) -> dict[str, object]:
    """`data` as a dictionary with all `needed` and only `allowed` keys; raises `error` otherwise."""
    names = list(allowed)
    if not isinstance(data, Mapping):
        raise error(f"{what} is a {type(data).__name__}: give a dictionary with the keys {', '.join(names)}")
    for key in data:
        if key not in names:
            raise error(f"{what} has the key {key!r}: its keys are {', '.join(names)}{_nearest(key, names)}")
    missing = [name for name in needed if name not in data]
    if missing:
        raise error(f"{what} lacks {', '.join(missing)}: its keys are {', '.join(names)}")
    return dict(data)


def _nearest(value: object, names: list[str]) -> str:
    close = difflib.get_close_matches(str(value).lower(), [name.lower() for name in names], n=1, cutoff=0.7)
    if not close:
        return ""
    return f" (did you mean {next(name for name in names if name.lower() == close[0])!r}?)"


def several(given: object, kind: type[T], name: str, error: type[GaidentError], remedy: str) -> tuple[T, ...]:
    """One of a kind, or a list of them, as a tuple of at least one; remedy: what to give."""
    if isinstance(given, kind):
        return (given,)
    if not isinstance(given, Sequence) or isinstance(given, str | bytes):
        raise error(f"{name} is {type(given).__name__}: {remedy}")
    if not given:
        raise error(f"{name} is empty: {remedy}")
    for i, one in enumerate(given):
        if not isinstance(one, kind):
            raise error(f"{name}[{i}] is {type(one).__name__}: {remedy}")
    return tuple(given)
