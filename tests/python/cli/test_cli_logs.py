"""The commands around logs, the drive file that init writes, progress, quiet, and completion."""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import examination as doctor
from gaident.cli import main
from gaident.data.guess import guess_channels, unit_from_position, unit_from_velocity
from gaident.data.listing import columns
from gaident.drive.draft import draft
from gaident.drive.drive_file import read_drive_file
from gaident.messages import Message, shortest
from gaident.show.progress_bar import Progress
from places import SAMPLES

TRUTH = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
RPM = 2 * np.pi / 60


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with step.csv: a two-mass drive in a closed loop, time in ms, speeds in rpm, position in rad."""
    monkeypatch.chdir(tmp_path)
    still = ga.Record(1e-3, command=np.repeat([0.0, 40.0, -20.0], [20, 150, 130]), velocity=np.zeros(300))
    run = ga.run(TRUTH, still, ga.PI(0.0232, 1.367))
    speed = run.velocity + 0.1 * np.random.default_rng(4).standard_normal(300)
    rows = np.column_stack([1e3 * still.time, still.channels().__next__()[1] / RPM, speed / RPM, run.torque])
    np.savetxt("step.csv", rows, delimiter=",", header="t [ms],speed_ref [rpm],speed_act [rpm],torque [Nm]", comments="")
    return tmp_path


def test_columns_lists_what_a_log_holds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["columns", str(SAMPLES / "scope.csv"), str(SAMPLES / "status_text.csv")]) == 0
    shown = capsys.readouterr().out
    lines = {line.split()[0]: line.split() for line in shown.splitlines() if line}
    assert lines["ActVelocity"] == ["ActVelocity", "rpm", "40", "0", "941.308", "0.5"]
    assert lines["Temperature"] == ["Temperature", "-", "10", "30", "34.5", "2"]
    assert "no number: 'STOP' at line 2" in shown
    assert main(["columns", str(SAMPLES / "scope.csv"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["form"] == "text"
    torque = next(c for c in data["columns"] if c["name"] == "ActTorque")
    assert (torque["unit"], torque["sample_time"], torque["lowest"]) == ("Nm", pytest.approx(5e-4), 0.02)


def test_names_of_a_file_do_nothing_to_the_terminal(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(40) * 1e-3
    np.savez("evil.npz", **{"t": t, "speed \x1b[31m": np.sin(50 * t), 'torque "\n[controller]\nkp = 1': np.cos(50 * t)})
    assert main(["columns", "evil.npz"]) == 0
    assert main(["init", "evil.npz"]) == 0
    shown = capsys.readouterr().out
    assert "\x1b" not in shown and "speed \\x1b[31m" in shown
    sections = read_drive_file("drive.toml")
    assert sections["columns"]["torque"] == 'torque "\n[controller]\nkp = 1' and sections["controller"] == {"loop": "open"}
    call = ["identify", "evil.npz", "--drive", "drive.toml", "--quiet"]
    assert main(call) == 2
    assert "line 19: velocity and torque of [units], marked FILL IN, are not filled in" in capsys.readouterr().err
    assert main([*call, "--units", "velocity=rad/s,torque=N m"]) == 0


@pytest.mark.parametrize(
    ("file", "channels", "time"),
    [
        ("scope.csv", {"command": "SetVelocity", "velocity": "ActVelocity", "torque": "ActTorque"}, "Time #0"),
        (
            "german.csv",
            {"command": "Drehzahl Soll", "velocity": "Drehzahl Ist", "torque": "Moment", "position": "Winkel"},
            "Zeit [ms]",
        ),
        ("trace_two_names.csv", {"command": "Command speed", "velocity": "Motor speed", "torque": "Torque"}, "Time"),
        ("rostopic.csv", {"command": "field.command", "velocity": "field.velocity", "torque": "field.effort"}, "time"),
        ("savetxt.dat", {"command": "r", "velocity": "w", "torque": "u"}, "t"),
    ],
)
def test_channels_are_guessed_from_names_and_units(file: str, channels: dict[str, str], time: str) -> None:
    guess = guess_channels(columns(SAMPLES / file))
    assert {channel: c.name.split(" [")[0] for channel, c in guess.channels.items()} == channels
    assert guess.time is not None and guess.time.name == time


def test_twins_are_not_guessed_and_a_force_may_be_a_voltage(tmp_path: Path) -> None:
    t = np.arange(50) * 1e-3
    rows = "\n".join(f"{x:.3f},{np.sin(x):.6f},{np.cos(x):.6f},{x * x:.6f}" for x in t)
    (tmp_path / "alike.csv").write_text(f"t [s],u1,u2,w1\n{rows}\n")
    (tmp_path / "force.csv").write_text(f"t [s],Force [V],Input [V],speed [rpm]\n{rows}\n")
    assert {channel: c.name for channel, c in guess_channels(columns(tmp_path / "alike.csv")).channels.items()} == {
        "velocity": "w1"
    }
    guess = guess_channels(columns(tmp_path / "force.csv"))
    assert {channel: c.name for channel, c in guess.channels.items()} == {"velocity": "speed [rpm]", "torque": "Force [V]"}


@pytest.mark.parametrize(
    ("command", "velocity"),
    [
        ("Solldrehzahl [U/min]", "Istdrehzahl [U/min]"),
        ("Drehzahlsollwert [U/min]", "Drehzahlistwert [U/min]"),
        ("Sollgeschwindigkeit [mm/s]", "Istgeschwindigkeit [mm/s]"),
        ("Geschwindigkeitssollwert", "Geschwindigkeitsistwert"),
        ("speedref", "speedact"),
    ],
)
@pytest.mark.parametrize(
    ("torque", "kind"),
    [
        ("Sollmoment [Nm]", "commanded"),
        ("Istmoment [Nm]", "measured"),
        ("Momentensollwert", "commanded"),
        ("Stromistwert", "measured"),
    ],
)
@pytest.mark.parametrize("swapped", [False, True])
def test_compound_names_say_what_is_commanded(
    tmp_path: Path, command: str, velocity: str, torque: str, kind: str, swapped: bool
) -> None:
    t = np.arange(50)
    names = [velocity, command] if swapped else [command, velocity]
    rows = "\n".join(f"{x};{np.sin(0.1 * x):.6f};{np.sin(0.1 * x - 0.2):.6f};{np.cos(0.1 * x):.6f}" for x in t)
    (tmp_path / "log.csv").write_text(f"Zeit [ms];{';'.join(names)};{torque}\n{rows}\n")
    found = draft(columns(tmp_path / "log.csv"), {})
    assert found.channels == {"command": command, "velocity": velocity, "torque": torque}
    assert found.torque_is == kind


def test_init_asks_which_of_two_velocities_was_measured(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(50)
    rows = "\n".join(f"{x},{np.sin(0.1 * x):.6f},{np.sin(0.1 * x - 0.2):.6f},{np.cos(0.1 * x):.6f}" for x in t)
    Path("two.csv").write_text(f"t [ms],alpha [rpm],beta [rpm],torque [Nm]\n{rows}\n")
    assert main(["init", "two.csv", "--out", "two.toml", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert 'velocity: the measured velocity, not its command: "alpha [rpm]" or "beta [rpm]"?' in told["fill_in"]
    assert "velocity" not in told["channels"] and "command" not in told["channels"]
    assert main(["identify", "two.csv", "--drive", "two.toml", "--loop", "open"]) == 2
    assert "no column is named for the velocity" in capsys.readouterr().err


def test_init_writes_a_drive_file_that_identify_takes(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", "step.csv"]) == 0
    said = capsys.readouterr().out
    assert (
        "written: drive.toml" in said
        and "to be filled in, marked FILL IN" in said
        and "  controller.kp: N m s/rad; proportional gain" in said
    )
    sections = read_drive_file("drive.toml")
    assert sections["columns"] == {
        "time": "t [ms]", "command": "speed_ref [rpm]", "velocity": "speed_act [rpm]", "torque": "torque [Nm]",
    }  # fmt: skip
    assert sections["units"] == {"command": "rpm", "velocity": "rpm", "torque": "Nm"}
    # Open loop where that is asked for; in closed loop once the gains are filled in, by hand or as options.
    call = ["identify", "step.csv", "--drive", "drive.toml"]
    for command in (call, ["diagnose", *call[1:]]):
        assert main(command) == 2
        refused = capsys.readouterr().err
        assert "kp and ki of [controller], marked FILL IN, are not filled in" in refused and "--loop open" in refused
    assert main([*call, "--loop", "open"]) == 0
    assert capsys.readouterr().out.startswith("(p,q) = (1,2)")
    assert main([*call, "--kp", "0.0232"]) == 2
    assert ": ki of [controller], marked FILL IN, is not filled in" in capsys.readouterr().err
    text = Path("drive.toml").read_text()
    Path("drive.toml").write_text(text.replace("# kp = 0.0232", "kp = 0.0232").replace("# ki = 1.367", "ki = 1.367"))
    assert main(["identify", "step.csv", "--drive", "drive.toml", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["controller"]["kp"] == 0.0232
    # Never overwritten unasked.
    before = Path("drive.toml").read_bytes()
    assert main(["init", "step.csv"]) == 2
    assert "drive.toml: there is such a file already" in capsys.readouterr().err
    assert Path("drive.toml").read_bytes() == before
    assert main(["init", "step.csv", "--force", "--json"]) == 0
    marked = json.loads(capsys.readouterr().out)["fill_in"]
    assert [line.split(":")[0] for line in marked] == ["torque_is", "controller.kp", "controller.ki"]
    # The line to go on with is one that a shell takes.
    Path("my step.csv").write_bytes(Path("step.csv").read_bytes())
    assert main(["init", "my step.csv", "--out", "my.toml"]) == 0
    assert "then, once that is done: gaident diagnose 'my step.csv' --drive my.toml" in capsys.readouterr().out
    head = Path("my.toml").read_text().splitlines()[0]
    assert "for `gaident diagnose LOG --drive drive.toml`" in head and head.endswith('from "my step.csv".')
    # Every commented key is one that the file may have.
    for line in text.splitlines():
        key = line.removeprefix("# ").split("=")[0].strip()
        if line.startswith("# ") and "=" in line and key.isidentifier():
            Path("all.toml").write_text(text.replace(line, line.removeprefix("# ")))
            read_drive_file("all.toml")


def test_init_says_what_only_a_person_knows(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    turns = 50 * np.sin(np.arange(400) / 30)  # rpm
    angle = np.concatenate([[0.0], np.cumsum(0.5e-3 * (turns[1:] + turns[:-1]) * RPM)])
    rows = np.column_stack([np.arange(400) * 1e-3, turns, np.degrees(angle), np.cos(np.arange(400) / 30)])
    np.savetxt("odd.csv", rows, delimiter=";", header='t;speed;angle [deg];"torque, ""raw"" [%]"', comments="")
    assert main(["init", "odd.csv", "--out", "odd.toml"]) == 0
    said = capsys.readouterr().out
    assert "rated_torque: N m at 100 %" in said
    text = Path("odd.toml").read_text()
    assert "# rated_torque = 2.4      # FILL IN" in text
    assert 'velocity = "rpm"          # by comparison with the position' in text
    assert main(["identify", "odd.csv", "--drive", "odd.toml"]) == 2
    assert "--rated-torque" in capsys.readouterr().err
    Path("odd.toml").write_text(text.replace("# rated_torque", "rated_torque"))
    assert main(["identify", "odd.csv", "--drive", "odd.toml", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_init_finds_motion_by_its_values(here: Path, data_dir: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An array without names: time rises evenly, and of two columns one is the derivative of the other."""
    path = data_dir / "hsm150" / "idf_pos_0.065_1.mat"
    if not path.is_file():
        pytest.skip(f"no real data: {path} is missing")
    assert main(["init", str(path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["channels"] == {"position": "data[:,2]", "velocity": "data[:,3]"}
    assert [line.split(":")[0] for line in found["fill_in"][:3]] == ["torque_is", "command", "torque"]
    assert read_drive_file("drive.toml")["columns"]["time"] == "data[:,0]"


def test_the_unit_of_a_velocity_by_its_position() -> None:
    position = np.sin(np.arange(500) / 40)
    velocity = np.gradient(position, 1e-3)
    assert unit_from_position(velocity, position, 1e-3, linear=False) == "rad/s"
    assert unit_from_position(velocity / RPM, position, 1e-3, linear=False) == "rpm"
    assert unit_from_position(1e3 * velocity, position, 1e-3, linear=True) == "mm/s"
    assert unit_from_position(7.7 * velocity, position, 1e-3, linear=False) is None
    assert unit_from_position(np.cos(np.arange(500)), position, 1e-3, linear=False) is None
    assert unit_from_position(np.ones(500), position, 1e-3, linear=False) is None
    command = np.roll(velocity, -3)  # which the velocity follows
    assert unit_from_velocity(command / RPM, velocity, linear=False) == "rpm"
    assert unit_from_velocity(command, velocity, linear=False) == "rad/s"
    assert unit_from_velocity(1.7 * command, velocity, linear=False) is None
    assert unit_from_velocity(np.cos(np.arange(500)), velocity, linear=False) is None


@pytest.mark.parametrize(
    ("text", "what", "remedy"),
    [
        ("torque_is = 'actual'", "torque_is is 'actual'", "must be one of commanded, measured"),
        ("gear_ratio = -3", "gear_ratio is -3", "give a number > 0"),
        ('load_side = ["angle"]', "load_side is 'angle'", "position"),
        ("decimate = 2.5", "decimate is 2.5", "whole number"),
        ("[limits]\nsped = 3", "[limits] has the key 'sped'", "did you mean 'speed'?"),
        ('[limits]\nspeed = "fast"', "[limits] speed is 'fast'", 'or with its unit, "3000 rpm"'),
        ("resampel = 1e-3", "has the key 'resampel'", "did you mean 'resample'?"),
    ],
)
def test_new_keys_of_the_drive_file_are_checked(text: str, what: str, remedy: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(ga.GaidentError) as caught:
        read_drive_file(str(path))
    assert what in str(caught.value) and remedy in str(caught.value)


def test_log_options_of_drive_file_and_command_line(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = "[columns]\nvelocity = 'speed_act'\ntorque = 'torque'\nposition = 'speed_ref'\n[units]\nposition = 'rad'\n"
    Path("g.toml").write_text(
        f"gear_ratio = 2.0\nload_side = ['velocity']\ndecimate = 2\n{names}".replace("speed_ref'", "t [ms]'")
    )
    Path("g.toml").write_text(Path("g.toml").read_text().replace("[units]", "[units]\ntime = 'ms'"))
    from gaident.cli import COMMANDS
    from gaident.cli.drive import drive_of
    from gaident.cli.options import parser_of

    def rec(*more: str) -> ga.Record:
        return drive_of(parser_of(COMMANDS).parse_args(["identify", "step.csv", "--drive", "g.toml", *more])).read("step.csv")

    assert (len(rec()), rec().dt) == (150, pytest.approx(2e-3))
    assert (len(rec("--decimate", "3")), rec("--decimate", "3").dt) == (100, pytest.approx(3e-3))
    assert rec("--gear-ratio", "4").velocity[40] == pytest.approx(2 * rec().velocity[40])
    Path("gap.csv").write_text(Path("step.csv").read_text().replace("\n5.0", "\n5.3", 1))
    lines = Path("step.csv").read_text().splitlines()
    Path("gap.csv").write_text("\n".join(lines[:40] + lines[43:]))
    drive = drive_of(parser_of(COMMANDS).parse_args(["identify", "gap.csv", "--columns", "velocity=speed_act,torque=torque"]))
    with pytest.raises(ga.GaidentError, match=r"irregular.*resample=0\.001"):
        drive.read("gap.csv")
    assert main(["identify", "gap.csv", "--columns", "velocity=speed_act,torque=torque,time=t"]) == 2
    assert "--resample 0.001" in capsys.readouterr().err


def test_init_says_which_steps_an_even_axis_may_have(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stamps = np.cumsum(np.where(np.arange(400) % 2, 10, 12))
    lines = (f"{t},{np.sin(1e-3 * t)},{np.cos(1e-3 * t)}" for t in stamps)
    Path("jitter.csv").write_text("\n".join(["time [ms],velocity [rad/s],torque [Nm]", *lines]))
    assert main(["init", "jitter.csv", "--out", "jitter.toml"]) == 0
    offered = "s from line to line of an even time axis, from the log's own 0.011 to 0.015;"
    assert f"resample: {offered} the time stamps are irregular: " in capsys.readouterr().out
    text = Path("jitter.toml").read_text()
    assert f"\n# resample = 0.011        # FILL IN: {offered}" in text
    from gaident.cli import COMMANDS
    from gaident.cli.drive import drive_of
    from gaident.cli.options import parser_of

    for step, allowed in ((0.011, True), (0.015, True), (0.016, False), (0.00009, False)):
        Path("even.toml").write_text(text.replace("# resample = 0.011 ", f"resample = {step} "))
        asked = drive_of(parser_of(COMMANDS).parse_args(["identify", "jitter.csv", "--drive", "even.toml", "--loop", "open"]))
        if allowed:
            assert asked.read("jitter.csv").dt == step
            (note, *_) = asked.read("jitter.csv").notes
            assert note == f"The log's lines are not evenly apart; they were interpolated to every {1e3 * step:g} ms."
        else:
            with pytest.raises(ga.GaidentError, match="resample"):
                asked.read("jitter.csv")


def test_lines_between_those_of_a_log_are_said_to_show_nothing(here: Path) -> None:
    times = 1e-2 * np.arange(400)
    lines = (f"{t:.2f},{np.sin(t)},{np.cos(t)}" for t in times)
    Path("even.csv").write_text("\n".join(["time [s],velocity [rad/s],torque [Nm]", *lines]))
    columns = {"time": "time [s]", "velocity": "velocity [rad/s]", "torque": "torque [Nm]"}
    finer, same = (ga.read("even.csv", columns, resample=step).notes for step in (2e-3, 1e-2))
    assert finer[0].startswith("The log's lines, 10 ms apart, were interpolated to every 2 ms: between them nothing is known")
    assert finer[0].endswith("Give resample = 0.01 in its place.") and not any("interpolated" in note for note in same)


def test_experiment_writes_the_command_of_a_first_record(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("d.toml").write_text("dt = 1e-3\n[limits]\nspeed = 100\ntorque = 2\nduration = 2\n")
    assert main(["experiment", "--drive", "d.toml", "--out", "first.csv"]) == 0
    said = capsys.readouterr().out
    assert "written: first.csv" in said and "give kp to keep both" in said
    assert "To give them: --kp and --inertia LOW HIGH, or the drive file.\n" in said
    columns = ga.read_columns("first.csv")
    assert len(columns["time [s]"]) <= 2000 and np.abs(columns["command [rad/s]"]).max() <= 100
    options = ["--speed", "100", "--torque", "2", "--duration", "2", "--dt", "1e-3"]
    assert main(["experiment", *options, "--out", "same.csv"]) == 0  # the same without a drive file
    assert Path("same.csv").read_text() == Path("first.csv").read_text() and capsys.readouterr().out.endswith("same.csv\n")
    assert main(["experiment", "--drive", "d.toml"]) == 0
    out, err = capsys.readouterr()
    assert out == Path("first.csv").read_text() and "Torque and speed limit are not promised" in err
    gentle = ["experiment", "--drive", "d.toml", "--kp", "0.05", "--inertia", "1e-4", "1e-3", "--json"]
    assert main(gentle) == 0
    proposal = json.loads(capsys.readouterr().out)
    jumps = np.abs(np.subtract(proposal["command"][2:], proposal["command"][:-2]))
    assert 0.05 * jumps.max() < 2.0 and "give" not in proposal["reason"] and "torque_saturation" not in proposal["separates"]
    assert main(["experiment", "--dt", "1e-3"]) == 2
    assert "the limits lack speed and torque: give --speed and --torque" in capsys.readouterr().err


def test_doctor_tells_what_is_there(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    listed = ["numpy>=1", "tomli>=1; python_version < '3.11'", 'h5py>=3; extra == "hdf5"', 'nothing-such; extra == "tdms"']
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: [*listed, 'pytest; extra == "test"'])
    assert main(["doctor", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["flaws"] == [] and data["threads"] >= 1 and data["instruction_set"]
    assert "two masses found" in data["self_test"]
    assert doctor.instructions("avx2", True) == "avx2"
    assert "baseline, without fused multiply-add" in doctor.instructions("baseline", False)
    assert [(x["name"], x["extra"]) for x in data["libraries"]] == [("numpy", ""), ("h5py", "hdf5"), ("nothing-such", "tdms")]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["pillow>=9.1"])  # its module is PIL
    assert doctor.examine().flaws == ()
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["numpy", "no-such-thing>=2"])
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert "WRONG: no-such-thing is not installed: pip install" in out


def test_doctor_finds_what_is_too_old(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    here = doctor.metadata.version("scipy")
    listed = ["scipy>=99", "numpy>=1,!=1.2 ; python_version > '3'", 'h5py (>=98.1.2); extra == "hdf5"']
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: listed)
    assert main(["doctor"]) == 1
    out = capsys.readouterr().out
    assert f"scipy is {here}, and 99 is the oldest that gaident works with" in out
    assert 'pip install --upgrade "scipy>=99"' in out and 'pip install --upgrade "h5py>=98.1.2"' in out
    assert out.count("WRONG") == 2
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: [f"scipy>={here}", "numpy[extra] >1.2", "pillow~=9.0"])
    assert main(["doctor"]) == 0


@pytest.mark.parametrize(
    ("version", "lowest", "early"),
    [
        *(("1.15", "1.15", False), ("1.15.0", "1.15", False), ("1.9.3", "1.15", True), ("1.15.3", "1.16", True)),
        *(("2.0", "1.99.9", False), ("2.0rc1", "2.0", True), ("2.0.dev0+g12", "2", True), ("2.0.post1", "2.0", False)),
        *(("2.0+local", "2.0", False), ("2.1rc1", "2.0", False), ("2.0rc2", "2.0rc1", False), ("1.0", "", False)),
        *(("unknown", "1", False), ("10.0", "9.2", False)),
    ],
)
def test_versions_are_compared_by_their_numbers(version: str, lowest: str, early: bool) -> None:
    assert doctor.below(version, lowest) == early


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "tcsh"])
def test_completion_knows_commands_and_options(shell: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    pytest.importorskip("shtab")
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(word in script for word in ("identify", "velocity-cutoff", "resample", "doctor"))
    path = tmp_path / f"completion.{shell}"
    path.write_text(script)
    if shutil.which(shell) is not None and shell in ("bash", "zsh", "fish"):
        assert subprocess.run([shell, "-n", str(path)], capture_output=True).returncode == 0
    if shell == "bash":
        ask = f'source {path}; COMP_WORDS=(gaident id); COMP_CWORD=1; _shtab_gaident; printf "%s\\n" "${{COMPREPLY[@]}}"'
        assert subprocess.run(["bash", "-c", ask], capture_output=True, text=True).stdout.split() == ["identify"]
    if shell == "fish" and shutil.which(shell) is not None:
        asked = f"source {path}; complete -C 'gaident iden'; complete -C 'gaident identify --velo'"
        out = subprocess.run(["fish", "--no-config", "-c", asked], capture_output=True, text=True).stdout.splitlines()
        assert out[0] == "identify\tlog -> structure, parameters, uncertainty" and out[1].startswith("--velocity-cutoff\t")
    if shell == "zsh" and shutil.which(shell) is not None:  # registered, and its functions are there
        path.rename(tmp_path / "_gaident")
        asked = f"fpath=({tmp_path} $fpath); autoload -Uz compinit; compinit -u -D; print $_comps[gaident]; autoload +X _gaident"
        done = subprocess.run(["zsh", "-f", "-c", asked], capture_output=True, text=True)
        assert (done.stdout, done.stderr, done.returncode) == ("_gaident\n", "", 0)


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


SEARCHING = Message("generation 120, best fitness 9.107e+05, species (1, 2) of 12 leads", "gen. 120, best 9.107e+05, (1,2) of 12")


def test_a_search_says_how_far_it_is_in_long_and_in_short() -> None:
    from one_mass import one_mass_record

    rec, controller = one_mass_record()
    heard: list[str] = []
    ga.identify(rec, controller, trials=30, progress=lambda _, message: heard.append(message))
    pattern = r"generation \d+, best fitness [\d.e+-]+, species \(\d, \d\) of \d+ leads"
    long = [m for m in heard if re.fullmatch(pattern, m)]
    assert long and all(re.fullmatch(r"gen\. \d+, best [\d.e+-]+, \(\d,\d\) of \d+", shortest(m)) for m in long)
    assert all(re.findall(r"[\d.e+-]*\d", m) == re.findall(r"[\d.e+-]*\d", shortest(m)) for m in long)


def test_progress_is_drawn_on_a_terminal_and_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rich")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm-256color")
    for colours in (True, False):
        (monkeypatch.delenv if colours else monkeypatch.setenv)(*(("NO_COLOR", False) if colours else ("NO_COLOR", "1")))
        stream = Terminal()
        with Progress(stream) as show:
            assert show is not None
            monkeypatch.setattr("gaident.show.progress_bar._QUIET", 0.0)
            show(0.25, "generation 120, best fitness 0.01, species (1, 2) of [bold]10")
        drawn = stream.getvalue()
        assert "25%" in drawn and "species (1, 2) of [bold]10" in drawn and "left" in drawn
        assert ("\x1b[38" in drawn or "\x1b[3" in drawn.replace("\x1b[3;", "")) == colours
    monkeypatch.setenv("COLUMNS", "80")  # the message gives way, not the bar, the percentage or the time
    stream = Terminal()
    with Progress(stream) as show:
        assert show is not None
        show(0.25, SEARCHING)
    # In 80 columns generation, best fitness and the species that leads are all there.
    drawn = stream.getvalue()
    assert re.search(r"━━━ +25% \d:\d\d:\d\d \d+ s left gen\. 120, best 9\.107e\+05, \(1,2\) of 12\n", drawn) and "…" not in drawn
    monkeypatch.setenv("COLUMNS", "60")
    stream = Terminal()
    with Progress(stream) as show:
        assert show is not None
        show(0.25, SEARCHING)
    assert re.search(r"━━━ +25% \d:\d\d:\d\d \d+ s left gen\. 120, best [\d.e+]*…", stream.getvalue())
    with Progress(io.StringIO()) as show:
        assert show is None
    with Progress(None) as show:
        assert show is None


def test_a_long_step_is_named_although_nothing_is_told_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rich")
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr("gaident.show.progress_bar._QUIET", 0.05)
    stream = Terminal()
    with (bar := Progress(stream)) as show:
        assert show is not None
        bar.doing("reading run1.csv")
        deadline = time.monotonic() + 20.0
        while "reading run1.csv" not in stream.getvalue() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert "reading run1.csv" in stream.getvalue()
        show(0.5, "looking beyond the linear model")
        bar.doing("writing run1.html")
    assert "50%" in stream.getvalue() and "writing run1.html" in stream.getvalue()
    stream = Terminal()
    monkeypatch.setattr("gaident.show.progress_bar._QUIET", 60.0)
    with (bar := Progress(stream)):
        bar.doing("reading run1.csv")
    assert stream.getvalue() == ""
    Progress(None).doing("nothing is drawn")


def test_progress_in_a_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    class Handle:
        def update(self, page: dict[str, str], raw: bool) -> None:
            shown.append(page["text/html"])

    kernel, display = types.ModuleType("IPython"), types.ModuleType("IPython.display")
    shell = type("ZMQInteractiveShell", (), {})()
    kernel.get_ipython = lambda: shell  # type: ignore[attr-defined]
    display.display = lambda page, raw, display_id: Handle()  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "IPython", kernel)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    monkeypatch.setattr("gaident.show.progress_bar._QUIET", 0.0)
    with Progress(io.StringIO()) as show:
        assert show is not None  # although the stream is no terminal
        show(0.5, "generation 10 <b>")
    assert 'value="0.5000"' in shown[0] and "generation 10 &lt;b&gt;" in shown[0] and "left" in shown[0]
    assert shown[-1] == ""


def test_quiet_prints_nothing_but_what_json_asks_for(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    call = ["identify", "step.csv", "--columns", "velocity=speed_act,torque=torque,time=t", "--quiet"]
    assert main([*call, "--out", "idn.json"]) == 0
    assert capsys.readouterr() == ("", "")
    assert Path("idn.json").is_file()
    assert main([*call, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["p"] == 1
    assert main(["identify", "none.csv", "--quiet"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_plain_output_holds_no_colours(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert main(["columns", "step.csv"]) == 0
    assert "\x1b" not in capsys.readouterr().out
