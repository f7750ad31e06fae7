"""Names of a controller's settings, for whoever needs no controller: importing them imports nothing else."""

from __future__ import annotations

__all__ = ["ANTI_WINDUP", "LOOPS"]

LOOPS = ("sampled", "continuous")
ANTI_WINDUP = ("none", "hold", "tracking")
