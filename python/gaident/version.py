"""The version, which stands in pyproject.toml alone."""

from __future__ import annotations

from functools import cache

__all__ = ["version"]


@cache
def version() -> str:
    """Version of the installed package."""
    from importlib.metadata import PackageNotFoundError  # takes as long as half of `gaident --help`
    from importlib.metadata import version as installed

    try:
        return installed("gaident")
    except PackageNotFoundError:
        return "unknown (not installed)"
