"""A log that wrote a channel on another line than the rest: what law and motion tell, what is moved, what is only said."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from drive_rig import Plant, rig
from gaident.cli import main
from gaident.diagnosis.controller.driving import driving_of
from gaident.diagnosis.controller.form_findings import loop_of
from gaident.diagnosis.controller.log_shift import Aligned, aligned
from gaident.errors import ReadError, RecordError
from gaident.estimation.regression.torque_lag import torque_lag
from gaident.identification.replay.driven_records import torque_driven
from gaident.models.effects_linear import LINEAR, response_of

RIGID = Plant(3e-4, 2e-3, 0.03, 1.9, 1e-3, name="rigid")
ELASTIC = Plant(1e-4, 1e-3, 0.03, 1.0, 1e-3, JL=1e-4, DL=1e-3, KG=20.0, name="antiresonance at 71 Hz")
SOFT = Plant(2e-4, 2e-3, 0.03, 1.9, 1e-3, JL=3e-4, DL=1e-3, KG=2.0, name="antiresonance at 13 Hz")
STEPS = np.repeat(np.random.default_rng(5).uniform(-60, 60, 15), 200)
SINE = 40 * np.sin(2 * np.pi * 2e-3 * np.arange(3000))
FRICTION = {"coulomb_friction": {"torque": 0.05}}
DELAY = {"transport_delay": {"delay": 1e-3}}


def noisy(rec: ga.Record, share: float = 0.05) -> ga.Record:
    """The record with its torque measured."""
    assert rec.torque is not None
    noise = share * float(rec.torque.std()) * np.random.default_rng(2).standard_normal(len(rec))
    return rec.with_channels(torque=rec.torque + noise, torque_is="measured")


def looked_at(rec: ga.Record, plant: Plant | None) -> tuple[dict[str, int], Aligned]:
    found = aligned([rec], [], None if plant is None else plant.controller)
    return {name: k for moves in found.shifts.values() for name, k in moves.items()}, found


@pytest.mark.parametrize("plant", [RIGID, ELASTIC, SOFT], ids=lambda p: p.name)
@pytest.mark.parametrize("noise", ["white"])
def test_the_law_shows_which_channel_was_moved(plant: Plant, noise: str) -> None:
    rec = rig(plant, STEPS, FRICTION, noise)
    assert looked_at(rec, plant) == ({}, aligned([rec], [], plant.controller))
    for channel, k in (("torque", 1), ("torque", -2), ("velocity", 1), ("velocity", -1), ("command", -2)):
        back, found = looked_at(rec.shifted(**{channel: k}), plant)
        assert back == {channel: -k}
        assert f"{channel} by {-k:+d}" in found.notes[0] and len(found.notes) == 1
    back, found = looked_at(rec.shifted(torque=1, velocity=-1), plant)
    assert back == {"command": 1, "velocity": 2}  # all stand as before, a sample later
    assert looked_at(found.records[0], plant)[0] == {}


@pytest.mark.long
@pytest.mark.parametrize("channel", ["velocity", "command"])
def test_where_a_shift_makes_the_torque_follow_no_other_sample_time_is_advised(channel: str) -> None:
    rec = rig(RIGID, STEPS, FRICTION, "white").shifted(**{channel: 1})
    asked = loop_of([rec], RIGID.controller)
    driven = torque_driven([rec], RIGID.controller)
    found = driving_of(driven.records, (), asked, driven, {driven.records[0].digest: rec})
    assert found.moved.shifts == {rec.digest: {channel: -1}}
    assert not any("period" in note for note in (*found.notes, *found.moved.notes))


@pytest.mark.long
def test_what_is_no_shift_is_not_moved() -> None:
    """Delay, lag, filter, wrong gains, another rule of integration and limits are explained otherwise, or are the drive's."""
    rectangular = ga.PI(RIGID.kp + 0.5 * RIGID.ki * RIGID.dt, RIGID.ki)
    for effects in ({}, DELAY, {"torque_lag": {"time_constant": 1e-3}}, {"velocity_filter": {"time_constant": 2e-3}},
                    {"integrator_clamp": {"limit": 0.1}}):  # fmt: skip
        for command in (STEPS, SINE):
            rec = rig(RIGID, command, effects)
            for controller in (RIGID.controller, rectangular, ga.PI(1.3 * RIGID.kp, 0.8 * RIGID.ki)):
                assert not aligned([rec], [], controller).shifts
                assert not aligned([noisy(rec)], [], controller).shifts


def test_a_lagging_measured_torque_is_no_shift() -> None:
    """A current behind a first-order lag of one sample stands about a sample late, but by no whole number of them."""
    rec = rig(RIGID, STEPS, FRICTION)
    assert rec.torque is not None
    lagged = np.copy(rec.torque)
    for n in range(1, len(lagged)):
        lagged[n] = lagged[n - 1] + (1 - np.exp(-1.0)) * (rec.torque[n] - lagged[n - 1])
    for share in (0.0, 0.02):
        assert not aligned([noisy(rec.with_channels(torque=lagged), share)], [], RIGID.controller).shifts


def test_gains_that_are_wrong_beside_a_shift_are_still_found() -> None:
    rec = rig(RIGID, STEPS).shifted(torque=1)
    back, _ = looked_at(rec, RIGID)
    assert back == {"torque": -1}
    wrong = ga.PI(1.3 * RIGID.kp, RIGID.ki)
    assert list(aligned([rec], [], wrong).shifts.values()) == [{"torque": -1}]


def test_where_the_command_stands_still_its_place_is_not_told_and_nothing_depends_on_it() -> None:
    rec = rig(RIGID, np.full(1500, 40.0))
    assert looked_at(rec.shifted(command=-2), RIGID)[0] == {}
    assert looked_at(rec.shifted(velocity=1), RIGID)[0] == {"torque": 1}


def test_a_measured_torque_is_moved_only_where_law_and_motion_agree() -> None:
    rec = rig(RIGID, STEPS, FRICTION)
    assert looked_at(noisy(rec.shifted(torque=1)), RIGID)[0] == {"torque": -1}
    # A drive that acts a sample late, its current measured: law and motion disagree by that sample.
    late = rig(RIGID, STEPS, DELAY).shifted(torque=1)
    moves, found = looked_at(noisy(late), RIGID)
    assert moves == {} and "or the drive needs that long. The motion puts it" in found.notes[0]
    assert "shift torque=-1" in found.notes[0]
    # Before its law it cannot be: that is the log.
    assert looked_at(noisy(rec.shifted(torque=-1)), RIGID)[0] == {"torque": 1}
    # The same of a soft drive, whose motion the regression does not describe.
    moves, found = looked_at(noisy(rig(SOFT, STEPS).shifted(torque=1)), SOFT)
    assert moves == {} and "The motion does not tell which" in found.notes[0]


@pytest.mark.parametrize("late", [-2, -1, 1, 2])
def test_a_measured_torque_at_its_limit_is_moved_as_well(late: int) -> None:
    """Its noise lifts the highest lines above the limit: what stands at the limit is judged by the limit."""
    limited = ga.PI(0.03, 1.9, torque_limit=0.8)
    quiet = ga.Record(1e-3, command=np.append(np.zeros(20), STEPS), velocity=np.zeros(20 + len(STEPS)))
    done = ga.run(ga.OneMass(J=3e-4, D=2e-3), quiet, limited)
    rec = quiet.with_channels(velocity=done.velocity, torque=done.torque)
    assert rec.torque is not None and np.mean(np.abs(rec.torque) >= 0.8) > 0.02
    for share in (0.01, 0.05):
        found = aligned([noisy(rec.shifted(torque=late), share)], [], limited)
        assert list(found.shifts.values()) == [{"torque": -late}]


def leads(plant: Plant, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Samples by which the velocity of the motor leads that of one rigid mass with the plant's whole inertia and damping.

    The damping of the load turns the phase of the shaft's resonance, more towards the antiresonance.
    A lag that is read as that of one mass is off by so much.
    """
    s = 2j * np.pi * frequency
    whole = 1.0 / ((plant.J + plant.JL) * s + plant.D + plant.DL)
    if not plant.JL:
        return np.zeros(len(frequency))
    load = plant.JL * s + plant.DL
    shaft = plant.DG + plant.KG / s
    motor = 1.0 / (plant.J * s + plant.D + load * shaft / (load + shaft))
    return np.asarray(np.angle(motor / whole) / (2.0 * np.pi * frequency * plant.dt))


@pytest.mark.parametrize("noise", ["white", "encoder", "coloured"])
@pytest.mark.parametrize("plant", [RIGID, ELASTIC], ids=lambda p: p.name)
def test_the_lag_of_a_torque_from_its_motion(plant: Plant, noise: str) -> None:
    f = np.linspace(2.0, 45.0, 50)  # Hz, the band of the regression: to 0.9 of half its row rate of 100 Hz
    lead = leads(plant, f)
    assert plant is RIGID or 0.02 < lead.min() < lead.max() < 0.06
    behind = -np.arctan(2.0 * np.pi * f * 1e-3) / (2.0 * np.pi * f * 1e-3)  # samples, of the filter
    filtered = {"velocity_filter": {"time_constant": 1e-3}}
    for effects, expected in (({}, lead), (FRICTION, lead), (DELAY, lead - 1.0), (filtered, lead + behind)):
        rec = rig(plant, STEPS, effects, noise)
        found = [torque_lag(rec.shifted(torque=k)) for k in (0, 1, -1)]
        lags = [lag.lag - k for lag, k in zip(found, (0, 1, -1), strict=True) if lag is not None]
        assert len(lags) == 3 and np.ptp(lags) < 0.005, (effects, found)  # whichever sample the log begins with
        assert expected.min() - 0.03 < min(lags) <= max(lags) < expected.max() + 0.03, (effects, found)
    assert torque_lag(rig(plant, SINE)) is None  # one frequency: inertia and friction take any lag
    assert torque_lag(rig(SOFT, STEPS)) is None  # not the motion of one mass
    assert torque_lag(rig(plant, STEPS, torque_logged=False)) is None


def sampled(command: NDArray[np.float64]) -> ga.Record:
    """A drive of 10 kHz, of whose velocity and current every tenth sample is logged: nothing holds the current in between."""
    fast = rig(Plant(3e-4, 2e-3, 0.03, 1.9, 1e-4), command, FRICTION)
    assert fast.torque is not None
    return ga.Record(1e-3, velocity=fast.velocity[::10], torque=fast.torque[::10], torque_is="measured")


def test_a_torque_that_is_sampled_stands_half_a_sample_late_and_nothing_is_said_of_that() -> None:
    """Half a sample where the current is smooth, none where it jumps with the log's samples, as a held one does."""
    t = 1e-4 * np.arange(30000)
    smooth = sum(200.0 / f * np.sin(2.0 * np.pi * f * t + f) for f in (1.3, 3.1, 7.7, 17.0, 29.0))
    lengths = np.random.default_rng(6).integers(1500, 2500, 15)
    for command, low, high in ((smooth, 0.4, 0.6), (np.repeat(STEPS[::200], 2000), 0.0, 0.1),
                               (np.repeat(STEPS[::200], lengths), 0.1, 0.5)):  # fmt: skip
        rec = sampled(np.asarray(command))
        for k in (0, 1, -1):
            lag = torque_lag(rec.shifted(torque=k))
            assert lag is not None and low < lag.lag - k < high, (k, lag)
        assert aligned([rec], [], None).notes == ()
        moves, found = looked_at(rec.shifted(torque=1), None)
        assert moves == {"torque": -1} and found.notes  # of 1.1 to 1.5 samples, the part that goes on between the lines stays


def test_a_log_of_means_is_not_late() -> None:
    t = 1e-4 * np.arange(30000)
    fast = rig(
        Plant(3e-4, 2e-3, 0.03, 1.9, 1e-4), sum(200.0 / f * np.sin(2.0 * np.pi * f * t + f) for f in (1.3, 7.7, 29.0)), FRICTION
    )
    assert fast.torque is not None
    means = np.append(0.0, fast.torque.reshape(-1, 10).mean(axis=1)[:-1])
    rec = ga.Record(1e-3, velocity=fast.velocity[::10], torque=means, torque_is="measured", torque_log="mean")
    lag = torque_lag(rec)
    assert lag is not None and abs(lag.lag) < 0.1
    assert aligned([rec], [], None).notes == ()
    assert looked_at(rec.shifted(torque=1), None)[0] == {"torque": -1}


def test_in_open_loop_a_motion_before_its_torque_is_the_log_s_and_a_delay_is_only_said() -> None:
    rec = rig(ELASTIC, STEPS, FRICTION)
    assert aligned([rec], [], None).notes == ()
    moves, found = looked_at(rec.shifted(torque=1), None)
    assert moves == {"torque": -1} and "which no axis does" in found.notes[0] and "was moved by -1" in found.notes[0]
    for late in (rec.shifted(torque=-1), rig(ELASTIC, STEPS, DELAY)):
        moves, found = looked_at(late, None)
        assert (
            moves == {} and "without a controller the data cannot tell" in found.notes[0] and "shift torque=1" in found.notes[0]
        )
        # A torque that follows from a controller stands on the lines of what it read.
        assert aligned([late], [], None, follows=True).notes == ()


def test_of_velocity_and_position_the_one_that_the_torque_contradicts_is_moved() -> None:
    """Both are of one motion. A velocity behind its position may be a sensor's, so that nothing is moved there."""
    rec = rig(RIGID, STEPS, FRICTION, position_logged=True)
    assert looked_at(rec, None) == ({}, aligned([rec], [], None)) and aligned([rec], [], None).notes == ()
    for moved, back in (({"position": 1}, {"position": -1}), ({"position": -1}, {"position": 1}),
                        ({"velocity": -1}, {"velocity": 1}), ({"torque": 1}, {"torque": -1}), ({"velocity": 1}, {})):  # fmt: skip
        moves, found = looked_at(rec.shifted(**moved), None)
        assert moves == back and len(found.notes) == 1, (moved, moves, found.notes)
        assert found.may_be_early == (not back)
    assert "no delay of the drive" in found.notes[0] and "shift velocity=-1" in found.notes[0]


def slow(effects: dict[str, dict[str, float]]) -> tuple[ga.Record, ga.Cascade]:
    """A log of a controller that samples twice to a line, with its rule, and that controller."""
    pi = ga.PI(0.03, 1.9, rule="backward")
    cascade = ga.Cascade(velocity=pi, period=0.5e-3)
    plant = Plant(3e-4, 2e-3, 0.03, 1.9, 1e-3, cascade=cascade, name="two samples to a line")
    return rig(plant, np.repeat(STEPS, 2), effects, "none"), cascade


def test_where_the_torque_of_a_slow_log_follows_from_its_controller_no_shift_is_advised() -> None:
    """What stands behind the torque is then found by the diagnosis; a wrong controller proves nothing."""
    rec, cascade = slow({"velocity_filter": {"time_constant": 1e-3}})
    assert "shift torque=1" in "".join(aligned([rec], [], None).notes), "alone the motion tells no more"

    asked = loop_of([rec], cascade)
    driven = torque_driven([rec], cascade)
    found = driving_of(driven.records, (), asked, driven, {driven.records[0].digest: rec})
    assert found.moved.notes == found.doubts == ()
    (told,) = aligned([rec], [], None, refuted=True).notes
    assert "the given controller does not make this torque" in told and "without a controller" not in told


def test_a_lag_that_the_model_accounts_for_is_no_reason_to_shift_the_log() -> None:
    rec = rig(RIGID, STEPS, DELAY).with_channels(command=None)
    found = aligned([rec], [], None)
    dia = ga.diagnose(rec)
    assert [f.effect for f in dia.causes] == ["transport_delay"], dia.summary()
    assert "shift torque=1" in found.notes[0], "before anything is found"
    (note,) = [n for n in dia.notes if n.startswith("The motion follows")]
    assert "The model has what makes that: the transport delay" in note and "shift torque" not in " ".join(dia.notes)
    # A model that lacks it, or has only a part of it, leaves the advice.
    for model in (dia.model.linear.mechanism, dia.model.mechanism.with_effect("transport_delay", delay=1e-4)):
        assert found.notes[0] in found.noted(replace(dia, model=model)).notes
    half = replace(dia, model=dia.model.mechanism.with_effect("torque_lag", time_constant=5e-4), velocity_age=0.5)
    assert "the torque lag and the age of the velocity, 1 sample together" in found.noted(half).notes[0]


@pytest.mark.long
def test_a_delay_of_whole_samples_in_open_loop_may_be_the_log_s() -> None:
    """A delay, a filter of the sensor or a log that wrote the torque early: without a controller nothing tells them apart."""
    rec = rig(RIGID, STEPS, {"transport_delay": {"delay": 1e-3}}).with_channels(command=None)
    (cause,) = ga.diagnose(rec).causes
    assert cause.effect == "transport_delay" and "log_shift" in cause.alternatives
    assert "log_shift" not in ga.diagnose(rig(RIGID, STEPS, DELAY), RIGID.controller).causes[0].alternatives
    part = rig(RIGID, STEPS, {"transport_delay": {"delay": 1.5e-3}}).with_channels(command=None)
    assert all("log_shift" not in f.alternatives for f in ga.diagnose(part).causes), "no log is half a line early"


def test_how_late_a_slow_signal_comes_out_is_the_slope_of_the_phase() -> None:
    omega = np.array([1e-3])
    for name, values in (("transport_delay", [2e-3]), ("torque_lag", [3e-3]), ("extra_resonance", [300.0, 0.1, 200.0, 0.02])):
        transfer = LINEAR[name](values)
        assert transfer.late == pytest.approx(-float(np.angle(response_of([transfer], omega))[0]) / omega[0], rel=1e-4)


def test_a_torque_that_was_logged_late_in_open_loop_is_moved_and_the_inertia_is_right() -> None:
    rec = rig(RIGID, STEPS, FRICTION).shifted(torque=1).with_channels(command=None)
    dia = ga.diagnose(rec)
    assert dia.log_shifts == {rec.digest: {"torque": -1}} and dia.records == (rec,)
    assert [f.effect for f in dia.causes] == ["coulomb_friction"], dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(RIGID.J, rel=0.01)


@pytest.mark.long
def test_the_diagnosis_names_the_cause_behind_a_shift_and_speaks_of_the_records_that_it_was_given(tmp_path: Path) -> None:
    rec = rig(RIGID, STEPS, FRICTION, position_logged=True).shifted(torque=1)
    dia = ga.diagnose(rec, RIGID.controller)
    assert [f.effect for f in dia.findings] == ["coulomb_friction"], dia.summary()
    assert dia.findings[0].parameters["torque"].value == pytest.approx(0.05, rel=0.02)
    assert (
        dia.notes[0].startswith("The log wrote the torque 1 sample late against the rest")
        and "transport delay" not in dia.notes[0]
    )
    assert dia.records == (rec,) and dia.digests == (rec.digest,) and dia.log_shifts == {rec.digest: {"torque": -1}}
    assert dia.as_used(rec) == rec.shifted(torque=-1) and dia.loop_follows
    dia.save(tmp_path / "dia.json")
    again = ga.load(tmp_path / "dia.json")
    assert again == dia and again.log_shifts == dia.log_shifts
    ga.report(dia, tmp_path / "page.html")
    assert "The log wrote the torque 1 sample late" in (tmp_path / "page.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_a_drive_that_computes_for_a_sample_has_a_transport_delay() -> None:
    """Its log is the same as one of a shift, but the motion comes a sample later, and the delay is found where it acts."""
    rec = rig(RIGID, STEPS, DELAY, "none").shifted(torque=1)
    dia = ga.diagnose(rec, RIGID.controller)
    assert [f.effect for f in dia.causes] == ["transport_delay"], dia.summary()
    assert dia.causes[0].parameters["delay"].value == pytest.approx(1e-3, rel=0.02)
    assert "A drive that computes for 1 sample makes the same log" in dia.notes[0]


def test_records_are_moved_by_hand() -> None:
    rec = rig(RIGID, STEPS, position_logged=True)
    assert rec.torque is not None and rec.command is not None
    moved = rec.shifted(torque=-1, command=2)
    np.testing.assert_array_equal(moved.torque, rec.torque[3:])
    np.testing.assert_array_equal(moved.command, rec.command[:-3])
    np.testing.assert_array_equal(moved.velocity, rec.velocity[2:-1])
    assert rec.shifted() == rec and rec.shifted(torque=0) == rec
    for wrong, said in (
        ({"speed": 1}, r"shifted\(speed=1\): the record has no speed"),
        ({"torque": 0.5}, r"shifted\(torque=0.5\): give a whole number of samples"),
        ({"torque": -2990}, "leaves 10 of 3000 samples"),
    ):
        with pytest.raises(RecordError, match=said):
            rec.shifted(**wrong)  # type: ignore[arg-type]
    with pytest.raises(RecordError, match=r"shifted\(position=1\): the record has no position"):
        rec.with_channels(position=None).shifted(position=1)


def test_the_user_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    rec = rig(RIGID, STEPS)
    late = rec.shifted(torque=1)
    rows = np.column_stack([late.time, late.command, late.velocity, late.torque])
    np.savetxt("log.csv", rows, delimiter=",", header="time,command,velocity,torque", comments="", fmt="%.17g")
    read = ga.read("log.csv", shift={"torque": -1})
    np.testing.assert_array_equal(read.torque, late.torque[1:])
    np.testing.assert_array_equal(read.velocity, late.velocity[:-1])
    for wrong, said in (({"torque": 1.5}, "whole number"), ({"speed": 1}, "no|channel"), (3, "is no mapping")):
        with pytest.raises((ReadError, RecordError), match=said):
            ga.read("log.csv", shift=wrong)  # type: ignore[arg-type]
    with pytest.raises(ReadError, match="shift counts the log's own samples"):
        ga.read("log.csv", shift={"torque": -1}, decimate=2)
    gains = ["--kp", str(RIGID.kp), "--ki", str(RIGID.ki)]
    for options in (["--shift", "torque=-1"], ["--drive", "drive.toml"]):
        Path("drive.toml").write_text("[shift]\ntorque = -1\n")
        assert main(["diagnose", "log.csv", *gains, *options]) == 0
        said = capsys.readouterr().out
        assert "Verdict: adequate" in said and "The log wrote" not in said
    assert main(["diagnose", "log.csv", *gains]) == 0
    assert "The log wrote the torque 1 sample late" in " ".join(capsys.readouterr().out.split())
    assert main(["diagnose", "log.csv", *gains, "--shift", "torque=late"]) == 2
    assert "--shift torque=late: give a whole number of samples" in capsys.readouterr().err
