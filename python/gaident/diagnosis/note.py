"""How far a diagnosis has come."""

from __future__ import annotations

from gaident.diagnosis.records.arguments import ProgressCallback

__all__ = ["Note"]


class Note:
    """Progress that goes on by itself: each message without a fraction takes a fifth of what is left."""

    def __init__(self, callback: ProgressCallback | None) -> None:
        self.callback, self.fraction = callback, 0.0

    def __call__(self, fraction: float | None, message: str) -> None:
        self.fraction = fraction if fraction is not None else self.fraction + 0.2 * (1.0 - self.fraction)
        if self.callback is not None:
            self.callback(min(self.fraction, 1.0), message)
