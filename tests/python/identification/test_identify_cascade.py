"""identify() under a controller that is faster than the log: the loop from the command, in one difference equation."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
import referee_logs
import servo_referee as referee
from gaident.control import core
from gaident.control.between import at_the_clock, between_lines, straight_part
from gaident.errors import RecordError
from gaident.identification.closed_loop import line_equation, with_torque
from gaident.identification.logged_torque import not_followed
from referee_logs import GIVEN
from referee_logs import T as CLOCK

T = 125e-6
AXIS = referee.Axis(4e-4, 0.004, 9e-4, 0.006, 60.0, 0.02)
DRIVE = ga.TwoMass(JM=4e-4, DM=0.004, JL=9e-4, DL=0.006, KG=60.0, DG=0.02)
NOTCH = {"frequency": 285.0, "numerator_damping": 0.1, "denominator_damping": 0.7}
PI: dict[str, Any] = {"kp": 0.05, "ki": 2.0}


def speed(lines: int) -> np.ndarray:
    """Steps and ramps [rad/s] at the lines of a log."""
    n = np.arange(lines)
    steps = np.where(n < 20, 0.0, np.where(n < 150, 20.0, 0.0))
    return np.where(n < 250, steps, np.clip(0.5 * (n - 250), 0.0, 30.0))


def path(lines: int) -> np.ndarray:
    """A smooth move [rad] there and back."""
    return 3.0 * (1.0 - np.cos(2 * np.pi * np.arange(lines) / lines))


def low(tau: float) -> referee.Filter:
    return referee.low_pass(tau, T)


CASES: dict[str, tuple[dict[str, Any], dict[str, Any], Any]] = {
    # name: arguments of the PI, of the cascade, and what the referee is given
    "bare": ({}, {}, dict),
    "backward, weight": ({"rule": "backward", "command_weight": 0.4}, {}, lambda: {"rule": "backward", "weight": 0.4}),
    "IP": ({"command_weight": 0.0}, {}, lambda: {"weight": 0.0}),
    "filters": (
        {"rule": "forward"},
        {"torque_filters": (ga.LowPass(2e-4), ga.Notch(**NOTCH)), "velocity_filters": (ga.LowPass(5e-4),)},
        lambda: {
            "rule": "forward",
            "torque_filters": [low(2e-4), referee.notch(*NOTCH.values(), T)],
            "velocity_filters": [low(5e-4)],
        },
    ),
    "command filter, feedforward": (
        {},
        {"command_filters": (ga.LowPass(2e-3),), "acceleration_feedforward": 1.3e-3},
        lambda: {"command_filters": [low(2e-3)], "aff": 1.3e-3},
    ),
    "delay": ({}, {"delay": 2 * T}, lambda: {"delay": 2 * referee.FINE}),
}


def cost(rec: ga.Record, cascade: ga.Cascade) -> float:
    """Error of the true drive in the core's difference equation, relative to the velocity."""
    experiment = core.experiment([cascade.line_record(rec)], cascade, rec.dt)
    model = DRIVE.model()
    start = (model.gain, np.array(model.poles, complex), np.array(model.zeros, complex), np.zeros(0))
    fit = experiment.refine(
        [start], ga.SearchSpace(gain=(1.0, 1e6), real=(0.0, 1e3), imaginary=(0.0, 1e3)).ranges(paper=False), [], 0, 1
    )[0]
    return float(np.sqrt(fit.cost / len(rec)) / np.sqrt(np.mean(rec.velocity**2)))


@pytest.mark.parametrize("every", [2, 3, 4, 8])
@pytest.mark.parametrize("case", CASES)
def test_one_equation_is_the_loop_of_the_referee(case: str, every: int) -> None:
    pi, more, given = CASES[case]
    cascade = ga.Cascade(velocity=ga.PI(**PI, **pi), period=T, **more)
    command = speed(400)
    velocity, *_ = referee.simulate(AXIS, between_lines(command, every), T, every, **PI, **given())
    rec = ga.Record(every * T, command=command, velocity=velocity)
    assert cost(rec, cascade) < 1e-9
    assert line_equation([rec], cascade, None)


@pytest.mark.parametrize(("position_every", "every"), [(1, 8), (4, 8), (8, 8), (8, 16)])
def test_one_equation_is_the_simulated_position_loop(position_every: int, every: int) -> None:
    cascade = ga.Cascade(
        velocity=ga.PI(**PI),
        period=T,
        position=ga.P(10.0),
        position_period=position_every * T,
        velocity_feedforward=0.9,
        torque_filters=(ga.LowPass(2e-4),),
    )
    command = path(500)
    still = ga.Record(every * T, position_command=command, torque=np.zeros(500), velocity=np.zeros(500))
    rec = still.with_channels(velocity=ga.simulate(DRIVE, still, cascade))
    assert cost(rec, cascade) < 5e-6
    assert line_equation([rec], cascade, None)
    # Without a position in the log the axis rests where its path begins.
    moved = ga.Record(rec.dt, position_command=command + 10.0, torque=np.zeros(500), velocity=rec.velocity)
    np.testing.assert_allclose(ga.simulate(DRIVE, moved, cascade), rec.velocity, atol=1e-9)
    assert cost(moved, cascade) < 5e-6


@pytest.mark.parametrize(
    "cascade",
    [
        ga.Cascade(velocity=ga.PI(**PI)),
        ga.Cascade(velocity=ga.PI(**PI, torque_limit=5.0), period=T),
        ga.Cascade(velocity=ga.PI(**PI), period=T, friction_feedforward=0.1),
        ga.Cascade(velocity=ga.PI(**PI), period=T, delay=0.4 * T),
        ga.Cascade(velocity=ga.PI(**PI), period=T, torque_filters=(ga.Notch(**NOTCH),) * 5),
        ga.Cascade(velocity=ga.PI(**PI), period=T, position=ga.P(10.0)),
        ga.PI(**PI),
        None,
    ],
)
def test_any_other_loop_is_driven_by_its_torque(cascade: Any) -> None:
    rec = ga.Record(8 * T, command=speed(400), torque=np.zeros(400), velocity=np.zeros(400))
    assert not line_equation([rec], cascade, None)


def test_a_record_that_starts_in_motion_is_driven_by_its_torque() -> None:
    cascade = ga.Cascade(velocity=ga.PI(**PI), period=T)
    rec = ga.Record(8 * T, command=20.0 + speed(400), velocity=20.0 + speed(400))
    assert not line_equation([rec], cascade, None)


def test_a_free_start_is_one_of_a_model_that_the_torque_drives() -> None:
    given, free = ga.Cascade(GIVEN, CLOCK), ga.Settings(initial_state="free")
    rec = referee_logs.slower(2)
    idn = ga.identify(rec, given, settings=free, seed=1, workers=1)
    assert idn.controller is None and len(idn.initial_states) == 1
    assert np.abs(idn.model.poles).max() == pytest.approx(465.4, rel=5e-3)
    with pytest.raises(RecordError, match="no torque"):
        ga.identify(rec.with_channels(torque=None), given, settings=free)


def test_the_straight_part_of_a_command() -> None:
    steps, ramp = np.repeat([0.0, 5.0, -2.0], 20), np.clip(np.arange(60) - 10.0, 0.0, 30.0)
    assert straight_part(steps, False)[0] == "held"
    assert straight_part(ramp, False)[0] == "straight"
    for command in (steps + ramp, 7.0 + ramp):
        kind, straight = straight_part(command, False)
        part = np.arange(480) / 8
        held = np.repeat(command - straight, 8)
        assert kind == "mixed"
        assert np.allclose(held + np.interp(part, np.arange(60), straight), between_lines(command, 8), rtol=0, atol=1e-12)


def test_a_torque_is_made_for_the_search_ranges_only_where_none_is_logged() -> None:
    cascade = ga.Cascade(velocity=ga.PI(**PI), period=T, delay=T, torque_filters=(ga.LowPass(2e-4),))
    logged = ga.Record(8 * T, command=speed(400), torque=speed(400), velocity=speed(400))
    bare = ga.Record(8 * T, command=speed(400), velocity=0.9 * speed(400))
    kept, made = with_torque([logged, bare], cascade)
    assert kept is logged
    assert made.torque is not None
    # kp e + I of a PI at the log's rate, at the step of line 20
    assert made.torque[20] == pytest.approx((PI["kp"] + 0.5 * PI["ki"] * 8 * T) * 2.0, rel=1e-12)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_log_of_every_eighth_sample_gives_the_drive(noise: float) -> None:
    cascade = ga.Cascade(velocity=ga.PI(**PI, rule="backward"), period=T, torque_filters=(ga.LowPass(2e-4),))
    command = np.repeat(np.array([0.0, 20.0, -15.0, 30.0, 5.0, -30.0, 10.0, 0.0]), 150)
    still = ga.Record(8 * T, command=command, velocity=np.zeros(len(command)))
    velocity = ga.simulate(DRIVE, still, cascade)
    size = noise * float(np.sqrt(np.mean(velocity**2)))
    rec = ga.Record(8 * T, command=command, velocity=velocity + size * np.random.default_rng(4).standard_normal(len(velocity)))
    idn = ga.identify(rec, cascade, seed=2, workers=1)
    assert (idn.p, idn.q) == (1, 2)
    assert idn.controller == cascade
    assert not idn.falsified
    true = DRIVE.model()
    assert idn.model.gain == pytest.approx(true.gain, rel=1e-5 if noise == 0.0 else 0.05)
    if noise > 0.0:
        assert abs(idn.parameters["gain"].value - true.gain) < 4.0 * idn.parameters["gain"].std
    assert np.sqrt(np.mean(idn.residual(rec) ** 2)) == pytest.approx(idn.rmse, rel=1e-3, abs=1e-6)
    assert ga.Identification.from_dict(idn.to_dict()).controller == cascade
    assert "cascade" in idn.summary()


# What the drive has beyond the given controller; given.
CONTRADICTED: dict[str, tuple[dict[str, Any], ga.Cascade]] = {
    "low pass": ({"torque_filters": lambda: [referee_logs.low(1e-3)]}, ga.Cascade(GIVEN, CLOCK)),
    "limit": ({"torque_limit": lambda: 0.8}, ga.Cascade(GIVEN, CLOCK)),
    "no filter": ({}, ga.Cascade(GIVEN, CLOCK, torque_filters=(ga.LowPass(1e-3),))),
    "no weight": ({}, ga.Cascade(ga.PI(GIVEN.kp, GIVEN.ki, command_weight=0.0), CLOCK)),
}


@pytest.mark.parametrize("name", CONTRADICTED)
def test_a_loop_that_the_logged_torque_contradicts_is_not_closed(name: str) -> None:
    more, given = CONTRADICTED[name]
    rec = referee_logs.slower(2, **{key: make() for key, make in more.items()})
    assert line_equation([rec], given, None)
    (doubt,) = not_followed([rec], given)
    assert "does not follow from command and velocity through this controller" in doubt
    assert not_followed([rec.with_channels(torque=None)], given) == ()
    idn = ga.identify(rec, given, seed=1, workers=1)
    assert idn.controller is None and doubt in idn.warnings and str(doubt) in " ".join(idn.summary().split())
    # The resonance of the true drive, although its loop is another one.
    resonance = max(abs(np.imag(idn.model.poles)), key=lambda w: -abs(w - 463.6))
    assert resonance == pytest.approx(463.6, rel=0.01)


@pytest.mark.parametrize("every", [2, 4])
def test_gains_that_the_logged_torque_contradicts_are_corrected(every: int) -> None:
    rec = referee_logs.slower(every, torque_filters=[referee_logs.low(4e-4)])
    given = ga.Cascade(ga.PI(0.9 * GIVEN.kp, 1.1 * GIVEN.ki), CLOCK, torque_filters=(ga.LowPass(4e-4),))
    assert len(not_followed([rec], given)) == 1
    idn = ga.identify(rec, given, seed=1, workers=1)
    assert idn.controller is not None and idn.controller.gains.kp == pytest.approx(GIVEN.kp, rel=5e-3)
    assert any(f"(given: {given.velocity.kp:.4g} and {given.velocity.ki:.4g}) it does" in note for note in idn.warnings)
    kp = idn.controller_numbers["velocity.kp"]
    assert kp.value == idn.controller.gains.kp and 0.0 < kp.std < 0.02 * kp.value
    assert (idn.p, idn.q) == (1, 2) and not idn.falsified
    assert np.abs(idn.model.poles).max() == pytest.approx(465.4, rel=5e-3)


@pytest.mark.parametrize("noise", [0.0, 0.02, 0.3])
@pytest.mark.parametrize("every", [2, 4, 8])
def test_the_loop_that_made_the_torque_is_closed(every: int, noise: float) -> None:
    rec = referee_logs.slower(every, noise, torque_filters=[referee_logs.low(4e-4)])
    given = ga.Cascade(GIVEN, CLOCK, torque_filters=(ga.LowPass(4e-4),))
    assert rec.torque is not None
    measured = rec.torque + 0.02 * np.std(rec.torque) * np.random.default_rng(1).standard_normal(len(rec))
    for torque in (rec.torque, np.round(rec.torque, 2), measured):
        assert not_followed([rec.with_channels(torque=torque)], given) == ()
    path_of = np.cumsum(speed(400)) * T
    placed = {"position_gain": 10.0, "position_every": every}
    w, u, p = referee.simulate(AXIS, at_the_clock(path_of, every), T, every, **PI, **placed)
    place = ga.Cascade(ga.PI(**PI), T, position=ga.P(10.0), position_period=every * T)
    moved = ga.Record(every * T, position_command=path_of, velocity=w, torque=u, position=p)
    assert not_followed([moved], place) == ()
    assert len(not_followed([moved], replace(place, position=ga.P(12.0)))) == 1
