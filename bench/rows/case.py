"""One case of a kind, and its result."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any

__all__ = ["Case", "Result", "digest"]


@dataclass(frozen=True)
class Case:
    """One case, complete: the same case is the same record. `key` names it in the file; `what` is its cell, name or number."""

    kind: str
    key: str
    what: Any
    number: int = 0


@dataclass(frozen=True)
class Result:
    outcome: str
    said: str
    detail: str


def digest(what: Any) -> str:
    return hashlib.sha1(json.dumps(what, default=str).encode()).hexdigest()[:10]
