"""A log without a velocity: init's drive file gives the inertia, and a filter on the velocity alone is noted."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drive_rig import Noise, Plant, rig
from gaident.cli import main
from gaident.drive.drive_file import read_drive_file

FAST = Plant(1e-4, 1e-3, 0.03, 1.0, 1e-3, JL=1e-4, DL=1e-3, KG=20.0)  # antiresonance at 71 Hz, resonance at 101 Hz
INERTIA = FAST.J + FAST.JL


@pytest.fixture
def drive_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """What init writes for log.csv, a fast two-mass drive's command, torque and encoder, with the gains filled in."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    command = np.repeat(rng.choice([-1, 1], 20) * rng.uniform(9.0, 30.0, 20), 100)
    rec = rig(FAST, command, noise=Noise(white=0.0, encoder=2e-4), position_logged=True)
    assert rec.torque is not None and rec.position is not None
    rows = np.column_stack([rec.time, command, rec.torque, rec.position])
    np.savetxt("log.csv", rows, delimiter=",", header="t [s],speed_ref [rad/s],torque_ref [Nm],angle [rad]", comments="")
    assert main(["init", "log.csv"]) == 0
    capsys.readouterr()
    text = Path("drive.toml").read_text()
    Path("drive.toml").write_text(text.replace("# kp = 0.0232", "kp = 0.03").replace("# ki = 1.367", "ki = 1.0"))
    return Path("drive.toml")


def found(capsys: pytest.CaptureFixture[str], *options: str) -> tuple[float, list[str]]:
    """(inertia of both masses [kg m^2], the notes) of gaident identify."""
    assert main(["identify", "log.csv", "--drive", "drive.toml", "--json", *options]) == 0
    data = json.loads(capsys.readouterr().out)
    mechanics = data["mechanics"]
    return mechanics.get("J") or mechanics["JM"] + mechanics["JL"], data["warnings"]


def test_the_inertia_of_a_log_with_a_position_alone(drive_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    top = read_drive_file(str(drive_file))[""]
    assert "velocity_cutoff_hz" not in top and top["torque_is"] == "commanded"
    for loop in ((), ("--loop", "open", "--p", "1", "--q", "2")):
        inertia, notes = found(capsys, *loop)
        assert inertia == pytest.approx(INERTIA, rel=0.02)
        assert not any("low-pass" in note for note in notes)


def test_a_velocity_that_is_filtered_alone_is_noted(drive_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    inertia, notes = found(capsys, "--velocity-cutoff", "100")
    assert abs(inertia / INERTIA - 1.0) > 0.05
    assert sum("The velocity alone went through a low-pass of 100 Hz" in note for note in notes) == 1
