"""Diagnoses with a sensor at the load: what the motor alone does not tell is named, and what it tells stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_rig import LoadSensor, Plant, rig, skip_without_library

skip_without_library()

BASE = Plant(J=1e-3, D=1e-3, JL=2e-3, DL=1e-3, KG=80.0, DG=0.02, kp=0.05, ki=1.0, dt=1e-3)
LIGHT = replace(BASE, J=3e-3, JL=2e-4, KG=50.0, DG=0.02)
COMMAND = np.repeat([0.0, 20.0, -20.0, 50.0, -30.0, 5.0, -5.0, 0.0, 15.0, -40.0], 350)
POSITION = LoadSensor("load_position", 1e-4, scale=0.1, offset=2.0)
VELOCITY = LoadSensor("load_velocity", 0.05, scale=-0.5)


def log(plant: Plant, effects: dict[str, dict[str, float]], sensor: LoadSensor) -> ga.Record:
    return rig(plant, COMMAND, effects, seed=3, load_sensor=sensor)


def without_sensor(rec: ga.Record) -> ga.Record:
    return rec.with_channels(load_position=None, load_velocity=None)


@pytest.mark.long
def test_a_gap_that_the_motor_does_not_show_is_named_by_the_load() -> None:
    rec = log(LIGHT, {"backlash": {"gap": 0.002}}, replace(POSITION, noise=2e-5))
    alone, dia = (ga.diagnose(r, LIGHT.controller) for r in (without_sensor(rec), rec))
    assert "backlash" not in [f.effect for f in alone.findings]
    (found,) = dia.findings
    assert dia.verdict == "explained" and found.effect == "backlash" and found.named, dia.summary()
    gap = found.parameters["gap"]
    assert gap.value == pytest.approx(0.002, rel=0.05)


@pytest.mark.long
@pytest.mark.parametrize("sensor", [POSITION, VELOCITY], ids=["position", "velocity"])
def test_friction_keeps_its_end_and_the_sensor_its_scale(sensor: LoadSensor) -> None:
    rec = log(BASE, {"coulomb_friction@load": {"torque": 0.1}}, sensor)
    dia = ga.diagnose(rec, BASE.controller)
    (found,) = dia.findings
    assert dia.verdict == "explained" and found.named and found.sides == ("load",), dia.summary()
    torque = found.parameters["torque"]
    assert torque.value == pytest.approx(0.1, abs=4.0 * torque.std)
    scale, offset = dia.load_sensor["scale"], dia.load_sensor["offset"]
    assert scale.value == pytest.approx(sensor.scale, abs=4.0 * scale.std)
    assert offset.value == pytest.approx(sensor.offset, abs=4.0 * offset.std + 1e-3)
    assert any("explained to its noise" in note for note in dia.notes)


@pytest.mark.long
def test_clean_records_stay_adequate() -> None:
    """Beside a logged angle of the motor the load's, with a noise of its own, also tells the stiffness closer."""
    rec = rig(BASE, COMMAND, {}, seed=3, load_sensor=replace(POSITION, noise=2e-5), position_logged=True)
    dia = ga.diagnose(rec, BASE.controller)
    assert dia.verdict == "adequate" and not dia.findings, dia.summary()
    stiffness = dia.mechanics["stiffness"]
    alone = ga.diagnose(without_sensor(rec), BASE.controller)
    assert alone.load_sensor == {} and dia.load_sensor
    assert stiffness.value == pytest.approx(BASE.KG, abs=4.0 * stiffness.std)
    assert stiffness.std < alone.mechanics["stiffness"].std


@pytest.mark.long
def test_a_sensor_that_no_model_explains_is_said_and_changes_no_name() -> None:
    """A load encoder with an eccentric disc: 0.02 rad once per turn, which is no motion of the load."""
    rec = log(BASE, {"coulomb_friction": {"torque": 0.1}}, POSITION)
    assert rec.load_position is not None
    turned = (rec.load_position - 2.0) / 0.1
    rec = rec.with_channels(load_position=rec.load_position + 0.1 * 0.02 * np.sin(turned))
    dia = ga.diagnose(rec, BASE.controller)
    assert [(f.effect, f.sides) for f in dia.findings if f.effect == "coulomb_friction"] == [("coulomb_friction", ("motor",))]
    assert dia.verdict == "partly explained", dia.summary()
    assert any("load position is not explained" in note for note in dia.notes)


@pytest.mark.long
def test_results_are_saved_with_the_sensor(tmp_path) -> None:  # type: ignore[no-untyped-def]
    dia = ga.diagnose(log(BASE, {}, VELOCITY), BASE.controller)
    path = tmp_path / "dia.json"
    dia.save(path)
    again = ga.load(path)
    assert isinstance(again, ga.Diagnosis) and again.load_sensor == dia.load_sensor
    assert "Load sensor" in dia.summary()
