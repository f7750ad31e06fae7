"""What the time of a log is called, and the unit that such a name ends with."""

from __future__ import annotations

import re

from gaident.data.formats.units import is_unit

__all__ = ["NO_NAME", "TIME_NAMES", "time_and_unit"]

NO_NAME = "Time"
"""What a first column without a name, of a unit of time, is called."""

TIME_NAMES = (
    *("time", "t", "__time", "timestamp", "stamp", "header.stamp", "field.header.stamp", "header/stamp"),
    *("zeit", "zeitstempel", "temps", "tempo", "tiempo", "jikan", "index"),
)
"""In English, ROS's, German, French, Italian, Spanish and Japanese words; small letters."""

_WITH_UNIT = re.compile(
    rf"({'|'.join(map(re.escape, TIME_NAMES))})(?:\s*[/,;_\s]\s*|\s+in\s+|\s*(?=[\[(]))[\[(]?(\w+)[\])]?", re.IGNORECASE
)
_UNIT_ALONE = ("ms", "us", "msec", "usec", "millis", "micros", "milliseconds", "microseconds")
_MEANS = {"millis": "ms", "micros": "us"}


def time_and_unit(name: str) -> tuple[str, str] | None:
    """(name, unit) of a time whose unit stands in its name, or is its name; None of any other.

    >>> [time_and_unit(name) for name in ("t/ms", "Zeit_ms", "Timestamp us", "millis", "time [s]", "Zeit in us", "s")]
    [('t', 'ms'), ('Zeit', 'ms'), ('Timestamp', 'us'), ('Time', 'ms'), ('time', 's'), ('Zeit', 'us'), None]
    """
    plain = name.strip()
    if plain.casefold() in _UNIT_ALONE:
        return NO_NAME, _MEANS.get(plain.casefold(), plain)
    found = _WITH_UNIT.fullmatch(plain)
    return (found[1], found[2]) if found is not None and is_unit(found[2], "time") else None
