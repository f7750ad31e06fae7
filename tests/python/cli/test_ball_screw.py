"""A motor on a ball screw: its log is in mm and mm/min, its gains are those of the motor."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from cli_cases import refusal
from gaident.cli import main
from gaident.drive.kinds import length, speed
from gaident.drive.quantities import number_or_unit, si_number
from gaident.errors import ReadError

LEAD, KT, J, FRICTION = 0.01, 0.71, 3.4e-3, 0.5
DRIVE = """
screw = "10 mm"
torque_constant = 0.71
[columns]
time = "t [ms]"
command = "v_soll [mm/min]"
velocity = "v_ist [mm/min]"
position = "x_ist [mm]"
torque = "I_soll [A]"
[controller]
kp = "0.6 N m s/rad"
tn = "12 ms"
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two logs of the axis, and its drive file."""
    monkeypatch.chdir(tmp_path)
    controller = ga.PI(0.6, 50.0)
    drive = ga.OneMass(J=J, D=3e-3).model().with_effect("coulomb_friction", torque=FRICTION)
    for i in (1, 2):
        rng = np.random.default_rng(i)
        command = np.repeat(rng.uniform(-60.0, 60.0, 20), 100)
        noise = 0.01 * rng.standard_normal(len(command))
        run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=0.0 * command), controller)
        per_rad = 1e3 * LEAD / math.tau  # mm
        rows = np.column_stack(
            [
                np.arange(len(command)),
                60.0 * per_rad * command,
                60.0 * per_rad * (run.velocity + noise),
                per_rad * run.position,
                run.torque / KT,
            ]
        )
        head = "t [ms];v_soll [mm/min];v_ist [mm/min];x_ist [mm];I_soll [A]"
        np.savetxt(f"run{i}.csv", rows, delimiter=";", comments="", header=head, fmt="%.9g")
    Path("drive.toml").write_text(DRIVE)
    return tmp_path


@pytest.mark.long
def test_lengths_of_the_log_are_angles_of_the_motor(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["diagnose", "run1.csv", "--validation", "run2.csv", "--drive", "drive.toml"]
    assert main([*arguments, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    (cause,) = found["findings"]
    assert cause["effect"] == "coulomb_friction"
    assert cause["parameters"]["torque"]["value"] == pytest.approx(FRICTION, rel=0.01)
    assert found["mechanics"]["inertia"]["value"] == pytest.approx(J, rel=0.01)
    Path("drive.toml").write_text(DRIVE.replace('screw = "10 mm"\n', ""))
    assert main([*arguments, "--screw", "10 mm", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["findings"] == found["findings"]


def test_a_unit_that_is_none_of_the_axis_is_said_before_the_work(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("drive.toml").write_text(DRIVE.replace('screw = "10 mm"\n', "") + '[show]\nvelocity = "mm/s"\n')
    told = refusal(["diagnose", "run1.csv", "--drive", "drive.toml", "--out", "dia.json"], capsys)
    assert "'mm/s', which no rotary axis is measured in" in told and not Path("dia.json").exists()


def test_numbers_with_a_decimal_comma_are_read_and_thousands_are_not() -> None:
    assert si_number("0,42 Nm/(rad/s)", "kp", {}) == 0.42 and si_number("18,5 ms", "tn", {}) == pytest.approx(0.0185)
    assert length("10,5 mm", "pitch") == pytest.approx(0.0105) and speed("1500,5 rpm", "speed") == pytest.approx(157.1320)
    with pytest.raises(ReadError, match="write a decimal point, and none between thousands"):
        number_or_unit("1,500 ms", "tn")
    with pytest.raises(ReadError, match="give a length in m"):
        length("1,500 mm", "pitch")


def test_a_gain_of_the_other_kind_of_axis_is_refused_with_the_way_out(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    linear = 'axis = "linear"\n' + DRIVE.replace('screw = "10 mm"\n', "")
    Path("drive.toml").write_text(linear)
    told = refusal(["diagnose", "run1.csv", "--drive", "drive.toml"], capsys)
    assert "kp is '0.6 N m s/rad', a unit of a rotary axis" in told
    assert 'give it in N s/m, or, of a motor on a screw, axis = "rotary" and screw = "10 mm"' in told
    without = DRIVE.replace('screw = "10 mm"\n', "").replace("0.6 N m s/rad", "400 N s/m")
    Path("drive.toml").write_text(without)
    assert "a unit of a linear axis" in refusal(["diagnose", "run1.csv", "--drive", "drive.toml"], capsys)
    Path("drive.toml").write_text('axis = "linear"\n' + DRIVE.replace("0.6 N m s/rad", "400 N s/m"))
    assert "leave the one or the other out" in refusal(["diagnose", "run1.csv", "--drive", "drive.toml"], capsys)


def test_a_force_is_a_torque_of_the_motor_and_what_is_in_rad_stays(here: Path) -> None:
    still = np.linspace(0.0, 1.0, 30)
    np.savetxt("f.csv", np.column_stack([1e3 * still, still, 100.0 * still]), delimiter=",", comments="", header="x,w,F")
    columns = {"position": "x", "velocity": "w", "torque": "F"}
    rec = ga.read("f.csv", columns, {"position": "mm", "velocity": "rad/s", "torque": "N"}, 1e-3, screw=LEAD)
    assert rec.position is not None and rec.torque is not None
    np.testing.assert_allclose(rec.position, still * math.tau / LEAD)
    np.testing.assert_allclose(rec.velocity, still)
    np.testing.assert_allclose(rec.torque, 100.0 * still * LEAD / math.tau)
    with pytest.raises(ReadError, match="screw"):
        ga.read("f.csv", columns, dt=1e-3, screw=-1.0)
