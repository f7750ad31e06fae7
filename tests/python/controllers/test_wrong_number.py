"""A controller with a wrong number, in a log of every fourth sample: which it is, and a verdict that does not rest on it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.diagnosis.controller.period_shown import period_shown

TRUE = ga.Cascade(
    ga.PI(0.03, 1.0),
    period=0.25e-3,
    torque_filters=(ga.LowPass(0.5e-3),),
    position=ga.P(30.0),
    position_period=1e-3,
    velocity_feedforward=1.0,
    acceleration_feedforward=4e-4,
)
WRONG: dict[str, tuple[ga.Cascade, str]] = {
    "feedforward of the wrong sign": (
        replace(TRUE, acceleration_feedforward=-4e-4),
        "kg m^2 (given: -0.0004) it does",
    ),
    "a gain ten times too high": (replace(TRUE, position=ga.P(300.0)), "1/s (given: 300) it does"),
    "an unstable loop": (replace(TRUE, position=ga.P(3000.0)), "1/s (given: 3000) it does"),
}
TWO_WRONG = replace(TRUE, position=ga.P(300.0), velocity=ga.PI(0.06, 3.0))


@lru_cache
def log() -> ga.Record:
    """A position loop over one mass with 0.05 N m of dry friction, noise of 0.02 rad/s on the logged velocity."""
    n, dt = 1600, 1e-3
    levels = np.repeat([0, 10.0, -25, 5, -5, 40, -40, 15, -2, 2, -15, 30, -30, 8, -8, 0], 100)
    speed = np.convolve(levels, np.full(25, 1 / 25), "same")
    path = dt * (np.cumsum(speed) - speed)
    drive = ga.OneMass(J=4e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)
    done = ga.run(drive, ga.Record(dt, position_command=path, velocity=np.zeros(n)), TRUE)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * dt * (done.velocity[1:] + done.velocity[:-1]))])
    noise = 0.02 * np.random.default_rng(0).standard_normal(n)
    return ga.Record(dt, position_command=path, position=angle, velocity=done.velocity + noise, torque=done.torque)


@pytest.mark.long
@pytest.mark.parametrize("case", WRONG)
def test_the_wrong_number_is_named_and_the_right_one_used(case: str) -> None:
    given, words = WRONG[case]
    dia = ga.diagnose(log(), given)
    (note,) = (note for note in dia.notes if "(given:" in note)
    assert words in note and "all simulations use this" in note
    assert any("does not follow from command and velocity through this controller" in note for note in dia.notes)
    assert isinstance(dia.controller, ga.Cascade) and dia.controller.position is not None
    assert dia.controller.position.gain == pytest.approx(30.0, rel=1e-2)
    assert dia.controller.acceleration_feedforward == pytest.approx(4e-4, rel=1e-2)
    assert dia.controller_numbers and dia.loop_follows
    number, cause = dia.causes
    effect = "acceleration_feedforward" if given.acceleration_feedforward < 0.0 else "other_gains"
    assert (number.effect, number.place) == (effect, "controller")
    assert cause.effect == "coulomb_friction" and cause.parameters["torque"].value == pytest.approx(0.05, rel=0.01)
    assert dia.verdict == "explained" and dia.after.rmse < 1.1 * dia.after.noise_floor


@pytest.mark.long
def test_a_loop_that_is_not_the_drives_is_not_simulated() -> None:
    """Two numbers are wrong and no single one helps: the torque drives the models."""
    dia = ga.diagnose(log(), TWO_WRONG)
    assert not dia.loop_follows
    assert any("So no loop is closed over this controller" in note for note in dia.notes)
    told = " ".join(dia.summary().split())
    assert "does not follow from this controller (see above): it drives these models, no loop is closed" in told
    friction = next(cause for cause in dia.causes if cause.effect == "coulomb_friction")
    assert friction.parameters["torque"].value == pytest.approx(0.05, rel=0.01)
    assert dia.mechanics["inertia"].value == pytest.approx(4e-4, rel=0.01)
    # Between the lines the logged torque goes straight: 1.6 times the noise; 2.3 as a controller with two wrong numbers makes it.
    assert dia.after.rmse < 2.0 * dia.after.noise_floor


def test_a_forgotten_sample_time_of_the_controller_is_found() -> None:
    """The whole cascade, every fourth sample of which was logged, and nobody said so."""
    shown = period_shown([log()], replace(TRUE, period=None))
    assert shown is not None and shown.controller == TRUE
    assert "samples about 4 times for each line" in shown.note
    assert period_shown([log()], TRUE) is None is period_shown([log()], None)
    assert period_shown([log()], replace(TWO_WRONG, period=None)) is None  # another number is wrong: no clock mends that
    dia = ga.diagnose(log(), replace(TRUE, period=None))
    assert any("0.25 ms is taken for its sample time" in note for note in dia.notes) and dia.controller == TRUE
    assert [f.effect for f in dia.causes] == ["coulomb_friction"] and dia.verdict == "explained"


AT_LIMIT = ga.Cascade(ga.PI(0.15, 8.0, torque_limit=1.0, anti_windup="hold"), period=0.25e-3)
RPM = 30.0 / np.pi
STRIBECK = {"torque": 0.15, "static_torque": 0.25, "stribeck_velocity": 4.0}


def at_limit(every: int, differenced: bool = True) -> ga.Record:
    """One mass behind a limit that is reached, an encoder of 2^20 lines, three decimals of rpm."""
    skip_without_library()
    cascade = replace(AT_LIMIT, period=1e-3 / every)
    axis = Plant(J=1e-3, D=2e-3, kp=0.15, ki=8.0, dt=1e-3, cascade=cascade, name="axis")
    levels = np.repeat([0.0, 50.0, 100.0, 20.0, -40.0, -100.0, -30.0, 10.0, 70.0, 0.0, 5.0, -5.0], 180 * every)
    speed, step = np.zeros(len(levels)), 2.5 / every  # a ramp that the controller makes at its own samples
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(levels[n] - speed[n - 1], -step, step)
    sensor = {"encoder": 2.0 * np.pi / 2**20, "differenced": differenced}
    whole = run_drive(axis, speed, {"stribeck_friction": STRIBECK}, **sensor)
    velocity, torque = whole.velocity[::every], whole.torque[::every]
    return ga.Record(1e-3, command=speed[::every], velocity=np.round(velocity * RPM, 3) / RPM, torque=np.round(torque, 4))


@pytest.mark.parametrize("every", [1, 2, 4, 8])
def test_a_sample_time_is_told_by_the_torque_and_by_the_age_of_the_velocity(every: int) -> None:
    shown = period_shown([at_limit(every)], ga.PI(0.15, 8.0))
    if every == 1:
        assert shown is None
    else:
        assert shown is not None and shown.controller == ga.Cascade(ga.PI(0.15, 8.0), 1e-3 / every)


def test_a_current_loop_beside_a_coarse_encoder_does_not_hide_the_sample_time() -> None:
    """What the encoder's steps make of the integral between the lines is more than what another sample time would."""
    skip_without_library()
    pi, every, period = ga.PI(0.0232, 1.367), 4, 125e-6
    axis = Plant(J=1.1e-4, D=4e-4, kp=pi.kp, ki=pi.ki, dt=every * period, cascade=ga.Cascade(pi, period), name="axis")
    levels = np.repeat([0, 30.0, -50, 5, -5, 80, -80, 20, -1, 1, -20, 60], 160 * every)
    lag = {"torque_lag": {"time_constant": 0.3e-3}}
    whole = run_drive(axis, levels, lag, encoder=2.0 * np.pi / 2**17, differenced=True)
    log = ga.Record(axis.dt, command=levels[::every], velocity=whole.velocity[::every], torque=whole.torque[::every])
    shown = period_shown([log], pi)
    assert shown is not None and shown.controller == ga.Cascade(pi, period)


@pytest.mark.long
def test_behind_a_limit_a_forgotten_sample_time_makes_no_second_mass() -> None:
    dia = ga.diagnose(at_limit(4), ga.PI(0.15, 8.0))
    assert any("0.25 ms is taken for its sample time" in note for note in dia.notes), dia.summary()
    assert "motor_inertia" not in dia.mechanics
    limit, *windup, friction = [f for f in dia.causes if f.effect in ("torque_saturation", "anti_windup", "stribeck_friction")]
    assert (limit.effect, friction.effect) == ("torque_saturation", "stribeck_friction")
    assert [f.effect for f in windup] == ["anti_windup"]
    found = friction.parameters
    assert {name: found[name].value for name in STRIBECK} == pytest.approx(STRIBECK, rel=0.1), dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=2e-3)
