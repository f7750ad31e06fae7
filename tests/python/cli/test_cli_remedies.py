"""gaident retune, feedforward and map: what they print and write is what the package says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main


@pytest.fixture(scope="module")
def result() -> ga.Diagnosis:
    controller = ga.PI(0.5, 5.0)
    command = np.repeat([20.0, -30.0, 10.0, -5.0], 100)
    noise = 0.02 * np.random.default_rng(1).standard_normal(400)
    drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), controller)
    rec = ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque)
    return ga.diagnose(rec, controller, seed=1)


@pytest.fixture
def here(result: ga.Diagnosis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    result.save("run.json")
    result.identification.save("idn.json")
    result.records[0].save("rec.json")
    return tmp_path


@pytest.mark.long
def test_retune_prints_and_saves(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["run.json", "--dt", "1e-3", "--step", "50", "--phase-margin", "55", "--torque-limit", "60"]
    assert main(["retune", *options, "--out", "gains.json", "--plot", "loop.png"]) == 0
    printed = capsys.readouterr().out
    tuned = ga.load("gains.json")
    assert isinstance(tuned, ga.Retuning) and tuned.phase_margin == 55.0 and tuned.after.step_torque.value <= 60.0
    assert tuned == ga.retune(result, phase_margin=55.0, torque_limit=60.0, step=50.0, dt=1e-3)
    assert printed == f"{tuned.summary()}\nwritten: gains.json\nwritten: loop.png\n" and Path("loop.png").stat().st_size > 1000
    assert main(["retune", *options, "--json", "--axis", "linear"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "gaident/retuning" and data["after"]["stiffness"]["unit"] == "N/m"


COLUMNS = {"command": "r", "velocity": "w", "torque": "M"}
UNITS = {"command": "rad/s", "velocity": "rad/s", "torque": "Nm"}


def write_log(rec: ga.Record) -> list[str]:
    """The record as a log to the last digit, run.csv, and the options that read it."""
    assert rec.command is not None and rec.torque is not None
    columns = np.column_stack([rec.command, rec.velocity, rec.torque])
    np.savetxt("run.csv", columns, delimiter=",", header=",".join(COLUMNS.values()), comments="", fmt="%.17g")
    told = [",".join(f"{channel}={value}" for channel, value in given.items()) for given in (COLUMNS, UNITS)]
    return ["run.csv", "--columns", told[0], "--units", told[1], "--dt", "1e-3"]


def test_feedforward_prints_and_writes(here: Path, result: ga.Diagnosis, capsys: pytest.CaptureFixture[str]) -> None:
    """With its log the command prints what the package says of the whole result; a saved one has no samples."""
    log, sizes = write_log(result.records[0]), ["--speed", "30", "--points", "8"]
    rec = ga.read("run.csv", COLUMNS, UNITS, dt=1e-3)
    tables, own = ga.feedforward(result, speed=30.0, points=8, rec=rec), ga.feedforward(result, speed=30.0, points=8)
    assert tables.following is not None and own.following is not None and tables.following.after == own.following.after
    assert main(["feedforward", "run.json", *log, *sizes, "--csv", "t.csv", "--c", "t.c"]) == 0
    assert capsys.readouterr().out == f"{tables.summary()}\nwritten: t.csv\nwritten: t.c\n"
    assert Path("t.c").read_text() == own.to_c(None, "t")
    assert len(Path("t.csv").read_text().splitlines()) == 1 + 3 + 16
    loaded = ga.load("run.json")
    assert isinstance(loaded, ga.Diagnosis) and main(["feedforward", "run.json", *sizes]) == 0
    said = capsys.readouterr().out
    assert said == f"{ga.feedforward(loaded, speed=30.0, points=8).summary()}\n"
    assert said.endswith("not simulated: the result is a loaded one and has no records.\n")
    assert main(["feedforward", "run.json", "--speed", "30", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "gaident/feedforward" and data["following"] is None


SPEEDS_LOG = ["speeds.csv", "--columns", "time=t,velocity=w,torque=M", "--unit", "time=s,velocity=rad/s,torque=Nm"]


def write_speeds() -> ga.Record:
    """The log of held speeds, a line every 20 ms, with a temperature beside: speeds.csv."""
    rng = np.random.default_rng(2)
    w = np.repeat([2.0, 5.0, 10.0, 20.0, -20.0, -10.0, -5.0, -2.0], 100)
    torque = 0.05 * np.sign(w) + 2e-3 * w + 1e-3 * rng.standard_normal(len(w))
    t, heat = 0.02 * np.arange(len(w)), np.linspace(20.0, 40.0, len(w))
    np.savetxt("speeds.csv", np.column_stack([t, w, torque, heat]), delimiter=",", header="t,w,M,heat", comments="")
    return ga.read(
        "speeds.csv", {"time": "t", "velocity": "w", "torque": "M"}, {"time": "s", "velocity": "rad/s", "torque": "Nm"}
    )


def test_map_prints_and_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    rec = write_speeds()
    found = ga.friction_map(rec)
    assert main(["map", *SPEEDS_LOG]) == 0 and capsys.readouterr().out == f"{found.summary()}\n"
    assert found.law is not None and found.law.effects["coulomb_friction"]["torque"].value == pytest.approx(0.05, abs=1e-3)
    assert main(["map", *SPEEDS_LOG, "--out", "friction", "--temperature", "heat", "--inertia", "1e-3", "--bins", "4"]) == 0
    told = ga.friction_map(rec, inertia=1e-3, bins=4, temperature=np.linspace(20.0, 40.0, len(rec)))
    names = [f"friction/{name}" for name in ("friction_map.csv", "bins.csv", "friction_map.json", "friction_map.png")]
    assert capsys.readouterr().out == "\n".join([told.summary(), *(f"written: {name}" for name in names)]) + "\n"
    told.to_csv("held.csv", "plateaus")
    assert Path("held.csv").read_text() == Path(names[0]).read_text() and Path(names[3]).read_bytes()[:4] == b"\x89PNG"
    assert len(Path(names[1]).read_text().splitlines()) == 1 + 8 and json.loads(Path(names[2]).read_text())["law"]
    assert main(["map", *SPEEDS_LOG, "--axis", "linear", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["schema"] == "gaident/friction_map" and data["law"]["viscous"]["unit"] == "N s/m"


@pytest.mark.parametrize(
    ("more", "message"),
    [(["--inertia", "-1"], "inertia is -1"), (["--bins", "0"], "bins is 0"), (["--temperature", "x"], "no column 'x'"),
     (["--column", "torque=,command=M"], "there is no torque, which shows the friction: name its column (--columns torque=...)"),
     (["--out", "speeds.csv"], "speeds.csv")],
)  # fmt: skip
def test_map_says_what_is_wrong(
    more: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_speeds()
    assert main(["map", *SPEEDS_LOG, *more]) in (1, 2)
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["retune", "run.json"], "give --dt [s]"), (["retune", "rec.json", "--dt", "1e-3"], "rec.json contains no model"),
     (["retune", "run.json", "--dt", "1e-3", "--phase-margin", "100"], "phase_margin is 100"),
     (["retune", "run.json", "--dt", "1e-3", "--plot", "loop.txt"], "a picture ends in"),
     (["retune", "run.json", "--out", "run.json"], "this is the log itself"),
     (["feedforward", "idn.json", "--speed", "3"], "idn.json contains no diagnosis"),
     (["feedforward", "run.json", "--speed", "3", "--csv", "a", "--c", "a"], "both name a"),
     (["feedforward", "run.json"], "--speed")],
)  # fmt: skip
def test_wrong_use_is_one_line(here: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
