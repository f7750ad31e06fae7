"""Evidence before any cause is named: controller replay, what was excited, the missing torque, residual tests."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import gaident as ga
from gaident.data.signals.lattice import digits_step, lattice_step, rounding_step
from gaident.diagnosis.experiments.excitation import excitation
from gaident.diagnosis.explain.alternatives import alternatives_of, impossible_here
from gaident.diagnosis.explain.missing_torque import missing_torque
from gaident.diagnosis.library import terms
from gaident.diagnosis.library.coordinates import HIGHEST_LOBE, HIGHEST_ORDER
from gaident.diagnosis.library.equivalences import EQUIVALENT
from gaident.diagnosis.selection.offset import Offset
from gaident.errors import ModelError, RecordError
from gaident.estimation.state_space import discretised, disturbed
from gaident.identification.replay.replay import replay
from written_out import CONTROLLER, DT, LEVELS, ONE_MASS, TWO_MASS, changed, drive

# --- controller replay


def test_a_torque_made_by_this_controller_follows_to_the_last_digits() -> None:
    rec = drive()
    found = replay(rec, CONTROLLER)
    assert found.follows and found.cause == "" and found.departs is None
    assert found.maximum < 1e-13
    np.testing.assert_array_equal(found.torque, rec.torque)
    without = replay(changed(rec), CONTROLLER)
    assert without.follows is None and math.isnan(without.rms)
    np.testing.assert_allclose(without.torque, rec.torque, atol=1e-13)


def test_the_replay_is_the_simulated_controller_in_both_loops() -> None:
    command = np.repeat([20.0, -30.0, 5.0], 100)
    for loop in ("sampled", "continuous"):
        for limits in ({}, {"torque_limit": 0.3, "integrator_limit": 0.05}):
            controller = ga.PI(0.02, 0.5, loop=loop, **limits)
            done = ga.run(ONE_MASS, ga.Record(DT, command, 0.0 * command), controller)
            rec = ga.Record(DT, command, done.velocity, torque=done.torque)
            assert replay(rec, controller).maximum < 1e-12, (loop, limits)


def test_rounded_and_measured_torques_follow() -> None:
    rec = drive()
    rounded = replay(changed(rec, np.round(rec.velocity, 3), np.round(rec.torque, 4)), CONTROLLER)
    assert rounded.follows and rounded.resolution == pytest.approx(1e-4, rel=1e-9)
    noisy = rec.torque + 0.01 * np.random.default_rng(1).standard_normal(len(rec))
    measured = replay(changed(rec, torque=noisy), CONTROLLER)
    assert measured.follows and "white noise of 0.01 N m" in measured.sentence


@pytest.mark.parametrize(
    ("rec", "cause", "value"),
    [
        (drive(clamp=0.1), "integrator_limit", 0.1),
        (drive(limit=0.6), "torque_limit", 0.6),
        (drive(clamp=0.1, limit=0.6), "integrator_limit", 0.1),
        (drive(rate=3000.0), "command_rate", 3000.0),
        (drive(rectangular=True), "integration_rule", math.nan),
        (changed(drive(), torque=1000.0 * drive().torque), "scale", 1000.0),
        (changed(drive(), torque=-drive().torque), "scale", -1.0),
        (changed(drive(), torque=np.append(0.0, drive().torque[:-1])), "shift", 1.0),
    ],
)
def test_a_torque_that_does_not_follow_says_why(rec: ga.Record, cause: str, value: float) -> None:
    found = replay(rec, CONTROLLER)
    assert found.follows is False and found.departs is not None
    assert found.cause == cause, found.sentence
    assert found.value == pytest.approx(value, rel=1e-6, nan_ok=True)
    np.testing.assert_array_equal(found.torque, rec.torque)


def test_a_rectangular_integral_is_a_trapezoidal_one_with_another_gain() -> None:
    rec = drive(rectangular=True)
    same = replay(rec, CONTROLLER).controller
    assert same is not None and same.kp == pytest.approx(CONTROLLER.kp + 0.5 * CONTROLLER.ki * DT, rel=1e-9)
    assert replay(rec, same).follows


def test_the_decimals_of_a_text_log_are_no_other_controller() -> None:
    """A command that is off by the same for long adds up in the integrator: 0.01 rpm here, and the torque to six decimals."""
    rpm = 30.0 / np.pi
    good = drive(rectangular=True)
    rounded = changed(good, torque=np.round(good.torque, 6))
    rounded = ga.Record(DT, np.round(good.command * rpm + 0.0013, 2) / rpm, good.velocity, torque=rounded.torque)
    same = replace(CONTROLLER, kp=CONTROLLER.kp + 0.5 * CONTROLLER.ki * DT)
    found = replay(rounded, same)
    assert found.follows and found.maximum > 1e-5 and "rounding of the log" in found.sentence
    for given, cause in ((CONTROLLER, "integration_rule"), (replace(CONTROLLER, kp=0.012), "gains")):
        found = replay(rounded, given)
        assert found.follows is False and found.cause == cause, found.sentence
        assert found.controller is not None and found.controller.kp == pytest.approx(same.kp, rel=1e-3)


def test_speeds_in_rpm_show_as_a_factor() -> None:
    rpm = 30.0 / np.pi
    rec = ga.Record(DT, drive().command * rpm, drive().velocity * rpm, torque=drive().torque)
    found = replay(rec, CONTROLLER)
    assert found.cause == "scale" and "speeds in rpm" in found.sentence


def test_departure_gains_start_and_rubbish() -> None:
    clamped = drive(clamp=0.1)
    integral = clamped.torque - 0.02 * (clamped.command - clamped.velocity)
    first = int(np.argmax(np.abs(integral) >= 0.1 - 1e-12))
    assert first <= replay(clamped, CONTROLLER).departs <= first + 3
    gains = replay(drive(), ga.PI(0.025, 0.4))
    assert gains.cause == "gains" and "kp = 0.02 N m s/rad and ki = 0.5 N m/rad" in gains.sentence
    loaded = replay(changed(drive(), torque=drive().torque + 0.07), CONTROLLER)
    assert loaded.follows and loaded.cause == "initial_integral" and loaded.value == pytest.approx(0.07)
    strange = replay(changed(drive(), torque=drive().torque + 0.05 * np.sin(0.01 * np.arange(2000))), CONTROLLER)
    assert strange.follows is False and strange.cause == "" and "none of the simple reasons" in strange.sentence
    with pytest.raises(RecordError, match=r"no torque and nothing to make it from"):
        replay(changed(drive()), None)


def test_the_digits_of_a_text_log_are_found_and_not_invented() -> None:
    x = 40.0 * np.random.default_rng(3).standard_normal(3000)
    assert 100.0 < np.abs(x).max() < 1000.0
    for digits in (5, 7, 9):
        assert rounding_step(np.array([float(f"{v:.{digits}g}") for v in x])) == pytest.approx(10.0 ** (3 - digits))
    assert rounding_step(x) == 0.0 and rounding_step(np.zeros(10)) == 0.0
    assert rounding_step(np.round(x / 0.3) * 0.3) == pytest.approx(0.3)
    counts = np.round(x * 83.44) / 83.44  # an encoder's speeds, written with digits of their own
    for decimals, unit in ((5, 1.0), (2, np.pi / 30.0), (3, np.pi / 180.0)):
        assert digits_step(np.round(counts / unit, decimals) * unit) == pytest.approx(unit * 10.0**-decimals)
    assert digits_step(counts) == 0.0


def test_a_load_above_the_dry_friction_is_no_friction_of_two_levels() -> None:
    def found(load: float, **friction: float) -> dict[str, dict[str, ga.Estimate]]:
        levels = {"coulomb_friction": {n: ga.Estimate(v, 0.5, "N m") for n, v in friction.items()}} if friction else {}
        return {"load_torque": {"torque": ga.Estimate(load, 0.5, "N m")}, **levels}

    for load in (250.0, -250.0):
        assert impossible_here("load_torque", found(load, torque=25.0)) == {"asymmetric_friction"}
    assert impossible_here("load_torque", found(10.0)) == {"asymmetric_friction"}  # without friction: levels of 10 and -10
    assert impossible_here("load_torque", found(1.0)) == impossible_here("load_torque", found(26.0, torque=25.0)) == frozenset()
    assert impossible_here("coulomb_friction", found(250.0, torque=25.0)) == frozenset()
    here = impossible_here("load_torque", found(250.0, torque=25.0))
    assert alternatives_of("load_torque", [], [], False, None, True, here) == []
    assert alternatives_of("load_torque", [], [], False, None, True) == ["asymmetric_friction"]


def test_lattices_are_found_and_not_invented() -> None:
    rng = np.random.default_rng(0)
    x = rng.standard_normal(500)
    assert lattice_step(x) == 0.0
    for q in (0.63, 1e-3, 2.0 * math.pi / 60.0):
        assert lattice_step(np.round(x / q) * q + 0.1) == pytest.approx(q, rel=1e-6)
    assert lattice_step(np.full(50, 3.0)) == 0.0
    assert lattice_step(np.repeat([0.0, 1.0], 30)) == 0.0


# --- missing torque


def kalman(model: ga.Model, loop: str, u: np.ndarray, w: np.ndarray, noise: float, walk: float) -> tuple[np.ndarray, np.ndarray]:
    """(dhat, std) by filter and Rauch-Tung-Striebel smoother, step by step, real matrices of scipy, from a vague prior."""
    method = "bilinear" if loop == "continuous" else "zoh"
    Ad, Bd, C, D, _ = signal.cont2discrete(signal.zpk2ss(model.zeros, model.poles, model.gain), DT, method)
    m = len(Ad)
    A = np.eye(m + 1)
    A[:m, :m], A[:m, m] = Ad, Bd[:, 0]
    B, H, through, Q = np.append(Bd, 0.0), np.append(C, D), D[0, 0], np.zeros((m + 1, m + 1))
    Q[m, m] = walk**2 * DT
    # Vague: where random torques of 1 N m may have brought the drive.
    x, P = np.zeros(m + 1), np.eye(m + 1)
    for _ in range(300):
        P[:m, :m] = Ad @ P[:m, :m] @ Ad.T + Bd @ Bd.T
    steps = []
    for n in range(len(w)):
        K = P @ H / (H @ P @ H + noise**2)
        filtered, spread = x + K * (w[n] - H @ x - through * u[n]), P - np.outer(K, H @ P)
        steps.append((x, P, filtered, spread))
        x, P = A @ filtered + B * u[n], A @ spread @ A.T + Q
    x, P = filtered, spread
    found = [(x[-1], P[-1, -1])]
    for n in range(len(w) - 2, -1, -1):
        predicted, ahead, (_, _, filtered, spread) = steps[n + 1][0], steps[n + 1][1], steps[n]
        G = np.linalg.solve(ahead, A @ spread).T
        x, P = filtered + G @ (x - predicted), spread + G @ (P - ahead) @ G.T
        found.append((x[-1], P[-1, -1]))
    dhat, var = np.array(found[::-1]).T
    return dhat, np.sqrt(var)


@pytest.mark.parametrize(("model", "loop"), [(ONE_MASS, "sampled"), (TWO_MASS, "sampled"), (TWO_MASS, "continuous")])
def test_the_smoother_equals_the_textbook_one(model: ga.OneMass | ga.TwoMass, loop: str) -> None:
    controller = ga.PI(0.02, 0.5, loop=loop)
    still = ga.Record(DT, np.repeat([20.0, -40.0, 5.0], 700), np.zeros(2100))
    done = ga.run(model, still, controller)
    rng = np.random.default_rng(3)
    rec = ga.Record(DT, still.command, done.velocity + 0.1 * rng.standard_normal(2100), torque=done.torque)
    found = missing_torque(model.model(), rec, controller, noise=0.1, walk=0.3)
    dhat, std = kalman(model.model(), loop, rec.torque, rec.velocity, 0.1, 0.3)
    # The steady gains differ from the growing ones where the start is not yet forgotten (damping 4 rad/s of the zeros).
    np.testing.assert_allclose(found.dhat, dhat, rtol=0.0, atol=0.01 * std[1000])
    np.testing.assert_allclose(found.dhat[1000:], dhat[1000:], rtol=0.0, atol=1e-5 * std[1000])
    np.testing.assert_allclose(found.std, std, rtol=0.01)
    np.testing.assert_allclose(found.std[1000:], std[1000:], rtol=1e-4)


def test_dry_friction_and_load_show_with_their_sign_and_size() -> None:
    model = ONE_MASS.model()
    rec = drive(Tc=0.05)
    found = missing_torque(model, rec, CONTROLLER)
    fast = np.abs(rec.velocity) > 3.0
    since = np.array([fast[max(0, n - 30) : n + 30].all() for n in range(len(rec))])
    off = found.dhat + 0.05 * np.sign(rec.velocity)
    assert abs(off[since].mean()) < 5e-4
    assert off[since].std() < 2.0 * found.std[len(rec) // 2]
    assert found.noise == pytest.approx(0.1, rel=0.1)
    loaded = missing_torque(model, drive(load=0.03), CONTROLLER)
    assert loaded.dhat.mean() == pytest.approx(-0.03, abs=5e-4)
    assert abs(loaded.velocity - drive(load=0.03).velocity).std() < 0.15


def test_an_offset_is_told_in_the_units_of_the_axis() -> None:
    (two_levels,) = (e.of for e in EQUIVALENT if e.of is not None)
    text = Offset(two_levels, two_levels.whole, 0.512, 31.0, 0.0421).sentence
    assert "load of 0.512 N m in" in text and "0.042 N m of it is left" in text
    assert "load of 0.512 N in" in text.linear and "0.042 N of it is left" in text.linear


def test_a_true_model_misses_nothing_beyond_its_deviation() -> None:
    still = ga.Record(DT, np.repeat(LEVELS, 100), np.zeros(2000))
    done = ga.run(TWO_MASS, still, CONTROLLER)
    rng = np.random.default_rng(5)
    rec = changed(still, done.velocity + 0.1 * rng.standard_normal(2000), done.torque)
    found = missing_torque(TWO_MASS.model(), rec, CONTROLLER, noise=0.1, walk=0.05)
    # A random walk that is not there: the estimate stays within what its deviation claims.
    assert np.mean(np.abs(found.dhat) < 2.0 * found.std) > 0.95
    chosen = missing_torque(TWO_MASS.model(), rec, CONTROLLER)
    assert chosen.dhat.std() < 2e-3 and chosen.noise == pytest.approx(0.1, rel=0.05)
    assert chosen.log_likelihood > found.log_likelihood


def test_the_missing_torque_without_a_logged_torque_is_the_same() -> None:
    rec = drive(Tc=0.05)
    logged = missing_torque(ONE_MASS.model(), rec, CONTROLLER)
    replayed = missing_torque(ONE_MASS.model(), changed(rec), CONTROLLER)
    np.testing.assert_allclose(replayed.dhat, logged.dhat, atol=1e-9)


def test_the_smoother_is_fast_and_refuses_what_it_cannot_see() -> None:
    rec = drive(Tc=0.05)
    long = ga.Record(DT, np.tile(rec.command, 50), np.tile(rec.velocity, 50), torque=np.tile(rec.torque, 50))
    begin = time.process_time()
    missing_torque(TWO_MASS.model(), long, CONTROLLER)
    assert time.process_time() - begin < 5.0  # 100 000 samples
    with pytest.raises(ModelError, match="zero at 0"):
        missing_torque(ga.Model(5000.0, [-3.0, -20.0], [0.0]), rec, CONTROLLER)
    with pytest.raises(ModelError, match="p = 0"):
        missing_torque(ga.Model(5000.0, [-3.0], [-20.0]), rec, CONTROLLER)
    with pytest.raises(RecordError, match="one number per sample"):
        missing_torque(ONE_MASS.model(), rec, CONTROLLER, torque=np.zeros(7))
    with pytest.raises(ModelError, match="noise is 0"):
        missing_torque(ONE_MASS.model(), rec, CONTROLLER, noise=0.0)
    # A velocity smoothed to its last digits: the noise stays what a sensor can have.
    smooth = changed(rec, ga.simulate(ONE_MASS, rec, CONTROLLER), None)
    assert missing_torque(ONE_MASS.model(), smooth, CONTROLLER).noise >= 0.9e-5 * np.ptp(smooth.velocity)


# --- excitation


def test_the_staircase_triggers_almost_everything() -> None:
    found = excitation(drive(Tc=0.05, samples=4000), CONTROLLER, TWO_MASS.model())
    assert set(found.not_testable) == {"velocity_difference"}  # its velocities are not rounded to an encoder's counts
    assert found.reversals >= 8 and 4 < found.revolutions < 5
    assert len([v for v in found.speeds if v]) >= 6 and found.steps[-1] == 100.0
    assert set(found.one_sided) >= {"torque_saturation", "integrator_clamp", "command_rate_limit"}
    assert found.one_sided["extra_resonance"].startswith(f"one above {0.4 / DT:.3g} Hz would not have shown")
    assert "reversals" in found.sentence


def test_a_short_range_of_the_angle_is_called_a_range() -> None:
    """Back and forth over 1.5 rad: the path is long, and the range is what orders need."""
    t = 1e-3 * np.arange(8000)
    w = 0.75 * 4.0 * np.cos(4.0 * t)
    said = excitation(ga.Record(1e-3, velocity=w, torque=1e-3 * w)).one_sided["cogging"]
    assert "need more than the 0.24 turns between the lowest and the highest angle of a record" in said
    assert "need more than the 1.5 m between the lowest and the highest position of a record" in said.linear


def test_a_single_step_says_what_it_cannot_judge() -> None:
    still = ga.Record(0.444e-3, np.full(250, 43.6), np.zeros(250))
    done = ga.run(ONE_MASS, still, CONTROLLER)
    found = excitation(ga.Record(still.dt, still.command, done.velocity, torque=done.torque), CONTROLLER, ONE_MASS.model())
    expected = {
        "asymmetric_friction",
        "quadratic_drag",
        "square_root_drag",
        "friction_drift",
        "load_dependent_friction",
        "position_friction",
        "backlash",
        "hardening_stiffness",
        "hysteretic_coupling",
        "velocity_difference",
    }
    assert set(found.not_testable) - {"torque_dead_band"} == expected
    assert found.not_testable["asymmetric_friction"] == "the axis turns forwards only"
    assert "coulomb_friction" not in found.not_testable


def test_little_travel_no_loop_and_no_motion() -> None:
    t = DT * np.arange(2000)
    w = 0.2 * np.cos(31.4 * t)
    small = excitation(ga.Record(DT, velocity=w, torque=0.01 * np.cos(31.4 * t + 1.0)))
    assert {"unbalance", "cogging", "velocity_ripple", "integrator_clamp", "command_rate_limit"} <= set(small.not_testable)
    assert "degrees" in small.not_testable["unbalance"]
    still = excitation(ga.Record(DT, velocity=0.0 * t, torque=0.0 * t))
    assert still.not_testable["coulomb_friction"] == "the axis does not move"
    assert still.not_testable["transport_delay"] == "the torque never changes"
    with pytest.raises(RecordError, match="at least one"):
        excitation([])


def test_an_axis_whose_reversals_fall_between_the_lines_reverses() -> None:
    """Fast ramps through zero: no line is as slow as the noise, and in a slow log no line ever is."""
    w = 10.0 * np.sign(np.sin(0.1 * np.arange(400) + 0.05)) * (1.0 + 0.01 * np.sin(np.arange(400)))
    found = excitation(ga.Record(1e-2, velocity=w, torque=np.gradient(w)))
    assert not {"presliding_friction", "lugre_friction"} & set(found.not_testable)
    ahead = excitation(ga.Record(1e-2, velocity=np.abs(w), torque=np.gradient(w)))
    assert ahead.not_testable["presliding_friction"].startswith("the axis neither stands nor reverses")


def test_what_one_record_lacks_another_may_bring() -> None:
    forwards = drive()[100:200]
    assert "asymmetric_friction" in excitation(forwards, CONTROLLER).not_testable
    assert "asymmetric_friction" not in excitation([forwards, drive()[400:500]], CONTROLLER).not_testable
    assert excitation(drive(), replace(CONTROLLER, torque_limit=4.0)).torque_share == pytest.approx(
        np.abs(drive().torque).max() / 4.0
    )


def test_a_limit_of_the_controller_is_why_no_more_torque_was_asked_for() -> None:
    asked = np.repeat([0.0, 40.0, -40.0], [50, 200, 200])
    still = ga.Record(DT, command=asked, velocity=np.zeros(450))
    sizes = {}
    for name, ctl in {
        "none": CONTROLLER,
        "torque": replace(CONTROLLER, torque_limit=0.5),
        "integral": replace(CONTROLLER, integrator_limit=0.05),
        "not reached": replace(CONTROLLER, torque_limit=1e3, integrator_limit=1e3),
    }.items():
        done = ga.run(ONE_MASS, still, ctl)
        sizes[name] = excitation(ga.Record(DT, asked, done.velocity, torque=done.torque), ctl).one_sided
    asked_for, let_through = "no more torque was asked for", "the controller's own limit lets no more through"
    assert sizes["torque"]["torque_saturation"] == f"a limit above 0.5 N m would not have shown: {let_through}"
    for name in ("none", "integral", "not reached"):
        assert sizes[name]["torque_saturation"].endswith(asked_for)
    own = "the controller's own clamp lets it go no higher"
    assert sizes["integral"]["integrator_clamp"] == f"a clamp above 0.05 N m would not have shown: {own}"
    for name in ("none", "torque", "not reached"):
        assert sizes[name]["integrator_clamp"].endswith("the integral went no higher")


def test_the_integral_is_read_where_no_limit_cuts_the_torque() -> None:
    """u - kp (r - w) of a torque at its limit is not the integral."""
    asked = np.repeat([0.0, 40.0, -40.0], [50, 200, 200])
    ctl = replace(CONTROLLER, ki=0.05, torque_limit=0.3 * CONTROLLER.kp * 40.0)
    still = ga.Record(DT, command=asked, velocity=np.zeros(450))
    done = ga.run(ONE_MASS, still, ctl)
    free = np.abs(done.torque) < 0.999 * ctl.limits[0]
    integral = float(np.abs(done.torque - ctl.kp * (asked - done.velocity))[free].max())
    cut = float(np.abs(done.torque - ctl.kp * (asked - done.velocity)).max())
    assert cut > 1.5 * integral
    sizes = excitation(ga.Record(DT, asked, done.velocity, torque=done.torque), ctl).one_sided
    assert f"above {integral:.3g} N m" in sizes["integrator_clamp"]


def test_an_axis_at_rest_shows_no_friction_of_the_family_and_no_order_up_to_the_highest() -> None:
    still = ga.Record(DT, velocity=np.zeros(500), torque=np.zeros(500))
    levels = {t.name for t in terms.LIBRARY.values() if t.levels}
    family = {t.name for t in terms.LIBRARY.values() if t.family}
    assert family == {*levels, "square_root_drag"} and family <= set(excitation(still).not_testable)
    highest = {t.orders[1] for t in terms.LIBRARY.values() if t.harmonic and t.orders[1] > 1}
    assert highest == {HIGHEST_LOBE, HIGHEST_ORDER}
    t = DT * np.arange(2000)
    for name, order in (("cogging", HIGHEST_ORDER), ("position_inertia", HIGHEST_LOBE)):
        for share, shown in ((0.99, False), (1.01, True)):  # of the travel that contains one period of that order
            angle = 0.5 * share * math.tau / order * np.sin(20.0 * t)
            rec = ga.Record(DT, velocity=np.gradient(angle, DT), torque=np.cos(20.0 * t), position=angle)
            assert (name not in excitation(rec).not_testable) is shown


def test_a_hum_is_not_looked_for_under_a_measured_torque() -> None:
    t = DT * np.arange(2000)
    moving = {"velocity": np.sin(20.0 * t), "torque": np.cos(20.0 * t)}
    under = excitation(ga.Record(DT, **moving, torque_is="measured")).not_testable
    assert "was measured" in under["torque_hum"]
    commanded = ga.Record(DT, **moving, torque_is="commanded")
    assert "torque_hum" not in excitation(commanded).not_testable


# --- residual tests


def fitted(rec: ga.Record) -> ga.Model:
    return ga.identify(rec, controller=CONTROLLER, space=ga.SearchSpace(
        gain=(100.0, 1e5), real=(-1.0, 200.0), imaginary=(0.0, 1e3), p=(1, 1), q=(0, 0)), workers=1).model  # fmt: skip


def test_the_disturbed_loop_is_the_simulated_one() -> None:
    """From a torque step beside the controller's to the velocity, against the loop simulated sample by sample."""
    for model, loop in ((ONE_MASS, "sampled"), (TWO_MASS, "sampled"), (ONE_MASS, "continuous")):
        plant = discretised(model.model(), DT, loop)
        f = np.where(np.arange(300) > 20, 0.1, 0.0)
        x, w_old, integral, w = np.zeros(len(plant.B), dtype=complex), 0.0, 0.0, np.empty(300)
        for n in range(300):
            # w = C x + D (u + f), u = I - (kp + h) w, I without the newest error: one unknown
            h = 0.5 * CONTROLLER.ki * DT
            w[n] = ((plant.C @ x).real + plant.D * (integral - h * w_old + f[n])) / (1.0 + plant.D * (CONTROLLER.kp + h))
            integral -= h * (w[n] + w_old)
            x = plant.A @ x + plant.B * (integral - CONTROLLER.kp * w[n] + f[n])
            w_old = w[n]
        np.testing.assert_allclose(disturbed(plant, CONTROLLER, DT).response(f), w, atol=1e-12)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_what_a_record_cannot_test_is_no_alternative(direction: float) -> None:
    """A load that drives, in one direction of motion: dry friction of two levels is a load as well, but needs both directions."""
    torque = direction * (1.0 + 0.4 * np.sign(np.sin(np.arange(800) / 37.0)))
    drive = ga.OneMass(J=0.01, D=0.05).model().with_effect("load_torque", torque=-0.3 * direction)
    run = ga.run(drive, ga.Record(1e-3, torque=torque, velocity=np.zeros(800)))
    noise = 0.02 * np.random.default_rng(1).standard_normal(800)
    dia = ga.diagnose(ga.Record(1e-3, torque=torque, velocity=run.velocity + noise))
    (load,) = dia.causes
    assert load.effect == "load_torque" and "coulomb_friction" in load.alternatives
    assert "asymmetric_friction" in dia.not_testable and not dia.not_testable.keys() & set(load.alternatives)
