"""gaident export: the files contain the result's model and numbers."""

from __future__ import annotations

import csv
import json
import runpy
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.cli.output import program


@pytest.fixture(scope="module")
def result() -> ga.Diagnosis:
    torque = np.repeat([0.8, -0.9, 0.5, -0.6, 1.0, -0.4], 100)
    noise = 0.005 * np.random.default_rng(1).standard_normal(600)
    drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    velocity = ga.simulate(drive, ga.Record(1e-3, torque=torque, velocity=0.0 * torque)) + noise
    return ga.diagnose(ga.Record(1e-3, torque=torque, velocity=velocity))


@pytest.fixture
def here(result: ga.Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    result.save("run.json")
    result.identification.save("idn.json")
    return tmp_path


def test_c_is_what_the_model_writes(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "run.json", "--to", "c", "--dt", "1e-3"]) == 0
    assert capsys.readouterr().out == "written: run.c\n"
    assert Path("run.c").read_text() == result.model.to_c(None, dt=1e-3, name="run")
    assert main(["export", "run.json", "--to", "c", "--dt", "1e-3"]) == 2  # no file is lost that was not named
    assert "such a file already" in capsys.readouterr().err
    assert main(["export", "run.json", "--to", "c", "--dt", "1e-3", "--closed", "--out", "run.c"]) == 2
    assert "--closed: the result has no controller, the torque drove its model" in capsys.readouterr().err
    assert main(["export", "run.json", "--to", "c", "--out", "run.c"]) == 2
    assert "give --dt" in capsys.readouterr().err


def test_c_and_fmu_with_the_controller_of_the_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    command = np.repeat([0.0, 10.0, -6.0, 4.0], 100)
    low = (ga.LowPass(2e-3),)
    controller = ga.Cascade(ga.PI(0.05, 0.8, rule="backward"), period=0.5e-3, torque_filters=low, acceleration_feedforward=1e-3)
    drive = ga.OneMass(J=0.01, D=0.05).model()
    answer = ga.run(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), controller)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(400)
    rec = ga.Record(1e-3, command=command, velocity=answer.velocity + noise, torque=answer.torque)
    found = ga.identify(rec, controller, ga.SearchSpace(gain=(10.0, 1000.0), p=(1, 1), q=(0, 0)))
    found.save("idn.json")
    assert main(["export", "idn.json", "--to", "c", "--dt", "1e-3", "--closed"]) == 0
    assert Path("idn.c").read_text() == found.model.to_c(None, dt=1e-3, controller=controller, name="idn")
    assert main(["export", "idn.json", "--to", "fmu", "--dt", "1e-3", "--closed", "--sources"]) == 2
    assert 'feedforward_over is "coming"' in capsys.readouterr().err


def test_c_of_any_file_name_compiles(here: Path) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler: cc")
    for stem in ("1run", "achse-ä", "int", "_"):
        assert main(["export", "run.json", "--to", "c", "--dt", "1e-3", "--out", f"{stem}.c"]) == 0
        done = subprocess.run([compiler, "-std=c99", "-Wall", "-Werror", "-c", f"{stem}.c", "-o", "any.o"], capture_output=True)
        assert done.returncode == 0, done.stderr.decode()


def test_a_python_file_makes_the_plant(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "run.json", "--to", "scipy"]) != 0
    assert "coulomb_friction" in capsys.readouterr().err
    assert main(["export", "run.json", "--to", "scipy", "--linear", "--out", "plant.py"]) == 0
    plant = runpy.run_path("plant.py")["plant"]
    assert plant.gain == result.model.gain and np.allclose(np.sort(plant.poles), np.sort(result.model.poles))
    assert "left out by --linear: coulomb_friction" in Path("plant.py").read_text()
    assert main(["export", "idn.json", "--to", "control", "--out", "plant2.py", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.partition("{")[2].join(("{", "")))["form"] == "control"
    assert "control.zpk(zeros, poles, gain)" in Path("plant2.py").read_text()


def test_a_table_of_all_numbers(here: Path, result: ga.Diagnosis) -> None:
    assert main(["export", "run.json", "--to", "csv"]) == 0
    with open("run.csv", newline="") as stream:
        rows = {(row["of"], row["parameter"]): row for row in csv.DictReader(stream)}
    friction = rows["coulomb_friction", "torque"]
    assert float(friction["value"]) == result.causes[0].parameters["torque"].value and friction["unit"] == "N m"
    assert float(rows["mechanics", "inertia"]["std"]) == result.mechanics["inertia"].std
    assert main(["export", "run.json", "--to", "csv", "--axis", "linear", "--out", "linear.csv"]) == 0
    assert ",N\n" in Path("linear.csv").read_text()
    assert main(["export", "idn.json", "--to", "csv"]) == 0 and "model,gain" in Path("idn.csv").read_text()
    assert main(["export", "idn.json", "--to", "csv", "--axis", "linear", "--out", "linear.csv"]) == 0
    lines = Path("linear.csv").read_text().splitlines()
    units = {line.split(",")[1]: line.rpartition(",")[2] for line in lines if line.startswith("model,")}
    assert units.pop("gain") == "m/s^2/N" and set(units.values()) == {"rad/s"}  # poles are no motion of the axis


def test_a_record_is_no_result(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    result.records[0].save("record.json")
    assert main(["export", "record.json", "--to", "csv"]) == 2
    assert "contains a record, no model" in capsys.readouterr().err


def test_a_printed_command_can_be_pasted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the folder of the program, where the shell would not find it."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr("sys.argv", [".my env/bin/gaident", "demo"])
    assert program() == "'.my env/bin/gaident'"
    monkeypatch.setattr("sys.argv", ["/usr/lib/python3/site-packages/gaident/__main__.py"])
    assert program() == "gaident"
    (tmp_path / "gaident").write_text("#!/bin/sh\n")
    (tmp_path / "gaident").chmod(0o755)
    monkeypatch.setattr("sys.argv", [str(tmp_path / "gaident")])
    assert program() == "gaident"


@pytest.mark.parametrize(("form", "file"), [("mujoco", "run.xml"), ("urdf", "run.urdf"), ("sdf", "run.sdf")])
def test_a_joint_for_a_simulator(here: Path, result: ga.Diagnosis, form: str, file: str) -> None:
    assert main(["export", "run.json", "--to", form]) == 0
    joint = ga.joint_parameters(result)
    assert Path(file).read_text() == getattr(joint, f"to_{form}")("run")


def test_gains_and_blocks_for_a_simulator(here: Path, result: ga.Diagnosis) -> None:
    joint = ga.joint_parameters(result)
    assert main(["export", "run.json", "--to", "wpilib", "--torque-constant", "0.5"]) == 0
    assert json.loads(Path("run.wpilib.json").read_text()) == joint.to_wpilib(0.5)
    assert main(["export", "run.json", "--to", "simscape", "--speed", "5", "--out", "blocks.csv"]) == 0
    rows = list(csv.reader(Path("blocks.csv").read_text().splitlines()))
    assert rows[0] == ["block", "parameter", "value", "unit"] and len(rows) == 1 + len(joint.to_simscape())
    assert main(["export", "run.json", "--to", "simscape", "--speed", "-5", "--out", "blocks.csv"]) == 2


def test_an_fmu(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "run.json", "--to", "fmu", "--dt", "1e-3", "--sources", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["path"] == "run.fmu"
    with zipfile.ZipFile("run.fmu") as made:
        assert made.read("sources/run.c").decode() == result.model.to_c(None, 1e-3, name="run")
        assert not any("binaries" in name for name in made.namelist())
    assert main(["export", "run.json", "--to", "fmu", "--out", "b.fmu"]) == 2
    assert "--to fmu needs the sample time" in capsys.readouterr().err
    assert main(["export", "run.json", "--to", "fmu", "--dt", "1e-3", "--compiler", "no-such-cc", "--out", "b.fmu"]) == 2
    assert "name one with --compiler gcc, or give --sources" in capsys.readouterr().err
