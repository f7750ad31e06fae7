"""JSON of results: numbers that JSON lacks are written as objects."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

__all__ = ["decoded", "json_text"]


def json_text(data: Mapping[str, Any]) -> str:
    """JSON of plain data; nan and inf, which JSON lacks, become objects {"number": "nan"}."""
    return json.dumps(_encoded(dict(data)), indent=1, allow_nan=False)


_WORDS = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def _encoded(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _encoded(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [_encoded(v) for v in x]
    if isinstance(x, float) and not math.isfinite(x):
        return {"number": "nan" if math.isnan(x) else "inf" if x > 0 else "-inf"}
    return x


def decoded(x: Any) -> Any:
    """What json_text had to encode, back as numbers."""
    if isinstance(x, dict):
        if set(x) == {"number"} and x["number"] in _WORDS:
            return _WORDS[x["number"]]
        return {k: decoded(v) for k, v in x.items()}
    if isinstance(x, list):
        return [decoded(v) for v in x]
    return x
