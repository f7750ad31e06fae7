"""How far a diagnosis has come, and so how long it will take.

Its parts take very different times: a controller that does not fit the torque is looked for in many forms, then a mechanism is
identified, and effects are searched for. All this is done again under another controller.
Before the identification the time cannot be predicted.
With t the time before a search and d the time that this search will take,

    fraction = t/(t + d) + d/(t + d) (part of the search that is done)

where d is five times the time of the identification, or the time of the search before.
The time that is left is then (time so far) (1 - fraction)/fraction.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from gaident.diagnosis.records.arguments import ProgressCallback

__all__ = ["Note"]

IDENTIFIED = 0.2  # no decision: of a search's time, what its identification takes; seen: 0.11 to 0.25


class Note:
    """Progress that goes on by itself: each message without a fraction takes a fifth of what is left of its search."""

    def __init__(self, callback: ProgressCallback | None, clock: Callable[[], float] = time.monotonic) -> None:
        self.callback, self.clock = callback, clock
        self.began = clock()
        self.part = self.shown = self.before = 0.0
        self.search: float | None = None

    def __call__(self, part: float | None, message: str) -> None:
        """part: of the search that is done."""
        self.part = part if part is not None else self.part + 0.2 * (1.0 - self.part)
        self.shown = min(max(self.shown, self.before + (1.0 - self.before) * self.part), 1.0)
        if self.callback is not None:
            self.callback(self.shown, message)

    def searching(self) -> None:
        """A search begins, the first one or another."""
        now = self.clock()
        if self.search is not None:
            self._expect(now, now - self.search)
        self.search = now

    def identified(self) -> None:
        """The linear model of the search is there."""
        if self.search is not None:
            self._expect(self.search, (self.clock() - self.search) / IDENTIFIED)

    def _expect(self, began: float, seconds: float) -> None:
        gone = began - self.began
        self.before = gone / (gone + seconds) if gone + seconds > 0.0 else 0.0
