"""A part of a log by its times, and the pieces around its gaps, from Python and from the command line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.errors import ReadError

COLUMNS: dict[str, str | int | None] = {"time": "t", "velocity": "w", "torque": "u"}
DRIVE = ga.OneMass(J=0.01, D=0.05)


def log(path: Path, gaps: tuple[tuple[int, int], ...] = (), step: float = 1e-3, jitter: float = 0.0, first: float = 0.0) -> Path:
    """1200 lines of a drive of one mass; gaps: rows that are missing; first: the time of the first line [s]."""
    torque = np.repeat([1.0, -1.0, 0.6, -0.8, 0.2, -0.3], 200)
    rng = np.random.default_rng(1)
    noise = 1e-4 * rng.standard_normal(1200)
    w = ga.simulate(DRIVE, ga.Record(step, torque=torque, velocity=noise)) + noise
    t = first + step * np.arange(1200) + jitter * step * rng.uniform(-1.0, 1.0, 1200)
    kept = np.ones(1200, dtype=bool)
    for a, b in gaps:
        kept[a:b] = False
    rows = "".join(f"{x:.7f},{v:.8f},{u:g}\n" for x, v, u in np.column_stack([t, w, torque])[kept])
    path.write_text("t [s],w [rad/s],u [Nm]\n" + rows)
    return path


def test_the_pieces_around_gaps_are_records_of_their_own(tmp_path: Path) -> None:
    path = log(tmp_path / "run.csv", ((300, 350), (360, 400), (900, 1000)), first=17.25)
    with pytest.raises(ReadError, match=r"irregular: .*read_pieces"):
        ga.read(path, COLUMNS)
    found = ga.read_pieces(path, COLUMNS)
    assert [(rec.name, len(rec)) for rec in found] == [("run 1", 300), ("run 2", 500), ("run 3", 200)]
    assert "1 piece of the log of fewer than 20 samples left out" in found[0].notes[0] and not found[1].notes
    whole = ga.read(log(tmp_path / "whole.csv"), COLUMNS)
    np.testing.assert_array_equal(found[1].velocity, whole.velocity[400:900])
    assert all(rec.dt == pytest.approx(1e-3, rel=1e-9) for rec in found)
    mechanics = ga.identify(found).mechanics
    assert isinstance(mechanics, ga.OneMass) and pytest.approx(0.01, rel=0.01) == mechanics.J


def test_pieces_are_counted_as_they_are_read(tmp_path: Path) -> None:
    """A piece of 50 lines is too short once every fifth line is kept."""
    path = log(tmp_path / "run.csv", ((300, 350), (400, 500)))
    assert [len(rec) for rec in ga.read_pieces(path, COLUMNS)] == [300, 50, 700]
    for coarser in ({"decimate": 5}, {"resample": 0.001, "decimate": 5}):
        found = ga.read_pieces(path, COLUMNS, **coarser)
        assert [len(rec) for rec in found] == [60, 140] and "1 piece of the log" in found[0].notes[0]
    with pytest.raises(ReadError, match="no piece of 20 samples"):
        ga.read_pieces(path, COLUMNS, decimate=50)


def test_a_part_by_its_times(tmp_path: Path) -> None:
    path = log(tmp_path / "run.csv", ((1000, 1100),), first=1e9)
    (part,) = ga.read_pieces(path, COLUMNS, start=0.2, stop=0.8, pieces=False)
    assert len(part) == 601 and part.name == "run"
    assert [len(rec) for rec in ga.read_pieces(path, COLUMNS, start=0.5)] == [500, 100]
    assert [len(rec) for rec in ga.read_pieces(path, COLUMNS, stop=1.05)] == [1000]
    assert [len(rec) for rec in ga.read_pieces(path, COLUMNS, start=1.05)] == [100]
    with pytest.raises(ReadError, match="irregular"):
        ga.read_pieces(path, COLUMNS, start=0.5, pieces=False)


def test_what_leaves_nothing_is_refused(tmp_path: Path) -> None:
    path = log(tmp_path / "run.csv")
    for bounds in ({"start": 1.3}, {"start": 0.1, "stop": 0.11}):
        with pytest.raises(ReadError, match="no piece of 20 samples"):
            ga.read_pieces(path, COLUMNS, **bounds)
    with pytest.raises(ReadError, match=r"start=0\.5 and stop=0\.2: the first has to be the earlier one"):
        ga.read_pieces(path, COLUMNS, start=0.5, stop=0.2)
    with pytest.raises(ReadError, match="start is 'now': give seconds"):
        ga.read_pieces(path, COLUMNS, start="now")  # type: ignore[arg-type]


def test_a_log_without_time_is_cut_by_its_lines(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("w [rad/s],u [Nm]\n" + "".join(f"{np.sin(k)},{np.cos(k)}\n" for k in range(100)))
    (part,) = ga.read_pieces(path, {"velocity": "w", "torque": "u"}, dt=1e-3, start=0.01, stop=0.05)
    assert part.velocity[0] == pytest.approx(np.sin(10)) and len(part) == 41


def test_the_advice_on_uneven_times_leads_to_a_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A log whose steps are uneven, with a gap: each refusal names options, and with these it is read in the end."""
    monkeypatch.chdir(tmp_path)
    log(Path("run.csv"), ((500, 600),), jitter=0.2)
    command = ["identify", "run.csv", "--columns", "time=t,velocity=w,torque=u", "--loop", "open", "--json"]
    assert main(command) == 2
    advice = re.search(r"with --resample (\S+);", capsys.readouterr().err)
    assert advice is not None
    command += ["--resample", advice[1]]
    assert main(command) == 2
    assert "a gap of" in (told := capsys.readouterr().err) and "(--pieces)" in told
    assert main([*command, "--pieces", "--p", "1", "--q", "0"]) == 0
    assert json.loads(capsys.readouterr().out)["mechanics"]["J"] == pytest.approx(0.01, rel=0.05)
    with pytest.raises(ReadError, match="coarser than the log") as refused:
        ga.read_pieces("run.csv", COLUMNS, resample=0.004)
    even = re.search(r"give resample=(\S+) and decimate=(\d+)", str(refused.value))
    assert even is not None
    found = ga.read_pieces("run.csv", COLUMNS, resample=float(even[1]), decimate=int(even[2]))
    assert [rec.dt for rec in found] == pytest.approx([0.004, 0.004], rel=0.01)


@pytest.mark.long
def test_from_to_and_pieces_of_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    log(Path("run.csv"), ((500, 600),))
    Path("drive.toml").write_text('[columns]\ntime = "t"\nvelocity = "w"\ntorque = "u"\n')
    command = ["identify", "run.csv", "--drive", "drive.toml", "--loop", "open"]
    assert main(command) == 2
    assert "--pieces" in capsys.readouterr().err
    assert main([*command, "--from", "0.1", "--to", "0.4", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["mechanics"]["J"] == pytest.approx(0.01, rel=0.05)
    assert main([*command, "--from", "0.4", "--to", "0.1"]) == 2
    assert "--from 0.4 and --to 0.1" in capsys.readouterr().err
    Path("drive.toml").write_text('pieces = true\n[columns]\ntime = "t"\nvelocity = "w"\ntorque = "u"\n')
    assert main([*command, "--json", "--out", "run.json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["digests"]) == 2
    assert main(["report", "run.json", "run.csv", "--drive", "drive.toml", "--out", "page.html"]) == 0
    assert "not the data" not in capsys.readouterr().out
    assert main(["simulate", "run.json", "run.csv", "--drive", "drive.toml"]) == 2
    assert "takes a log as one record" in capsys.readouterr().err
