"""Several axes of one log: read in one call, diagnosed in one call with a row for each."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, rig
from gaident.cli import main
from gaident.drive.drive_file import axes_in, read_drive_file, unfilled_of
from gaident.errors import ReadError, RecordError

X, Y = Plant(3e-4, 2e-3, 0.03, 1.9, 1e-3), Plant(8e-4, 4e-3, 0.08, 4.0, 1e-3)
RPM = 2 * np.pi / 60
STEPS = np.repeat(np.random.default_rng(5).uniform(-60, 60, 10), 150)
COLUMNS = {name: {"command": f"{name}.set", "velocity": f"{name}.act", "torque": f"{name}.M"} for name in ("a1", "a2")}
AXES = {"x": COLUMNS["a1"], "y": {**COLUMNS["a2"], "units": {"velocity": 1.0, "command": 1.0}}}
DRIVE = """
[columns]
time = "t"
[units]
velocity = "rpm"
command = "rpm"
[controller]
kp = 0.03
ki = 1.9
[axes.x.columns]
command = "a1.set"
velocity = "a1.act"
torque = "a1.M"
[axes.y]
axis = "linear"
[axes.y.columns]
command = "a2.set"
velocity = "a2.act"
torque = "a2.M"
[axes.y.units]
velocity = "m/s"
command = "m/s"
[axes.y.controller]
kp = 0.08
ki = 4.0
"""


@pytest.fixture
def records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, ga.Record]:
    """machine.csv, with axis x (dry friction, in rpm) and y (nothing hidden, in SI), and what it contains."""
    monkeypatch.chdir(tmp_path)
    axes = {"x": rig(X, STEPS, {"coulomb_friction": {"torque": 0.05}}), "y": rig(Y, -STEPS, seed=1)}
    x, y = axes.values()
    rows = np.column_stack([x.time, x.command / RPM, x.velocity / RPM, x.torque, y.command, y.velocity, y.torque])
    header = "t,a1.set,a1.act,a1.M,a2.set,a2.act,a2.M"
    np.savetxt("machine.csv", rows, delimiter=",", header=header, comments="", fmt="%.14g")
    Path("drive.toml").write_text(DRIVE)
    return axes


def test_read_axes(records: dict[str, ga.Record]) -> None:
    common: dict[str, Any] = {"columns": {"time": "t"}, "units": {"velocity": "rpm", "command": "rpm"}}
    found = ga.read_axes("machine.csv", AXES, **common)
    assert list(found) == ["x", "y"] and [rec.name for rec in found.values()] == ["machine x", "machine y"]
    for name, rec in found.items():
        for channel, values in records[name].channels():
            np.testing.assert_allclose(getattr(rec, channel), values, rtol=1e-12, atol=1e-12)
    one = ga.read("machine.csv", columns={"time": "t", **COLUMNS["a1"]}, units=common["units"], name="machine x")
    assert found["x"] == one
    more = ga.read_axes(
        "machine.csv", {"x": {**COLUMNS["a1"], "torque_is": "measured", "name": "the first"}}, decimate=3, **common
    )
    assert more["x"].torque_is == "measured" and more["x"].name == "the first" and more["x"].dt == pytest.approx(3e-3)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ({}, "is no mapping of axes"),
        ({"x": ["a1.act"]}, "is no mapping of axes"),
        ({"x": COLUMNS["a1"], "y": {"velocity": "a3.act", "torque": "a2.M"}}, "axis 'y': .*there is no column 'a3.act'"),
        ({"x": {**COLUMNS["a1"], "unit": {}}}, "axis 'x': got an unexpected keyword argument 'unit'; give channels"),
        ({"x": {**COLUMNS["a1"], "shift": {"torque": 1490}}}, "axis 'x': .*leaves 10 of 1500 samples"),
    ],
)
def test_refusals(records: dict[str, ga.Record], axes: Any, said: str) -> None:
    with pytest.raises((ReadError, RecordError), match=said):
        ga.read_axes("machine.csv", axes, columns={"time": "t"})


def test_a_drive_file_of_several_axes(records: dict[str, ga.Record]) -> None:
    assert axes_in("drive.toml") == ("x", "y")
    x, y = (read_drive_file("drive.toml", name) for name in ("x", "y"))
    assert x["columns"] == {"time": "t", **COLUMNS["a1"]} and x["controller"] == {"kp": 0.03, "ki": 1.9}
    assert y["units"] == {"velocity": "m/s", "command": "m/s"} and y["controller"] == {"kp": 0.08, "ki": 4.0}
    assert (x[""], y[""]) == ({}, {"axis": "linear"})
    with pytest.raises(ReadError, match="contains the axes x, y: say which with --select NAME"):
        read_drive_file("drive.toml")
    with pytest.raises(ReadError, match="the axis is 'z': it must be one of x, y"):
        read_drive_file("drive.toml", "z")
    for text, said in (
        ("[axes.x.colums]\n", r"\[axes.x\] has the key 'colums': .* \(did you mean 'columns'\?\)"),
        ("[axes.x.units]\nvelocity = true\n", r"\[axes.x.units\] velocity is True"),
        ("[axes.x]\nkp = 1.0\n", r"put it below the line \[controller\]"),
        ("[axes.x]\ndt = 'a'\n", r"\[axes.x\] dt"),
        ("axes = 3\n", "axes is no table of axes"),
        ("[axes]\nx = 3\n", "axes is no table of axes"),
    ):
        Path("bad.toml").write_text(text)
        with pytest.raises(ReadError, match=said):
            read_drive_file("bad.toml", "x")
    Path("marks.toml").write_text("[controller]\n# kp = 1  # FILL IN: x\n[axes.x.units]\n# torque = 'N m'  # FILL IN: y\n")
    assert set(unfilled_of("marks.toml", "x")) == {("controller", "kp"), ("units", "torque")}


@pytest.mark.long
def test_diagnose_gives_a_row_for_each_axis(records: dict[str, ga.Record], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", "machine.csv", "--drive", "drive.toml", "--out", "run.json"]) == 0
    out = capsys.readouterr().out
    rows = [line.split("  ") for line in out.splitlines()[:3]]
    assert [row[0].strip() for row in rows] == ["axis", "x", "y"]
    assert "explained" in out.splitlines()[1] and "coulomb friction" in out.splitlines()[1] and "rad/s" in out.splitlines()[1]
    assert "adequate" in out.splitlines()[2] and "none" in out.splitlines()[2] and "m/s" in out.splitlines()[2]
    assert "--- x" in out and "--- y" in out and "written: run_x.json, run_y.json" in out
    single = ga.load("run_x.json")
    assert isinstance(single, ga.Diagnosis) and [f.effect for f in single.causes] == ["coulomb_friction"]
    # One of them, as every other command takes it.
    assert main(["diagnose", "machine.csv", "--drive", "drive.toml", "--select", "x", "--json"]) == 0
    alone = json.loads(capsys.readouterr().out)
    assert ga.Diagnosis.from_dict(alone) == single
    assert main(["identify", "machine.csv", "--drive", "drive.toml"]) == 2
    assert "say which with --select NAME" in capsys.readouterr().err
    assert main(["identify", "machine.csv", "--drive", "drive.toml", "--select", "x", "y"]) == 2
    assert "only gaident diagnose takes several axes at once" in capsys.readouterr().err
    assert main(["identify", "machine.csv", "--drive", "drive.toml", "--select", "y"]) == 0


def test_an_axis_that_cannot_be_diagnosed_is_a_row(records: dict[str, ga.Record], capsys: pytest.CaptureFixture[str]) -> None:
    Path("drive.toml").write_text(DRIVE.replace('torque = "a1.M"', 'torque = "a7.M"'))
    assert main(["diagnose", "machine.csv", "--drive", "drive.toml", "--json"]) == 1
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "gaident/axes" and data["axes"]["y"]["verdict"] == "adequate"
    assert "there is no column 'a7.M'" in data["axes"]["x"]["error"] and "--columns torque=" in data["axes"]["x"]["error"]
    assert main(["diagnose", "machine.csv", "--drive", "drive.toml", "--model", "run.json"]) == 2
