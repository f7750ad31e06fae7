"""What of a controller is an effect of the library: a setting that is configured there, and found by a replay where it is not."""

from __future__ import annotations

from types import MappingProxyType

__all__ = ["ANTI_WINDUP", "OF_SETTING"]

ANTI_WINDUP = "anti_windup"
"""The finding of another anti-windup than the given one: what the integrator does at a limit is no effect of the library."""

OF_SETTING = MappingProxyType(
    {
        "torque_limit": "torque_saturation",
        "integrator_limit": "integrator_clamp",
        "command_rate": "command_rate_limit",
    }
)
"""Setting of a controller -> effect that does the same beside a controller without it."""
