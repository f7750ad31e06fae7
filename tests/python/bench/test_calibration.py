"""The calibrated numbers of the policy are what the command of the blind bench writes."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from drive_rig import skip_without_library
from gaident.policy.declared import CALIBRATED
from gaident.policy.table import POLICY, rows
from places import ROOT


@pytest.fixture
def calibrate(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    return importlib.import_module("blind_calibrate")


def test_the_policy_has_the_numbers_that_the_command_wrote(calibrate: ModuleType) -> None:
    assert set(CALIBRATED["numbers"]) == set(calibrate.STATISTICS)
    table = {r.name: r for r in rows()}
    for name, measured in CALIBRATED["numbers"].items():
        assert table[name].value == measured["value"] > measured["largest"], name
        assert table[name].command == CALIBRATED["command"], name
    assert CALIBRATED["level"] == POLICY.noise_level


def test_the_level_is_that_of_an_exponential_tail(calibrate: ModuleType) -> None:
    values = np.random.default_rng(1).exponential(3.0, 20000) - 5.0
    for p in (1e-3, 1e-6):
        assert calibrate.level(values, p) == pytest.approx(-5.0 - 3.0 * np.log(p), rel=0.1)
    shuffled = np.random.default_rng(2).permutation(values)
    assert calibrate.level(shuffled, 1e-6) == calibrate.level(values, 1e-6)


def test_what_the_command_writes(calibrate: ModuleType, tmp_path: Path) -> None:
    lines = {str(i): dict.fromkeys(calibrate.STATISTICS, float(i)) | {"noise_ratio": 1.0 + 0.01 * i} for i in range(40)}
    lines["plain"] = {"key": "plain"}  # output errors decided there
    content = calibrate.calibrated(lines, cases=4, seed=3)
    calibrate.write(tmp_path / "calibrated.json", content)
    written = json.loads((tmp_path / "calibrated.json").read_text())
    assert written == content and written.keys() == CALIBRATED.keys()
    assert written["command"].endswith("--calibrate --cases 4 --seed 3") and written["records"] == 41
    ratio = written["numbers"]["noise_ratio"]
    assert ratio["records"] == 40 and ratio["largest"] == 1.39
    assert ratio["value"] == float(f"{calibrate.level([1.0 + 0.01 * i for i in range(40)]):.2g}")


def test_a_record_without_effects_is_measured(calibrate: ModuleType) -> None:
    skip_without_library()
    blind = importlib.import_module("blind")
    cells = [c for c in blind.cells("clean", 1, 5) if c.kind == "step" and calibrate.wanted(c)]
    assert [c.noise for c in cells] == ["white", "encoder", "coloured"]
    line = calibrate.measure(cells[0])
    assert line["whitened"] and line["key"] == calibrate.key_of(cells[0])
    assert -50.0 < line["effect_penalty"] < POLICY.effect_penalty
    assert -50.0 < line["dependence_gain"] < POLICY.dependence_gain
    assert 0.5 < line["noise_ratio"] < POLICY.noise_ratio and 0.5 < line["free_run_ratio"] < POLICY.free_run_ratio
