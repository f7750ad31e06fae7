"""Names of effects that are found without a fit: in a replay of the controller, or in the record itself."""

from __future__ import annotations

__all__ = ["CLAMP", "OUTLIERS", "QUANTISATION", "RATE_LIMIT", "SATURATION"]

CLAMP, RATE_LIMIT, SATURATION = "integrator_clamp", "command_rate_limit", "torque_saturation"
"""Limits that a replay of the controller shows without a model of the plant."""

OUTLIERS, QUANTISATION = "outliers", "velocity_quantisation"
"""Effects that describe the record rather than the drive; no fit moves them."""
