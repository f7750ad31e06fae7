"""The numbered examples: each runs, in this process, and finds what it says it finds."""

from __future__ import annotations

import os
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from places import ROOT

EXAMPLES = ROOT / "examples"

Names = dict[str, Any]


def near(value: float, truth: float, share: float) -> bool:
    return abs(value - truth) < share * truth


def several_records(names: Names) -> None:
    assert np.std(names["residual"]) < 0.22


def torque_log(names: Names) -> None:
    assert near(names["idn"].mechanics.J, 3.2e-4, 0.01)


def friction(names: Names) -> None:
    (finding,) = names["dia"].causes
    assert finding.effect == "coulomb_friction" and finding.named
    assert near(finding.parameters["torque"].value, 0.05, 0.03)


def backlash(names: Names) -> None:
    (finding,) = names["dia"].causes
    assert finding.effect == "backlash" and finding.named and near(finding.parameters["gap"].value, 0.02, 0.05)
    for found, true in ((finding.parameters["gap"], 0.02), (names["dia"].mechanics["inertia"], 7.2e-4)):
        assert abs(found.value - true) < 3.0 * found.std


def ambiguous(names: Names) -> None:
    (finding,) = names["first"].causes
    assert {"coulomb_friction", "load_torque"} <= {finding.effect, *finding.alternatives}
    (after,) = names["second"].causes
    assert after.effect == "coulomb_friction" and after.named


def emps(names: Names) -> None:
    assert names["idn"].falsified and near(names["idn"].mechanics.J, 100.0, 0.2)


CHECKS: dict[str, Callable[[Names], None]] = {
    "01_identify_from_arrays": lambda names: None,
    "02_several_records": several_records,
    "03_paper_settings": lambda names: None,
    "04_torque_log": torque_log,
    "05_diagnose_friction": friction,
    "06_diagnose_backlash": backlash,
    "07_ambiguous_record": ambiguous,
    "09_emps": emps,
}


def test_every_example_is_run() -> None:
    elsewhere = ["08_own_effect"]  # test_own_effects.py
    assert sorted([*CHECKS, *elsewhere]) == sorted(path.stem for path in EXAMPLES.glob("*.py"))


@pytest.mark.parametrize("stem", CHECKS)
def test_example(stem: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    if stem == "09_emps" and not (Path(os.environ.get("GAIDENT_DATA", ".")) / "emps").is_dir():
        pytest.skip("no recorded data: set GAIDENT_DATA to their folder")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [stem])
    names = runpy.run_path(str(EXAMPLES / f"{stem}.py"))
    out, err = capsys.readouterr()
    assert out and err == "" and not list(tmp_path.iterdir())
    CHECKS[stem](names)
