"""The checks that every measured channel passes, shared by Record and differentiate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.arguments import arg
from gaident.checks import LARGEST, LONGEST, SHORTEST, is_whole
from gaident.errors import RecordError

__all__ = ["MINIMUM_SAMPLES", "channel", "first_not_finite", "floats", "is_number", "positive_number", "sample_time"]

MINIMUM_SAMPLES = 20  # no decision: what an argument may be: a record has so many samples at least
"""Fewer samples identify nothing."""

_REFUSED_KINDS = {
    "b": ("boolean", "convert it with .astype(float) if 0 and 1 are really meant"),
    "c": ("complex", "give the real part, x.real"),
    "O": ("object", "give numbers only, for example numpy.asarray(x, dtype=float)"),
    "U": ("text", "convert the strings to numbers first"),
    "S": ("text", "convert the strings to numbers first"),
    "M": ("a date", "give plain numbers"),
    "m": ("a time difference", "give plain numbers"),
    "V": ("structured", "give one of its fields"),
}


def is_number(value: object) -> TypeGuard[float]:
    """Whether it is a real number of Python or NumPy; a bool is none, nor is a time difference."""
    return is_whole(value) or isinstance(value, float | np.floating)


def floats(values: object) -> NDArray[np.float64]:
    """A copy of a number or an array as float64, too large ones as infinity.

    Raises TypeError, which says why and no more, for a complex number, of which a part would be dropped, a text, a date, a list
    that is no array, and one that needs more memory than there is.
    """
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biufO":  # no decision: a format: numbers, and objects that may be some
            raise TypeError(f"dtype {array.dtype}")
        if array.dtype.kind == "O":
            for value in array.flat:
                if not isinstance(value, Real):
                    raise TypeError(f"{value!r:.40} is no real number")
        with np.errstate(over="ignore"):
            return np.array(array, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise TypeError(str(error)) from None
    except MemoryError:
        raise TypeError("it is too long") from None


def channel(values: ArrayLike, argument: str) -> NDArray[np.float64]:
    """Copy `values` to a read-only float64 array, shape (n,), n >= 20, all finite; units are the caller's.

    Exactly one copy is made. The result is a view of a read-only array, so that not even its write flag can be set again.
    Raises RecordError naming `argument`.
    """
    array = _as_array(values, argument)
    if array.ndim != 1:
        raise RecordError(
            f"{argument} has the shape {array.shape}, but one dimension is needed, time only; give one "
            "column, "
            f"for example {argument}=x[:, 0]"
        )
    if array.dtype.kind in _REFUSED_KINDS:
        kind, remedy = _REFUSED_KINDS[array.dtype.kind]
        raise RecordError(f"{argument} is {kind} (dtype {array.dtype}), but real numbers are needed; {remedy}")
    if array.size < MINIMUM_SAMPLES:
        raise RecordError(f"{argument} has {array.size} samples, but at least {MINIMUM_SAMPLES} are needed; give a longer record")
    own = isinstance(values, list | tuple) and array.dtype == np.float64
    with np.errstate(over="ignore"):
        copy = array if own else np.array(array, dtype=np.float64, order="C")
    bad = first_not_finite(copy)
    if bad is not None:
        raise RecordError(
            f"{argument}[{bad}] = {copy[bad]}, but every value must be finite; cut the record before that "
            "sample or "
            f"repair the value"
        )
    if max(float(copy.max()), -float(copy.min())) > LARGEST:
        far = int(np.argmax(np.abs(copy)))
        raise RecordError(f"{argument}[{far}] = {copy[far]:g} is beyond {LARGEST:g}, which no drive reaches; correct its unit")
    copy.flags.writeable = False
    view: NDArray[np.float64] = copy.view()
    return view


def sample_time(value: object, remedy: str | None = None, argument: str = "dt") -> float:
    """`value` as a sample time [s]. Raises RecordError for what is none of a drive's, as `positive_number`."""
    remedy = remedy or f"give the sample time in seconds, for example {arg('dt', '1e-3')}"
    dt = positive_number(value, argument, "s", remedy)
    if not SHORTEST <= dt <= LONGEST:
        raise RecordError(
            f"{arg(argument, repr(value))} s is no sample time of a drive ({SHORTEST:g} to {LONGEST:g} s); {remedy}"
        )
    return dt


def _as_array(values: ArrayLike, argument: str) -> NDArray[Any]:
    """numpy.asarray with our errors; a list of whole numbers too large for int64 still is one of numbers."""
    if isinstance(values, np.ma.MaskedArray) and values.dtype.kind != "V" and np.ma.getmaskarray(values).any():
        bad = int(np.argmax(np.ma.getmaskarray(values).ravel()))
        raise RecordError(f"{argument}[{bad}] is masked, but every value must be there; cut or repair the record")
    try:
        array = np.asarray(values)
    except (ValueError, TypeError, OverflowError, MemoryError) as error:
        raise RecordError(
            f"{argument} is no array ({str(error) or 'it is too long'}); give one number per sample, for example "
            "numpy.asarray(x, dtype=float)"
        ) from None
    if array.dtype.kind == "O" and array.ndim == 1 and isinstance(values, list | tuple):
        return _from_objects(values, array, argument)
    return array


def _from_objects(values: Sequence[Any], array: NDArray[Any], argument: str) -> NDArray[Any]:
    for index, value in enumerate(values):
        if not is_number(value):
            raise RecordError(f"{argument}[{index}] = {value!r} is no number; give real numbers only")
    try:
        return array.astype(np.float64)
    except OverflowError:
        raise RecordError(f"{argument} contains a whole number too large for a float64; scale it first") from None


def first_not_finite(array: NDArray[np.float64]) -> int | None:
    """Index of the first NaN or infinity, None if there is none."""
    finite = np.isfinite(array)
    return None if finite.all() else int(np.argmin(finite))


def positive_number(value: object, argument: str, unit: str, remedy: str) -> float:
    """`value` as a float > 0 and finite. Raises RecordError naming `argument`, the value and the remedy."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not is_number(value):
        raise RecordError(f"{arg(argument, repr(value))} is no number; {remedy}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not (math.isfinite(number) and number > 0.0):
        raise RecordError(f"{arg(argument, repr(value))} {unit}, but it must be positive and finite; {remedy}")
    return number
