"""Controllers of servo axes, compared with a simulation that shares no code with the library (servo_referee.py)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
import servo_referee as referee

T = 125e-6
KP, KI = 0.05, 2.0
ONE = (referee.Axis(1e-3, 0.01), ga.OneMass(J=1e-3, D=0.01))
TWO = (
    referee.Axis(4e-4, 0.004, 9e-4, 0.006, 60.0, 0.02),
    ga.TwoMass(JM=4e-4, DM=0.004, JL=9e-4, DL=0.006, KG=60.0, DG=0.02),
)
NOTCH = {"frequency": 80.0, "numerator_damping": 0.1, "denominator_damping": 0.7}


def command(samples: int) -> np.ndarray:
    """Steps and ramps [rad/s], one sample after the other at the controller's clock."""
    n = np.arange(samples)
    return np.where(n < 200, 0.0, np.where(n < 1200, 20.0, np.clip(20.0 - 0.05 * (n - 1200), -30.0, 20.0)))


def path(samples: int) -> np.ndarray:
    """A smooth move [rad] there and back."""
    n = np.arange(samples) * T
    return 3.0 * (1.0 - np.cos(2 * np.pi * n / (samples * T)))


def low(tau: float) -> referee.Filter:
    return referee.low_pass(tau, T)


def dip() -> referee.Filter:
    return referee.notch(NOTCH["frequency"], NOTCH["numerator_damping"], NOTCH["denominator_damping"], T)


CASES: dict[str, tuple[dict[str, Any], dict[str, Any], Any]] = {
    # name: arguments of the PI, of the cascade, and what the referee is given
    "backward": ({"rule": "backward"}, {}, lambda: {"rule": "backward"}),
    "forward": ({"rule": "forward"}, {}, lambda: {"rule": "forward"}),
    "IP": ({"command_weight": 0.0}, {}, lambda: {"weight": 0.0}),
    "half weight": ({"command_weight": 0.5, "rule": "backward"}, {}, lambda: {"weight": 0.5, "rule": "backward"}),
    "limit": ({"torque_limit": 0.6}, {}, lambda: {"torque_limit": 0.6}),
    "hold": ({"torque_limit": 0.6, "anti_windup": "hold"}, {}, lambda: {"torque_limit": 0.6, "windup": "hold"}),
    "hold, backward": (
        {"torque_limit": 0.6, "anti_windup": "hold", "rule": "backward"},
        {},
        lambda: {"torque_limit": 0.6, "windup": "hold", "rule": "backward"},
    ),
    "tracking": (
        {"torque_limit": 0.6, "anti_windup": "tracking", "tracking_time": 2e-3, "integrator_limit": 0.5},
        {},
        lambda: {"torque_limit": 0.6, "windup": "tracking", "tracking": 2e-3, "integrator_limit": 0.5},
    ),
    "torque filters": (
        {},
        {"torque_filters": (ga.LowPass(4e-4), ga.Notch(**NOTCH))},
        lambda: {"torque_filters": [low(4e-4), dip()]},
    ),
    "velocity filter": ({}, {"velocity_filters": (ga.LowPass(1e-3),)}, lambda: {"velocity_filters": [low(1e-3)]}),
    "command filters": (
        {},
        {"command_filters": (ga.LowPass(2e-3), ga.LowPass(1e-3))},
        lambda: {"command_filters": [low(2e-3), low(1e-3)]},
    ),
    "feedforward of a velocity command": (
        {},
        {"acceleration_feedforward": 9e-4, "friction_feedforward": 0.02},
        lambda: {"aff": 9e-4, "fff": 0.02},
    ),
}


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("axis", [ONE, TWO], ids=["one mass", "two masses"])
@pytest.mark.parametrize("name", CASES)
def test_velocity_loops(name: str, axis: tuple[referee.Axis, Any], every: int) -> None:
    pi, around, given = CASES[name]
    r = command(2400)
    # A log of every fourth line holds the command between its lines, but on the ramp: made so that both agree.
    w, u, q = referee.simulate(axis[0], r, T, every, kp=KP, ki=KI, **given())
    rec = ga.Record(every * T, command=r[::every], velocity=w)
    drive = ga.Cascade(ga.PI(KP, KI, **pi), period=T, **around)
    run = ga.run(axis[1], rec, drive)
    assert np.abs(w).max() > 10.0
    assert np.abs(run.velocity - w).max() < 1e-9
    assert np.abs(run.torque - u).max() < 1e-9
    assert np.abs(run.position - q).max() < 1e-4  # an integral by trapezoids on one side


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("tenths", [3, 5, 10, 15, 27])
@pytest.mark.parametrize("axis", [ONE, TWO], ids=["one mass", "two masses"])
def test_a_delay_of_any_part_of_a_period(tenths: int, axis: tuple[referee.Axis, Any], every: int) -> None:
    """The torque goes on its way and acts later; what is logged is the one before it."""
    r = command(2400)
    given = {"torque_filters": [low(4e-4)], "torque_limit": 0.6, "windup": "hold"}
    w, u, _ = referee.simulate(axis[0], r, T, every, kp=KP, ki=KI, delay=tenths, **given)
    rec = ga.Record(every * T, command=r[::every], velocity=w)
    pi = ga.PI(KP, KI, torque_limit=0.6, anti_windup="hold")
    drive = ga.Cascade(pi, period=T, torque_filters=(ga.LowPass(4e-4),), delay=tenths * T / 10)
    run = ga.run(axis[1], rec, drive)
    assert np.abs(w).max() > 10.0
    # Exact where the torques change at a substep; elsewhere a substep takes their mean: measured 7e-6 of the speed at most.
    within = 1e-9 if tenths % 5 == 0 else 1e-5 * np.abs(w).max()
    assert np.abs(run.velocity - w).max() < within
    assert np.abs(run.torque - u).max() < (1e-9 if tenths % 5 == 0 else 1e-5 * np.abs(u).max())


def test_a_delay_of_the_controller_adds_to_that_of_the_drive() -> None:
    rec = ga.Record(T, command=command(1200), velocity=np.zeros(1200))
    both = ga.run(ONE[1].model().with_effect("transport_delay", delay=0.6 * T), rec, ga.Cascade(ga.PI(KP, KI), delay=0.7 * T))
    one = ga.run(ONE[1].model().with_effect("transport_delay", delay=1.3 * T), rec, ga.Cascade(ga.PI(KP, KI)))
    known = ga.run(ONE[1], rec, ga.Cascade(ga.PI(KP, KI), delay=1.3 * T))
    np.testing.assert_allclose(both.velocity, one.velocity, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(known.velocity, one.velocity)
    assert np.abs(ga.run(ONE[1], rec, ga.Cascade(ga.PI(KP, KI))).velocity - one.velocity).max() > 0.1


def test_a_known_delay_under_a_slower_log_is_no_finding() -> None:
    r = np.repeat(np.random.default_rng(3).uniform(-60.0, 60.0, 20), 400)
    w, u, _ = referee.simulate(ONE[0], r, T, 4, kp=KP, ki=KI, delay=15)
    w = w + 0.005 * np.random.default_rng(4).standard_normal(len(w))
    dia = ga.diagnose(ga.Record(4 * T, command=r[::4], velocity=w, torque=u), ga.Cascade(ga.PI(KP, KI), period=T, delay=1.5 * T))
    assert (dia.verdict, dia.findings) == ("adequate", ())
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=1e-4)


def test_a_known_delay_is_no_finding_and_an_unknown_one_is() -> None:
    samples = 2000
    r = np.repeat(np.random.default_rng(3).uniform(-60.0, 60.0, 20), samples // 20)
    w, u, _ = referee.simulate(ONE[0], r, T, 1, kp=KP, ki=KI, rule="backward", torque_limit=2.0, delay=15)
    w = w + 0.005 * np.random.default_rng(4).standard_normal(len(w))
    rec = ga.Record(T, command=r, velocity=w, torque=u)
    drive = ga.Cascade(ga.PI(KP, KI, rule="backward", torque_limit=2.0), period=T, delay=1.5 * T)
    idn = ga.identify(rec, drive, seed=1)
    known, unknown = (ga.diagnose(rec, c, seed=1) for c in (drive, replace(drive, delay=0.0)))
    assert abs(1.0 / idn.model.gain / ONE[0].inertia - 1.0) < 5e-3
    assert known.verdict == "adequate"
    assert "transport_delay" in [f.effect for f in unknown.causes]


POSITION_CASES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "alone": ({}, {}),
    "slower": ({"position_period": 8 * T}, {"position_every": 8}),
    "velocity feedforward": ({"velocity_feedforward": 1.0}, {"kff": 1.0}),
    "all feedforward": (
        {
            "position_period": 4 * T,
            "velocity_feedforward": 0.9,
            "acceleration_feedforward": 1e-3,
            "friction_feedforward": 0.02,
        },
        {"position_every": 4, "kff": 0.9, "aff": 1e-3, "fff": 0.02},
    ),
}


@pytest.mark.parametrize("every", [1, 8])
@pytest.mark.parametrize("axis", [ONE, TWO], ids=["one mass", "two masses"])
@pytest.mark.parametrize("name", POSITION_CASES)
def test_position_loops(name: str, axis: tuple[referee.Axis, Any], every: int) -> None:
    around, given = POSITION_CASES[name]
    # Lines of the log with straight lines between them: what a log of every eighth sample can tell.
    n = np.arange(2400)
    q_ref = np.interp(n, n[::8], path(2400)[::8], right=None)
    q_ref[-8:] = q_ref[-9] + (q_ref[-9] - q_ref[-10]) * np.arange(1, 9)
    w, u, q = referee.simulate(axis[0], q_ref, T, every, kp=KP, ki=KI, position_gain=50.0, **given)
    rec = ga.Record(every * T, velocity=w, torque=u, position_command=q_ref[::every])
    drive = ga.Cascade(ga.PI(KP, KI), period=T, position=ga.P(50.0), **around)
    run = ga.run(axis[1], rec, drive)
    assert np.abs(w).max() > 10.0
    # The library's angle is the sum of trapezoids under the velocity, one a sample: measured 5e-6 of the speed at most.
    assert np.abs(run.velocity - w)[:-9].max() < 1e-5 * np.abs(w).max()
    assert np.abs(run.torque - u)[:-9].max() < 1e-5 * np.abs(u).max()
    assert np.abs(run.position - q)[:-9].max() < 1e-5


def servo_record(every: int, seed: int = 3) -> tuple[ga.Record, ga.Cascade]:
    """A drive of one mass under a backward PI with a torque filter and anti-windup, 0.02 rad/s of noise."""
    samples = 2000 * every
    r = np.repeat(np.random.default_rng(seed).uniform(-60.0, 60.0, 20), samples // 20)
    w, u, _ = referee.simulate(
        ONE[0], r, T, every, kp=KP, ki=KI, rule="backward", torque_limit=2.0, windup="hold", torque_filters=[low(4e-4)]
    )
    w = w + 0.02 * np.random.default_rng(seed + 1).standard_normal(len(w))
    drive = ga.Cascade(
        ga.PI(KP, KI, rule="backward", torque_limit=2.0, anti_windup="hold"), period=T, torque_filters=(ga.LowPass(4e-4),)
    )
    return ga.Record(every * T, command=r[::every], velocity=w, torque=u), drive


@pytest.mark.parametrize("every", [1, 8])
def test_a_clean_drive_under_a_whole_known_controller_is_adequate(every: int) -> None:
    rec, drive = servo_record(every)
    dia = ga.diagnose(rec, drive)
    assert dia.verdict == "adequate", dia.summary()
    assert not dia.findings
    assert dia.mechanics is not None
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=2e-3)


def test_the_torque_drives_the_identification() -> None:
    rec, drive = servo_record(1)
    idn = ga.identify(rec, drive, seed=1)
    assert (idn.p, idn.q) == (1, 0)
    assert idn.mechanics is not None
    assert pytest.approx(1e-3, rel=2e-3) == idn.mechanics.J
    assert any("identified from its torque" in w for w in idn.warnings)


def test_a_torque_that_another_controller_made_is_said() -> None:
    rec, drive = servo_record(1)
    idn = ga.identify(rec, ga.Cascade(drive.velocity, period=T), seed=1)
    assert any("does not follow from command and velocity" in w for w in idn.warnings)


def test_what_is_lost_between_the_lines_is_an_error() -> None:
    rec, drive = servo_record(8)
    with pytest.raises(ga.errors.RecordError, match="the controller samples 8 times for each of its lines"):
        ga.identify(rec.with_channels(torque=None), drive)


def test_without_a_torque_the_refusal_of_a_faster_controller_leads_on() -> None:
    """To identify, where its loop is one equation, and to a diagnosis without its sample time, which says what is lost."""
    command = np.repeat([0.0, 10.0, -20.0, 15.0, -5.0, 30.0], 50)
    linear = ga.Cascade(ga.PI(0.05, 1.0, rule="backward"), period=0.25e-3)
    drive = ga.OneMass(1e-3, 0.01).model()
    done = ga.run(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), linear)
    noise = 0.01 * np.random.default_rng(0).standard_normal(len(command))
    rec = ga.Record(1e-3, command=command, velocity=done.velocity + noise)
    with pytest.raises(ga.errors.RecordError, match=r"identify takes such a log as it is.*leave the controller's period out"):
        ga.diagnose(rec, linear)
    limited = replace(linear, velocity=ga.PI(0.05, 1.0, torque_limit=9.0))
    with pytest.raises(ga.errors.RecordError, match=r"or log each of its samples\. Where there is neither, leave"):
        ga.diagnose(rec, limited)
    assert ga.identify(rec, linear).fit_percent > 90.0
    assert ga.diagnose(rec, replace(linear, period=None)).mechanics["inertia"].value == pytest.approx(1e-3, rel=0.1)


WRONG: dict[str, tuple[Any, str]] = {
    "rule": (lambda: ga.PI(1.0, 1.0, rule="euler"), "rule is 'euler'"),
    "weight": (lambda: ga.PI(1.0, 1.0, command_weight=-1.0), "command_weight is -1"),
    "windup": (lambda: ga.PI(1.0, 1.0, anti_windup="hold"), "without a torque_limit"),
    "tracking": (lambda: ga.PI(1.0, 1.0, torque_limit=1.0, anti_windup="tracking"), "needs a tracking_time"),
    "time": (lambda: ga.PI(1.0, 1.0, torque_limit=1.0, tracking_time=1.0), "the others have none"),
    "continuous": (lambda: ga.PI(1.0, 1.0, loop="continuous", rule="forward"), 'give loop="sampled"'),
    "velocity": (lambda: ga.Cascade(ga.PI(1.0, 1.0, loop="continuous")), "the digital controller"),
    "gain": (lambda: ga.P(0.0), "gain is 0"),
    "position": (lambda: ga.Cascade(ga.PI(1.0, 1.0), position=40.0), "give P"),  # type: ignore[arg-type]
    "feedforward": (lambda: ga.Cascade(ga.PI(1.0, 1.0), velocity_feedforward=1.0), "there is none: give position=P"),
    "period": (lambda: ga.Cascade(ga.PI(1.0, 1.0), period=0.0), "period is 0"),
    "multiple": (lambda: ga.Cascade(ga.PI(1.0, 1.0), period=3e-4).log_every(1e-3), "such as 0.0009 s"),
    "delay": (lambda: ga.Cascade(ga.PI(1.0, 1.0), delay=-1e-6), "from 0 to 1"),
    "filter": (lambda: ga.Cascade(ga.PI(1.0, 1.0), torque_filters=(1.0,)), "a sequence of LowPass"),  # type: ignore[arg-type]
    "low pass": (lambda: ga.LowPass(0.0), "time_constant is 0"),
    "notch": (lambda: ga.Notch(100.0, 0.1, 0.0), "denominator_damping is 0"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_controllers_are_refused(name: str) -> None:
    make, words = WRONG[name]
    with pytest.raises(ga.errors.ControllerError, match=words):
        make()


def test_a_notch_above_half_the_sampling_frequency_is_refused() -> None:
    rec, _ = servo_record(8)
    with pytest.raises(ga.errors.ControllerError, match="lies below 500 Hz"):
        ga.simulate(ONE[1], rec, ga.Cascade(ga.PI(KP, KI), torque_filters=(ga.Notch(600.0, 0.1, 0.7),)))


def test_a_cascade_is_saved_whole() -> None:
    drive = ga.Cascade(
        ga.PI(KP, KI, rule="backward", torque_limit=2.0, anti_windup="tracking", tracking_time=1e-3),
        period=T,
        position=ga.P(40.0),
        position_period=8 * T,
        velocity_feedforward=1.0,
        torque_filters=(ga.LowPass(4e-4), ga.Notch(**NOTCH)),
        delay=60e-6,
    )
    assert ga.Cascade.from_dict(drive.to_dict()) == drive
    assert ga.PI.from_dict(ga.PI(KP, KI, rule="forward").to_dict()) == ga.PI(KP, KI, rule="forward")


def test_a_position_command_is_a_channel() -> None:
    n = np.arange(100.0)
    rec = ga.Record(1e-3, velocity=n, torque=n, position_command=2.0 * n)
    assert "position_command" in dict(rec.channels())
    part = rec[20:60]
    assert part.position_command is not None
    assert part.position_command[0] == 40.0
    assert ga.Record.from_dict(rec.to_dict()) == rec
    with pytest.raises(ga.errors.RecordError, match="no position_command, which drives"):
        ga.simulate(ONE[1], rec.with_channels(position_command=None), ga.Cascade(ga.PI(KP, KI), position=ga.P(1.0)))
