"""What a value of a drive file must be: each check returns it, or raises ReadError with its key and the remedy."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from gaident.axis import AXES
from gaident.checks import one_of, real_number
from gaident.data.formats.units import factor, of_other_axis
from gaident.data.record import CHANNELS
from gaident.data.torque_kind import TORQUE_KINDS, TORQUE_LOGS
from gaident.drive.quantities import number_and_unit, plain_number
from gaident.errors import ReadError

__all__ = [
    *("Check", "axis", "channels", "column", "length", "speed", "number", "pair", "pair_or_one", "positive"),
    *("positive_quantity", "quantity", "text"),
    *("torque_is", "torque_log", "unit", "whole", "yes_or_no"),
]

Check = Callable[[object, str], object]


def number(value: object, name: str) -> float:
    if isinstance(value, bool):
        raise ReadError(f"{name} is {value!r}: give one number")
    return real_number(value, name, ReadError, "give one number, without quotes")


def whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise ReadError(f"{name} is {value!r}: give a whole number")
    return value


def yes_or_no(value: object, name: str) -> bool:
    if not isinstance(value, bool):
        raise ReadError(f"{name} is {value!r}: give true or false, without quotes")
    return value


def text(value: object, name: str) -> str:
    if not isinstance(value, str):
        raise ReadError(f'{name} is {value!r}: give text in quotes, {name} = "..."')
    return value


def column(value: object, name: str) -> str | int:
    return value if isinstance(value, int) and not isinstance(value, bool) else text(value, name)


def unit(value: object, name: str) -> str | float:
    return value if isinstance(value, str) else number(value, name)


def pair(value: object, name: str) -> tuple[float, float]:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 2:
        # no decision: a format: what a decimal comma makes of a pair
        hint = ", with decimal points" if isinstance(value, list) and len(value) in (3, 4) else ""
        raise ReadError(f"{name} is {value!r}: give a pair{hint}, {name} = [lowest, highest]")
    low, high = (number(v, name) for v in value)
    return low, high


def pair_or_one(value: object, name: str) -> tuple[int, int]:
    if isinstance(value, int) and not isinstance(value, bool):
        return value, value
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 2:
        raise ReadError(f"{name} is {value!r}: give one whole number or a pair, {name} = [lowest, highest]")
    return whole(value[0], name), whole(value[1], name)


def channels(value: object, name: str) -> tuple[str, ...]:
    listed = [value] if isinstance(value, str) else value
    if not isinstance(listed, Sequence) or not listed:
        raise ReadError(f'{name} is {value!r}: give a list of channels, {name} = ["position"]')
    return tuple(one_of(text(entry, name), name, CHANNELS, ReadError) for entry in listed)


def positive(value: object, name: str) -> float:
    found = number(value, name)
    if not found > 0.0:
        raise ReadError(f"{name} is {value!r}: give a number > 0")
    return found


def quantity(value: object, name: str) -> float:
    """A number in SI; with its unit, "4.2 N m", too."""
    return plain_number(value, name) if isinstance(value, str) else number(value, name)


def positive_quantity(value: object, name: str) -> float:
    found = quantity(value, name)
    if not found > 0.0:
        raise ReadError(f"{name} is {value!r}: give a number > 0")
    return found


def length(value: object, name: str) -> float:
    """A length in m; with its unit, "24 mm", too."""
    if isinstance(value, str):
        number_, unit_ = number_and_unit(value)
        try:
            if of_other_axis("position", unit_, "linear"):
                raise ReadError(unit_)
            return positive(number_ * factor("position", unit_), name)
        except ReadError:
            raise ReadError(f'{name} is {value!r}: give a length in m, or with its unit, "24 mm"') from None
    return positive(value, name)


def speed(value: object, name: str) -> float:
    """A speed in rad/s or m/s; with its unit, "3000 rpm", too."""
    if isinstance(value, str):
        number_, unit_ = number_and_unit(value)
        try:
            return positive(number_ * factor("velocity", unit_), name)
        except ReadError:
            raise ReadError(f'{name} is {value!r}: give a speed in rad/s (linear: m/s), or with its unit, "3000 rpm"') from None
    return positive(value, name)


def axis(value: object, name: str) -> str:
    return one_of(value, name, AXES, ReadError)


def torque_is(value: object, name: str) -> str:
    return one_of(value, name, TORQUE_KINDS, ReadError)


def torque_log(value: object, name: str) -> str:
    return one_of(value, name, TORQUE_LOGS, ReadError)
