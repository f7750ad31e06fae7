"""The unit that stands at the end of a name: speed_rpm, pos_cmd_deg, vel_rad_s."""

from __future__ import annotations

import re

__all__ = ["name_and_unit", "unit_of"]

_PER = r"(?:/|[\s_]?per[\s_]?|[\s_]|p)"
"""What stands for the / of a unit in a name: rad/s, rad_per_s, rad_s, radps."""
_ENDS = (
    # Units that are no word beside.
    (r"rpm|nm|mnm|knm|1/min|r/min|u/min|min-1|deg|rad|mrad|mm|um|rps", r"\g<0>"),
    (r"counts", r"\g<0>"),
    (r"pct|percent", "%"),
    (rf"(rad|deg|mm|counts|turns|rev){_PER}s(?:ec)?", r"\1/s"),
    (r"m(?:/|[\s_]?per[\s_]?|_)(s|min)", r"m/\1"),
    (rf"mm{_PER}min", "mm/min"),
)
LONGEST_NAME = 1000  # no decision: a format: characters; a longer name has no unit at its end
_PATTERNS = tuple(
    (re.compile(rf"(.*[^\s_-])[\s_-]+({end})", re.IGNORECASE), re.compile(end, re.IGNORECASE), unit) for end, unit in _ENDS
)


_CURRENT = re.compile(r"(.*(?i:current|strom|courant|corrente|corriente)(?:.*[^\s_-])?)[\s_-]+(m?A)")
"""A current in A; in capitals alone, or small letters, A is a phase."""


def name_and_unit(name: str) -> tuple[str, str] | None:
    """(name, unit) of a name that ends with one behind a blank, a dash or an underline; None of any other.

    Single letters are no units here, but A behind a current: i_a is a phase.

    >>> [name_and_unit(name) for name in ("speed_rpm", "pos_cmd_deg", "vel_rad_s", "v_mm_per_s", "torque_pct", "i_a")]
    [('speed', 'rpm'), ('pos_cmd', 'deg'), ('vel', 'rad/s'), ('v', 'mm/s'), ('torque', '%'), None]
    >>> [name_and_unit(name) for name in ("motor_current_A", "current_a", "MOTOR_CURRENT_A")]
    [('motor_current', 'A'), None, None]
    """
    if len(name) > LONGEST_NAME:
        return None
    for pattern, alone, unit in reversed(_PATTERNS):
        found = pattern.fullmatch(name)
        if found is not None:
            return found[1].strip(), alone.sub(unit, found[2])
    current = _CURRENT.fullmatch(name) if not name.isupper() else None
    return None if current is None else (current[1].strip(), current[2])


def unit_of(name: str) -> str | None:
    """The unit that a name ends with."""
    found = name_and_unit(name)
    return None if found is None else found[1]
