"""gaident diagnose: summary, files, exit codes and messages, Ctrl-C."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from cli_cases import interrupted, refusal
from clock import fastest
from drive_cases import random_case
from friction_drive import CONTROLLER, drive_record
from gaident.cli import main
from gaident.cli.output import csv_text
from gaident.results.what_if import Stability, Variation

LOOP = ("--kp", str(CONTROLLER.kp), "--ki", str(CONTROLLER.ki))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two logs of a drive with hidden dry friction."""
    monkeypatch.chdir(tmp_path)
    for i in (0, 1):
        Path(f"run{i}.csv").write_text(csv_text(drive_record(i), None, "rotary"))
    return tmp_path


@pytest.mark.long
def test_it_says_what_is_wrong_and_writes_files(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = ("--out", "dia.json", "--plot", "dia.png", "--next-command", "next.csv")
    assert main(["diagnose", "run0.csv", "--validation", "run1.csv", *LOOP, *names]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out.startswith("Verdict: explained\n") and "Cause: coulomb\nfriction." in out
    assert "on validation records" in out
    assert out.endswith("\nnot written: next.csv, as there is no next experiment to propose\n\nwritten: dia.json, dia.png\n")
    assert sorted(p.name for p in here.iterdir()) == ["dia.json", "dia.png", "run0.csv", "run1.csv"]
    saved = ga.load("dia.json")
    assert isinstance(saved, ga.Diagnosis)
    assert saved.causes[0].parameters["torque"].value == pytest.approx(0.05, rel=0.02)
    # A diagnosis carries a model: it simulates, and can be told from an identification.
    assert main(["simulate", "dia.json", "run1.csv", "--out", "again.csv"]) == 0
    assert "fit 99." in capsys.readouterr().out
    assert "contains no identification" in refusal(["diagnose", "run0.csv", *LOOP, "--model", "dia.json"], capsys)


@pytest.mark.long
def test_variations_of_the_log_are_printed_and_stand_in_the_page(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[int, float | None]] = []

    def once(dia: ga.Diagnosis, records: Sequence[ga.Record], pitch: float | None, progress: object) -> Stability:
        asked.append((len(records), pitch))
        named = Variation("first half", "explained", (("coulomb_friction",),))
        return Stability(dia.verdict, (("coulomb_friction",),), (named, Variation("second half", "adequate")))

    monkeypatch.setattr(ga.Diagnosis, "stability", once)
    assert main(["diagnose", "run0.csv", *LOOP, "--stability", "--report", "page.html", "--pictures"]) == 0
    out, _ = capsys.readouterr()
    assert out.index("Verdict explained in 1 of 2 variations") > out.index("Verdict: explained") and asked == [(1, None)]
    assert "coulomb_friction: named in 1 of 2 variations that could show it: a hint" in out
    page = Path("page.html").read_text(encoding="utf-8")
    assert "Is it beyond doubt?" in page and page.index("first half") < page.index("second half")
    assert main(["diagnose", "run0.csv", *LOOP, "--stability", "--out", "dia.json", "--quiet"]) == 0
    assert main(["report", "dia.json", "--out", "again.html", "--pictures"]) == 0
    assert "Is it beyond doubt?" in Path("again.html").read_text(encoding="utf-8")
    asked.clear()
    capsys.readouterr()
    assert main(["diagnose", "run0.csv", *LOOP, "--stability", "--json"]) == 0
    assert [v["what"] for v in json.loads(capsys.readouterr().out)["stability"]["variations"]] == ["first half", "second half"]
    assert main(["diagnose", "run0.csv", *LOOP, "--json"]) == 0
    assert "stability" not in json.loads(capsys.readouterr().out) and len(asked) == 1


@pytest.mark.long
def test_a_log_whose_name_is_no_utf_8(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Named in Latin-1: it ended as an internal error behind all the work."""
    os.rename("run0.csv", b"Achse_\xe9.csv")
    (log,) = (name for name in os.listdir() if name.startswith("Achse"))
    names = ("--out", "dia.json", "--plot", "dia.png", "--report", "page.html")
    assert main(["diagnose", log, *LOOP, *names]) == 0
    out, err = capsys.readouterr()
    assert err == "" and out.endswith("written: dia.json, dia.png, page.html\n")
    assert "Achse_é" in Path("page.html").read_text(encoding="utf-8")


def test_what_was_found_outside_of_an_expected_range_is_said(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A range of the drive file bounds no search; of a resonance that is not there nothing is said."""
    told = "The inertia was found as"
    for inertia, said in (("[1e-5, 2e-5]", True), ("[1e-5, 1.0]", False)):
        Path("drive.toml").write_text(f"[space]\ninertia = {inertia}\nresonance_hz = [200, 220]\n")
        beside = "expected 1e-05 to 2e-05" if said else "expected 1e-05 to 1"
        assert main(["diagnose", "run0.csv", "--validation", "run1.csv", *LOOP, "--drive", "drive.toml"]) == 0
        out = " ".join(capsys.readouterr().out.split())
        assert (told in out) == said and "resonance was found" not in out and beside in out


def test_json_is_what_out_saves_and_a_model_is_taken(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", "run0.csv", *LOOP, "--p", "1", "--q", "0", "--out", "idn.json"]) == 0
    capsys.readouterr()
    arguments = ["diagnose", "run0.csv", "run1.csv", *LOOP, "--model", "idn.json", "--noise", "0.05", "--bootstrap", "1"]
    assert main([*arguments, "--seed", "4", "--json", "--out", "dia.json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads(Path("dia.json").read_text())
    assert printed["schema"] == "gaident/diagnosis" and printed["seed"] == 4 and len(printed["digests"]) == 2
    assert printed["after"]["noise_floor"] == 0.05
    assert printed["findings"][0]["p_value"] == 0.5  # (1 + 0)/(1 + 1)
    assert printed["identification"] == json.loads(Path("idn.json").read_text())


def test_the_next_command_is_written(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        rec, _, controller, _ = random_case(1, ("coulomb_friction",), "step")
    except RuntimeError as missing:  # no compiler for the simulated drive
        pytest.skip(str(missing))
    Path("step.csv").write_text(csv_text(rec, None, "rotary"))
    loop = ("--kp", str(controller.kp), "--ki", str(controller.ki))
    assert main(["diagnose", "step.csv", *loop, "--next-command", "next.csv"]) == 0
    out = capsys.readouterr().out
    assert "Next experiment\n" in out and out.endswith("\nwritten: next.csv\n")
    with open("next.csv") as file:
        assert file.readline() == "time [s],command [rad/s]\n"
        time_, command = np.loadtxt(file, delimiter=",").T
    np.testing.assert_allclose(np.diff(time_), rec.dt, rtol=1e-6)
    assert rec.command is not None and 0.0 < np.abs(command).max() <= rec.command.max() * (1 + 1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--noise", "-1"), "noise is -1"),
        (("--noise", "0,1"), "write a decimal point, 0.1"),
        (("--bootstrap", "-3"), "bootstrap is -3"),
        (("--validation", "nowhere.csv"), "there is no such file"),
        (("--model", "nowhere.json"), "nowhere.json: there is no such file"),
        (("--plot", "x.bmp"), "a picture ends in"),
        (("--out", "run0.csv"), "this is the log itself"),
        (("--validation", "run1.csv", "--out", "run1.csv"), "this is the log itself"),
        (("--out", "a.json", "--next-command", "a.json"), "--out and --next-command both name a.json"),
        (("--loop", "open", "--columns", "command=#1,velocity=#2,time=#0"), "there is no torque"),
        (("--nonsense",), "unrecognized arguments"),
    ],
)
def test_wrong_use_gets_one_line(here: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...], words: str) -> None:
    controller = () if "open" in more else LOOP
    assert words in refusal(["diagnose", "run0.csv", *controller, *more], capsys)
    assert sorted(p.name for p in here.iterdir()) == ["run0.csv", "run1.csv"]


def test_a_folder_that_is_not_there_is_a_failure_before_the_work(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "create it first" in refusal(["diagnose", "run0.csv", *LOOP, "--out", "no/dia.json"], capsys, 1)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_it_with_one_line(here: Path) -> None:
    arguments = ["diagnose", "run0.csv", *LOOP, "--bootstrap", "100000", "--out", "dia.json"]
    assert fastest(lambda: interrupted(arguments, after=1.0), below=0.5) < 0.5
    assert not Path("dia.json").exists()
