"""How many processors a search may use: all that the process may run on, or one where the caller keeps the others busy."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["one_processor", "processors"]

_ALONE: ContextVar[bool] = ContextVar("one_processor", default=False)


def processors() -> int:
    """Processors that a search uses where nobody says how many."""
    if _ALONE.get():
        return 1
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def one_processor() -> Iterator[None]:
    """Searches inside use one processor; they find the same with any number."""
    token = _ALONE.set(True)
    try:
        yield
    finally:
        _ALONE.reset(token)
