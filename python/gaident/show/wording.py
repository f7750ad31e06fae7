"""How numbers, structures and tables are written."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from gaident.axis import unit, word
from gaident.results.estimate import Estimate

__all__ = ["certainty", "controller_lines", "number", "structure_words", "table", "with_std"]


def certainty(bic: float) -> str:
    """What a difference of so many BIC units means: 2 ln of the odds."""
    return next(words for least, words in ((50.0, "beyond doubt"), (20.0, "very likely"), (-math.inf, "likely")) if bic >= least)


def structure_words(p: int, q: int) -> str:
    """What a structure (p, q) means mechanically."""
    known = {(1, 0): "one mass", (1, 2): "two masses on a shaft", (1, 4): "three masses in a row"}
    return known.get((p, q), "neither one mass nor two")


def number(value: float, digits: int = 4) -> str:  # no decision: how a number is printed
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
    if -3 <= size < 6:  # no decision: how a number is printed
        shift, digits = 0, max(decimals, 0)
    else:
        shift, digits = size, decimals + size
    if digits > 9:  # next to no noise: the deviation needs an exponent of its own  # no decision: how a number is printed
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


def controller_lines(numbers: Mapping[str, Estimate], axis: str) -> list[str]:
    """What was not known of the controller and follows from the logged torque; empty where all was given."""
    rows = [(name, with_std(e.value, e.std), "" if e.unit == "1" else unit(e.unit, axis)) for name, e in numbers.items()]
    return ["Of the controller, from the logged " + word("torque", axis), *table(rows)] if rows else []
