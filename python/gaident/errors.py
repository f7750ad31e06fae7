"""Exceptions of gaident.

Wrong use raises one of these; all are subclasses of ValueError. Every message names the argument (or the
file and the line), the offending value and the remedy.
"""

from __future__ import annotations

__all__ = [
    "ControllerError",
    "GaidentError",
    "ModelError",
    "ReadError",
    "RecordError",
    "SettingsError",
    "SpaceError",
]


class GaidentError(ValueError):
    """Base of everything gaident raises on wrong use."""


class RecordError(GaidentError):
    """A record's arrays or its sample time cannot be used."""


class ReadError(GaidentError):
    """A log file cannot be read as asked."""


class ControllerError(GaidentError):
    """A controller's parameters make no controller."""


class ModelError(GaidentError):
    """A model's parameters make no model, or it does not suit the loop it is put in."""


class SpaceError(GaidentError):
    """A search space is empty or contradicts itself."""


class SettingsError(GaidentError):
    """Settings of a method are out of their range."""
