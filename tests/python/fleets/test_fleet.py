"""A fleet of logs: every log is a row, what is done is not done again, and a run that is killed loses nothing."""

from __future__ import annotations

import errno
import importlib
import os
import runpy
import signal
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta, timezone
from functools import partial
from pathlib import Path

import pytest
from fleet_cases import children, content, fatal, write_log, write_logs

import gaident as ga
from cli_cases import interrupted
from gaident.cli import main
from gaident.errors import SettingsError
from gaident.fleets import dataset, engine
from gaident.fleets.names import names_of
from gaident.fleets.task import Job, Outcome
from places import ROOT

fleet = importlib.import_module("gaident.fleets.fleet")
identified = partial(ga.fleet, "logs/**/*.csv", method="identify", temperature="heat")
RUN = """
import gaident as ga
if __name__ == "__main__":
    ga.fleet("logs/**/*.csv", method="identify", temperature="heat", out="killed", workers=1)
"""


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with logs, and the dataset of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("fleet")
    write_logs(folder / "logs")
    before = Path.cwd()
    os.chdir(folder)
    try:
        found = identified(out="whole", executor=map)
    finally:
        os.chdir(before)
    assert (found.logs, found.done, found.failed, found.there) == (7, 6, 1, 0)
    return folder


@pytest.fixture
def inside(whole: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(whole)
    return whole


def test_every_log_is_a_row(inside: Path) -> None:
    rows = list(fleet.kept_fleet("whole").rows())
    assert [(r["axis"], r["month"], r["status"]) for r in rows if r["axis"] == "x"] == [
        ("x", "2026-01", "done"),
        ("x", "2026-01", "done"),
        ("x", "2026-02", "done"),
    ]
    (failed,) = (r for r in rows if r["status"] == "failed")
    assert failed["log"] == "logs/y/2026-01-20.csv" and failed["log"] in failed["error"] and failed["result"] is None
    for row in rows:
        if row is not failed:
            assert row["temperature"] == 30.0 and row["samples"] == 240 and row["version"] and row["content"]
            saved = ga.load(Path("whole") / row["result"])
            assert isinstance(saved, ga.Identification)
    values = list(fleet.kept_fleet("whole").rows("parameters"))
    gains = {r["axis"]: r["value"] for r in values if r["parameter"] == "gain"}
    assert gains["x"] == pytest.approx(100.0, rel=0.1) and gains["y"] == pytest.approx(50.0, rel=0.1)


def test_a_diagnosis_has_mechanics_and_friction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "logs" / "x" / "2026-01-01.csv", 1)
    found = ga.fleet("logs", names=lambda path: ("x", datetime(2026, 1, 1)), out="one", executor=map)
    assert found.failed == 1  # a folder is no log
    found = ga.fleet("logs/x/*", out="one", quick=True, executor=map)
    assert found.done == 1
    values = {r["parameter"]: r for r in found.rows("parameters") if r["of"] == "mechanics"}
    assert abs(values["inertia"]["value"] - 0.01) < 4 * values["inertia"]["std"] + 1e-4
    assert values["inertia"]["unit"] == "kg m^2" and values["inertia"]["verdict"]


def test_what_is_there_is_not_done_again(inside: Path) -> None:
    before = content(Path("whole"))
    found = identified(out="whole", executor=lambda work, jobs: pytest.fail("nothing is to be done"))
    assert (found.done, found.failed, found.there) == (6, 1, 7)
    assert content(Path("whole")) == before
    with ThreadPoolExecutor(1) as executor:
        again = identified(out="whole", executor=executor, resume=False)
    assert again.there == 0 and content(Path("whole")) == before


def test_other_settings_and_other_content_are_other_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "logs" / "x" / "2026-01-01.csv"
    write_log(log, 1)
    assert identified(out="out", executor=map).there == 0
    assert identified(out="out", executor=map, seed=2).there == 0
    write_log(log, 2)
    assert identified(out="out", executor=map).there == 0
    assert len(list(Path("out/results").rglob("*.json"))) == 3
    assert len(list(fleet.kept_fleet("out").rows())) == 1  # the last one counts
    log.unlink()
    gone = ga.fleet(["logs/x/2026-01-01.csv"], method="identify", out="out", executor=map)
    assert (gone.done, gone.failed, gone.there) == (1, 0, 1), "what was found of a log that was moved stays"
    never = ga.fleet(["logs/x/2026-01-02.csv"], method="identify", out="out", executor=map)
    assert never.failed == 1 and "there is no such log" in never.first_failed()[0]


def test_one_file_is_one_log_whatever_it_is_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "logs" / "x" / "2026-01-01.csv"
    write_log(log, 1)
    (tmp_path / "link").symlink_to(tmp_path / "logs")
    (tmp_path / "logs" / "x" / "2026-01-02.csv").symlink_to(log)
    ways = ["logs/x/2026-01-01.csv", "./logs/../logs/x/2026-01-01.csv", "link/x/*.csv", "logs/x/2026-01-02.csv"]
    for order in (ways, ways[::-1]):
        found = ga.fleet(order, method="identify", out="out", executor=map)
        assert (found.logs, found.done) == (1, 1)
        assert [r["log"] for r in found.rows()] == ["link/x/2026-01-01.csv"], "the first of its names"
    found = ga.fleet(str(log), method="identify", out="out", executor=map)
    assert found.there == 1 and [r["log"] for r in found.rows()] == [log.as_posix()], "the name of the last run"


def test_a_moved_log_leaves_no_axis_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for axis in ("old", "other"):
        write_log(tmp_path / "logs" / axis / "2026-01-01.csv", 1 if axis == "old" else 2)
    assert identified(out="out", executor=map).done == 2
    (tmp_path / "logs" / "old").rename(tmp_path / "logs" / "new")
    found = identified(out="out", executor=map)
    assert (found.logs, found.there) == (2, 2) and [r["axis"] for r in found.rows()] == ["new", "other"]
    assert [a.axis for a in ga.trends("out").axes] == ["new", "other"]
    found = identified(out="out", executor=map, names="(?P<axis>logs)")  # a name that is said otherwise leaves none either
    assert {r["axis"] for r in found.rows()} == {"logs"} and not Path("out/logs/axis=new").exists()
    (tmp_path / "logs" / "other" / "2026-01-01.csv").unlink()
    (tmp_path / "logs" / "new" / "copy.csv").write_bytes((tmp_path / "logs" / "new" / "2026-01-01.csv").read_bytes())
    assert len(list(identified(out="out", executor=map).rows())) == 3, "a copy is no move, and a log that is gone stays"


def test_a_name_that_is_not_utf_8_is_a_log_like_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    good, bad = (os.fsdecode(b"logs/x\xff/2026-01-0%d\xe9.csv" % day) for day in (1, 2))
    write_log(Path(good), 1)
    Path(bad).write_text("time\n1\n")
    found = identified(out="out", executor=map)
    assert (found.done, found.failed) == (1, 1)
    rows = {r["log"]: r for r in found.rows()}
    assert {r["axis"] for r in rows.values()} == {"x\\xff"}
    failed = rows["logs/x\\xff/2026-01-02\\xe9.csv"]
    assert failed["status"] == "failed" and failed["error"].encode()
    ga.trends("out", "page.html")
    (report,) = Path("page_reports").iterdir()  # it says whose it is
    assert "logs/x\\xff/2026-01-01\\xe9.csv" in report.read_text()


def test_a_killed_run_goes_on_to_the_same_dataset(inside: Path) -> None:
    script = inside / "run.py"
    script.write_text(RUN)
    installed = {**os.environ, "PYTHONPATH": str(Path(ga.__file__).parents[1])}
    with subprocess.Popen([sys.executable, str(script)], env=installed) as run:
        until = time.monotonic() + 60.0
        while not list((inside / "killed").rglob("*.json")):
            assert time.monotonic() < until and run.poll() is None
            time.sleep(0.01)
        workers = children(run.pid)
        run.kill()
    assert workers
    until = time.monotonic() + 10.0
    while any(Path(f"/proc/{pid}/cmdline").exists() and Path(f"/proc/{pid}/cmdline").read_bytes() for pid in workers):
        assert time.monotonic() < until, "a worker outlives its parent"
        time.sleep(0.05)
    done = len(list((inside / "killed").rglob("*.json")))
    found = identified(out="killed", executor=map)
    assert 0 < found.there <= done + 1 and found.logs == 7
    assert content(inside / "killed") == content(inside / "whole")


def test_a_killed_worker_costs_nothing(inside: Path) -> None:
    killed: list[int] = []

    def kill(done: float, message: str) -> None:
        if not killed:
            killed.extend(children(os.getpid())[:1])
            os.kill(killed[0], signal.SIGKILL)

    found = identified(out="worker", workers=1, progress=kill)
    assert killed and (found.done, found.failed) == (6, 1)
    assert content(inside / "worker") == content(inside / "whole")


@pytest.mark.long
def test_ctrl_c_keeps_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for day in range(150):  # far more than are done when it comes
        write_log(tmp_path / "logs" / "x" / f"2026-{1 + day // 28:02}-{1 + day % 28:02}.csv", day)

    def kept() -> int:
        return len(list(Path("out/results").rglob("*.json")))

    interrupted(["fleet", "logs/x/*.csv", "--loop", "open", "--out", "out", "--workers", "1"], until=lambda: kept() >= 3)
    done = kept()
    rows = list(fleet.kept_fleet("out").rows())
    assert 2 <= done - 1 <= len(rows) <= done < 150  # a result that was just written when Ctrl-C came may have no row yet


@pytest.mark.long
def test_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    pytest.importorskip("duckdb")
    monkeypatch.chdir(tmp_path)
    pages = runpy.run_path(str(ROOT / "docs" / "tools" / "run_pages.py"))
    pages["worked"]((ROOT / "docs/how-to/fleets.md").read_text(encoding="utf-8"), "the page of fleets")


def test_a_log_that_ends_its_process_is_a_row() -> None:
    jobs = [Job(name, name, name) for name in ("a", "fatal", "b")]
    found = {o.log: o for o in engine._by_processes(fatal, iter(jobs), 1)}
    assert {log: o.status for log, o in found.items()} == {"a": "done", "b": "done", "fatal": "lost"}
    assert "fewer workers" in found["fatal"].error


def test_a_full_disk_keeps_what_is_done(inside: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real, count = fleet.write_whole, []

    def full(path: Path, text: bytes) -> None:
        count.append(path)
        if len(count) == 3:
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        real(path, text)

    monkeypatch.setattr(fleet, "write_whole", full)
    with pytest.raises(OSError, match="No space left"):
        identified(out="full", executor=map)
    monkeypatch.setattr(fleet, "write_whole", real)
    assert identified(out="full", executor=map).there == 2
    assert content(inside / "full") == content(inside / "whole")


@pytest.mark.long
def test_dask_loses_no_log_with_a_worker(inside: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: pip install 'gaident[dask]'")
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        where = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
        with distributed.LocalCluster(**where) as cluster, distributed.Client(cluster) as client:
            killed: list[int] = []

            def kill(done: float, message: str) -> None:
                if not killed:
                    killed.append(next(iter(client.run(os.getpid).values())))
                    os.kill(killed[0], signal.SIGKILL)

            found = identified(out="dask", executor=client.get_executor(), progress=kill)
    assert killed and (found.done, found.failed) == (6, 1)
    assert content(inside / "dask") == content(inside / "whole")


def test_without_pyarrow_the_tables_are_csv(inside: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset.importlib.util, "find_spec", lambda name: None)
    found = identified(out="text", executor=map)
    assert sorted({f.suffix for f in Path("text/logs").rglob("part.*")}) == [".csv"]
    rows = zip(found.rows(), fleet.kept_fleet("whole").rows(), strict=True)
    for text, binary in rows:
        assert {k: v for k, v in text.items() if v not in ("", None)} == {k: v for k, v in binary.items() if v not in ("", None)}


def test_a_log_that_is_gone_or_another_when_it_is_read_is_tried_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "logs" / "x" / "2026-01-01.csv"
    write_log(log, 1)
    whole = log.read_text()

    def gone(work: object, jobs: Iterable[Job]) -> Iterator[Outcome]:
        for job in jobs:
            log.unlink()
            yield work(job)  # type: ignore[operator]

    def cut(work: object, jobs: Iterable[Job]) -> Iterator[Outcome]:
        for job in jobs:
            log.write_text(whole[:100])
            yield work(job)  # type: ignore[operator]

    for spoiled, said in ((gone, "cannot be read"), (cut, "changed while it was read")):
        found = identified(out="out", executor=spoiled)
        assert found.failed == 1 and said in found.first_failed()[0]
        log.write_text(whole)
    again = identified(out="out", executor=map)
    assert (again.done, again.failed, again.there) == (1, 0, 0)


def test_the_command_does_the_same(inside: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--out", "whole", "--method", "identify", "--temperature", "heat", "--workers", "1"]
    assert main(["fleet", "logs/x/*.csv", *options, "--loop", "open"]) == 0
    assert "3 logs: 3 done, 0 failed" in capsys.readouterr().out
    before = content(Path("whole"))
    assert main(["fleet", "logs/x/*.csv", *options, "--loop", "open", "--resume"]) == 0
    assert "3 of them before" in capsys.readouterr().out and content(Path("whole")) == before
    assert main(["fleet", "logs/x/*.csv", *options, "--loop", "open", "--again"]) == 0
    assert "0 of them before" in capsys.readouterr().out
    assert main(["fleet", "logs/x/*.csv", *options, "--loop", "open", "--resume", "--again"]) == 2
    err = capsys.readouterr().err
    assert "--resume" in err and "--again" in err and "leave one of them out" in err and err.count("\n") == 1
    assert main(["fleet", "logs/none/*.csv", *options]) == 2
    assert "no file fits this pattern" in capsys.readouterr().err


def test_names_say_axis_and_time() -> None:
    by_folder = names_of(None)
    axis, when = by_folder("plant/press 4/2026-03-31T14-05-09.csv")
    assert axis == "press 4" and when.isoformat() == "2026-03-31T14:05:09+00:00"
    assert by_folder("press/20260331/run.csv")[0] == "press"
    axis, when = names_of(r"(?P<axis>x\d+)_(?P<time>[\d-]+)")("all/x12_2026-03-31.csv")
    assert axis == "x12" and when.day == 31
    for wrong, said in ((r"(", "no regular expression"), ("axis", "no group"), (3, "give a regular expression")):
        with pytest.raises(SettingsError, match=said):
            names_of(wrong)
    with pytest.raises(SettingsError, match="does not fit"):
        names_of(r"(?P<axis>x\d+)")("y.csv")
    with pytest.raises(SettingsError, match="is none"):
        by_folder("x/2026-02-31.csv")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"executor": 3}, "executor is 3"),
        ({"workers": 0}, "workers is 0"),
        ({"method": "guess"}, "method is 'guess'"),
        ({"resume": 1}, "resume is 1"),
        ({"read": {"colums": {}}}, "colums"),
        ({"quick": True}, "belong to a diagnosis"),
        ({"seed": -1}, "seed is -1"),
        ({"temperature": 3}, "temperature is 3"),
        ({"names": 3}, "names is 3"),
        ({"progress": 3}, "progress is 3"),
        ({"axis": "round"}, "round"),
        ({"drive": "none.toml"}, "no such drive file"),
        ({"method": "diagnose", "noise": [1.0, 2.0]}, r"noise is \[1.0, 2.0\]: give its standard deviation"),
        ({"method": "diagnose", "noise": float("inf")}, "noise is inf"),
        ({"method": "diagnose", "pitch": "x"}, "pitch is 'x'"),
        ({"temperature": ""}, "temperature is ''"),
        ({"read": {"columns": {1: "time", "a": "b"}}}, "read: columns is"),
        ({"read": {"dt": lambda: 1.0}}, "read: dt is"),
        ({"executor": lambda work, jobs: 3}, "executor gives 3"),
        ({"names": lambda path: {}[path]}, "names raises KeyError"),
        ({"names": lambda path: ()}, r"names gives \(\)"),
        ({"names": lambda path: ("x", datetime(2026, 1, 1), 3)}, "names gives"),
        ({"names": lambda path: ("x", datetime(1, 1, 1, tzinfo=timezone(timedelta(hours=2))))}, "names gives"),
        ({"names": lambda path: (300 * "x", datetime(2026, 1, 1))}, "too long for a folder"),
        ({"out": "run.txt"}, "this is a file"),
    ],
)
def test_wrong_use_is_named(inside: Path, wrong: dict[str, object], said: str) -> None:
    (inside / "run.txt").write_text("")
    with pytest.raises(ga.GaidentError, match=said):
        ga.fleet("logs/x/*.csv", **{"method": "identify", "out": "wrong", **wrong})  # type: ignore[arg-type]


def test_two_runs_do_not_write_at_the_same_time(inside: Path) -> None:
    from gaident.fleets.index import opened

    with opened(Path("locked")), pytest.raises(ga.GaidentError, match="another process writes there"):
        ga.fleet("logs/x/*.csv", method="identify", out="locked", executor=map)
