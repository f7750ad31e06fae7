"""The worked examples of the docs: files, commands and Python in the order of the page, and what the page shows of them."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from places import ROOT

PAGES = runpy.run_path(str(ROOT / "docs" / "tools" / "run_pages.py"))


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES["WORKED"])
def test_a_worked_page_runs_as_it_stands(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    PAGES["worked"]((ROOT / "docs" / page).read_text(encoding="utf-8"), page)


def test_what_does_not_come_out_is_seen() -> None:
    shown = ["Verdict: explained", "...", "  torque  0.1201 +- 0.0001  N m"]
    PAGES["compared"](shown, "Verdict: explained\nCause\n  torque   0.1203 +- 0.0001  N m\nmore\n", "page")
    for printed in ("Verdict: unexplained\n", "Verdict: explained\n  torque  0.1401 +- 0.0001  N m\n", "Verdict: explained\n"):
        with pytest.raises(SystemExit, match="is shown and does not come out here"):
            PAGES["compared"](shown, printed, "page")
