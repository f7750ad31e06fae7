"""What the tests of hostile arguments share; their rows are imported where one of them runs, for they identify and diagnose."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def kept_fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `fleet` found in the log, by both methods: made once, so that no row waits for it."""
    import hostile_calls as calls

    with pytest.MonkeyPatch.context() as there:
        there.chdir(tmp_path_factory.mktemp("fleet"))
        calls.write_log()
        for given in (calls.FLEET, calls.FLEET | {"method": "diagnose", "quick": True}):
            assert calls.ga.fleet(**given).done == 1
        return Path("fleet").absolute()


@pytest.fixture
def files(kept_fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with the files that the rows name."""
    from hostile_calls import write_files

    monkeypatch.chdir(tmp_path)
    write_files(kept_fleet)
    return tmp_path
