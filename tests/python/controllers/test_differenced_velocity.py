"""A loop whose drive takes the difference of its encoder's angle for the velocity: simulated with the mean over each sample.

The referee is the drive of tests/cpp/drive_rig.cpp, with an encoder that is far finer than any.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_servo import CASES, KI, KP, T

import gaident as ga
from drive_rig import Array, Noise, Plant, rig, run_drive, skip_without_library
from gaident.control.differencing import differencing
from gaident.diagnosis.gains import closed_over
from gaident.identification.replay.replay import replay

skip_without_library()

EVERY = 4
DRIVE = Plant(J=4e-4, D=0.004, JL=3e-4, DL=0.006, KG=1500.0, DG=0.02, kp=KP, ki=KI, dt=EVERY * T)  # resonance at 470 Hz
LOOPS: dict[str, dict[str, Any]] = {
    "bare": {},
    "IP": {"velocity": {"command_weight": 0.0}},
    "limit": {"velocity": {"torque_limit": 0.6, "anti_windup": "hold"}},
    "low pass": {"torque_filters": ga.LowPass(time_constant=0.4e-3)},
    "delay": {"delay": 0.5 * T},
    "position": {"position": ga.P(30.0), "position_period": 2 * T},
}


def drive(loop: str) -> tuple[Plant, ga.Cascade, ga.Model]:
    given = dict(LOOPS[loop])
    cascade = ga.Cascade(ga.PI(KP, KI, **given.pop("velocity", {})), period=T, **given)
    model = ga.TwoMass(JM=DRIVE.J, DM=DRIVE.D, JL=DRIVE.JL, DL=DRIVE.DL, KG=DRIVE.KG, DG=DRIVE.DG).model()
    return replace(DRIVE, cascade=cascade), cascade, model


def command(placed: bool) -> Array:
    n = np.arange(600)
    if placed:
        return np.asarray(3.0 * (1.0 - np.cos(2 * np.pi * n / 600)))
    return np.where(n < 50, 0.0, np.where(n < 300, 20.0, -15.0))


@pytest.mark.parametrize("lag", [0.0, 0.2e-3])
@pytest.mark.parametrize("loop", LOOPS)
def test_the_loop_shows_the_mean_over_each_sample(loop: str, lag: float) -> None:
    plant, cascade, model = drive(loop)
    effects = {"torque_lag": {"time_constant": lag}} if lag else {}
    model = model.with_effect("torque_lag", time_constant=lag) if lag else model
    log = rig(plant, command(plant.placed), effects, Noise(white=0.0, encoder=1e-13, differenced=True))
    by_mean = ga.simulate(model, log, differencing(cascade)) - log.velocity
    by_delay = ga.simulate(model, log, replace(cascade, delay=cascade.delay + 0.5 * T)) - log.velocity
    size = np.abs(log.velocity).max()
    assert np.abs(by_mean).max() < 2e-5 * size
    assert np.abs(by_mean).max() < 0.1 * np.abs(by_delay).max()


WITH: dict[str, tuple[dict[str, dict[str, float]], float]] = {
    "filter": ({"velocity_filter": {"time_constant": 0.3e-3}}, 1e-6),
    "observer": ({"velocity_observer": {"bandwidth": 4000.0}}, 1e-6),
    "observer and filter": ({"velocity_observer": {"bandwidth": 4000.0}, "velocity_filter": {"time_constant": 0.3e-3}}, 1e-6),
    "lag and filter": ({"torque_lag": {"time_constant": 0.2e-3}, "velocity_filter": {"time_constant": 0.3e-3}}, 1e-6),
    "ripple": ({"velocity_ripple": {"amplitude": 1e-4, "order": 8.0, "phase": 0.3}}, 1e-6),
    "difference": ({"velocity_difference": {"samples": 3.0}}, 1e-6),
    "friction": ({"coulomb_friction": {"torque": 0.05}}, 1e-5),
    "gap": ({"backlash": {"gap": 1e-3}}, 3e-3),
}


@pytest.mark.parametrize("effects", WITH)
@pytest.mark.parametrize("loop", ["bare", "position"])
def test_one_substep_of_a_sample_shows_the_mean_that_sixteen_show(loop: str, effects: str) -> None:
    """Where the mean of what the sensor gives is not known two substeps are taken; impacts are as exact as a substep is."""
    plant, cascade, model = drive(loop)
    given, least = WITH[effects]
    for name, values in given.items():
        model = model.with_effect(name, **values)
    log = ga.Record(EVERY * T, command=command(plant.placed), velocity=np.zeros(600))
    if plant.placed:
        log = ga.Record(EVERY * T, position_command=command(True), velocity=np.zeros(600))
    one, many = (ga.simulate(model, log, differencing(cascade), substeps=n) for n in (1, 16))
    assert np.sqrt(np.mean((one - many) ** 2)) < least * np.abs(many).max()


def test_it_needs_a_servo_and_is_no_one_equation() -> None:
    from gaident import _core

    with pytest.raises(ValueError, match="only a servo"):
        _core.Loop(kind="open").differenced()
    log = ga.Record(4 * T, command=command(False), velocity=np.zeros(600))
    cascade = ga.Cascade(ga.PI(KP, KI), period=T)
    assert cascade.line_equation(log, 2)
    assert not differencing(cascade).line_equation(log, 2)


@pytest.mark.parametrize("name", CASES)
def test_it_keeps_all_of_the_controller(name: str) -> None:
    pi, around, _ = CASES[name]
    cascade = ga.Cascade(ga.PI(KP, KI, **pi), period=T, **around)
    assert differencing(cascade).to_dict() == cascade.to_dict()
    log = ga.Record(T, command=command(False), velocity=np.zeros(600))
    assert np.array_equal(differencing(cascade).torque_of(log), cascade.torque_of(log))


def behind_a_current_loop(seed: int) -> ga.Record:
    """One mass, a current loop of 0.2 ms, a rectangular integral, an encoder of 17 bits that is differenced."""
    period, acceleration = 2.5e-4, 3000.0  # s, rad/s^2
    source, speed = [], 0.0
    for level in (0.0, *np.round(np.random.default_rng(seed).uniform(-130.0, 130.0, 14))):
        for _ in range(480):
            speed += float(np.clip(level - speed, -acceleration * period, acceleration * period))
            source.append(speed)
    cascade = ga.Cascade(ga.PI(0.12, 6.0, rule="backward"), period=period)
    plant = Plant(J=9e-4, D=0.004, kp=0.12, ki=6.0, dt=period, cascade=cascade)
    sensor = Noise(white=0.0, encoder=2 * np.pi / 2**17, differenced=True)
    log = rig(plant, np.array(source), {"torque_lag": {"time_constant": 0.2e-3}}, sensor)
    return ga.Record(log.dt, command=log.command, velocity=log.velocity, torque=log.torque)


@pytest.mark.long
def test_one_mass_behind_a_current_loop_gets_no_second_one_where_the_rule_was_not_given() -> None:
    """Two masses leave less before whitening, whose zero lies to the right; with its own noise filter one mass and its lag do."""
    rec = behind_a_current_loop(3)
    assert rec.torque is not None
    of_a_log = rec.with_channels(torque=np.round(rec.torque / 3.2 * 100.0, 3) * 0.032)  # % of 3.2 N m, three decimals
    dia = ga.diagnose(of_a_log, ga.PI(0.12, 6.0))
    assert "load_inertia" not in dia.mechanics and dia.mechanics["inertia"].value == pytest.approx(9e-4, rel=1e-6)
    assert any("half a sample old" in note for note in map(str, dia.notes))
    assert [f.effect for f in dia.causes] == ["integration_rule", "torque_lag"]


def test_torques_that_are_alike_at_the_top_are_no_limit_where_the_rule_alone_makes_them() -> None:
    """The largest five torques are alike to a thousandth, which an anti-windup at a limit there makes as exactly."""
    said = replay(behind_a_current_loop(0), ga.PI(0.12, 6.0))
    assert said.cause == "integration_rule" and "limit" not in said.sentence


@pytest.mark.long
@pytest.mark.parametrize("first", [0, 150])
def test_its_age_is_asked_in_motion_too_where_the_torque_of_each_sample_is_logged(first: int) -> None:
    controller = ga.PI(0.1, 5.0, rule="backward")
    plant = Plant(J=4e-4, D=0.002, kp=0.1, ki=5.0, dt=0.5e-3, cascade=ga.Cascade(controller, period=0.5e-3))
    levels = np.repeat(np.random.default_rng(1).uniform(-60.0, 60.0, 16), 200)
    log = rig(plant, levels, {}, Noise(white=0.0, encoder=2 * np.pi / 5000.3, differenced=True), seed=1)
    assert ga.diagnose(log[first:], controller).causes == ()


def test_what_a_controller_limits_is_no_candidate_where_its_torque_drives_the_model() -> None:
    """Without a command nothing replays it, and nothing simulates its loop."""
    controller = ga.PI(0.1, 5.0, rule="backward")
    plant = Plant(J=4e-4, D=0.002, kp=0.1, ki=5.0, dt=0.5e-3, cascade=ga.Cascade(controller, period=0.5e-3))
    levels = np.repeat(np.random.default_rng(1).uniform(-60.0, 60.0, 8), 200)
    log = rig(plant, levels, {"coulomb_friction": {"torque": 0.05}}, Noise(white=0.01), seed=1)
    dia = ga.diagnose(log.with_channels(command=None), controller)
    assert [f.effect for f in dia.causes] == ["coulomb_friction"]


def test_free_runs_are_closed_over_what_the_torque_does_not_tell() -> None:
    log = ga.Record(T, command=command(False), velocity=np.zeros(600), torque=np.zeros(600))
    moving = ga.Record(T, command=command(False), velocity=20.0 * np.cos(np.arange(600) / 50.0), torque=np.sin(np.arange(600.0)))
    bare, other = ga.PI(KP, KI), ga.PI(KP, KI, rule="backward")
    faster = ga.Cascade(other, period=T / 4)
    assert closed_over(None, [log]) is None
    assert closed_over(bare, [log]) is bare and closed_over(bare, [moving]) is bare
    assert closed_over(other, [log]) is None and closed_over(other, [log], ["coulomb_friction"]) is None
    assert closed_over(other, [log], ["backlash"]) is other and closed_over(other, [moving], ["backlash"]) is None
    assert closed_over(faster, [log]) is faster and closed_over(faster, [moving]) is None


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 2])
def test_friction_and_gravity_do_not_hide_the_age_nor_what_kind_of_lag_there_is(seed: int) -> None:
    """Seed 0 had a Stribeck friction and seed 2 a transport delay on a second mass for the lag of a current loop."""
    loop = ga.Cascade(ga.PI(0.45, 18.0, rule="backward"), 250e-6)
    axis = Plant(J=4.5e-3, D=3e-3, kp=0.45, ki=18.0, dt=250e-6, cascade=loop, name="axis")
    levels, command = np.repeat(np.random.default_rng(seed).uniform(-100, 100, 8), 900), np.zeros(7200)
    for n in range(1, len(command)):
        command[n] = command[n - 1] + np.clip(levels[n] - command[n - 1], -0.5, 0.5)
    truth = {
        "unbalance": {"amplitude": 0.6, "phase": 0.4},
        "coulomb_friction": {"torque": 0.2},
        "torque_lag": {"time_constant": 3e-4},
    }
    log = run_drive(axis, command, truth, encoder=2 * np.pi / 2**20, differenced=True)
    rec = ga.Record(250e-6, command=np.round(command, 4), velocity=log.velocity, torque=np.round(log.torque, 4))
    dia = ga.diagnose(rec, loop)
    assert dia.verdict == "explained" and dia.velocity_age == 0.5, dia.summary()
    assert {f.effect: f.alternatives for f in dia.causes} == {
        "unbalance": (),
        "coulomb_friction": (),
        "torque_lag": ("velocity_filter",),
    }
    for cause in dia.causes:
        for name, value in truth[cause.effect].items():
            assert cause.parameters[name].value == pytest.approx(value, rel=1e-3)
    assert dia.mechanics["inertia"].value == pytest.approx(4.5e-3, rel=1e-4) and "motor_inertia" not in dia.mechanics
