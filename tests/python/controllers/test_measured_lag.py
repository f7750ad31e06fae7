"""A measured current behind the controller's command: a lag, not other gains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, log_of, run_drive, skip_without_library
from gaident.diagnosis.controller.as_read import outliers_of_the_log
from gaident.diagnosis.controller.measured_lag import behind_a_lag, commanded, lag_shown

T = 0.5e-3
PI = ga.PI(0.05, 2.0)
AXIS = Plant(J=1e-3, D=2e-3, kp=0.05, ki=2.0, dt=T, name="axis")
LAG = 0.3e-3


def record(
    lag: float,
    noise: float = 0.01,
    late: int = 1,
    effects: dict[str, dict[str, float]] | None = None,
    seed: int = 2,
    pi: ga.PI | None = None,
) -> ga.Record:
    """A ramped motion with reversals; what is logged is the torque behind the lag, as it stood when the controller sampled."""
    skip_without_library()
    levels = np.repeat([0.0, 30.0, 60.0, 12.0, -24.0, -60.0, -18.0, 6.0, 42.0, 0.0, 3.0, -3.0, 0.0], 200)
    speed = np.zeros(len(levels))
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(levels[n] - speed[n - 1], -0.5, 0.5)
    hidden = {"coulomb_friction": {"torque": 0.1}} | (effects or {}) | ({"torque_lag": {"time_constant": lag}} if lag else {})
    rng = np.random.default_rng(seed)
    log = run_drive(AXIS, speed, hidden, velocity_noise=0.01 * rng.standard_normal(len(speed)))
    made = log.torque if pi is None else pi.torque_of(ga.Record(T, command=speed, velocity=log.velocity))
    behind, a = np.zeros(len(speed)), np.exp(-T / lag) if lag else 0.0
    for n in range(1, len(speed)):
        behind[n] = a * behind[n - 1] + (1.0 - a) * made[n - late]
    torque = behind + noise * rng.standard_normal(len(speed))
    return ga.Record(T, command=speed, velocity=log.velocity, torque=torque, torque_is="measured")


@pytest.mark.parametrize("late", [0, 1])
def test_a_lag_behind_the_controller_is_found_with_its_deviation(late: int) -> None:
    lag = lag_shown([record(LAG, late=late)], PI)
    assert lag is not None and abs(lag.time_constant - LAG) < 3.0 * lag.std < 0.3 * LAG
    assert lag.noise == pytest.approx(0.01, rel=0.05)


def test_the_torque_before_the_lag_is_the_controllers() -> None:
    rec = record(LAG)
    made = commanded(rec, PI)
    assert made.torque_is == "commanded" and made.torque is not None
    error = rec.command - rec.velocity
    integral = np.cumsum(error) - 0.5 * error
    assert np.abs(made.torque - PI.kp * error - PI.ki * T * integral).max() < 1e-9


def test_where_other_gains_explain_more_no_lag_is_found() -> None:
    rec = record(LAG, noise=0.001)
    assert lag_shown([rec], ga.PI(0.06, 2.0)) is None  # the gains are other
    assert lag_shown([record(0.0, late=0)], PI) is None  # it follows as it is
    assert lag_shown([ga.Record(T, command=rec.command, velocity=rec.velocity, torque=rec.torque)], PI) is None  # commanded
    assert lag_shown([rec], None) is None


@pytest.mark.parametrize("seed", range(8))
def test_a_torque_that_is_only_late_has_no_lag(seed: int) -> None:
    assert lag_shown([record(0.0, late=1, seed=seed)], PI) is None


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_the_unit_of_torque_decides_nothing(unit: float) -> None:
    def scaled(rec: ga.Record) -> ga.Record:
        assert rec.torque is not None
        return rec.with_channels(torque=unit * rec.torque)

    pi = ga.PI(unit * PI.kp, unit * PI.ki)
    late = [scaled(record(0.0, late=2, seed=seed)) for seed in range(4)]  # a lag of 1.4 samples is 46 BIC units worse
    assert lag_shown(late, pi) is None
    lag = lag_shown([scaled(record(LAG))], pi)
    assert lag is not None and lag.time_constant == pytest.approx(lag_shown([record(LAG)], PI).time_constant, rel=1e-4)


@pytest.mark.parametrize("begin", [0, 430, 1000])
def test_a_torque_limit_hides_no_lag(begin: int) -> None:
    """From line 430 on the record begins at the limit, with what the integrator stored there."""
    limited = ga.PI(PI.kp, PI.ki, torque_limit=0.6)
    rec = record(LAG, pi=limited)
    whole = limited.torque_of(rec)
    assert 0.05 < np.mean(np.abs(whole) >= 0.6) < 0.95
    lag = lag_shown([rec[begin:]], limited)
    assert lag is not None and abs(lag.time_constant - LAG) < 3.0 * lag.std < 0.4 * LAG
    made = commanded(rec[begin:], limited).torque
    assert np.abs(made).max() <= 0.6
    assert np.std(made - whole[begin:]) < 0.01
    assert lag_shown([record(0.0, pi=limited)[begin:]], limited) is None


@pytest.mark.long
def test_a_lag_of_the_measured_current_is_not_said_to_be_other_gains() -> None:
    dia = ga.diagnose(record(LAG), PI)
    assert [f.effect for f in dia.causes] == ["coulomb_friction", "torque_lag"], dia.summary()
    assert {*dia.causes[1].alternatives} <= {"transport_delay"}  # no velocity filter: the current shows the lag
    found = {f.effect: f.parameters for f in dia.causes}
    assert found["torque_lag"]["time_constant"].value == pytest.approx(LAG, rel=0.05)
    assert found["coulomb_friction"]["torque"].value == pytest.approx(0.1, rel=0.01)
    assert dia.mechanics["inertia"].value == pytest.approx(AXIS.J, rel=0.005)
    assert any("behind a lag of 0.3" in note or "behind a lag of 0.29" in note for note in dia.notes), dia.notes
    assert "torque_lag" not in dia.not_testable and dia.verdict == "explained"


CASCADE = ga.Cascade(ga.PI(0.05, 2.0, rule="backward"), period=T / 4)


def slow_record(
    lag: float,
    noise: float,
    seed: int = 5,
    cascade: ga.Cascade = CASCADE,
    effects: dict[str, dict[str, float]] | None = None,
) -> ga.Record:
    """Every fourth sample of a controller: the motion, and the torque of the motor behind a lag that was not given."""
    skip_without_library()
    filters = (ga.LowPass(lag),) if lag else ()
    plant = Plant(J=1e-3, D=2e-3, kp=0.05, ki=2.0, dt=T, cascade=replace(cascade, torque_filters=filters))
    levels = np.array([0.0, 30.0, 60.0, 12.0, -24.0, -60.0, -18.0, 6.0, 42.0, 0.0, 3.0, -3.0, 0.0])
    before, ramp = np.append(0.0, levels[:-1]), 0.125 * np.arange(800)
    ramps = np.concatenate([a + np.clip(b - a, -ramp, ramp) for a, b in zip(before, levels, strict=True)])
    noises = Noise(white=0.0, encoder=2 * np.pi / 2**20)
    log = log_of(plant, ramps, effects or {"coulomb_friction": {"torque": 0.1}}, noises, seed)
    assert log.torque is not None
    torque = log.torque + noise * np.random.default_rng(seed).standard_normal(len(log))
    return log.with_channels(torque=torque, torque_is="measured")


@pytest.mark.parametrize("seed", [1, 2])
def test_a_measured_torque_of_a_slow_log_lags_by_a_low_pass(seed: int) -> None:
    form = behind_a_lag([slow_record(0.8e-3, 0.005, seed)], (), CASCADE)
    assert form is not None and [f.effect for f in form.findings] == ["torque_filter"]
    found = form.findings[0].parameters["time_constant"]
    assert abs(found.value - 0.8e-3) < 3.0 * found.std < 0.3 * found.value
    assert form.notes[0].startswith("The measured torque lags behind what the controller asks for, by a low pass of 0.")


@pytest.mark.parametrize("seed", [1, 2])
def test_a_noise_of_the_measured_torque_is_no_lag_and_a_commanded_one_has_none(seed: int) -> None:
    assert behind_a_lag([slow_record(0.0, 0.005, seed)], (), CASCADE) is None
    assert behind_a_lag([slow_record(0.8e-3, 0.005, seed).with_channels(torque_is="commanded")], (), CASCADE) is None


def test_what_was_given_beside_the_lag_stays() -> None:
    given = replace(CASCADE, velocity=replace(CASCADE.velocity, torque_limit=50.0, anti_windup="hold"))
    form = behind_a_lag([slow_record(0.8e-3, 0.005)], (), given)
    assert form is not None and form.controller.velocity == given.velocity
    assert [type(f) for f in form.controller.torque_filters] == [ga.LowPass]


@pytest.mark.parametrize("lines", [1, 2])
def test_a_torque_that_a_slow_log_writes_late_has_no_lag(lines: int) -> None:
    rec = slow_record(0.0, 0.005)
    assert rec.torque is not None
    late = rec.with_channels(torque=np.concatenate([np.zeros(lines), rec.torque[:-lines]]))
    assert behind_a_lag([late], (), CASCADE) is None


@pytest.mark.long
def test_a_lag_behind_the_current_of_a_slow_log_is_found_with_the_friction() -> None:
    """The torque follows without it, too, within what its log can show."""
    dia = ga.diagnose(slow_record(0.8e-3, 0.005), CASCADE)
    found = {f.effect: f.parameters for f in dia.causes}
    assert set(found) == {"torque_filter", "coulomb_friction"} and dia.verdict == "explained", dia.summary()
    assert found["torque_filter"]["time_constant"].value == pytest.approx(0.8e-3, rel=0.02)
    assert found["coulomb_friction"]["torque"].value == pytest.approx(0.1, rel=0.01)
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.005)
    assert dia.given_controller == CASCADE and dia.controller is None
    again, of = dia.stability().named("torque_filter")  # under the controller that was given, in which it is not
    assert of == 6 and again >= 4


@pytest.mark.long
def test_where_the_measured_torque_alone_leaves_something_the_torque_of_the_controller_behind_the_lag_drives_the_model() -> None:
    """Between two lines the measured torque does not tell enough of a stuck shaft that begins to move."""
    friction = {"torque": 0.1, "static_torque": 0.16, "stribeck_velocity": 2.0}
    dia = ga.diagnose(slow_record(0.65e-3, 0.01, seed=1, effects={"stribeck_friction": friction}), CASCADE)
    found = {f.effect: f.parameters for f in dia.causes}
    assert set(found) == {"torque_filter", "stribeck_friction"} and dia.verdict == "explained", dia.summary()
    for name, true in friction.items():
        assert abs(found["stribeck_friction"][name].value - true) < 3.0 * found["stribeck_friction"][name].std < 0.02 * true
    assert isinstance(dia.controller, ga.Cascade) and len(dia.controller.torque_filters) == 1


@pytest.mark.parametrize("known", [True, False])
def test_outliers_of_a_slow_log_are_found_at_a_torque_limit_too(known: bool) -> None:
    """There the torque answers no velocity; elsewhere it says that these are of the log alone."""
    limited = ga.Cascade(ga.PI(0.05, 2.0, torque_limit=0.25, anti_windup="hold"), T / 4)
    rec, rng = slow_record(0.0, 0.0, cascade=limited).with_channels(torque_is="commanded"), np.random.default_rng(3)
    at = np.sort(rng.choice(len(rec), 26, replace=False))
    spoiled = rec.velocity.copy()
    spoiled[at] += rng.choice([-1.0, 1.0], 26) * rng.uniform(10.0, 60.0, 26)
    given = limited if known else ga.Cascade(ga.PI(0.05, 2.0), T / 4)
    _, (lines,) = outliers_of_the_log([rec.with_channels(velocity=spoiled)], given)
    assert lines.tolist() == at.tolist()
