"""Conversions of an MDF channel from what was stored to what it means: applied here, so that no formula of a file is evaluated.

Sources: ASAM MDF 3.3 (CCBLOCK) and 4.1 (CCBLOCK); what is read is the parsed block of the library, of which nothing is called.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Conversion", "conversion_of"]

_Apply = Callable[[NDArray[Any]], NDArray[np.float64]]

# The kinds by their numbers in a file of version 3 and of version 4.
_KINDS_3 = {
    65535: "none", 0: "linear", 1: "interpolated", 2: "table", 6: "polynomial", 7: "exponential", 8: "logarithmic",
    9: "rational", 10: "formula", 11: "texts", 12: "texts",
}  # fmt: skip
_KINDS_4 = {
    0: "none", 1: "linear", 2: "rational", 3: "formula", 4: "interpolated", 5: "table", 6: "ranges", 7: "texts", 8: "texts",
    9: "texts", 10: "texts", 11: "texts",
}  # fmt: skip
_NEVER = "{} as conversion, which is not evaluated: export its values with the conversion applied, or as CSV"


@dataclass(frozen=True)
class Conversion:
    """What becomes of the stored values.

    apply   stored values, of the file's number type -> values, both (n,); None: they are the values, or cannot become numbers
    flaw    why they cannot become numbers; "" where they can
    """

    apply: _Apply | None = None
    flaw: str = ""


def conversion_of(block: Any, version: int) -> Conversion:
    """The conversion that a block (None: there is none) of a file of version 3 or 4 stands for."""
    if block is None:
        return Conversion()
    number = int(block.conversion_type)
    kind = (_KINDS_3 if version < 4 else _KINDS_4).get(number, f"kind {number}")  # no decision: a format: versions of MDF
    if kind == "none":
        return Conversion()
    if kind == "texts":
        return Conversion(flaw="text")
    if kind not in _MAKERS:
        return Conversion(flaw=_NEVER.format(f"a {kind}" if kind == "formula" else f"{kind}"))
    return _MAKERS[kind](block, version)


def _linear(block: Any, _: int) -> Conversion:
    factor, offset = float(block.a), float(block.b)
    return Conversion(None if (factor, offset) == (1.0, 0.0) else lambda x: factor * x.astype(np.float64) + offset)


def _rational(block: Any, _: int) -> Conversion:
    p1, p2, p3, p4, p5, p6 = (float(getattr(block, f"P{k}")) for k in range(1, 7))  # no decision: a format: six parameters

    def apply(x: NDArray[Any]) -> NDArray[np.float64]:
        x = x.astype(np.float64)
        with np.errstate(all="ignore"):  # what has no value is refused where it is needed
            return np.asarray((p1 * x * x + p2 * x + p3) / (p4 * x * x + p5 * x + p6))

    return Conversion(apply)


def _polynomial(block: Any, _: int) -> Conversion:
    p1, p2, p3, p4, p5, p6 = (float(getattr(block, f"P{k}")) for k in range(1, 7))  # no decision: a format: six parameters

    def apply(x: NDArray[Any]) -> NDArray[np.float64]:
        x = x.astype(np.float64)
        with np.errstate(all="ignore"):
            return np.asarray((p2 - p4 * (x - p5 - p6)) / (p3 * (x - p5 - p6) - p1))

    return Conversion(apply)


def _pairs(block: Any, version: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(stored, value) of a table, both (m,)."""
    pairs = int(block.ref_param_nr) if version < 4 else int(block.val_param_nr) // 2  # no decision: a format: versions of MDF
    stored = np.array([float(getattr(block, f"raw_{k}")) for k in range(pairs)])
    return stored, np.array([float(getattr(block, f"phys_{k}")) for k in range(pairs)])


def _table(block: Any, version: int, nearest: bool = True) -> Conversion:
    stored, values = _pairs(block, version)
    if not len(stored) or not np.all(np.diff(stored) > 0.0):
        return Conversion(flaw="a table as conversion whose keys do not rise; export its values with the conversion applied")
    if not nearest:
        return Conversion(lambda x: np.interp(x, stored, values))

    def apply(x: NDArray[Any]) -> NDArray[np.float64]:
        above = np.clip(np.searchsorted(stored, x), 0, len(stored) - 1)
        below = np.maximum(above - 1, 0)
        found = np.where(x - stored[below] <= stored[above] - x, values[below], values[above])
        found = np.where(x >= stored[-1], values[-1], np.where(x <= stored[0], values[0], found))
        return np.where(np.isnan(x), np.nan, found)

    return Conversion(apply)


def _ranges(block: Any, _: int) -> Conversion:
    count = (int(block.val_param_nr) - 1) // 3  # no decision: a format: lower, upper and value of each range, and a default
    lower, upper, values = (
        np.array([float(getattr(block, f"{name}_{k}")) for k in range(count)]) for name in ("lower", "upper", "phys")
    )
    default = float(block.default)
    if not count or not (np.all(np.diff(lower) > 0.0) and np.all(lower <= upper)):
        return Conversion(flaw="ranges as conversion that do not rise; export its values with the conversion applied")

    def apply(x: NDArray[Any]) -> NDArray[np.float64]:
        at = np.clip(np.searchsorted(lower, x, side="right") - 1, 0, None)
        below = x < upper[at] if x.dtype.kind == "f" else x <= upper[at]  # a range contains its end where numbers are whole
        inside = (x >= lower[at]) & below
        return np.where(inside, values[at], default)

    return Conversion(apply)


_MAKERS: dict[str, Callable[[Any, int], Conversion]] = {
    "linear": _linear,
    "rational": _rational,
    "polynomial": _polynomial,
    "interpolated": lambda block, version: _table(block, version, nearest=False),
    "table": _table,
    "ranges": _ranges,
}
