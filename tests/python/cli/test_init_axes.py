"""init beside gaps of the time, and in a log of several axes: the file that it writes is taken as it is, once it is filled in."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.data.listing import columns
from gaident.drive.drive_file import axes_in, read_drive_file, unfilled_of
from gaident.drive.log_content import axes_of, gaps_of

LOOP = ga.PI(kp=0.5, ki=5.0)
RPM = 30.0 / np.pi


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ga.Record:
    """A drive of 0.01 kg m^2 in its loop."""
    monkeypatch.chdir(tmp_path)
    command = np.repeat([20.0, -30.0, 10.0, -5.0, 15.0], 120)
    noise = 0.02 * np.random.default_rng(1).standard_normal(600)
    found = ga.run(ga.OneMass(J=0.01, D=0.05).model(), ga.Record(1e-3, command=command - noise, velocity=noise), LOOP)
    return ga.Record(1e-3, command=command, velocity=found.velocity + noise, torque=found.torque)


def written(path: str, names: list[str], rows: np.ndarray) -> None:
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="", fmt="%.10g")


def filled(path: str, **values: str) -> None:
    """The lines that are marked, with these values in them, as a person writes them."""
    text = Path(path).read_text(encoding="utf-8")
    for key, value in values.items():
        text = re.sub(rf"^# {key} = .*FILL IN", f"{key} = {value}  # FILL IN", text, flags=re.MULTILINE)
    Path(path).write_text(text, encoding="utf-8")


def test_init_beside_gaps_takes_the_pieces(run: ga.Record, capsys: pytest.CaptureFixture[str]) -> None:
    kept = np.r_[0:200, 260:400, 410:600]
    rows = np.column_stack([1e3 * run.time, RPM * run.command, RPM * run.velocity, run.torque])[kept]
    written("gap.csv", ["t [ms]", "n_set [rpm]", "n_act [rpm]", "M_set [Nm]"], rows)
    assert main(["init", "gap.csv"]) == 0
    text = Path("drive.toml").read_text(encoding="utf-8")
    assert "pieces = true             # the time has 2 gaps" in text and "# dt = 0.001 " in text and "resample" not in text
    filled("drive.toml", kp="0.5", ki="5.0")
    capsys.readouterr()
    assert main(["identify", "gap.csv", "--drive", "drive.toml", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["mechanics"]["J"] == pytest.approx(0.01, rel=0.02) and len(data["digests"]) == 3


def test_gaps_are_pauses_of_an_even_time() -> None:
    t = np.arange(300.0)
    assert gaps_of(t) == (0, 0.0) == gaps_of(None) == gaps_of(np.zeros(5))
    assert gaps_of(np.delete(t, slice(100, 140))) == (1, 1.0)
    assert gaps_of(np.delete(t, 100)) == (0, 0.0)  # a lost line is no pause
    assert gaps_of(np.r_[t, 500.0 + t] + 0.3 * np.random.default_rng(1).uniform(size=600)) == (0, 0.0)


def test_init_writes_each_of_several_axes(run: ga.Record, capsys: pytest.CaptureFixture[str]) -> None:
    rows = [1e3 * run.time, RPM * run.command, RPM * run.velocity, run.torque / 0.024]
    rows += [1e3 * run.command, 1e3 * run.velocity, run.torque]
    names = ["t [ms]", "X.n_set [rpm]", "X.n_act [rpm]", "X.M [%]", "Y.v_set [mm/s]", "Y.v_act [mm/s]", "Y.F [N]"]
    written("machine.csv", names, np.column_stack(rows))
    assert list(axes_of(columns("machine.csv"))) == ["X", "Y"] == list(axes_in_draft())
    told = capsys.readouterr().out
    assert "X.velocity X.n_act [rpm]" in told and "axes.X: rated_torque: N m at 100 %" in told
    assert "gaident diagnose machine.csv --drive drive.toml" in told
    assert unfilled_of("drive.toml", "X")["", "rated_torque"].startswith("drive.toml: line ")
    assert ("controller", "kp") in unfilled_of("drive.toml", "Y") and ("", "rated_torque") not in unfilled_of("drive.toml", "Y")
    filled("drive.toml", kp="0.5", ki="5.0", rated_torque="2.4")
    assert read_drive_file("drive.toml", "Y")[""]["axis"] == "linear"
    assert main(["diagnose", "machine.csv", "--drive", "drive.toml"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^X +adequate", out, re.MULTILINE) and re.search(r"^Y +adequate", out, re.MULTILINE)


def axes_in_draft() -> tuple[str, ...]:
    assert main(["init", "machine.csv"]) == 0
    return axes_in("drive.toml")


def test_signals_of_one_axis_are_no_axes(run: ga.Record) -> None:
    """Command and answer of one drive that begin differently, and one axis beside a trigger."""
    rows = np.column_stack([run.time, run.command, run.velocity, run.torque])
    for names in (
        ["t [s]", "Set.velocity [rad/s]", "Act.velocity [rad/s]", "Act.torque [Nm]"],
        ["t [s]", "A.v_set [rad/s]", "A.v_act [rad/s]", "B.trigger"],
    ):
        written("one.csv", names, rows)
        assert axes_of(columns("one.csv")) == {}


def test_the_gains_are_asked_for_in_a_position_loop_too(run: ga.Record) -> None:
    """Also where a torque could drive the model; rule and anti-windup are offered."""
    angle = np.cumsum(run.velocity) * 1e-3
    rows = np.column_stack([1e3 * run.time, angle + 0.01, angle, RPM * run.velocity, run.torque])
    written("move.csv", ["t [ms]", "pos_set [rad]", "pos_act [rad]", "n_act [rpm]", "M_set [Nm]"], rows)
    assert main(["init", "move.csv"]) == 0
    text = Path("drive.toml").read_text(encoding="utf-8")
    assert 'position_command = "pos_set [rad]"' in text
    assert re.search("^# kp = .*FILL IN", text, re.MULTILINE) and re.search("^# ki = .*FILL IN", text, re.MULTILINE)
    assert re.search('^# rule = "backward" ', text, re.MULTILINE) and re.search('^# anti_windup = "hold" ', text, re.MULTILINE)


def test_the_loop_is_asked_for_where_neither_command_nor_torque_is_found(run: ga.Record) -> None:
    """Each may be among the columns that say nothing; both together leave no line that contradicts the other."""
    written(
        "run.csv",
        ["t [ms]", "n_act [rpm]", "x1", "x2"],
        np.column_stack([1e3 * run.time, RPM * run.velocity, run.time, run.torque]),
    )
    assert main(["init", "run.csv", "-o", "axis.toml"]) == 0
    text = Path("axis.toml").read_text(encoding="utf-8")
    assert re.search(r"^# command = .*FILL IN", text, re.MULTILINE) and re.search(
        r'^# loop = "open" .*FILL IN', text, re.MULTILINE
    )
    assert not re.search(r"^loop", text, re.MULTILINE)


def test_without_a_command_the_torque_drives_the_model(run: ga.Record) -> None:
    """The file is taken as it is; a voltage beside a current is offered for the winding."""
    assert run.torque is not None
    current, supply = run.torque / 0.06, 0.5 * run.torque / 0.06 + 0.06 * run.velocity
    rows = np.column_stack([1e3 * run.time, supply, current, RPM * run.velocity, 57.3 * np.cumsum(1e-3 * run.velocity)])
    written("motor.csv", ["t [ms]", "Spannung [V]", "Strom [A]", "Drehzahl [1/min]", "Lage [Grad]"], rows)
    assert main(["init", "motor.csv"]) == 0
    text = Path("drive.toml").read_text(encoding="utf-8")
    assert re.search(r'^loop = "open" ', text, re.MULTILINE) and re.search(r'^position = "Grad" ', text, re.MULTILINE)
    assert re.search(r'^# voltage = "Spannung \[V\]"', text, re.MULTILINE)
    assert "# its name says torque or current, its unit is one of torque or current" in text
    assert re.search('^torque_is = "measured" .*FILL IN: .*; measured is taken, as no command is logged$', text, re.MULTILINE)
    filled("drive.toml", torque_constant="0.06", torque_is='"measured"')
    assert main(["identify", "motor.csv", "--drive", "drive.toml", "--quiet"]) == 0
    offered = re.sub(r"^# voltage", "voltage", re.sub(r"^torque = ", "current = ", text, flags=re.MULTILINE), flags=re.MULTILINE)
    Path("drive.toml").write_text(offered.replace('torque = "A"', 'current = "A"'), encoding="utf-8")
    assert main(["identify", "motor.csv", "--drive", "drive.toml", "--quiet"]) == 0
