"""Names of a controller's settings, for whoever needs no controller: importing them imports nothing else."""

from __future__ import annotations

__all__ = ["ANTI_WINDUP", "LOOPS", "UNKNOWN"]

LOOPS = ("sampled", "continuous")
ANTI_WINDUP = ("none", "hold", "tracking")

UNKNOWN = "unknown"
"""What stands in a drive file in the place of a number that is not known: None in Python."""
