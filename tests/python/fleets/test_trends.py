"""Trends of a fleet: changes, axes that differ, what is too poor, and the page."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main
from gaident.errors import ReadError
from gaident.fleets.changes import Scale, shifts_of
from gaident.fleets.courses import logs_a_year
from gaident.fleets.dataset import INDEX, best_format, read_part, write_part

DAYS = 90
BEGIN = datetime(2026, 1, 1)


def write_course(out: Path, axis: str, values: np.ndarray, heat: float | None = 30.0, **more: Any) -> None:
    """A fleet's tables of one axis with a parameter of a log a day."""
    months: dict[str, list[dict[str, Any]]] = {}
    for day, value in enumerate(values):
        time = (BEGIN + timedelta(days=day)).isoformat()
        row = {"log": f"{axis}/{time[:10]}.csv", "time": time, "status": "done", "verdict": "explained", "temperature": heat}
        told = {"of": "mechanics", "effect": "", "side": "", "parameter": "inertia", "unit": "kg m^2", "alternatives": ""}
        told |= {"value": float(value), "std": 0.01 * abs(value), "at_bound": False, "identifiable": True}
        months.setdefault(time[:7], []).append({**row, **told, **more})
    for month, rows in months.items():
        for table in ("logs", "parameters"):
            write_part(out, table, axis, month, rows, best_format())


def noisy(level: float, seed: int, days: int = DAYS) -> np.ndarray:
    return level * np.exp(0.02 * np.random.default_rng(seed).standard_normal(days))


@pytest.fixture
def fleet_of_seven(tmp_path: Path) -> Path:
    out = tmp_path / "fleet"
    for k in range(6):
        write_course(out, f"axis {k}", noisy(1.0 + 0.02 * k, k) * np.where(np.arange(DAYS) >= 60, 1.2 if k == 3 else 1.0, 1.0))
    write_course(out, "<b>odd</b>", noisy(3.0, 9, 10))
    return out


def test_a_step_is_found_with_its_size_and_its_day(fleet_of_seven: Path) -> None:
    found = ga.trends(fleet_of_seven)
    (change,) = found.changes
    assert (change.axis, change.quantity, change.unit) == ("axis 3", "inertia", "kg m^2")
    assert abs((datetime.fromisoformat(change.began) - BEGIN).days - 60) <= 1
    assert (datetime.fromisoformat(change.found) - BEGIN).days <= 67
    assert change.share == pytest.approx(0.2, abs=4.0 * change.std) and change.after > change.before
    assert change.log == f"axis 3/{change.began[:10]}.csv"
    assert "axis 3" in found.summary() and "Too poor to say: 1 of 7" in found.summary()


def test_an_axis_that_differs_and_one_that_is_too_poor(fleet_of_seven: Path) -> None:
    found = ga.trends(fleet_of_seven)
    assert found.siblings[0].axis == "<b>odd</b>" and found.siblings[0].spreads > 10.0
    (poor,) = found.poor
    assert poor.axis == "<b>odd</b>" and poor.poor.startswith("only 10 usable logs")


def test_later_logs_change_no_alarm() -> None:
    values = noisy(1.0, 1, 150) * np.where(np.arange(150) >= 80, 1.15, 1.0)
    y, s = Scale.of_course(values)(values, 0.01 * values)
    whole = shifts_of(y, s, None)
    assert whole
    for n in (whole[0].found, whole[0].found + 1, 120):
        assert shifts_of(y[:n], s[:n], None) == [shift for shift in whole if shift.found < n]


@pytest.mark.parametrize("low", [1.0, -0.5], ids=["positive first", "negative first"])
def test_no_later_log_changes_what_an_alarm_says(tmp_path: Path, low: float) -> None:
    """Neither a value below 0, nor another level, nor logs at the end."""
    rng = np.random.default_rng(8)
    values = np.concatenate([np.full(40, low), np.full(20, 1.5 * low), np.full(20, 4.0), np.full(10, -3.0)])
    values = values + 0.02 * rng.standard_normal(len(values))
    said = []
    for n in (55, 70, 90):
        write_course(tmp_path / str(n), "x", values[:n])
        said.append(ga.trends(tmp_path / str(n)).changes)
    assert said[0] and said[1][: len(said[0])] == said[0] and said[2][: len(said[1])] == said[1]
    assert said[0][0].share == pytest.approx(0.5 if low > 0.0 else -0.5, abs=0.1)


def test_a_log_without_a_temperature_is_one_of_any_temperature() -> None:
    """Friction falls by 2 % a degree: 50 days without a thermometer are no change, a step of twice in them is."""
    rng = np.random.default_rng(3)
    heat = 20.0 + 10.0 * np.sin(2.0 * np.pi * np.arange(200) / 200) + 2.0 * rng.standard_normal(200)
    s = np.full(200, 0.01)
    y = -0.02 * heat + 0.02 * rng.standard_normal(200)
    assert shifts_of(y, s, np.where(np.arange(200) == 77, np.nan, heat)) == []
    gone = np.where(np.arange(200) >= 150, np.nan, heat)
    assert shifts_of(y, s, gone) == [] and shifts_of(y, s, None)
    (shift,) = shifts_of(y + np.where(np.arange(200) >= 160, 0.7, 0.0), s, gone)
    assert abs(shift.first - 160) <= 1


def test_temperature_is_no_change_and_hides_none() -> None:
    rng = np.random.default_rng(3)
    heat = 20.0 + 10.0 * np.sin(2.0 * np.pi * np.arange(200) / 200) + 2.0 * rng.standard_normal(200)
    values = np.exp(-0.02 * heat + 0.02 * rng.standard_normal(200))
    y, s = Scale.of_course(values)(values, 0.01 * values)
    assert shifts_of(y, s, None)
    assert not shifts_of(y, s, heat)
    y[120:] += 0.2
    (shift,) = shifts_of(y, s, heat)
    assert abs(shift.first - 120) <= 1 and shift.size == pytest.approx(0.2, abs=0.05)


def test_logs_that_agree_are_told_soon_and_damaged_ones_are_not() -> None:
    """Behind 21 logs: seven that are 30 % off are a change from the first of them on, two that are e times off are none."""
    rng = np.random.default_rng(5)
    level = np.where(np.arange(28) < 21, 0.0, 0.3)
    s = np.full(28, 0.003)
    (shift,) = shifts_of(level + s * rng.standard_normal(28), s, None)
    assert (shift.first, shift.size) == (21, pytest.approx(0.3, abs=0.01)) and shift.found <= 25
    damaged = s * rng.standard_normal(28)
    damaged[[22, 25]] = 1.0
    assert shifts_of(damaged, s, None) == []


def weekly(seed: int, at: int, step: float = 0.2) -> tuple[np.ndarray, np.ndarray]:
    """(y, s) of a log a week for 50 weeks, deviation and scatter 2 % each, a step in week `at`."""
    rng = np.random.default_rng([77, seed])
    s = np.full(50, 0.02)
    y = s * rng.standard_normal(50) + 0.02 * rng.standard_normal(50)
    return y + np.where(np.arange(50) >= at, np.log1p(step), 0.0), s


def test_a_step_of_weekly_logs_is_told_within_three_weeks() -> None:
    """Of 20 % behind 20 logs, the fewest that there may be; nothing is told of courses without one."""
    told = [shifts_of(*weekly(k, 20), None, 52.0) for k in range(20)]
    assert all(shifts for shifts in told) and all(abs(shifts[0].first - 20) <= 1 for shifts in told)
    assert np.mean([shifts[0].found <= 23 for shifts in told]) >= 0.95
    assert all(shifts_of(*weekly(k, 50), None, 52.0) == [] for k in range(40, 50))


def test_weekly_logs_need_less_than_daily_ones_for_the_same_rate_of_false_alarms() -> None:
    y, s = weekly(3, 20)
    found = {a_year: shifts_of(y, s, None, a_year)[0].found for a_year in (4.0, 52.0, 1e9)}
    assert found[4.0] <= found[52.0] < found[1e9]


def test_logs_in_a_year_follow_from_the_first_logs_alone() -> None:
    times = [(BEGIN + timedelta(weeks=k)).isoformat() for k in range(20)]
    assert logs_a_year(times) == pytest.approx(365.25 / 7.0)
    assert logs_a_year(times + [times[-1]] * 50) == logs_a_year(times)
    assert logs_a_year(times[:1] * 23) == pytest.approx(365.25 * 24.0)  # no times apart: as if hourly


@pytest.mark.parametrize("damaged", [(22, 23), (22, 26)], ids=["two of three", "two of five"])
def test_fewer_damaged_logs_than_agree_are_no_change(damaged: tuple[int, ...]) -> None:
    for k in range(8):
        y, s = weekly(k, 50)
        y[list(damaged)] += 3.0
        assert shifts_of(y, s, None, 52.0) == []


def test_a_first_scale_that_is_too_small_leaves_no_log_out_for_good() -> None:
    """Ten of twenty logs lie close together: the median deviation is theirs, the scale of the others comes back."""
    rng = np.random.default_rng(4)
    y = np.concatenate([np.tile([-0.004, 0.004], 7), np.tile([-0.03, 0.03], 5), 0.045 + 0.005 * rng.standard_normal(4)])
    assert shifts_of(y, np.full(len(y), 0.001), None, 52.0) == []


def test_outliers_are_no_change() -> None:
    values = noisy(1.0, 5, 120)
    values[[25, 40, 41, 90]] *= 3.0
    y, s = Scale.of_course(values)(values, 0.01 * values)
    assert not shifts_of(y, s, None)
    assert not shifts_of(np.zeros(60), np.zeros(60), None)  # no scatter at all


def test_values_that_say_nothing_are_left_out(tmp_path: Path) -> None:
    write_course(tmp_path / "fleet", "x", noisy(1.0, 1), at_bound=True)
    (course,) = ga.trends(tmp_path / "fleet").courses
    assert course.poor == "only 0 usable logs; a change shows from 23 on; 90 at a bound or undetermined"
    with pytest.raises(ga.GaidentError, match="no table"):
        ga.trends(tmp_path)


def test_the_page_needs_nothing_else_and_escapes_names(fleet_of_seven: Path, tmp_path: Path) -> None:
    page = tmp_path / "trends.html"
    ga.trends(fleet_of_seven, page)
    text = page.read_text(encoding="utf-8")
    assert "<b>odd</b>" not in text and "&lt;b&gt;odd&lt;/b&gt;" in text
    assert (
        "http://" not in text and "https://" not in text and "src=" not in text.replace("script-src", "").replace("style-src", "")
    )
    assert text.count("<svg") == 7 and text.count('class="changed"') == 1


def test_the_command_says_the_same(fleet_of_seven: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["trends", str(fleet_of_seven), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [c["axis"] for c in said["changes"]] == ["axis 3"] and said["poor"][0]["axis"] == "<b>odd</b>"
    assert main(["trends", str(fleet_of_seven)]) == 0
    assert "Axes that differ from their siblings" in capsys.readouterr().out


def test_where_nothing_can_be_said_that_comes_first(tmp_path: Path) -> None:
    """Eight logs of an axis whose inertia steps by a third are too few: the reason stands in place of "No changes."."""
    out = tmp_path / "fleet"
    write_course(out, "gate", noisy(1.0, 3, 8) * np.where(np.arange(8) >= 4, 1.3, 1.0))
    found = ga.trends(out, tmp_path / "page.html")
    assert found.nothing_to_say.startswith("Nothing can be said of changes yet: only 8 usable logs; a change shows from ")
    assert found.nothing_to_say in found.summary() and "No changes." not in found.summary()
    assert found.nothing_to_say in (tmp_path / "page.html").read_text()


def test_a_fleet_that_was_stopped_says_what_to_do(tmp_path: Path) -> None:
    (tmp_path / INDEX).write_bytes(b"")
    with pytest.raises(ReadError, match="stopped before its tables were written; call gaident fleet again"):
        ga.trends(tmp_path)


@pytest.mark.skipif(best_format() == "csv", reason="pyarrow is not installed: pip install 'gaident[parquet]'")
def test_tables_are_read_and_written_by_streams_of_pyarrow_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its threads may outlive the interpreter: one that then drops an object of Python ended the process with "Aborted"."""
    import pyarrow.parquet

    given: list[object] = []
    for name, place in (("write_table", 1), ("ParquetFile", 0)):
        usual = getattr(pyarrow.parquet, name)

        def noting(*args: Any, usual: Any = usual, place: int = place, **more: Any) -> Any:
            given.append(args[place])
            return usual(*args, **more)

        monkeypatch.setattr(pyarrow.parquet, name, noting)
    write_course(tmp_path, "gate", noisy(1.0, 3, 3))
    assert len(read_part(next((tmp_path / "logs").glob("*/*/part.parquet")), "logs")) == 3
    assert len(given) >= 2 and all(isinstance(stream, pyarrow.NativeFile) for stream in given)
    assert {type(stream).__name__ for stream in given} == {"BufferOutputStream", "OSFile"}
