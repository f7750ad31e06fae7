"""Results in the units that a user works with: tables beside SI, axes of pictures and of the page, JSON; whose page it is."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.axis import say
from gaident.cli import main
from gaident.errors import GaidentError, ReadError, SettingsError
from gaident.results.estimate import of_axis
from gaident.results.json_text import on_axis
from gaident.show.chart import Band, Chart, Mark, Panel, Trace
from gaident.show.diagnosis_summary import parameter_row
from gaident.show.units import beside, in_units, scales_of, shown_in, with_column
from page import unpacked

RPM = 60.0 / math.tau
UNITS = {"velocity": "rpm", "torque": "%", "position": "deg", "rated_torque": 2.4}
DRIVE = """rated_torque = 2.4
[columns]
velocity = "w"
torque = "u"
[show]
velocity = "rpm"
torque = "%"
[report]
date = "2026-11-22"
customer = "Miller & Co"
text = "after the repair"
"""


def test_a_table_has_the_users_unit_as_its_last_column() -> None:
    rows = [("", "rms [N m]"), ("linear", "0.1"), ("none", "diverges")]
    assert with_column(rows, "rms", (0.1, None), "N m", {"N m": ("%", 50.0)}) == [
        ("", "rms [N m]", "rms [%]"),
        ("linear", "0.1", "5"),
        ("none", "diverges", ""),
    ]
    assert with_column(rows, "rms", (0.1, None), "N m", {}) == rows


@pytest.fixture(scope="module")
def record() -> ga.Record:
    """Driven in open loop, with 0.3 N m of dry friction."""
    torque = np.repeat([0.8, -0.9, 0.5, -0.6, 1.0, -0.4], 100)
    noise = 0.005 * np.random.default_rng(1).standard_normal(600)
    drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("coulomb_friction", torque=0.3)
    still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    return ga.Record(1e-3, torque=torque, velocity=ga.simulate(drive, still) + noise, name="run1")


@pytest.fixture(scope="module")
def diagnosis(record: ga.Record) -> ga.Diagnosis:
    return ga.diagnose(record)


def test_the_units_and_what_they_need() -> None:
    scales = scales_of(UNITS, "rotary")
    assert scales == {
        "rad/s": ("rpm", pytest.approx(RPM)),
        "N m": ("%", pytest.approx(100 / 2.4)),
        "rad": ("deg", pytest.approx(180 / np.pi)),
        "N m s/rad": ("%/rpm", pytest.approx(100 / 2.4 / RPM)),
        "N m/rad": ("%/deg", pytest.approx(100 / 2.4 * np.pi / 180)),
    }
    of_force = scales_of({"velocity": "mm/s", "torque": "kN"}, "linear")
    assert of_force == {"m/s": ("mm/s", 1e3), "N": ("kN", 1e-3), "N s/m": ("kN/(mm/s)", 1e-6), "N/m": ("kN/m", 1e-3)}
    of_screw = scales_of({"velocity": "mm/s", "position": "mm", "screw": 0.01}, "rotary")
    assert of_screw == {"rad/s": ("mm/s", pytest.approx(10.0 / math.tau)), "rad": ("mm", pytest.approx(10.0 / math.tau))}
    with pytest.raises(SettingsError, match="'mm/s', which no rotary axis"):
        scales_of({"velocity": "mm/s"}, "rotary")
    assert scales_of(None, "rotary") == {} and scales_of({"velocity": "rad/s"}, "rotary") == {}
    with pytest.raises(ReadError, match="needs a constant of the drive; give rated_torque"):
        scales_of({"torque": "%"}, "rotary")
    with pytest.raises(SettingsError, match="units: the quantity is 'speed'"):
        scales_of({"speed": "rpm"}, "rotary")
    with pytest.raises(ReadError, match=r"'rmp' is no unit of velocity .did you mean 'rpm'"):
        scales_of({"velocity": "rmp"}, "rotary")


def test_a_unit_of_the_other_kind_of_axis_is_refused() -> None:
    for axis, wrong, listed in (
        ("linear", {"velocity": "rpm"}, "m/s, mm/s"),
        ("rotary", {"velocity": "mm/s"}, "rad/s, rpm"),
        ("linear", {"position": "deg"}, "m, mm, um"),
        ("rotary", {"torque": "kN", "rated_torque": 2.4}, "N m, mN m"),
    ):
        quantity = next(iter(wrong))
        with pytest.raises(SettingsError, match=f"{quantity} is .*, which no {axis} axis is measured in: give one of {listed}"):
            scales_of(wrong, axis)
    assert scales_of({"torque": "%", "rated_torque": 200.0}, "linear")["N"] == ("%", pytest.approx(0.5))


def test_numbers_of_a_linear_axis_bear_its_units(diagnosis: ga.Diagnosis) -> None:
    order = ga.Estimate(200.0 * math.pi, 0.02 * math.pi, "1/turn", at_bound=True)
    assert of_axis("order", order, "linear") == ga.Estimate(pytest.approx(100.0), pytest.approx(0.01), "1/m", at_bound=True)
    assert of_axis("order", order, "rotary") == order
    assert of_axis("frequency", ga.Estimate(9.0, 1.0, "rad/s"), "linear").unit == "rad/s"  # turns no axis
    assert parameter_row("order", order, "linear", {})[1:] == ("100.000 +- 0.010", "1/m", "", "every 10 mm, at a bound")
    cogging = ga.Finding("cogging", {"order": order}, evidence=say("{Torque} ripple, {:g} {N m}", 0.3))
    model = diagnosis.model.with_effect("cogging", amplitude=0.3, order=200.0 * math.pi, phase=0.1)
    dia = replace(diagnosis, axis="linear", findings=(cogging,), notes=(say("a {torque}"),), model=model)
    data = on_axis(dia.to_dict(), "linear")
    assert data["findings"][0]["parameters"]["order"]["unit"] == "1/m"
    assert data["findings"][0]["parameters"]["order"]["value"] == pytest.approx(100.0)
    assert (data["findings"][0]["evidence"], data["notes"]) == ("Force ripple, 0.3 N", ["a force"])
    assert data["mechanics"]["inertia"]["unit"] == "kg" and "N m" not in json.dumps(data)
    numbers = data["identification"]["parameters"]
    assert numbers["gain"]["unit"] == "m/s^2/N" and {e["unit"] for n, e in numbers.items() if n != "gain"} == {"rad/s"}
    effect = data["model"]["effects"][-1]
    assert effect["units"] == {"amplitude": "N", "order": "1/m", "phase": "rad"}
    assert effect["parameters"]["order"] == pytest.approx(100.0)
    again = ga.Diagnosis.from_dict(data)
    assert again.findings[0].evidence == "Force ripple, 0.3 N"
    assert [e.values for e in again.model.effects] == [pytest.approx(e.values) for e in model.effects]
    assert on_axis(diagnosis.to_dict(), "rotary") == diagnosis.to_dict()
    assert shown_in(dia, {"N": ("kN", 1e-3)}, "linear")["findings"][0]["parameters"]["order"]["unit"] == "1/m"  # type: ignore[index]
    assert list(dia.to_pandas()["unit"]) == ["1/m"] and "Force ripple, 0.3 N" in dia._repr_html_()


def test_a_value_beside_its_si() -> None:
    scales = scales_of(UNITS, "rotary")
    assert beside(scales, "torque", 0.12, 0.0024, "N m") == "5.00 +- 0.10 %"
    assert beside(scales, "frequency", 100.0, 1.0, "rad/s") == ""  # an angular frequency turns no axis
    assert beside(scales, "time_constant", 1.0, 0.1, "s") == "" and beside({}, "torque", 1.0, 0.1, "N m") == ""


def test_a_chart_in_units() -> None:
    x, y = np.array([1.0, 2.0]), np.array([0.3, -0.3])
    panel = Panel(
        "missing torque [N m]",
        (Trace(x, y, "", "ink", spread=0.1 * x),),
        (Band(-0.1, 0.1, "noise"),),
        (Mark(1.0, "a", 0.3),),
        limits=(-1.0, 1.0),
    )
    density = Panel("error [rad/s/√Hz]", (Trace(x, y, "", "ink"),), log=True)
    chart = in_units(Chart("key", "velocity [rad/s]", (panel, density), ""), scales_of(UNITS, "rotary"))
    assert (chart.x, chart.panels[0].y, chart.panels[1].y) == ("velocity [rpm]", "missing torque [%]", "error [rpm/√Hz]")
    shown = chart.panels[0]
    np.testing.assert_allclose(shown.traces[0].x, RPM * x)
    np.testing.assert_allclose(shown.traces[0].y, y / 0.024)
    assert shown.limits == pytest.approx((-100 / 2.4, 100 / 2.4)) and shown.bands[0].high == pytest.approx(0.1 / 0.024)
    assert (shown.marks[0].x, shown.marks[0].y) == pytest.approx((RPM, 12.5))


def test_a_summary_has_both(diagnosis: ga.Diagnosis) -> None:
    text = diagnosis.summary(units=UNITS)
    row = next(line for line in text.splitlines() if line.startswith("    torque "))
    assert "N m" in row and " %" in row and "rmse [rad/s]" in text and "rmse [rpm]" in text
    assert "rpm" not in diagnosis.summary()
    assert " rpm" in diagnosis.identification.summary(units={"velocity": "rpm"})


@pytest.mark.long
def test_the_page_says_whose_it_is_and_draws_in_units(record: ga.Record, diagnosis: ga.Diagnosis, tmp_path: Path) -> None:
    about = {"date": "2026-11-22", "customer": "Miller & Co", "text": "after <the> repair"}
    ga.report(diagnosis, tmp_path / "page.html", record, units=UNITS, about=about)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    page = unpacked(page)
    assert "&amp;times;" not in page and "&times;10<sup>&minus;3</sup> rad/s" in page  # in a tile: a small number beside rpm
    assert "velocity [rpm]" in page and "missing torque [%]" in page and "missing torque [N m]" not in page
    assert "Miller &amp; Co" in page and "after &lt;the&gt; repair" in page and "2026-11-22" in page
    assert "The model lacks coulomb friction (0.3 N m)" in page
    with pytest.raises(GaidentError, match="about: date is 2026: give text"):
        ga.report(diagnosis, tmp_path / "page.html", record, about={"date": 2026})  # type: ignore[dict-item]


@pytest.mark.long
def test_the_drive_file_says_the_units(
    record: ga.Record, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = np.column_stack([record.time, record.velocity, record.torque])
    np.savetxt("run.csv", rows, delimiter=",", header="time,w,u", comments="", fmt="%.9g")
    Path("drive.toml").write_text(DRIVE)
    command = ["diagnose", "run.csv", "--drive", "drive.toml"]
    assert main([*command, "--json", "--report", "page.html", "--plot", "picture.svg", "--out", "run.json"]) == 0
    data = json.loads(capsys.readouterr().out)
    shown = data["shown"]
    assert shown["units"]["rad/s"] == {"unit": "rpm", "per_si": pytest.approx(RPM)}
    assert shown["after"]["rmse"] == pytest.approx(RPM * data["after"]["rmse"]) and shown["after"]["unit"] == "rpm"
    (found,) = shown["findings"]
    torque = found["parameters"]["torque"]
    assert torque["unit"] == "%" and torque["value"] == pytest.approx(12.5, rel=0.02)
    assert data["findings"][0]["parameters"]["torque"]["value"] == pytest.approx(0.3, rel=0.02)
    assert "shown" not in json.loads(Path("run.json").read_text())
    assert "Miller" in Path("page.html").read_text(encoding="utf-8") and Path("picture.svg").stat().st_size > 10_000
    assert main(["report", "run.json", "run.csv", "--drive", "drive.toml", "--out", "again.html", "--pictures"]) == 0
    again = Path("again.html").read_text(encoding="utf-8")
    assert "Miller" in again and "<script" not in again and again.count("data:image/png") > 4 and len(again) < 1e6
    Path("drive.toml").write_text(DRIVE.replace('"rpm"', '"rmp"'))
    assert main(command) == 2
    assert "did you mean 'rpm'" in capsys.readouterr().err


def test_ticks_of_a_picture_are_round_in_units(diagnosis: ga.Diagnosis) -> None:
    from gaident.show.units import figure_in_units

    figure = figure_in_units(diagnosis.plot(), scales_of(UNITS, "rotary"))
    axis = figure.axes[0].yaxis
    assert axis.get_label_text() == "velocity [rpm]"
    ticks = np.asarray(axis.get_major_locator().tick_values(-20.0, 20.0)) * RPM  # type: ignore[attr-defined]
    assert set(np.diff(ticks).round(6)) == {50.0}
