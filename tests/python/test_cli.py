"""The command line: output, exit codes and messages, Ctrl-C, the bar, files, and measured records."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli import COMMANDS, main
from gaident.cli_options import drive_of, in_options, parser_of
from gaident.data import differentiate
from gaident.drive_file import read_drive_file

ROOT = Path(__file__).resolve().parents[2]
LOOP = ("--kp", "0.0232", "--ki", "1.367", "--loop", "continuous")
TRUTH = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)


def command(*args: object) -> list[str]:
    return [sys.executable, "-m", "gaident", *map(str, args)]


def called(*args: object, cwd: Path | None = None, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*args), capture_output=True, text=True, cwd=cwd, timeout=60, **more)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in, with the log of a two-mass drive: step.csv."""
    monkeypatch.chdir(tmp_path)
    controller = ga.PI(0.0232, 1.367, loop="continuous")
    still = ga.Record(0.444e-3, command=np.full(250, 43.6), velocity=np.zeros(250))
    run = ga.run(TRUTH, still, controller)
    velocity = run.velocity + 0.3 * np.random.default_rng(4).standard_normal(250)
    columns = np.column_stack([still.time, np.full(250, 43.6), velocity, run.torque])
    np.savetxt("step.csv", columns, delimiter=",", header="t,w_ref,w,u", comments="")
    return tmp_path


NAMES = ("--columns", "command=w_ref,velocity=w", "--columns", "torque=u,time=t")


def refusal(args: list[str], capsys: pytest.CaptureFixture[str], code: int = 2) -> str:
    """The one line on stderr of a call that must fail with `code` and print nothing."""
    assert main(args) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1 and err.startswith("gaident: "), err
    assert "Traceback" not in err and "internal error" not in err
    return err


def test_identify_prints_a_summary_and_writes_files(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP, "--out", "idn.json", "--plot", "idn.png"]
    assert main(args) == 0
    out, err = capsys.readouterr()
    assert err == ""  # nothing where stderr is no terminal
    assert out.startswith("(p,q) = (1,2), two masses on a shaft; the linear model stands\n")
    assert out.endswith("\nwritten: idn.json, idn.png\n")
    assert Path("idn.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in here.iterdir()) == ["idn.json", "idn.png", "step.csv"]  # no parts left
    idn = ga.load("idn.json")
    assert isinstance(idn.mechanics, ga.TwoMass)
    assert pytest.approx(TRUTH.JL, rel=0.05) == idn.mechanics.JL


def test_messages_speak_of_options(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    err = refusal(["identify", "step.csv", *LOOP], capsys)
    assert "--columns velocity=..." in err and "columns={" not in err
    err = refusal(["identify", "step.csv", *NAMES, "--kp", "0,0232", "--ki", "1.367"], capsys)
    assert "argument --kp: '0,0232' is no number: write a decimal point, 0.0232" in err
    err = refusal(["identify", "step.csv", *NAMES, "--kp", "lots", "--ki", "1.367"], capsys)
    assert "'lots' is no number; see" in err
    for text, options in (
        ("set columns={'time': None} to trust dt", "set --columns time= to trust dt"),
        ("give units={'time': 'ms'}; give dt= [s] then", "give --units time=ms; give --dt [s] then"),
        (
            "counts_per_turn=0.0 is no number; give velocity_cutoff_hz=",
            "--counts-per-turn 0.0 is no number; give --velocity-cutoff",
        ),
        ("use p=(1, 3), or PI(..., loop='continuous')", "use --p 1..3, or --loop continuous"),
        ("give delimiter=',' and decimal='.' as in my--run_1.csv", "give --delimiter ',' and --decimal '.' as in my--run_1.csv"),
        (
            "if the drive is not a digital one, give loop='continuous'.",
            "if the drive is not a digital one, give --loop continuous.",
        ),
        ("reverse one, or give space=SearchSpace(gain=...)", "reverse one, or give --gain LOW HIGH"),
    ):
        assert " ".join(in_options(text).split()) == options


def test_warnings_in_the_summary_speak_of_options_too(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, "--kp", "0.0232", "--ki", "1.367"]) == 0
    out, _ = capsys.readouterr()
    assert "--loop continuous" in out and "loop='" not in out
    assert out.index("Keep in mind") < out.index("Mechanics")


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


def test_json_is_what_is_saved_and_valid(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--json", "--out", "idn.json"]) == 0
    out, err = capsys.readouterr()

    def refuse(word: str) -> float:
        raise AssertionError(f"{word} is no JSON")

    data = json.loads(out, parse_constant=refuse)
    assert err == "" and data == json.loads(Path("idn.json").read_text())
    assert data["schema"] == "gaident/identification" and data["schema_version"] == 1
    assert {"model", "controller", "parameters", "mechanics", "adequacy", "structures", "seed"} <= set(data)
    assert set(data["parameters"]["gain"]) == {"value", "std", "unit", "at_bound", "identifiable"}


def test_drive_file_stands_for_options_and_options_win(here: Path) -> None:
    Path("drive.toml").write_text(
        '[columns]\ncommand = "w_ref"\nvelocity = "w"\ntime = "t"\n[units]\nvelocity = "rpm"\n'
        '[controller]\nkp = 0.02\nki = 1.367\nloop = "continuous"\n'
        "[space]\ninertia = [1e-4, 5e-3]\np = 1\nq = [0, 2]\n"
    )
    arguments = parser_of(dict.fromkeys(COMMANDS, print)).parse_args(
        [
            "identify",
            "step.csv",
            "--drive",
            "drive.toml",
            "--kp",
            "0.0232",
            "--unit",
            "velocity=0.5",
            "--q",
            "2",
        ]
    )
    drive = drive_of(arguments)
    assert drive.controller() == ga.PI(0.0232, 1.367, loop="continuous")
    rec = drive.read("step.csv")
    whole = ga.read("step.csv", columns={"command": "w_ref", "velocity": "w"})
    np.testing.assert_allclose(rec.velocity, 0.5 * whole.velocity)
    space = drive.space([whole], drive.controller())
    assert space is not None and (space.p, space.q) == ((1, 1), (2, 2))
    assert space.gain == (200.0, 1e5) and "inertia" in space.source and "derived" in space.source


def test_space_options(here: Path) -> None:
    def space(*options: str) -> ga.SearchSpace | None:
        parser = parser_of(dict.fromkeys(COMMANDS, print))
        drive = drive_of(parser.parse_args(["identify", "step.csv", *NAMES, *LOOP, *options]))
        return drive.space([drive.read("step.csv")], drive.controller())

    assert space() is None
    paper = space("--gain", "1e3", "2e4", "--real", "0", "60", "--imaginary", "0", "250", "--bits", "12")
    assert paper is not None
    assert (paper.gain, paper.real, paper.imaginary) == ((1e3, 2e4), (0.0, 60.0), (0.0, 250.0))
    assert (paper.p, paper.q, paper.bits) == ((0, 3), (0, 3), 12)
    known = space("--inertia", "1e-4", "1e-3", "--resonance-hz", "5", "100", "--p", "1", "--q", "0..2")
    expected = ga.SearchSpace.from_mechanics((1e-4, 1e-3), (5.0, 100.0), p=(1, 1), q=(0, 2))
    assert known == expected


def test_same_seed_same_result_for_any_workers(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    results = []
    for workers in ("1", "2"):
        args = ["identify", "step.csv", *NAMES, *LOOP, "--paper", "--trials", "3", "--seed", "5"]
        assert main([*args, "--workers", workers, "--json"]) == 0
        results.append({k: v for k, v in json.loads(capsys.readouterr().out).items() if k != "seconds"})
    assert results[0] == results[1]
    assert results[0]["settings"]["engine"] == "plain" and len(results[0]["trials"]) == 3


def test_simulate_writes_csv_that_can_be_read(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("truth.json").write_text(json.dumps(TRUTH.to_dict()))
    assert main(["simulate", "truth.json", "step.csv", *NAMES, *LOOP, "--out", "sim.csv"]) == 0
    out, _ = capsys.readouterr()
    assert re.fullmatch(r"step: fit 97\.\d\d %, rmse 0\.\d+; written: sim\.csv\n", out)
    rec = ga.read("step.csv", columns={"command": "w_ref", "velocity": "w"})
    run = ga.run(TRUTH, rec, ga.PI(0.0232, 1.367, loop="continuous"))
    again = ga.read("sim.csv")
    np.testing.assert_allclose(again.velocity, run.velocity, rtol=1e-11)
    assert again.torque is not None
    np.testing.assert_allclose(again.torque, run.torque, rtol=1e-11)
    assert main(["simulate", "truth.json", "step.csv", *NAMES, *LOOP]) == 0
    assert capsys.readouterr().out == Path("sim.csv").read_text()


def test_a_proposed_command_can_be_simulated_as_it_is(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("truth.json").write_text(json.dumps(TRUTH.to_dict()))
    # The drive's logs have names and units of their own, which are not the proposal's.
    columns, units = "[columns]\ncommand = 'w_ref'\nvelocity = 'w'\n", "[units]\ncommand = 'rpm'\nvelocity = 'rpm'\n"
    rest = "[controller]\nkp = 0.0232\nki = 1.367\n[limits]\nspeed = 100\ntorque = 2\n"
    Path("d.toml").write_text(f"dt = 1e-3\n{columns}{units}{rest}")
    assert main(["experiment", "--drive", "d.toml", "--out", "next.csv"]) == 0
    capsys.readouterr()
    assert main(["simulate", "truth.json", "next.csv", "--drive", "d.toml", "--out", "sim.csv"]) == 0
    assert capsys.readouterr().out == "next: no measured velocity to compare with; written: sim.csv\n"
    rec = ga.read("next.csv", measured=False)
    assert rec.command is not None and 50 < rec.command.max() <= 100 and not rec.velocity.any()
    np.testing.assert_allclose(ga.read("sim.csv").velocity, ga.simulate(TRUTH, rec, ga.PI(0.0232, 1.367)), rtol=1e-9)
    assert main(["simulate", "truth.json", "next.csv", "--drive", "d.toml", "--json"]) == 0
    (run,) = json.loads(capsys.readouterr().out)["runs"]
    assert run["rmse"] is None and run["fit_percent"] is None and len(run["velocity"]) == len(rec)
    assert "velocity" in refusal(["identify", "next.csv", "--kp", "0.0232", "--ki", "1.367"], capsys)
    with pytest.raises(ga.GaidentError, match="velocity of the record is constant"):
        ga.identify(rec, ga.PI(0.0232, 1.367))


def test_simulate_takes_the_saved_controller_and_start(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--initial-state", "free", "--out", "idn.json"]) == 0
    idn = ga.load("idn.json")
    capsys.readouterr()
    assert main(["simulate", "idn.json", "step.csv", *NAMES, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["controller"]["loop"] == "continuous" and data["schema"] == "gaident/simulation"
    (run,) = data["runs"]
    assert run["rmse"] == pytest.approx(idn.rmse) and run["fit_percent"] == pytest.approx(idn.fit_percent)
    assert len(run["velocity"]) == len(run["torque"]) == run["samples"] == 250
    # The same model without the controller, from the log's torque.
    assert main(["simulate", "idn.json", "step.csv", *NAMES, "--loop", "open", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["controller"] is None
    torque = ga.read("step.csv", columns={"torque": "u", "velocity": "w"}).torque
    assert torque is not None
    np.testing.assert_allclose(data["runs"][0]["torque"], torque)


def test_simulate_several_logs_into_a_folder(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("m.json").write_text('{"gain": 5000, "poles": [-10]}')
    Path("other.csv").write_bytes(Path("step.csv").read_bytes())
    logs = ["step.csv", "other.csv"]
    assert main(["simulate", "m.json", *logs, *NAMES, *LOOP, "--out", "sim"]) == 0
    assert sorted(p.name for p in Path("sim").iterdir()) == ["other_simulated.csv", "step_simulated.csv"]
    capsys.readouterr()
    assert "--out" in refusal(["simulate", "m.json", *logs, *NAMES, *LOOP], capsys)


WRONG = [
    ([], "COMMAND"),
    (["identif"], "invalid choice: 'identif'"),
    (["identify"], "LOG"),
    (["identify", "stp.csv"], "stp.csv: there is no such file (did you mean 'step.csv'?)"),
    (["identify", "step.csv", *NAMES, "--frobnicate"], "unrecognized arguments: --frobnicate"),
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


WRONG_DRIVE_FILES = [
    ("[controller]\nkpp = 3", "[controller] has the key 'kpp'", "did you mean 'kp'?"),
    ('[controller]\nkp = "3"', "[controller] kp is '3'", "give one number"),
    ("[controler]\nkp = 3", "has the key 'controler'", "did you mean 'controller'?"),
    ("columns = 3", "[columns] is a int", ""),
    ("[columns]\nvelocity = 2.5", "[columns] velocity is 2.5", "in quotes"),
    ("[space]\ninertia = [1e-4]", "[space] inertia is [0.0001]", "[lowest, highest]"),
    ("[space]\np = [0.5, 1]", "[space] p is 0.5", "whole number"),
    ("skip = true", "skip is True", "whole number"),
    ('axis = "linaer"', "axis is 'linaer'", "did you mean 'linear'?"),
    ("dt = = 3", "this is not TOML", "line 1"),
    ("# gains\n[controller]\nkp = 0,0232  # N m s", "line 3: kp is 0,0232, with a decimal comma", "write 0.0232"),
    ("dt = 1,5e-3", "line 1: dt is 1,5e-3", "write 1.5e-3"),
    ("[space]\ninertia = [0,1, 0,5]", "[space] inertia is [0, 1, 0, 5]", "with decimal points"),
    ("kp = 0.1", "kp stands at the top", "put it below the line [controller]"),
    ("[controller]\nvelocity = 'w'", "velocity stands in [controller]", "below the line [columns] or below the line [units]"),
    ("[controller]\ndt = 1e-3", "dt stands in [controller]", "at the top, above the first [section]"),
    (
        "# nothing\n",
        "this drive file is empty",
        "it holds [columns], [units], [controller], [space], [limits] and axis, dt, velocity_cutoff_hz",
    ),
]


@pytest.mark.parametrize(("text", "what", "remedy"), WRONG_DRIVE_FILES)
def test_drive_file_names_key_value_and_remedy(text: str, what: str, remedy: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(ga.GaidentError) as caught:
        read_drive_file(str(path))
    assert str(caught.value).startswith(str(path))
    assert what in str(caught.value) and remedy in str(caught.value)


def test_the_drive_file_of_the_readme_is_one(tmp_path: Path) -> None:
    (tmp_path / "drive.toml").write_text((ROOT / "README.md").read_text().split("```toml\n")[1].split("```")[0])
    sections = read_drive_file(str(tmp_path / "drive.toml"))
    assert sections["controller"] == {"kp": 0.0232, "ki": 1.367} and sections["columns"]["torque"] == "M"


def test_a_drive_file_is_spoken_of_in_its_own_keys(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Not in the command line's options, and no word is suggested that looks nothing like the one that was written."""
    Path("drive.toml").write_text("zz = 0.1\n")
    said = refusal(["identify", "step.csv", "--drive", "drive.toml"], capsys)
    assert "has the key 'zz'" in said and "dt, velocity_cutoff_hz, counts_per_turn" in said
    assert "--velocity-cutoff" not in said and "did you mean" not in said


def test_no_utf8_is_no_drive_file(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ga.GaidentError, match="UTF-8"):
        read_drive_file(str(tmp_path / "bad.toml"))


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


def test_failure_of_writing_bears_the_users_name(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device", ".idn.png.part")

    monkeypatch.setattr(Path, "write_bytes", full)
    err = refusal(["identify", "step.csv", *NAMES, *LOOP, "--plot", "idn.png"], capsys, 1)
    assert err == "gaident: cannot write idn.png: No space left on device\n"
    assert [p.name for p in here.iterdir()] == ["step.csv"]


def test_a_bug_is_1_and_no_traceback(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("one\nover zero")

    monkeypatch.setattr("gaident.cli.identify", broken)
    assert main(["identify", "step.csv", *NAMES, *LOOP]) == 1
    assert capsys.readouterr().err == ("gaident: internal error, please report it: ZeroDivisionError: one over zero\n")


def test_help_and_version(capsys: pytest.CaptureFixture[str]) -> None:
    for args, parts in (
        (["--help"], ("identify", "simulate", "demo")),
        (["--version"], ("gaident ",)),
        (["identify", "--help"], ("examples:", "--drive", "[controller]", "rated_torque", "load_side", "exit codes")),
        (["simulate", "--help"], ("MODEL.json", "examples:")),
        (["demo", "--help"], ("GAIDENT_DATA",)),
        (["columns", "--help"], ("TwinCAT", "--quiet")),
        (["init", "--help"], ("FILL IN", "--force")),
        (["experiment", "--help"], ("[limits]", "--travel")),
        (["doctor", "--help"], ("Exit code 1",)),
        (["completion", "--help"], ("bash", "fish")),
    ):
        assert main(args) == 0
        out, err = capsys.readouterr()
        assert err == "" and all(part in out for part in parts)
        assert max(map(len, out.splitlines())) <= 110


def test_a_reader_that_goes_away(here: Path) -> None:
    with subprocess.Popen(
        command("identify", "step.csv", *NAMES, *LOOP, "--json"),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        err = process.stderr.read()
        assert process.wait(30) == 1
    assert err == "gaident: the output was closed before all of it was written\n"


LONG = """
import signal, sys
from gaident.cli import COMMANDS, main
signal.signal(signal.SIGINT, signal.default_int_handler)  # some shells start jobs with it ignored
print("ready", flush=True)
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.alone
@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_within_half_a_second(here: Path) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP, "--trials", "100000", "--out", "idn.json"]
    with subprocess.Popen(
        [sys.executable, "-c", LONG, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.7)
        assert process.poll() is None
        began = time.perf_counter()
        process.send_signal(signal.SIGINT)
        code = process.wait(30)
        seconds = time.perf_counter() - began
        assert process.stdout.read() == ""
        assert process.stderr.read() == "gaident: interrupted\n"
    assert code == 130
    assert seconds < 0.5
    assert [p.name for p in here.iterdir()] == ["step.csv"]


@pytest.mark.skipif(os.name != "posix", reason="pseudo terminals")
def test_progress_bar_on_a_terminal_only(here: Path) -> None:
    import pty

    args = ("identify", "step.csv", *NAMES, *LOOP, "--paper", "--trials", "200", "--workers", "1")
    ours, theirs = pty.openpty()
    with subprocess.Popen(command(*args), stdout=subprocess.PIPE, stderr=theirs, text=True) as process:
        os.close(theirs)
        seen = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # how Linux says that the other side is closed
                break
            if not part:
                break
            seen += part
        assert process.stdout is not None
        assert process.stdout.read().startswith("(p,q) = ")
        assert process.wait(30) == 0
    os.close(ours)
    text = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", seen)
    bars = re.findall(rb" (\d+)%", text)
    assert bars and bars == sorted(bars, key=int)
    assert re.search(rb"about \d+ s left generation \d+, best fitness [\d.e-]+", text)
    assert text.split(b"\r")[-1].strip() == b""  # nothing of it stays
    assert called(*args[:-4], "--workers", "1").stderr == ""


def test_demo_without_measured_data(here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: Any) -> None:
    monkeypatch.delenv("GAIDENT_DATA", raising=False)
    assert main(["demo"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "(p,q) = (1,2), two masses on a shaft; the linear model stands" in out
    assert "Compared with the truth" in out
    assert "\nThe measured EMPS axis is left out: GAIDENT_DATA" in out
    assert "\nVerdict: explained\n" in out and "Cause: coulomb\nfriction." in out
    assert "\nThe truth: a dry friction of 0.04 N m" in out
    made = [f"demo_{name}.{suffix}" for name in ("friction", "two_mass") for suffix in ("csv", "png")]
    assert sorted(p.name for p in here.iterdir()) == [*made, "step.csv"]
    # The commands that it proposes, the first with the drive file of the examples.
    assert main(out.splitlines()[-1].split()[1:]) == 0
    assert "Cause: coulomb\nfriction." in capsys.readouterr().out
    drive = ROOT / "examples" / "drive.toml"
    assert main(["identify", "demo_two_mass.csv", "--drive", str(drive)]) == 0
    assert capsys.readouterr().out.startswith("(p,q) = (1,2)")


def test_demo_with_measured_data(here: Path, data_dir: Path, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setenv("GAIDENT_DATA", str(data_dir))
    assert main(["demo", "--json", "--out", "new/folder"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["two_masses"]["truth"]["structure"] == "two masses"
    assert data["emps"]["identification"]["adequacy"]["falsified"] is True
    assert (here / "new" / "folder" / "demo_emps.png").is_file()
    (found,) = data["friction"]["diagnosis"]["findings"]
    truth = data["friction"]["truth"]["coulomb_friction"]["torque"]
    assert found["effect"] == "coulomb_friction" and not found["alternatives"]
    assert found["parameters"]["torque"]["value"] == pytest.approx(truth, rel=0.02)


def test_emps_axis_falsifies_the_linear_model(here: Path, data_dir: Path, capsys: Any) -> None:
    log = data_dir / "emps" / "DATA_EMPS.mat"
    columns = ("--columns", "torque=vir,position=qm,time=t", "--unit", "torque=35.15065188248547")
    args = [
        "identify",
        str(log),
        *columns,
        "--velocity-cutoff",
        "100",
        "--axis",
        "linear",
        "--out",
        "emps.json",
    ]
    assert main(args) == 0
    out, _ = capsys.readouterr()
    assert "the linear model is FALSIFIED" in out and "m/s" in out
    idn = ga.load("emps.json")
    rec = ga.read(log, columns={"torque": "vir", "position": "qm"}, units={"torque": 35.15065188248547},
                  velocity_cutoff_hz=100.0)  # fmt: skip
    assert rec.position is not None
    np.testing.assert_allclose(rec.velocity, differentiate(rec.position, 1e-3, 100.0), rtol=1e-6, atol=1e-9)
    assert idn.falsified and idn.adequacy.predictable > 0.9
    if idn.mechanics is not None:
        assert "NOT TO BE TRUSTED" in out


def test_hsm150_runs_together_falsify_the_linear_model(here: Path, data_dir: Path, capsys: Any) -> None:
    logs = sorted(str(path) for path in (data_dir / "hsm150").glob("*.mat"))
    assert len(logs) == 6
    columns = ("--columns", "velocity=data[:,3],torque=data[:,4]", "--columns", "time=data[:,0]")
    assert main(["identify", *logs, *columns, "--out", "hsm.json"]) == 0
    out, _ = capsys.readouterr()
    assert "120000 samples of 6 records" in out and "FALSIFIED" in out
    assert ga.load("hsm.json").falsified


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, which only Linux has")
@pytest.mark.parametrize(
    ("arguments", "buffered"),
    # argparse itself ignores that an unbuffered --version or --help cannot be written
    [(["--version"], True), (["--help"], True), (["effects"], True), (["effects"], False)],
)
def test_a_full_output_is_1_with_buffering_and_without(arguments: list[str], buffered: bool, tmp_path: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    environment |= {} if buffered else {"PYTHONUNBUFFERED": "1"}
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "gaident", *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
            env=environment, cwd=tmp_path, timeout=60,
        )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
