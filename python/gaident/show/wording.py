"""How numbers, units, structures and tables are written."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from gaident.errors import SettingsError

__all__ = ["AXES", "certainty", "number", "sentence", "structure_words", "table", "unit", "velocity_unit", "with_std"]

AXES = ("rotary", "linear")

# Longest first: "N m s/rad" must not be read as "N m".
_LINEAR = (
    ("N m s/rad", "N s/m"),
    ("N m/rad", "N/m"),
    ("kg m^2", "kg"),
    ("rad/s^", "m/s^"),
    ("rad/s/(", "m/s/("),
    ("(N m)", "N"),
    ("N m", "N"),
)
_LINEAR_WORDS = (
    ("rad/s", "m/s"),
    (r"(?<!load )\btorque\b(?! saturation| dead band| lag)", "force"),
    (r"(?<!load )\bTorque\b(?! saturation| dead band| lag)", "Force"),
    (r"\bturns (forwards|backwards|slower)", r"moves \1"),
    (r"\baxis turns\b", "axis moves"),
    (r"\binertia\b", "mass"),
)
# (an angle in words, metres or 1/m for each, how it is then written); a turn of a linear axis is 2 pi m
_LINEAR_ANGLES = (
    (r"(?P<value>[\d.e+-]+) degrees of travel", math.radians(1.0), "{:.2g} m of travel"),
    (r"(?P<value>[\d.e+-]+) turns travelled", math.tau, "{:.2g} m travelled"),
    (r"\borders below (?P<value>\d+)", 1.0 / math.tau, "orders below {:.2g} 1/m"),
    (r"\borders above (?P<value>\d+)", 1.0 / math.tau, "orders above {:.2g} 1/m"),
    (r"\bperiod of order (?P<value>\d+) or less", 1.0 / math.tau, "period of order {:.2g} 1/m or less"),
)


def unit(text: str, axis: str = "rotary") -> str:
    """The unit of a torque, inertia, damping, stiffness or gain as the axis has it; roots stay in rad/s.

    Raises SettingsError for an axis that is neither "rotary" nor "linear".
    """
    if axis not in AXES:
        raise SettingsError(f"axis is {axis!r}: it must be one of {', '.join(map(repr, AXES))}")
    if axis == "linear":
        for rotary, linear in _LINEAR:
            text = text.replace(rotary, linear)
    return text


def velocity_unit(axis: str = "rotary") -> str:
    """rad/s or m/s."""
    return "rad/s" if unit("N m", axis) == "N m" else "m/s"


def sentence(text: str, axis: str = "rotary") -> str:
    """A plain sentence with the units and words of the axis; names of effects ("torque saturation") stay.

    Raises SettingsError for another axis.
    """
    text = unit(text, axis)
    if axis == "rotary":
        return text
    for rotary, linear in _LINEAR_WORDS:
        text = re.sub(rotary, linear, text)
    for pattern, factor, of_metres in _LINEAR_ANGLES:
        text = re.sub(pattern, _in_metres(factor, of_metres), text)
    return text


def _in_metres(factor: float, written: str) -> Callable[[re.Match[str]], str]:
    return lambda found: written.format(float(found["value"]) * factor)


def certainty(bic: float) -> str:
    """What a difference of so many BIC units means: 2 ln of the odds."""
    return next(words for least, words in ((50.0, "beyond doubt"), (20.0, "very likely"), (-math.inf, "likely")) if bic >= least)


def structure_words(p: int, q: int) -> str:
    """What a structure (p, q) means mechanically."""
    known = {(1, 0): "one mass", (1, 2): "two masses on a shaft", (1, 4): "three masses in a row"}
    return known.get((p, q), "neither one mass nor two")


def number(value: float, digits: int = 4) -> str:
    """`value` with so many significant digits; a dash where there is none."""
    return f"{value + 0.0:.{digits}g}" if math.isfinite(value) else "-" if math.isnan(value) else f"{value}"


def with_std(value: float, std: float | None) -> str:
    """`value +- std`, the standard deviation with two significant digits and the value as far as it goes."""
    if std is None or math.isnan(std) or std == 0.0 or not math.isfinite(value):
        return number(value, 5)
    if math.isinf(std):
        return f"{number(value, 5)} +- inf"
    size = math.floor(math.log10(max(abs(value), std)))
    decimals = 1 - math.floor(math.log10(std))
    if -3 <= size < 6:
        shift, digits = 0, max(decimals, 0)
    else:
        shift, digits = size, decimals + size
    if digits > 9:  # next to no noise: the deviation needs an exponent of its own
        return f"{value:.9g} +- {std:.1e}"
    scale = 10.0**-shift
    text = f"{round(value * scale, digits) + 0.0:.{digits}f} +- {std * scale:.{digits}f}"
    return text if shift == 0 else f"({text})e{shift:+03d}"


def table(rows: Sequence[Sequence[str]], indent: str = "  ") -> list[str]:
    """Lines with the cells in left-aligned columns two spaces apart; empty columns are left out."""
    columns = list(zip(*rows, strict=True))
    kept = [column for column in columns if any(column)]
    widths = [max(map(len, column)) for column in kept]
    lines = zip(*kept, strict=True)
    return [(indent + "  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True))).rstrip() for line in lines]
