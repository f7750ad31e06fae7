"""Diagnoses with a sensor at the load: what the motor alone does not tell is named, and what it tells stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import gaident as ga
from drive_rig import LoadSensor, Noise, Plant, rig, skip_without_library

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
    rec = rig(BASE, COMMAND, {"coulomb_friction": {"torque": 0.1}}, seed=3, load_sensor=POSITION, position_logged=True)
    assert rec.load_position is not None
    turned = (rec.load_position - 2.0) / 0.1
    rec = rec.with_channels(load_position=rec.load_position + 0.1 * 0.02 * np.sin(turned))
    dia = ga.diagnose(rec, BASE.controller)
    assert [(f.effect, f.sides) for f in dia.findings if f.effect == "coulomb_friction"] == [("coulomb_friction", ("motor",))]
    assert dia.verdict == "partly explained", dia.summary()
    assert any("load position is not explained" in note for note in dia.notes)


@pytest.mark.long
def test_a_late_sensor_is_no_fault_of_the_motor() -> None:
    """The load's channel ten lines late: the model of the motor stands, and no signal of the motor is blamed."""
    rec = log(BASE, {}, VELOCITY)
    late = np.concatenate([np.full(10, rec.load_velocity[0]), rec.load_velocity[:-10]])  # type: ignore[index]
    dia = ga.diagnose(rec.with_channels(load_velocity=late), BASE.controller)
    assert not dia.findings and dia.driver is None and dia.verdict == "unexplained", dia.summary()
    assert any("load velocity is not explained" in note and "late" in note for note in dia.notes)
    assert dia.mechanics["inertia"].value == pytest.approx(BASE.J + BASE.JL, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("at", ["motor", "load"])
def test_coloured_noise_of_either_sensor_is_noise(at: str) -> None:
    rec = log(BASE, {}, POSITION)
    colour = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], np.random.default_rng(5).standard_normal(len(rec)))
    if at == "motor":
        rec = rec.with_channels(velocity=rec.velocity + 0.1 * colour)
    else:
        rec = rec.with_channels(load_position=rec.load_position + 2e-4 * colour)  # type: ignore[operator]
    dia = ga.diagnose(rec, BASE.controller)
    assert dia.verdict == "adequate" and not dia.findings, dia.summary()


@pytest.mark.long
def test_noise_of_a_measured_torque_is_no_motion_of_the_load() -> None:
    rec = rig(BASE, COMMAND, {"coulomb_friction@load": {"torque": 0.1}}, seed=3, load_sensor=POSITION, position_logged=True)
    assert rec.torque is not None
    noise = 0.05 * float(np.sqrt(np.mean(rec.torque**2))) * np.random.default_rng(1).standard_normal(len(rec))
    dia = ga.diagnose(rec.with_channels(command=None, torque=rec.torque + noise, torque_is="measured"), None)
    assert {f.effect for f in dia.findings if f.named} == {"coulomb_friction"}, dia.summary()
    assert any("load position is explained" in note for note in dia.notes), dia.notes


@pytest.mark.long
def test_outliers_of_the_load_s_sensor_are_left_out() -> None:
    rec = log(BASE, {"coulomb_friction@load": {"torque": 0.1}}, POSITION)
    spoiled = rec.load_position.copy()  # type: ignore[union-attr]
    spoiled[[700, 1900]] += [0.5, -0.8]
    dia = ga.diagnose(rec.with_channels(load_position=spoiled), BASE.controller)
    (found,) = dia.findings
    assert dia.verdict == "explained" and found.sides == ("load",), dia.summary()
    assert dia.load_sensor["scale"].value == pytest.approx(0.1, abs=4.0 * dia.load_sensor["scale"].std)


@pytest.mark.long
def test_one_mass_becomes_two_where_the_load_shows_it() -> None:
    """So much noise at the motor that its signals show one mass; the load's sensor shows the shaft."""
    plant = replace(BASE, J=3e-3, JL=2e-4, KG=50.0, DG=0.02)
    noisy = Noise(white=0.5)
    rec = rig(plant, COMMAND, {}, noise=noisy, seed=3, load_sensor=replace(POSITION, noise=1e-5), position_logged=True)
    alone, dia = (ga.diagnose(r, plant.controller) for r in (without_sensor(rec), rec))
    assert "stiffness" not in alone.mechanics
    assert dia.mechanics["stiffness"].value == pytest.approx(plant.KG, rel=0.02), dia.summary()


@pytest.mark.long
def test_a_channel_that_one_record_lacks_does_not_count_and_a_bootstrap_is_of_the_motor() -> None:
    rec = log(BASE, {"coulomb_friction": {"torque": 0.1}}, VELOCITY)
    dia = ga.diagnose([rec, without_sensor(log(BASE, {"coulomb_friction": {"torque": 0.1}}, VELOCITY))], BASE.controller)
    assert dia.load_sensor == {} and any("load velocity does not count" in note for note in dia.notes)
    drawn = ga.diagnose(rec, BASE.controller, bootstrap=2)
    assert any("no p-value" in note for note in drawn.notes) and drawn.findings[0].p_value is None


@pytest.mark.long
def test_results_are_saved_with_the_sensor(tmp_path) -> None:  # type: ignore[no-untyped-def]
    dia = ga.diagnose(log(BASE, {}, VELOCITY), BASE.controller)
    path = tmp_path / "dia.json"
    dia.save(path)
    again = ga.load(path)
    assert isinstance(again, ga.Diagnosis) and again.load_sensor == dia.load_sensor
    assert "Load sensor" in dia.summary()
