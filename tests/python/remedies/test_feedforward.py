"""feedforward(): the tables are what brakes the drive, and with them the loop follows better."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.results.json_text import json_text

T = 1e-3
GIVEN = ga.PI(0.03, 1.0)
DRIVE = ga.OneMass(J=4e-4, D=2e-3).model()
HIDDEN = DRIVE.with_effect("coulomb_friction", torque=0.06).with_effect("cogging", amplitude=0.04, order=6.0, phase=0.7)


@pytest.fixture(scope="module")
def rec() -> ga.Record:
    rng = np.random.default_rng(2)
    command = np.repeat([20.0, -30.0, 5.0, -3.0, 12.0, -8.0, 2.0], 120)
    v = 0.05 * rng.standard_normal(len(command))
    run = ga.run(HIDDEN, ga.Record(T, command=command - v, velocity=v), GIVEN)
    return ga.Record(T, command=command, velocity=run.velocity + v, torque=run.torque, position=run.position)


@pytest.fixture(scope="module")
def found(rec: ga.Record) -> ga.Diagnosis:
    return ga.diagnose(rec, GIVEN, seed=1)


@pytest.fixture(scope="module")
def tables(found: ga.Diagnosis) -> ga.FeedforwardTables:
    return ga.feedforward(found)


def test_the_tables_are_what_brakes_the_drive(tables: ga.FeedforwardTables) -> None:
    w = np.array([-25.0, -1.0, 1.0, 25.0])
    expected = 0.06 * np.sign(w) + 2e-3 * w + 0.04 * np.sin(6.0 * 0.3 + 0.7)
    assert np.allclose(tables.torque(w, 0.3), expected, atol=4e-3)
    assert tables.torque(0.0, 0.0, 100.0) == pytest.approx(0.04 + 0.04 * np.sin(0.7), rel=0.03)
    (wave,) = tables.waves
    assert wave.order == 6.0 and np.hypot(wave.sine, wave.cosine) == pytest.approx(0.04, rel=0.05)
    assert len(tables.velocity) == 64 and np.all(np.diff(tables.velocity) > 0.0) and len(tables.angle) == 360
    assert np.allclose(tables.by_angle, tables.torque(0.0, tables.angle) - tables.constant)
    assert not tables.doubts and not tables.notes


def test_with_the_tables_the_loop_follows_better(tables: ga.FeedforwardTables) -> None:
    """The true drive under a new command, with the torque of the tables added for the commanded motion."""
    command = np.concatenate(
        [np.linspace(0.0, 15.0, 200), np.full(200, 15.0), np.linspace(15.0, -15.0, 400), np.full(200, -15.0)]
    )
    slope = np.gradient(command, T)
    still = ga.Record(T, command=command, velocity=np.zeros(len(command)))

    def beforehand(signals: ga.effects.Signals, share: float) -> np.ndarray:
        n = min(int(signals.time / T), len(command) - 1)
        return share * tables.torque(command[n], signals.angle, slope[n])

    parameter = ga.effects.Parameter("share", "1", neutral=0.0, lowest=0.0, highest=1.0)
    ga.effects.register("beforehand", [parameter], meaning="torque of the tables", torque=beforehand)
    try:
        errors = []
        for share in (0.0, 1.0):
            run = ga.run(HIDDEN.with_effect("beforehand", share=share), still, GIVEN)
            errors.append(float(np.sqrt(np.mean((run.velocity - command) ** 2))))
    finally:
        ga.effects.unregister("beforehand")
    assert errors[1] < 0.25 * errors[0], errors


def test_the_curve_of_each_effect_counts_and_what_has_none_is_said(found: ga.Diagnosis) -> None:
    friction = {"torque": 0.05, "static_torque": 0.09, "stribeck_velocity": 1.0}
    model = DRIVE.with_effect("stribeck_friction", **friction).with_effect("load_torque", torque=0.02)
    model = model.with_effect("unbalance", amplitude=0.1, phase=-0.5).with_effect("torque_lag", time_constant=1e-3)
    tables = ga.feedforward(replace(found, model=model), speed=50.0, points=200)
    hump = 0.05 + 0.04 * np.exp(-(tables.velocity**2))
    assert np.allclose(tables.friction, np.sign(tables.velocity) * hump) and tables.constant == 0.02
    assert tables.waves[0].order == 1.0 and np.allclose(tables.by_angle, 0.1 * np.sin(tables.angle - 0.5))
    two = ga.TwoMass(JM=2e-4, DM=1e-3, JL=4e-4, DL=1e-3, KG=40.0).model().with_effect("coulomb_friction", side="load", torque=0.1)
    at_load = ga.feedforward(replace(found, model=two), speed=50.0)
    assert at_load.friction[-1] == pytest.approx(0.1) and at_load.inertia == pytest.approx(6e-4, rel=0.02)
    uneven = {"torque": 0.05, "amplitude": 0.5, "order": 2.0, "phase": 0.0}
    said = ga.feedforward(
        replace(found, model=DRIVE.with_effect("position_friction", **uneven), verdict="unexplained"), speed=9.0
    )
    assert "changes with the angle" in said.notes[0] and said.summary().startswith("Warning: The data contradict this model")
    assert "changes with the position" in said.summary(axis="linear") and "N m" not in said.summary(axis="linear")


def test_a_cause_that_is_not_told_from_another_is_said_to_be_taken_for_granted(found: ga.Diagnosis) -> None:
    finding = ga.Finding("load_torque", {}, alternatives=("asymmetric_friction",), gain=0.5)
    model = DRIVE.with_effect("coulomb_friction", torque=0.05).with_effect("load_torque", torque=0.02)
    tables = ga.feedforward(replace(found, model=model, findings=(*found.findings, finding)), speed=9.0)
    text = "The tables take {} for granted: these data do not tell it from asymmetric friction."
    assert text.format("load torque") in tables.notes and text.format("load force") in tables.summary(axis="linear")
    assert not any("for granted" in note for note in ga.feedforward(found, speed=9.0).notes)


@pytest.mark.parametrize("turning", [True, False])
def test_the_c_file_says_the_same(tables: ga.FeedforwardTables, turning: bool, tmp_path: Path) -> None:
    tables = tables if turning else replace(tables, waves=())
    compiler = shutil.which("gcc") or shutil.which("cc") or shutil.which("g++")
    if compiler is None:
        pytest.skip("no C compiler on the path")
    text = tables.to_c(tmp_path / "axis 1.c")
    assert text == (tmp_path / "axis 1.c").read_text() and "double axis_1(double velocity" in text
    made = tmp_path / "axis.so"
    flags = ["-Wall", "-Wextra", "-Wtype-limits", "-Werror", "-O1", "-shared", "-fPIC"]
    subprocess.run([compiler, "-x", "c", "-std=c99", *flags, str(tmp_path / "axis 1.c"), "-o", str(made), "-lm"], check=True)
    function = ctypes.CDLL(str(made)).axis_1
    function.argtypes, function.restype = [ctypes.c_double] * 3, ctypes.c_double
    for w, x, a in (
        (-200.0, 0.1, 3.0),
        (-4.2, 1.0, 0.0),
        (0.0, 2.0, 0.0),
        (1e-3, 2.0, -50.0),
        (7.7, -3.0, 1.0),
        (300.0, 0.0, 0.0),
    ):
        assert function(w, x, a) == pytest.approx(float(tables.torque(w, x, a)), abs=1e-12)


def test_csv_and_json(tables: ga.FeedforwardTables, tmp_path: Path) -> None:
    tables.to_csv(tmp_path / "axis.csv")
    rows = [line.split(",") for line in (tmp_path / "axis.csv").read_text().splitlines()]
    assert rows[0] == ["table", "at", "value", "unit"] and len(rows) == 1 + 3 + 64 + 360 + 2
    friction = np.array([[float(r[1]), float(r[2])] for r in rows if r[0] == "friction"])
    assert np.array_equal(friction, np.column_stack([tables.velocity, tables.friction]))
    data = json.loads(json_text(tables.to_dict()))
    assert data["waves"][0]["effect"] == "cogging" and len(data["by_angle"]) == 360
    text = tables.summary()
    assert "kg m^2" in text and "sine [N m]" in text and "cogging" in text


def test_wrong_use_is_told(found: ga.Diagnosis, tmp_path: Path) -> None:
    with pytest.raises(ga.GaidentError, match="points is 1: give a whole number from 2 to 10000"):
        ga.feedforward(found, points=1)
    with pytest.raises(ga.GaidentError, match="speed is -1"):
        ga.feedforward(found, speed=-1.0)
    with pytest.raises(ga.GaidentError, match="result is Identification"):
        ga.feedforward(found.identification)  # type: ignore[arg-type]
    found.save(tmp_path / "found.json")
    with pytest.raises(ga.GaidentError, match="give speed="):
        ga.feedforward(ga.load(tmp_path / "found.json"))  # type: ignore[arg-type]
