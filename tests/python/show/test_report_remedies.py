"""The chapter "What to do" of a report: other gains, feedforward, what a repair brings, and why one of them is not there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from friction_drive import CONTROLLER, drive_record
from gaident.policy.table import POLICY
from gaident.reporting.remedies import remedies_of
from gaident.reporting.report import report_page
from gaident.show.report import parts
from gaident.show.report.remedies import _table_of
from gaident.show.report.views import Mended, Remedies
from page import Reader, charts_of
from report_cases import diagnosed, retuned_once


@pytest.fixture
def fast(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts, "picture", lambda chart: b"png")
    monkeypatch.setattr("plotly.offline.get_plotlyjs", lambda: "plotly()")
    retuned_once(monkeypatch)


@pytest.fixture
def no_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise ga.GaidentError("not here")

    monkeypatch.setattr("gaident.reporting.remedies.retune", refused)


@pytest.fixture(scope="module")
def dia() -> ga.Diagnosis:
    return diagnosed()


def chapter(dia: ga.Diagnosis, axis: str = "rotary") -> str:
    text = Reader(report_page(dia, axis=axis)).text
    return text[text.rindex("What to do") : text.rindex("What could not be tested")]


def remedies(dia: ga.Diagnosis) -> Remedies:
    found = remedies_of(dia, dia.records)
    assert found is not None
    return found


def test_the_page_has_the_gains_the_tables_and_what_a_repair_brings(dia: ga.Diagnosis, fast: None) -> None:
    text, found = chapter(dia), remedies(dia)
    assert found.retuning is not None and found.mended is not None and not found.doubts
    assert text.index("Other gains") < text.index("Feedforward") < text.index("If mended")
    for number in (found.retuning.controller.gains.kp, found.retuning.after.phase_margin.value):
        assert f"{number:.4g}" in text
    assert "The proposal keeps what was asked for" in text and "without coulomb friction" in text
    charts = charts_of(report_page(dia))["charts"]
    assert {"loop", "loop-step"} <= set(charts)
    linear = chapter(dia, "linear")
    assert "N s/m" in linear and "N m" not in linear and "rad/s" not in linear


def test_the_table_of_repairs_is_that_of_the_simulations(dia: ga.Diagnosis, fast: None) -> None:
    rec, found = max(dia.records, key=len), remedies(dia).mended
    assert found is not None and found.unit == "rad/s" and rec.command is not None

    def error(velocity: np.ndarray) -> float:
        return float(np.sqrt(np.mean((rec.command - velocity) ** 2)))

    mended = dia.simulate_without("coulomb_friction", rec)
    assert found.without == {("coulomb_friction", "motor"): error(mended.velocity)}
    assert found.now == error(ga.simulate(dia.model, rec, dia.controller))
    tuned = ga.retune(dia, filters=False, most_times=POLICY.raised)
    assert found.retuned == error(ga.simulate(dia.model, rec, tuned.controller))


def test_the_feedforward_has_the_following_error_before_and_after(dia: ga.Diagnosis, fast: None) -> None:
    text, found = chapter(dia), ga.feedforward(dia).following
    assert found is not None and "Feedforward" in text and "as it is, simulated" in text
    part = text[text.rindex("Feedforward") : text.rindex("If mended")]
    for loop in (found.before, found.after):
        assert f"{loop.rms:.4g}" in part and f"{loop.largest:.4g}" in part
    assert "the model that the tables are made of" in part
    assert "following-error" in charts_of(report_page(dia))["charts"]
    unlike = replace(dia, loop_follows=False)
    assert "What the tables bring is not simulated: the logged torque does not follow" in chapter(unlike)
    assert "following-error" not in charts_of(report_page(unlike))["charts"]


def test_the_first_line_says_that_a_model_is_contradicted(dia: ga.Diagnosis, fast: None) -> None:
    text = chapter(replace(dia, verdict="partly explained", driver="velocity"))
    begin = text.removeprefix("What to do").strip()
    assert begin.startswith("The data contradict this model") and begin.index("Do not act") < begin.index("Other gains")
    assert "Do not act" not in chapter(dia)


def test_what_is_not_there_has_its_reason(dia: ga.Diagnosis, fast: None) -> None:
    paper = remedies(replace(dia, controller=replace(CONTROLLER, loop="continuous")))
    assert paper.retuning is None and "continuous loop" in paper.no_gains and paper.tables is not None
    alone = remedies(replace(dia, controller=None))
    assert "no controller" in alone.no_gains and "no loop" in alone.no_mended and alone.tables is not None
    other = remedies(replace(dia, loop_follows=False))
    assert other.mended is None and "is not the drive's" in other.no_mended and len(other.doubts) == 1
    linear = remedies(replace(dia, model=dia.model.mechanism))
    assert linear.mended is None and "no effect that a repair" in linear.no_mended
    backwards = remedies(replace(dia, model=replace(dia.model, gain=-dia.model.gain)))
    assert backwards.retuning is None and backwards.tables is None and "runs away" in backwards.no_mended
    text = chapter(replace(dia, controller=None))
    assert "No gains are proposed: " in text and "What a repair brings is not shown: " in text
    assert remedies_of(dia, ()) is None


def test_under_a_position_controller_the_position_follows(dia: ga.Diagnosis, no_gains: None) -> None:
    loop = ga.Cascade(CONTROLLER, position=ga.P(5.0))
    rec = drive_record()
    assert rec.command is not None
    path = rec.dt * np.cumsum(rec.command)
    placed = ga.Record(rec.dt, position_command=path, velocity=rec.velocity, torque=rec.torque, name="path")
    found = remedies(replace(dia, controller=loop, records=(placed,)))
    assert found.mended is not None and found.mended.unit == "rad" and found.mended.retuned is None
    run = dia.simulate_without("coulomb_friction", placed) if dia.controller is loop else ga.run(dia.model, placed, loop)
    assert found.mended.now == float(np.sqrt(np.mean((path - run.position) ** 2)))
    assert found.no_gains == "not here"
    lost = remedies(replace(dia, controller=loop, records=(rec,)))
    assert lost.mended is None and "no command that the loop follows" in lost.no_mended


def test_a_cause_that_hides_or_cannot_be_taken_out_is_a_row_all_the_same() -> None:
    without = {("coulomb_friction", ""): float("inf"), ("cogging", ""): 0.1001, ("load_torque", ""): 0.05}
    text = str(_table_of(Mended("run", "rad/s", 0.1, None, without), "rotary", {}))
    assert "A cause with 0 % does not show in it" in text and "without coulomb friction" in text
    seen = str(_table_of(Mended("run", "rad/s", 0.1, None, {("load_torque", ""): 0.05}), "rotary", {}))
    assert "does not show in it" not in seen


def test_the_chapter_can_be_left_out(dia: ga.Diagnosis, no_gains: None) -> None:
    page = report_page(dia, remedies=False)
    assert "What to do" not in page and "What could not be tested" in page
    with pytest.raises(ga.GaidentError, match="remedies"):
        report_page(dia, remedies="no")  # type: ignore[arg-type]


def test_gains_and_feedforward_stand_in_the_units_of_the_drive_too(dia: ga.Diagnosis, fast: None) -> None:
    found = remedies(dia)
    assert found.retuning is not None and found.tables is not None
    text = Reader(report_page(dia, units={"velocity": "rpm", "torque": "mN m"})).text
    to_do = text[text.rindex("What to do") : text.rindex("What could not be tested")]
    per_rpm = 1e3 * 2.0 * np.pi / 60.0
    assert f"{found.retuning.given.gains.kp * per_rpm:.4g} mN m/rpm" in to_do
    assert f"{found.tables.viscous * per_rpm:.4g} mN m/rpm" in to_do and "speed [rpm]" in to_do
