"""Bounds on time, on machines that others use, too."""

from __future__ import annotations

from collections.abc import Callable


def fastest(measure: Callable[[], float], below: float, attempts: int = 5) -> float:
    """Seconds of the fastest of up to `attempts` measurements, the last one being `below`: a disturbance goes, a delay stays."""
    best = float("inf")
    for _ in range(attempts):
        best = min(best, measure())
        if best < below:
            break
    return best
