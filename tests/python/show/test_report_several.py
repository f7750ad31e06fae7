"""One page of several results: an overview, what differs, each with its record; in Python and on the command line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli.main import main
from gaident.reporting.report import report_page
from gaident.show.report import parts
from gaident.show.report.several import change_words
from page import Reader, charts_of

CONTROLLER = ga.PI(kp=0.5, ki=5.0)


def record(friction: float, seed: int) -> ga.Record:
    command = np.repeat([20.0, -30.0, 10.0, -5.0], 100)
    noise = 0.02 * np.random.default_rng(seed).standard_normal(400)
    drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=friction)
    run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), CONTROLLER)
    return ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque, name=f"run {seed}")


@pytest.fixture(scope="module")
def results() -> dict[str, ga.Diagnosis]:
    return {
        name: ga.diagnose(record(friction, seed), CONTROLLER) for name, friction, seed in (("before", 0.3, 1), ("after", 0.12, 2))
    }


@pytest.fixture
def fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the pictures for print, and with a short name for plotly.js."""
    monkeypatch.setattr(parts, "picture", lambda chart: b"png of " + chart.key.encode())
    monkeypatch.setattr("plotly.offline.get_plotlyjs", lambda: "plotly()")


def test_before_and_after_stand_beside_each_other(results: dict[str, ga.Diagnosis], fast: None) -> None:
    page = report_page(results, units={"torque": "%", "rated_torque": 2.4}, about={"machine": "X1"})
    seen = Reader(page)
    assert [h for h in ("Overview", "What differs", "before", "after") if h in seen.text] == [
        "Overview",
        "What differs",
        "before",
        "after",
    ]
    assert "2 results: before, after" in seen.text and "machine : X1" in seen.text
    assert re.search(r"coulomb friction \((0.3\d*|0.29\d*) N m\)", seen.text) and "coulomb friction (0.12" in seen.text
    assert re.search(r"changed -(60|59)\.\d %", seen.text)
    assert re.search(r"12\.[45]\d* ± [\d.]+ %", seen.text)  # of the rated torque
    charts = charts_of(page)["charts"]
    assert set(charts) == {f"result-{i}-{key}" for i in (0, 1) for key in ("run", "missing-velocity")}
    links = {a["href"] for a in seen.found("a") if "href" in a}
    assert {"#result-0", "#result-1"} <= links


def test_a_sequence_is_named_by_its_records_and_a_linear_model_has_a_row(results: dict[str, ga.Diagnosis], fast: None) -> None:
    first = results["before"]
    seen = Reader(report_page([first, first.identification], records=[*first.records]))
    assert "2 results: run 1, run 1 (2)" in seen.text and "not asked: a linear model alone" in seen.text
    assert "inertia" in seen.text


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ((1.0, 0.1), (1.0, 0.1), "the same"),
        ((1.0, 0.1), (1.3, 0.1), "within the deviations"),
        ((1.0, 0.1), (1.6, 0.1), "changed +60.0 %"),
    ],
)
def test_a_change_is_one_beyond_both_deviations(old: tuple[float, float], new: tuple[float, float], said: str) -> None:
    assert change_words(ga.Estimate(*old, "N m"), ga.Estimate(*new, "N m")) == said


@pytest.mark.parametrize("wrong", [[], ["a"], {"a": 3}, "dia.json", 3])
def test_wrong_use_is_refused(wrong: Any) -> None:
    with pytest.raises(ga.GaidentError, match="result"):
        report_page(wrong)


def test_the_command_line_finds_which_log_belongs_to_which(
    results: dict[str, ga.Diagnosis],
    fast: None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    columns = "--columns", "time=t,command=r,velocity=w,torque=u"
    for i, name in enumerate(results, 1):
        rec = record({1: 0.3, 2: 0.12}[i], i)
        rows = np.column_stack([1e-3 * np.arange(400), rec.command, rec.velocity, rec.torque])  # type: ignore[list-item]
        np.savetxt(f"{name}.csv", rows, delimiter=",", header="t,r,w,u", comments="", fmt="%.17g")
        assert main(["diagnose", f"{name}.csv", *columns, "--kp", "0.5", "--ki", "5", "--out", f"{name}.json"]) == 0
    capsys.readouterr()
    assert main(["report", "before.json", "after.json", "after.csv", "before.csv", *columns, "--out", "both.html"]) == 0
    assert "written: both.html" in capsys.readouterr().out
    page = Path("both.html").read_text()
    assert len(charts_of(page)["charts"]) == 4 and "not the data" not in page
    assert main(["report", "before.json", "after.json", "after.csv", *columns, "--out", "both.html"]) == 0
    assert "Its curves need its log beside it." in Reader(Path("both.html").read_text()).text
