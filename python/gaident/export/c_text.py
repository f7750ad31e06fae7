"""Numbers as C writes them."""

from __future__ import annotations

import math
from collections.abc import Sequence

__all__ = ["array", "number"]


def number(value: float) -> str:
    """A double as C writes it, all digits."""
    value = float(value)
    return repr(value) if math.isfinite(value) else "INFINITY"


def array(values: Sequence[float]) -> str:
    """Numbers as C initialises an array."""
    return "{" + ", ".join(number(v) for v in values or [0.0]) + "}"
