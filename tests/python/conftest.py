"""What every Python test may use."""

from __future__ import annotations

import os
from pathlib import Path

import hypothesis
import pytest

ROOT = Path(__file__).resolve().parents[2]

# The same examples in every run, and no clock: a slow machine is no failure.
# HYPOTHESIS_PROFILE=search looks further.
hypothesis.settings.register_profile("repeatable", derandomize=True, deadline=None, database=None)
hypothesis.settings.register_profile("search", deadline=None, max_examples=1000)
hypothesis.settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

os.environ.setdefault("MPLBACKEND", "Agg")  # no test opens a window


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Return the folder of recorded data: GAIDENT_DATA, else ../shared/data beside the project."""
    named = os.environ.get("GAIDENT_DATA")
    folder = Path(named) if named else ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"no recorded data: {folder} does not exist; set GAIDENT_DATA")
    return folder
