"""A log without a velocity: init's drive file gives the inertia, and a filter that is asked for does not move it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig
from gaident.cli import main
from gaident.drive.drive_file import read_drive_file

FAST = Plant(1e-4, 1e-3, 0.03, 1.0, 1e-3, JL=1e-4, DL=1e-3, KG=20.0)  # antiresonance at 71 Hz, resonance at 101 Hz
INERTIA = FAST.J + FAST.JL
LINK = Plant(2e-3, 5e-3, 0.4, 8.0, 1e-3, JL=3e-3, DL=2e-3, KG=4.0, name="flexible link")  # 5e-3 kg m^2
TWO_MASSES = ga.SearchSpace(gain=(100.0, 5e3), real=(0.0, 100.0), imaginary=(0.0, 300.0), p=(1, 1), q=(2, 2))


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


def test_the_inertia_does_not_depend_on_a_cutoff(drive_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All channels pass the same filter: what is filtered alone is another plant."""
    inertia, notes = found(capsys, "--velocity-cutoff", "100")
    assert inertia == pytest.approx(INERTIA, rel=0.02)
    assert sum("All channels went through the same zero-phase low-pass of 100 Hz" in note for note in notes) == 1


def test_the_inertia_of_a_flexible_link(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a filter, as `init` writes it, and behind any corner that leaves the resonance at 9 Hz."""
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(3)
    command = np.repeat(rng.choice([-1, 1], 20) * rng.uniform(2.0, 6.0, 20), 150)
    rec = rig(LINK, command, noise=Noise(white=0.0, encoder=2e-4), position_logged=True)
    rows = np.column_stack([rec.time, command, rec.torque, rec.position])
    np.savetxt("link.csv", rows, delimiter=",", header="time,command,torque,position", comments="", fmt="%.10g")
    assert main(["init", "link.csv"]) == 0
    assert "velocity_cutoff_hz" not in Path("drive.toml").read_text()
    for cutoff in (None, 20.0, 50.0, 100.0):
        read = ga.read("link.csv", velocity_cutoff_hz=cutoff)
        for controller in (LINK.controller, None):
            mechanics = ga.identify(read, controller=controller, space=TWO_MASSES).mechanics
            assert isinstance(mechanics, ga.TwoMass)
            assert pytest.approx(5e-3, rel=0.02) == mechanics.JM + mechanics.JL, (cutoff, controller)
