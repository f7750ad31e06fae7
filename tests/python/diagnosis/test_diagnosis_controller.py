"""What the logged torque tells a diagnosis before any plant: gains, limits, anti-windup; and which samples are outliers."""

from __future__ import annotations

import gc
import math
import weakref

import numpy as np
import pytest

import gaident as ga
import gaident.identification.replay.replay as replay_module
from friction_drive import CONTROLLER, DRIVE, DT, drive_record
from gaident.control.pi_torque import held_torque
from gaident.diagnosis.controller.as_read import outliers_of_the_log
from gaident.diagnosis.controller.form_findings import driver_of, loop_of
from gaident.diagnosis.records.hygiene import outliers
from gaident.identification.replay.causes import white_noise
from gaident.identification.replay.replay import Replay, replay
from gaident.models.starts import noise_std

J, D = 5e-4, 2e-3
LEVELS = np.repeat((60.0, -60.0, 20.0, -40.0, 60.0, -20.0), 120)


def limited_drive(limit: float, hold: str = "", hum: float = 0.0, step: float = 0.0, seed: int = 0) -> ga.Record:
    """One mass behind a torque limit, noise inside the loop; hold: how the integrator is kept from winding up (text of HOLDS).

    hum: a torque of 37 Hz at the shaft [N m]; step: resolution of the velocity [rad/s].
    The controller's equations once more, sample by sample, with the exact step of the mass.
    """
    rng = np.random.default_rng(seed)
    decay = math.exp(-D / J * DT)
    w = integral = last = 0.0
    seen, torques = [], []
    for n, command in enumerate(LEVELS):
        y = w + 0.02 * rng.standard_normal()
        y = round(y / step) * step if step else y
        e = command - y
        new = integral + 0.5 * CONTROLLER.ki * DT * (e + last)
        v = CONTROLLER.kp * e + new
        u = min(max(v, -limit), limit)
        if not hold or u == v or (hold == "held_back" and e * v <= 0.0):
            integral = new
        elif hold == "tracked":
            integral = u - CONTROLLER.kp * e
        last = e
        seen.append(y)
        torques.append(u)
        w = decay * w + (1.0 - decay) * (u + hum * math.sin(math.tau * 37.0 * n * DT)) / D
    return ga.Record(DT, command=LEVELS, velocity=np.array(seen), torque=np.array(torques))


def test_a_velocity_that_the_log_alone_has_noise_on_asks_for_no_form_of_controller() -> None:
    """The controller read a velocity without it: its torque follows from one that is off by white noise."""
    seen = limited_drive(math.inf)
    off = 0.03 * np.random.default_rng(3).standard_normal(len(seen))
    rec = seen.with_channels(velocity=seen.velocity + off)
    told = replay(rec, CONTROLLER)
    assert told.follows is False and not told.cause
    assert told.velocity_noise == pytest.approx(float(np.std(off)), rel=0.05)
    assert "off the logged one by white noise" in told.sentence
    found = loop_of([rec], CONTROLLER)
    assert found.controller == CONTROLLER and found.at_rate and not found.findings
    assert driver_of([rec], [], CONTROLLER) is None


def test_a_filter_of_the_torque_is_no_shift_with_other_gains() -> None:
    """Under rare steps what a shift by one sample leaves of a low pass passes for white: large errors that are few."""
    period, pi = 1.25e-4, ga.PI(0.0232, 1.367)
    command = np.repeat(np.random.default_rng(0).uniform(-80.0, 80.0, 8), 1000)
    filtered = ga.Cascade(pi, period=period, torque_filters=(ga.LowPass(2.7e-4),))
    two = ga.TwoMass(JM=8.7e-5, DM=3.5e-3, JL=5e-4, DL=9e-3, KG=3.1).model()
    run = ga.run(two, ga.Record(period, command=command, velocity=0.0 * command), filtered)
    rec = ga.Record(period, command=command, velocity=run.velocity, torque=run.torque)
    told = replay(rec, pi)
    assert told.follows is False and not told.cause
    assert replay(rec, filtered).follows


@pytest.mark.parametrize(("spikes", "size"), [(1, 0.1), (10, 0.1), (3, 0.3)])
def test_a_measured_torque_with_spikes_follows(spikes: int, size: float) -> None:
    """One spike of half the torque's deviation has more squares than the noise of 2400 samples."""
    rng, pi = np.random.default_rng(1), ga.PI(0.05, 1.0)
    command = np.repeat([20.0, -30.0, 10.0, -5.0, 40.0, -20.0, 3.0, 0.0], 300)
    drive = ga.OneMass(J=1e-3, D=2e-3).model().with_effect("coulomb_friction", torque=0.03)
    run = ga.run(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), pi)
    torque = run.torque + 1e-3 * rng.standard_normal(len(command))
    torque[rng.choice(len(command), spikes, replace=False)] += size * rng.choice([-1.0, 1.0], spikes)
    told = replay(ga.Record(1e-3, command=command, velocity=run.velocity, torque=torque), pi)
    assert told.follows and "and a few spikes: it is a measured torque" in told.sentence


def test_white_noise_is_everywhere() -> None:
    """Normal noise and noise with long tails are noise; a few large errors are not, however white."""
    rng = np.random.default_rng(1)
    torque = rng.standard_normal(4000)
    for noise in (rng.standard_normal(4000), rng.standard_t(4, 4000), rng.uniform(-1.0, 1.0, 4000)):
        assert white_noise(0.02 * noise, torque) == pytest.approx(0.02 * np.std(noise))
    few = np.zeros(4000)
    few[rng.choice(4000, 30, replace=False)] = rng.standard_normal(30)
    assert white_noise(0.1 * few + 1e-3 * rng.standard_normal(4000), torque) == 0.0


def test_a_limit_that_is_not_reached_hides_no_noise_of_the_log() -> None:
    seen = limited_drive(math.inf)
    rec = seen.with_channels(velocity=seen.velocity + 0.03 * np.random.default_rng(3).standard_normal(len(seen)))
    highest = float(np.abs(rec.torque).max())
    far, reached = (ga.PI(CONTROLLER.kp, CONTROLLER.ki, torque_limit=share * highest) for share in (2.0, 1.0))
    assert replay(rec, far).velocity_noise == pytest.approx(0.03, rel=0.05)
    assert replay(rec, reached).velocity_noise == 0.0


def test_a_filter_of_the_controller_is_no_noise_of_the_log() -> None:
    seen = limited_drive(math.inf)
    filtered = ga.Cascade(CONTROLLER, velocity_filters=(ga.LowPass(2e-3),))
    rec = seen.with_channels(torque=filtered.torque_of(seen), velocity=seen.velocity)
    assert replay(rec, CONTROLLER).velocity_noise == 0.0
    assert replay(seen, ga.PI(1.2 * CONTROLLER.kp, CONTROLLER.ki)).velocity_noise == 0.0


def test_corners_impacts_tops_and_delays_are_no_outliers() -> None:
    rng = np.random.default_rng(0)
    n = np.arange(400)
    rough = 0.02 * rng.standard_normal(400)
    corner = np.where(n < 200, 20.0, 20.0 - 4.0 * (n - 200))
    impact = np.where(n < 200, 0.0, 5.0 * np.exp(-(n - 200) / 3.0))
    top = -0.4 * np.abs(n - 200.0) ** 1.5
    flat_then_error = np.where(n == 200, 1.2, 0.0)  # what a model makes of a delay that it does not know
    for signal in (corner, impact, top):
        assert len(outliers(signal + rough)) == 0
        assert len(outliers(signal + rough, rough + flat_then_error)) == 0


def test_outliers_are_found_on_slopes_and_side_by_side_and_only_where_the_model_does_not_follow() -> None:
    rng = np.random.default_rng(1)
    n = np.arange(600)
    noise = 0.02 * rng.standard_normal(600)
    signal = 20.0 * np.sin(n / 15.0)
    at = np.array([50, 120, 121, 300, 455])
    spikes = np.zeros(600)
    spikes[at] = (3.0, 8.0, 5.0, -4.0, -9.0)
    np.testing.assert_array_equal(outliers(signal + noise + spikes, noise + spikes), at)
    assert len(outliers(signal + noise + spikes, noise)) == 0  # the model does the same


def test_a_factor_of_the_torque_says_what_else_would_be_as_much_larger() -> None:
    """Gains both wrong by one factor and a wrong unit of the torque are the same to the log."""
    rec = limited_drive(10.0)
    dia = ga.diagnose(rec.with_channels(torque=1.25 * rec.torque), CONTROLLER)
    assert dia.controller.kp == pytest.approx(1.25 * CONTROLLER.kp, rel=1e-6)
    assert dia.mechanics["inertia"].value == pytest.approx(1.25 * J, rel=1e-2)
    assert "If the gains are as given, inertia, friction and every other torque below are 0.8 times as large." in " ".join(
        dia.notes
    )


def test_what_a_difference_of_counts_loses_to_rounding_is_no_step_of_the_encoder() -> None:
    """(theta(n) - theta(n-1))/dt holds its value but for the last digits, where the angle is much larger than a step of it."""
    n = np.arange(4000)
    counts = np.floor(3000.0 * np.sin(n / 60.0)) * (n < 1200) + np.floor(0.02 * n)  # it moves, then a count now and then
    q = 2.0 * np.pi / 10000.0
    dusty, exact = np.diff(counts * q) / DT, np.diff(counts) * (q / DT)
    steps = np.abs(np.diff(dusty))
    assert 0.0 < steps[steps > 0.0].min() < 1e-9 * q / DT
    np.testing.assert_array_equal(outliers(dusty), outliers(exact))
    assert noise_std(dusty) == pytest.approx(noise_std(exact), rel=1e-9)


@pytest.mark.parametrize("read", [False, True], ids=["of the log alone", "read by the controller"])
def test_at_the_rate_of_the_log_the_torque_says_whether_the_controller_read_an_outlier(read: bool) -> None:
    rec = limited_drive(10.0)
    rng, at = np.random.default_rng(3), np.array([90, 200, 333, 471, 600])
    spikes = np.zeros(len(rec))
    spikes[at] = rng.choice([-1.0, 1.0], len(at)) * rng.uniform(10.0, 30.0, len(at))
    spoiled = rec.with_channels(velocity=rec.velocity + spikes)
    if read:
        spoiled = spoiled.with_channels(torque=CONTROLLER.torque_of(spoiled))
    (clean,), (lines,) = outliers_of_the_log([spoiled], CONTROLLER)
    if read:
        assert clean is spoiled and len(lines) == 0
        return
    np.testing.assert_array_equal(lines, at)
    np.testing.assert_allclose(clean.velocity, rec.velocity, atol=1e-9)
    dia = ga.diagnose(spoiled, CONTROLLER)
    assert dia.verdict == "adequate" and [f.effect for f in dia.findings] == ["outliers"], dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=2e-3)
    assert dia.digests == (spoiled.digest,) and dia.records == (spoiled,), "the result is of the log that was given"


def test_a_replay_is_made_once_for_a_record_and_kept_no_longer_than_it() -> None:
    rec = limited_drive(0.2)
    other = ga.PI(2.0 * CONTROLLER.kp, CONTROLLER.ki)
    assert replay(rec, CONTROLLER) is replay(rec, CONTROLLER)
    assert replay(rec, other) is not replay(rec, CONTROLLER) and replay(rec, other).follows is False
    assert replay(rec.with_channels(torque=0.5 * rec.torque), CONTROLLER).rms > 0.0
    gone = weakref.ref(rec)
    del rec
    gc.collect()
    assert gone() is None


def test_a_log_that_follows_from_the_recorded_velocity_is_not_compared_with_the_cleaned_one() -> None:
    """Glitches of the sensor that the controller read are left out of the fit, not out of the replay."""
    asked = drive_record().command
    assert asked is not None
    glitch = np.zeros(len(asked))
    glitch[[150, 700, 1333]] = (9.0, -12.0, 10.0)
    noise = 0.05 * np.random.default_rng(3).standard_normal(len(asked)) + glitch
    done = ga.run(DRIVE, ga.Record(DT, command=asked - noise, velocity=np.zeros(len(asked))), CONTROLLER)
    seen = ga.Record(DT, command=asked, velocity=done.velocity + noise, torque=done.torque)
    found = ga.diagnose(seen, CONTROLLER)
    assert [f.effect for f in found.findings] == ["outliers", "coulomb_friction"], found.summary()
    assert not any("does not follow" in note for note in found.notes)
    # Spoiled behind the controller, in the log alone, the cleaned velocity is what it read.
    good = drive_record()
    spoiled = ga.Record(DT, command=good.command, velocity=good.velocity + glitch, torque=good.torque)
    found = ga.diagnose(spoiled, CONTROLLER)
    assert found.findings[0].parameters["fraction"].value == 3 / len(asked)
    assert [f.effect for f in found.causes] == ["coulomb_friction"], found.summary()


def test_gains_that_the_log_shows_take_the_place_of_the_given_ones() -> None:
    wrong = ga.PI(kp=1.3 * CONTROLLER.kp, ki=CONTROLLER.ki)
    found = ga.diagnose(drive_record(), wrong, validation=drive_record(1))
    assert found.controller is not None and found.controller.kp == pytest.approx(CONTROLLER.kp, rel=1e-4)
    assert any(
        "All simulations use these (kp = 0.05 N m s/rad, ki = 1.5 N m/rad, trapezoidal integral)" in note for note in found.notes
    )
    assert [(f.effect, f.place) for f in found.causes] == [("other_gains", "controller"), ("coulomb_friction", "shaft")]
    assert found.after.rmse < 1.1 * found.after.noise_floor < found.before.rmse


@pytest.mark.parametrize("hold", ["held", "held_back", "tracked"])
def test_an_anti_windup_is_named(hold: str) -> None:
    rec = limited_drive(0.5, hold)
    assert rec.command is not None and rec.torque is not None
    known = ga.PI(CONTROLLER.kp, CONTROLLER.ki, torque_limit=0.5)
    np.testing.assert_allclose(held_torque(rec.command, rec.velocity, DT, known, hold), rec.torque, atol=1e-12)
    for controller in (CONTROLLER, known):
        found = replay(rec, controller)
        assert found.cause == "anti_windup" and "(anti-windup)" in found.sentence, found.sentence
        assert found.value == 0.5 and found.controller == known
    # A measured torque has a noisy plateau.
    measured = rec.torque + 0.005 * np.random.default_rng(4).standard_normal(len(rec))
    found = replay(ga.Record(DT, command=rec.command, velocity=rec.velocity, torque=measured), CONTROLLER)
    assert found.cause == "anti_windup" and found.value == pytest.approx(0.5, rel=0.005), found.sentence


def issued(e: np.ndarray, limit: float, share: float, hold: str) -> np.ndarray:
    """The PI's torque sample by sample; share, hold: as `held_torque` has them, hold "": the integrator winds up."""
    kp, step, integral, last, torque = CONTROLLER.kp, CONTROLLER.ki * DT, 0.0, 0.0, []
    for now in e:
        after = integral + step * ((0.5 + share) * now + (0.5 - share) * last)
        wanted = kp * now + after
        torque.append(min(max(wanted, -limit), limit))
        if torque[-1] == wanted or hold == "" or (hold == "held_back" and now * wanted <= 0.0):
            integral = after
        elif hold == "tracked":
            integral = torque[-1] - kp * now
        last = now
    return np.array(torque)


@pytest.mark.parametrize("hold", ["", "held", "held_back", "tracked"])
@pytest.mark.parametrize("share", [0.0, 0.5, -0.5])
def test_limits_and_rules_of_integration_are_found_in_a_text_log(share: float, hold: str) -> None:
    rec = limited_drive(0.5)
    assert rec.command is not None
    log = [rec.command, rec.velocity, issued(rec.command - rec.velocity, 0.5, share, hold)]
    for digits in (7, 5) if hold == "" else (7,):  # one digit more or less decides when an integrator is held
        r, w, u = ([float(f"{x:.{digits}g}") for x in column] for column in log)
        found = replay(ga.Record(DT, command=r, velocity=w, torque=u), CONTROLLER)
        assert found.cause == ("anti_windup" if hold else "torque_limit"), found.sentence
        assert found.value == 0.5 and ("rectangular" in found.sentence) == (share != 0.0)
        assert ("lacks the newest error" in found.sentence) == (share < 0.0)
        same = ga.PI(CONTROLLER.kp + share * CONTROLLER.ki * DT, CONTROLLER.ki, torque_limit=0.5)
        assert found.controller is not None and found.controller.kp == pytest.approx(same.kp, rel=1e-12)
        assert found.controller.limits == same.limits


def test_a_torque_channel_of_zeros_is_no_controller() -> None:
    rec = limited_drive(0.5)
    found = replay(ga.Record(DT, command=rec.command, velocity=rec.velocity, torque=np.zeros(len(rec))), CONTROLLER)
    assert found.follows is False and found.controller is None


def test_a_limit_that_the_log_shows_is_a_finding_and_part_of_the_model() -> None:
    found = ga.diagnose(limited_drive(0.5), CONTROLLER, validation=limited_drive(0.5, seed=1))
    assert found.verdict == "explained" and [f.effect for f in found.findings] == ["torque_saturation"], found.summary()
    (limit,) = found.findings
    assert limit.parameters["limit"].value == 0.5 and "which acts at" in limit.evidence
    assert [e.name for e in found.model.effects] == ["torque_saturation"]
    assert found.after.rmse < 1.2 * found.after.noise_floor < 0.1 * found.before.rmse


def test_an_anti_windup_is_said_and_its_free_run_not_trusted() -> None:
    found = ga.diagnose(limited_drive(0.5, "held"), CONTROLLER)
    assert [(f.effect, f.place) for f in found.findings] == [("torque_saturation", "controller"), ("anti_windup", "controller")]
    assert found.findings[1].delta_bic > 100.0 and "the integrator held while the torque is limited" in found.findings[0].evidence
    assert any("does not hold its integrator" in note for note in found.notes)
    configured = ga.diagnose(limited_drive(0.5, "held"), ga.PI(CONTROLLER.kp, CONTROLLER.ki, torque_limit=0.5))
    assert [f.effect for f in configured.findings] == ["anti_windup"] and configured.verdict == "explained"
    assert "(anti-windup)" in configured.findings[0].evidence


def test_a_hum_gets_its_frequency_and_size_and_a_lattice_its_noise() -> None:
    found = ga.diagnose(limited_drive(math.inf, hum=0.03, step=0.1), CONTROLLER)
    (cause,) = found.causes
    assert found.verdict == "explained" and (cause.effect, cause.alternatives) == ("torque_hum", ()), found.summary()
    assert cause.parameters["frequency"].value == pytest.approx(37.0, abs=0.03)
    assert cause.parameters["amplitude"].value == pytest.approx(0.03, rel=0.05)
    assert found.before.noise_floor >= 0.1 / math.sqrt(12.0)


@pytest.mark.long
def test_a_hum_in_two_records_is_one_frequency_with_a_phase_of_each() -> None:
    """No effect has a phase of each record: what it is like is said of the error that is left."""
    whole = limited_drive(math.inf, hum=0.03)
    found = ga.diagnose([whole[: len(whole) // 2], limited_drive(math.inf, seed=1, hum=0.03)[len(whole) // 3 :]], CONTROLLER)
    assert found.driver == "time" and found.line is not None, found.summary()
    assert found.line == (pytest.approx(37.0, abs=0.3), pytest.approx(0.03, rel=0.1))


@pytest.mark.long
def test_a_diagnosis_replays_a_record_once_with_the_same_controller(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only another controller, or a record with other samples, asks for another replay."""
    done = []
    made = replay_module._replayed

    def counted(rec: ga.Record, controller: ga.PI | None) -> Replay:
        done.append((rec.digest, controller))
        return made(rec, controller)

    monkeypatch.setattr(replay_module, "_replayed", counted)
    monkeypatch.setattr(replay_module, "_KEPT", weakref.WeakKeyDictionary())  # no record of another test
    first, second = limited_drive(1.0), limited_drive(1.0, seed=1)
    assert "torque_saturation" in {f.effect for f in ga.diagnose([second, first], CONTROLLER).causes}
    assert {(r.digest, CONTROLLER) for r in (first, second)} <= set(done) and len(set(done)) == len(done)
    done.clear()
    rec = drive_record()
    used = ga.diagnose(rec, ga.PI(kp=0.06, ki=1.5)).controller
    assert used is not None and used.kp == pytest.approx(CONTROLLER.kp, rel=1e-3)
    assert {(rec.digest, ga.PI(kp=0.06, ki=1.5)), (rec.digest, used)} <= set(done) and len(set(done)) == len(done)
