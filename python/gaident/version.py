"""The version, which stands in pyproject.toml alone."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed

__all__ = ["version"]


@cache
def version() -> str:
    """Version of the installed package."""
    try:
        return installed("gaident")
    except PackageNotFoundError:
        return "unknown (not installed)"
