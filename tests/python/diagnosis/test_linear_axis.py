"""A linear axis of 2 m of travel: its positions are lengths, and nothing that returns with every turn is tried or named."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.axis import said
from gaident.cli import main
from gaident.diagnosis.experiments.excitation import excitation
from gaident.errors import SettingsError
from gaident.estimation.period import period_of_place
from gaident.reporting.report import view_of
from gaident.results.json_text import on_axis

DT, N = 5e-3, 2000
LOOP = ga.PI(kp=3000.0, ki=20000.0)  # N s/m, N/m
PERIODIC = {"unbalance", "cogging", "velocity_ripple"}


def record(force_of_place: float = 0.0) -> ga.Record:
    """95 kg with 20 N of dry friction on slow strokes of 2 m, and with a force that follows sin(position + 0.3) [N]."""
    t = DT * np.arange(N)
    command = 0.85 * np.sin(2.0 * np.pi * 0.15 * t) + 0.68 * np.sin(2.0 * np.pi * 0.9 * t)
    axis = ga.OneMass(J=95.0, D=200.0).model().with_effect("coulomb_friction", torque=20.0)
    if force_of_place:
        axis = axis.with_effect("unbalance", amplitude=force_of_place, phase=0.3)
    noise = 2e-4 * np.random.default_rng(1).standard_normal(N)
    run = ga.run(axis, ga.Record(DT, command=command - noise, velocity=noise), LOOP)
    return ga.Record(DT, velocity=run.velocity + noise, torque=run.torque, position=run.position)


@pytest.fixture(scope="module")
def diagnosis() -> ga.Diagnosis:
    return ga.diagnose(record(), axis="linear")


def test_dry_friction_is_named_and_gravity_by_the_angle_is_not_tried(diagnosis: ga.Diagnosis) -> None:
    assert np.ptp(diagnosis.records[0].position) > 1.8
    (cause,) = diagnosis.causes
    assert cause.effect == "coulomb_friction" and cause.named and diagnosis.verdict == "explained"
    assert cause.parameters["torque"].value == pytest.approx(20.0, rel=0.01)
    assert diagnosis.mechanics["inertia"].value == pytest.approx(95.0, rel=0.01)
    assert set(diagnosis.not_testable) >= PERIODIC and not PERIODIC & set(diagnosis.one_sided)
    assert diagnosis.regression is not None and diagnosis.regression.axis == "linear"
    assert not any(c.name == "gravity" for c in diagnosis.comparisons) and not any(c.differs for c in diagnosis.comparisons)


def test_both_methods_are_compared_in_one_unit(diagnosis: ga.Diagnosis) -> None:
    inside, shown = (
        {c["name"]: (c["diagnosis"]["unit"], c["regression"]["unit"]) for c in data["comparisons"]}
        for data in (diagnosis.to_dict(), on_axis(diagnosis.to_dict(), "linear"))
    )
    assert inside["inertia"] == ("kg m^2", "kg m^2") and inside["dry friction"] == ("N m", "N m")
    assert shown["inertia"] == ("kg", "kg") and shown["dry friction"] == ("N", "N")


@pytest.mark.long
def test_a_force_that_follows_the_place_gets_no_name_of_a_turn() -> None:
    """The numbers are those of gravity on a rotary axis, which that of the regression finds."""
    rec = record(60.0)[:1000]
    assert "gravity" in ga.inverse_dynamics(rec).terms
    dia = ga.diagnose(rec, axis="linear")
    assert not PERIODIC & {name for f in dia.findings for name in (f.effect, *f.alternatives)}
    assert dia.verdict in ("partly explained", "unexplained") and dia.driver == "position"


def test_the_result_speaks_of_its_axis_and_keeps_it(diagnosis: ga.Diagnosis, tmp_path: Path) -> None:
    assert diagnosis.axis == "linear" and diagnosis.summary() == diagnosis.summary("linear") != diagnosis.summary("rotary")
    assert re.search(r"force +(20\.0|19\.9)\d* \+- \S+ +N\n", diagnosis.summary()) and "N m" not in diagnosis.summary()
    assert "which length is one turn" in diagnosis.summary("linear")
    diagnosis.save(tmp_path / "axis.json")
    loaded = ga.load(tmp_path / "axis.json")
    assert isinstance(loaded, ga.Diagnosis) and loaded.axis == "linear" and loaded.summary() == diagnosis.summary()
    assert view_of(loaded, None, None, None).axis == "linear" and view_of(loaded, None, None, "rotary").axis == "rotary"


def test_a_rotary_axis_is_asked_for_its_turns_as_before() -> None:
    rec = record()
    assert not PERIODIC & set(excitation(rec).not_testable)
    assert set(excitation(rec, axis="linear").not_testable) >= PERIODIC
    why = "positions are lengths on a linear axis: which length is one turn, they do not say"
    short = excitation(rec.with_channels(position=0.01 * rec.velocity), axis="linear").not_testable
    assert short["unbalance"] == why and {short[name] for name in PERIODIC} == {
        why,
        "positions are lengths on a linear axis: with which length it returns, they do not say; give its pitch",
    }


def screw(pitch: float) -> ga.Record:
    """20 kg with 15 N of dry friction, and 8 N of cogging with every pitch [m]."""
    t = 1e-3 * np.arange(4000)
    command = 0.08 * np.sin(2.0 * np.pi * 0.2 * t) + 0.05 * np.sign(np.sin(2.0 * np.pi * 0.45 * t))
    axis = ga.OneMass(J=20.0, D=100.0).model().with_effect("coulomb_friction", torque=15.0)
    axis = axis.with_effect("cogging", amplitude=8.0, order=2.0 * np.pi / pitch, phase=0.4)
    noise = 2e-4 * np.random.default_rng(1).standard_normal(len(t))
    run = ga.run(axis, ga.Record(1e-3, command=command - noise, velocity=noise), LOOP)
    return ga.Record(1e-3, command=command, velocity=run.velocity + noise, torque=run.torque, position=run.position)


@pytest.mark.long
@pytest.mark.parametrize("given", [0.024, 0.048])
def test_cogging_of_a_linear_axis_is_found_by_its_pitch(given: float) -> None:
    """By the pitch itself, and by one of which it is the second order."""
    dia = ga.diagnose(screw(0.024), LOOP, axis="linear", pitch=given)
    found = {f.effect: f for f in dia.causes}
    assert dia.verdict == "explained" and all(f.named for f in dia.causes) and set(found) == {"coulomb_friction", "cogging"}
    cogging = found["cogging"].parameters
    assert cogging["amplitude"].value == pytest.approx(8.0, rel=0.01)
    assert cogging["order"].value == pytest.approx(2.0 * np.pi / 0.024)
    assert "every 24 mm" in dia.summary() and "torque" not in dia.summary().lower()


@pytest.mark.long
def test_a_pitch_that_nobody_gave_is_seen() -> None:
    """The same screw, and one of 10.3 mm; its length is then a number of the fit."""
    for pitch in (0.024, 0.0103):
        dia = ga.diagnose(screw(pitch), LOOP, axis="linear")
        found = {f.effect: f for f in dia.causes}
        assert dia.verdict == "explained" and all(f.named for f in dia.causes) and set(found) == {"coulomb_friction", "cogging"}
        order = found["cogging"].parameters["order"]
        assert order.value == pytest.approx(2.0 * np.pi / pitch, rel=1e-3) and 0.0 < order.std < 1e-3 * order.value
        assert found["cogging"].parameters["amplitude"].value == pytest.approx(8.0, rel=0.01)
        (note,) = (n for n in dia.notes if "No pitch is given" in n)
        assert f"the force returns with every {1e3 * pitch:g} mm of the path" in said(note, "linear")


def test_no_period_is_seen_where_none_is() -> None:
    """In friction, in a force of the place that passes once, in a hum at one speed."""
    assert period_of_place([record()]) is None and period_of_place([record(60.0)]) is None
    rng, t = np.random.default_rng(2), 1e-3 * np.arange(4000)
    speed = 0.05 + 1e-4 * rng.standard_normal(len(t))
    hum = ga.Record(1e-3, velocity=speed, torque=5.0 + np.sin(2.0 * np.pi * 11.0 * t), position=np.cumsum(1e-3 * speed))
    assert period_of_place([hum]) is None
    still = ga.Record(1e-3, velocity=0.0 * t, torque=rng.standard_normal(len(t)), position=0.0 * t)
    assert period_of_place([still]) is None


def test_a_period_is_the_longest_that_its_waves_share() -> None:
    """Poles of 24 mm whose second order is the stronger one; the two records begin elsewhere."""
    t = 1e-3 * np.arange(4000)
    records = []
    for k in range(2):
        w = 0.08 * np.sin(2.0 * np.pi * (0.2 + 0.1 * k) * t) + 0.03
        x = np.cumsum(1e-3 * w) + 0.007 * k
        waves = 8.0 * np.sin(2.0 * np.pi * x / 0.012 + 1.0) + 3.0 * np.sin(2.0 * np.pi * x / 0.024)
        noise = 0.2 * np.random.default_rng(k).standard_normal(len(t))
        torque = 20.0 * np.gradient(w, 1e-3) + 100.0 * w + 15.0 * np.sign(w) + waves + noise
        records.append(ga.Record(1e-3, velocity=w, torque=torque, position=x))
    assert period_of_place(records) == pytest.approx(0.024, rel=1e-4)


def test_a_pitch_that_is_none() -> None:
    rec = record()[:400]
    for wrong in (0.0, -0.01, np.nan, True):
        with pytest.raises(SettingsError, match=r"pitch is .*: give the length in m"):
            ga.diagnose(rec, axis="linear", pitch=wrong)
    with pytest.raises(SettingsError, match=r"pitch is 0\.024, which belongs to a linear axis: .*axis='linear'"):
        ga.diagnose(rec, pitch=0.024)


def test_experiments_keep_to_the_travel_of_a_linear_axis() -> None:
    """A shaft that has gone through a turn is taken to turn freely; a carriage that has gone 6.3 m is not."""
    t = DT * np.arange(N)
    rec = ga.Record(DT, velocity=4.0 * np.cos(t), torque=np.cos(t), position=4.0 * np.sin(t))
    assert np.isinf(ga.Limits.of(rec).travel)
    limits = ga.Limits.of(rec, axis="linear")
    assert 8.0 <= limits.travel < 9.0
    first = ga.first_experiment(1e-3, ga.Limits(speed=1.0, torque=300.0, travel=2.0, duration=20.0), axis="linear")
    assert not PERIODIC & set(first.separates) and {"coulomb_friction", "load_torque"} <= set(first.separates)
    path = np.cumsum(first.command) * first.dt
    assert np.ptp(path) <= 2.0 and "does not depend on the turns of a shaft" in said(first.reason, "linear")
    rotary = ga.first_experiment(1e-3, ga.Limits(speed=1.0, torque=300.0, travel=2.0, duration=20.0))
    assert set(rotary.separates) >= PERIODIC and np.array_equal(rotary.command, first.command)


def test_the_command_line_takes_the_axis_of_the_drive_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rec = record()[:400]
    rows = np.column_stack([rec.time, rec.velocity, rec.torque, rec.position])
    np.savetxt("axis.csv", rows, delimiter=",", header="time,velocity,torque,position", comments="", fmt="%.10g")
    Path("drive.toml").write_text('axis = "linear"\n')
    assert main(["diagnose", "axis.csv", "--drive", "drive.toml", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["axis"] == "linear" and set(data["not_testable"]) >= PERIODIC
    assert main(["diagnose", "axis.csv", "--drive", "drive.toml", "--pitch", "500 mm", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["not_testable"]) & PERIODIC == {"unbalance"}
    assert main(["diagnose", "axis.csv", "--drive", "drive.toml", "--pitch", "ten"]) == 2
    assert "argument --pitch: 'ten' is no number" in capsys.readouterr().err
    for wrong in ("24 parsec", "24 deg", "1 turn"):
        Path("drive.toml").write_text(f'axis = "linear"\npitch = "{wrong}"\n')
        assert main(["diagnose", "axis.csv", "--drive", "drive.toml"]) == 2
        assert f"pitch is '{wrong}': give a length in m" in capsys.readouterr().err
    limits = "[limits]\nspeed = 1.0\ntorque = 300.0\ntravel = 2.0\nduration = 20.0\n"
    Path("drive.toml").write_text('axis = "linear"\ndt = 1e-3\n' + limits)
    assert main(["experiment", "--drive", "drive.toml", "--json"]) == 0
    assert not PERIODIC & set(json.loads(capsys.readouterr().out)["separates"])


def test_another_axis_is_refused() -> None:
    rec = record()
    for call in (lambda: ga.diagnose(rec, axis="skew"), lambda: ga.Limits.of(rec, axis="skew"),
                 lambda: ga.first_experiment(1e-3, ga.Limits(speed=1.0, torque=300.0, duration=20.0), axis="skew")):  # fmt: skip
        with pytest.raises(SettingsError, match="axis is 'skew': it must be one of 'rotary', 'linear'"):
            call()
