"""What every Python test may use."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import hypothesis
import pytest

try:
    import fcntl
except ImportError:  # not POSIX
    fcntl = None  # type: ignore[assignment]

ROOT = Path(__file__).resolve().parents[2]

# Tests run side by side (pytest -n); threads below numpy would only stand in each other's way. Read when numpy is imported.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

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


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with the log of a two-mass drive: step.csv."""
    from cli_cases import write_step

    monkeypatch.chdir(tmp_path)
    write_step("step.csv")
    return tmp_path


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Let no test of another worker run beside one that is marked `alone`."""
    if fcntl is None:
        yield
        return
    # Two files that are there in any case. Who waits for an empty room holds the door, so that nobody else enters before.
    with open(ROOT / "pyproject.toml") as door, open(__file__) as room:
        fcntl.flock(door, fcntl.LOCK_EX)
        fcntl.flock(room, fcntl.LOCK_EX if item.get_closest_marker("alone") else fcntl.LOCK_SH)
        fcntl.flock(door, fcntl.LOCK_UN)
        yield
