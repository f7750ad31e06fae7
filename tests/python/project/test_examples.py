"""The numbered examples: each runs, in this process, and finds what it says it finds."""

from __future__ import annotations

import json
import os
import runpy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaident.cli.main import main
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


@pytest.mark.long
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


TRACES = {
    "run1.csv": ("drive.toml", {"coulomb_friction": ("torque", 0.04)}),
    "velocity_mode.csv": ("velocity_mode.toml", {"coulomb_friction": ("torque", 0.12)}),
    "position_mode.csv": ("position_mode.toml", {"coulomb_friction": ("torque", 0.12)}),
    "robot_joint.csv": ("robot_joint.toml", {"unbalance": ("amplitude", 1.5), "coulomb_friction": ("torque", 0.3)}),
}


@pytest.mark.long
@pytest.mark.parametrize("trace", TRACES)
def test_a_trace_with_its_drive_file_shows_what_is_hidden_in_it(
    trace: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(EXAMPLES / "traces")
    drive, hidden = TRACES[trace]
    assert main(["diagnose", trace, "--drive", drive, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    causes = {f["effect"]: f for f in found["findings"] if not f["is_noise"]}
    assert found["verdict"] == "explained" and causes.keys() == hidden.keys()
    for effect, (name, value) in hidden.items():
        assert causes[effect]["alternatives"] == [] and near(causes[effect]["parameters"][name]["value"], value, 0.01)


@pytest.mark.parametrize("trace", [*TRACES, "run2.csv"])
def test_init_reads_every_trace(
    trace: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", str(EXAMPLES / "traces" / trace)]) == 0
    said = capsys.readouterr().out
    assert "velocity" in said and "torque" in said and "FILL IN" in said


def test_the_traces_are_what_their_script_makes(tmp_path: Path) -> None:
    script = EXAMPLES / "traces" / "make_traces.py"
    names = runpy.run_path(str(script))
    names["two_masses"].__globals__["HERE"] = tmp_path
    for make in ("two_masses", "velocity_mode", "position_mode", "robot_joint"):
        names[make]()
    written = {path.name: path.read_text(encoding="utf-8").splitlines() for path in tmp_path.iterdir()}
    assert sorted(written) == sorted(path.name for path in script.parent.glob("*.csv"))
    for name, lines in written.items():
        there = (script.parent / name).read_text(encoding="utf-8").splitlines()
        assert lines[0] == there[0] and len(lines) == len(there)
        # The last digits of a simulation are the processor's.
        fine, stored = (
            np.array([row.replace(";", " ").replace(",", "." if ";" in row else " ").split() for row in rows[1:]], dtype=float)
            for rows in (lines, there)
        )
        assert np.all(np.abs(fine - stored) <= 1e-4 * np.abs(stored).max(axis=0))
