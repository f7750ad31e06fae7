"""One thread for the sums of BLAS, for as long as any diagnosis of this process needs it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

__all__ = ["one_thread"]

_LOCK = threading.Lock()
_INSIDE = 0  # no decision: a count of what goes on, which begins at nothing.
_LIMIT: Any = None


@contextmanager
def one_thread() -> Iterator[None]:
    """A sum that several threads share is rounded otherwise with each number of them, and a search follows the last digit.

    The number of threads belongs to the process.
    The first that is inside limits it, and the last that leaves gives it back.
    Of two that overlap, each by itself would give back what the other had set.
    """
    global _INSIDE, _LIMIT
    with _LOCK:
        if _INSIDE == 0:
            _LIMIT = _libraries().limit(limits=1, user_api="blas")
        _INSIDE += 1
    try:
        yield
    finally:
        with _LOCK:
            _INSIDE -= 1
            if _INSIDE == 0:
                _LIMIT.restore_original_limits()
                _LIMIT = None


@cache
def _libraries() -> Any:
    """Those of NumPy and SciPy, which make all sums here; looked for once in a process, as that takes milliseconds."""
    import scipy.linalg  # noqa: F401  brings a BLAS of its own, to be limited too
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
