"""The command line's errors: one line each, in the words of its options, and their exit codes."""

from __future__ import annotations

import importlib
import os
import pickle
import resource
import subprocess
from pathlib import Path

import numpy as np
import pytest

from cli_cases import LOOP, NAMES, command, refusal
from gaident.arguments import CONTINUOUS_LOOP, NO_TIME, arg
from gaident.cli import main
from gaident.cli.remedies import in_options
from gaident.errors import ReadError, SettingsError


def test_messages_speak_of_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    err = refusal(["identify", "step.csv", *LOOP], capsys)
    assert "--columns velocity=..." in err and "columns={" not in err
    err = refusal(["identify", "step.csv", *NAMES, "--kp", "0,0232", "--ki", "1.367"], capsys)
    assert "argument --kp: '0,0232' is no number: write a decimal point, 0.0232" in err
    err = refusal(["identify", "step.csv", *NAMES, "--kp", "lots", "--ki", "1.367"], capsys)
    assert "'lots' is no number; see" in err
    for text, python, options in (
        (
            f"set {NO_TIME} to trust dt",
            "set columns={'time': None} to trust dt",
            "set --columns time= to trust dt",
        ),
        (
            f"give {arg('columns', repr('M soll [%]'), 'torque')}",
            "give columns={'torque': 'M soll [%]'}",
            "give --columns 'torque=M soll [%]'",
        ),
        (
            f"give {arg('units', repr('ms'), 'time')}; give {arg('dt')} [s] then",
            "give units={'time': 'ms'}; give dt= [s] then",
            "give --units time=ms; give --dt [s] then",
        ),
        (
            f"{arg('counts_per_turn', '0.0')} is no number; give {arg('velocity_cutoff_hz')}",
            "counts_per_turn=0.0 is no number; give velocity_cutoff_hz=",
            "--counts-per-turn 0.0 is no number; give --velocity-cutoff",
        ),
        (
            f"use {arg('p', '(1, 3)')}, or {CONTINUOUS_LOOP}",
            "use p=(1, 3), or PI(..., loop='continuous')",
            "use --p 1..3, or --loop continuous",
        ),
        (
            f"give {arg('delimiter', repr(','))} and {arg('decimal', repr('.'))} as in my--run_1.csv, dt=1 says",
            "give delimiter=',' and decimal='.' as in my--run_1.csv, dt=1 says",
            "give --delimiter ',' and --decimal '.' as in my--run_1.csv, dt=1 says",
        ),
        (f"leave {arg('pade', '3')} out", "leave pade=3 out", "leave pade=3 out"),
    ):
        error = ReadError(text)
        assert str(error) == python and in_options(error) == options
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is ReadError and in_options(again) == options
        assert in_options(SettingsError(f"run.csv: {error.marked}")) == f"run.csv: {options}"


@pytest.mark.parametrize("name", ["identify", "diagnose"])
@pytest.mark.parametrize("sign", [0.0, -1.0])
def test_a_record_that_shows_no_gain_has_no_remedy_among_the_options(
    here: Path, capsys: pytest.CaptureFixture[str], name: str, sign: float
) -> None:
    """A range of the gain does not help: it is an option of identify alone, and the rest of the space comes from the record."""
    torque = np.sign(np.sin(np.arange(400) / 30))
    velocity = sign * np.cumsum(torque)
    np.savetxt("bad.csv", np.column_stack([1e-3 * np.arange(400), abs(sign) * torque, velocity]), delimiter=",", header="t,u,w")
    err = refusal([name, "bad.csv", "--columns", "torque=u,velocity=w"], capsys)
    assert ("reverse the sign" if sign else "use a record in which the drive moves") in err
    assert "--gain" not in err and "--inertia" not in err


def test_a_forgotten_unit_is_named_and_not_taken_for_a_sign(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command or the velocity left in rpm, a command against the velocity: each has its own remedy."""
    for wrong, text in (
        ("command=9.549", "the command seems to be in rpm, the other in rad/s: give --units command=rpm"),
        ("velocity=9.549", "the velocity seems to be in rpm, the other in rad/s: give --units velocity=rpm"),
        ("command=0.0314", "times the velocity all along: they are in different units"),
        ("command=-1", "the velocity runs against its command all along: reverse the sign of one of them"),
    ):
        err = refusal(["identify", "step.csv", "--columns", "command=w_ref,velocity=w,time=t", *LOOP, "--unit", wrong], capsys)
        assert text in err, wrong


WRONG = [
    (["--quiet"], "COMMAND"),
    (["identif"], "invalid choice: 'identif' (did you mean 'identify'?); see gaident --help"),
    (["frobnicate"], "invalid choice: 'frobnicate'"),
    (["identify"], "LOG"),
    (["identify", "stp.csv"], "stp.csv: there is no such file (did you mean 'step.csv'?)"),
    (["identify", "step.csv", *NAMES, "--frobnicate"], "unrecognized arguments: --frobnicate; see gaident identify --help"),
    (["diagnose", "step.csv", "--sed", "3"], "arguments: --sed 3 (did you mean --seed?); see gaident diagnose --help"),
    (["identify", "step.csv", "--trails=3"], "arguments: --trails=3 (did you mean --trials?); see gaident identify --help"),
    (["identify", "step.csv", "--kp", "1", "other.csv"], "name all files in one place"),
    (["identify", "step.csv", *NAMES, "--kp", "much"], "--kp: 'much' is no number"),
    (["identify", "step.csv", *NAMES, "--kp", "0.02"], "the controller lacks ki"),
    (["identify", "step.csv", *NAMES, "--kp", "-1", "--ki", "1"], "kp is -1"),
    (["identify", "step.csv", "--columns", "torque=u,velocity=w", "--kp", "1", "--ki", "1"], "no command"),
    (["identify", "step.csv", "--columns", "command=w_ref,velocity=w"], "no torque"),
    (["identify", "step.csv", "--columns", "velocty=w"], "did you mean 'velocity'?"),
    (["identify", "step.csv", "--columns", "w"], "channel=value"),
    (["identify", "step.csv", *NAMES, "--columns", "velocity=omega"], "'omega'"),
    (["identify", "step.csv", *NAMES, "--units", "velocity=rpmm"], "did you mean 'rpm'?"),
    (["identify", "step.csv", *NAMES, "--units", "velocity=rmp"], "did you mean 'rpm'?"),
    (["identify", "step.csv", *NAMES, *LOOP, "--gain", "5", "2"], "gain is"),
    (["identify", "step.csv", *NAMES, *LOOP, "--gain", "2", "5", "--inertia", "1", "2"], "leave one out"),
    (["identify", "step.csv", *NAMES, *LOOP, "--damping", "1", "2"], "damping is given without inertia"),
    (["identify", "step.csv", *NAMES, *LOOP, "--p", "one"], "'one' is neither"),
    (["identify", "step.csv", *NAMES, *LOOP, "--trials", "0"], "trials is 0"),
    (["identify", "step.csv", *NAMES, *LOOP, "--seed", "-3"], "seed is -3"),
    (["identify", "step.csv", *NAMES, *LOOP, "--plot", "x.bmp"], "x.bmp: a picture ends in .png"),
    (["identify", "step.csv", *NAMES, *LOOP, "--out", "step.csv"], "this is the log itself"),
    (["identify", "step.csv", "--drive", "no.toml"], "no.toml: there is no such drive file"),
    (["simulate", "no.json", "step.csv"], "no.json: there is no such file"),
    (["simulate", "step.csv", "step.csv"], "cannot be read as JSON"),
]


@pytest.mark.parametrize(("args", "part"), WRONG, ids=lambda x: x if isinstance(x, str) else "")
def test_wrong_use_is_one_line_and_2(args: list[str], part: str, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert part in refusal(args, capsys)


def test_what_cannot_be_written_is_1(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP]
    assert "there is no folder nowhere" in refusal([*args, "--out", "nowhere/x.json"], capsys, 1)
    assert "it is a folder" in refusal([*args, "--out", "."], capsys, 1)
    Path("folder").mkdir()
    if os.name == "posix" and Path("/dev/full").exists():
        with open("/dev/full", "w") as full:
            done = subprocess.run(command(*args), stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        assert done.returncode == 1
        assert done.stderr.splitlines()[0] == "gaident: No space left on device"


def test_failure_of_writing_bears_the_users_name(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The system's own limit on a file's size ends the write in its middle, as a full disk does, whatever function writes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    Path("idn.png").write_bytes(b"old")
    importlib.import_module("matplotlib.font_manager")  # its cache is no part of this
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        err = refusal(["identify", "step.csv", *NAMES, *LOOP, "--plot", "idn.png"], capsys, 1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert err == "gaident: cannot write idn.png: File too large\n"
    assert Path("idn.png").read_bytes() == b"old"
    assert sorted(p.name for p in here.iterdir()) == ["idn.png", "step.csv"]


def test_a_bug_is_1_and_no_traceback(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("one\nover zero")

    monkeypatch.setattr("gaident.cli.commands.identify.identify", broken)
    assert main(["identify", "step.csv", *NAMES, *LOOP]) == 1
    assert capsys.readouterr().err == ("gaident: internal error, please report it: ZeroDivisionError: one over zero\n")
