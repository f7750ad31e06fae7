"""When a velocity command changed between the lines of a slow log: as the torque tells it."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.control.between import between_lines, unsure_between
from gaident.identification.replay import command_timing
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.notes import jump_notes
from gaident.identification.replay.timed_record import TimedRecord
from loop_cases import PERIOD as T
from loop_cases import jump_levels as levels
from loop_cases import jump_log as record

LOOP = ga.Cascade(ga.PI(0.1, 6.0), T)
FINE = Noise(white=0.0, encoder=2 * np.pi / 2**24, differenced=True)
FILTERED = ga.Cascade(ga.PI(0.1, 6.0, rule="backward"), T, torque_filters=(ga.LowPass(0.3e-3),))

skip_without_library()


def means_off(command: np.ndarray, whole: np.ndarray, every: int) -> float:
    """The greatest error of a command's mean over a line [rad/s]."""
    return float(np.abs((command.ravel() - whole).reshape(-1, every).mean(axis=1))[:-1].max())


@pytest.mark.parametrize("every", [2, 4, 8])
@pytest.mark.parametrize("loop", [LOOP, FILTERED], ids=["bare", "filtered"])
def test_the_torque_tells_when_the_command_jumped(every: int, loop: ga.Cascade) -> None:
    whole = levels(every, every)
    rec = record(whole, every, loop)
    (found,) = timed([rec], loop)
    assert isinstance(found, TimedRecord) and found == rec and found.digest == rec.digest
    assert found.command_between is not None
    assert np.array_equal(found.command_between[:, 0], rec.command)
    assert means_off(between_lines(whole[::every], every), whole, every) > 10.0, "jumps held until the next line"
    assert means_off(found.command_between, whole, every) < 0.5


@pytest.mark.parametrize("every", [2, 8])
def test_a_jump_in_the_first_interval_is_told_as_well(every: int) -> None:
    """As in a trace that a step of the command has triggered."""
    whole = np.where(np.arange(500 * every) < every // 2, 0.0, 30.0)
    whole[200 * every + 1 :] = 0.0
    (found,) = timed([record(whole, every, LOOP)], LOOP)
    assert isinstance(found, TimedRecord) and found.command_between is not None
    assert means_off(found.command_between, whole, every) < 0.5


@pytest.mark.parametrize(
    ("every", "early", "on_lines", "all_on_lines"),
    [
        (8, 11, 324, True),
        (8, 3, 7, False),
        (4, 3, 7, False),
        (2, 1, 4, False),
        (2, 2, 8, False),
        (8, 1, 0, False),
        (2, 0, 1, True),
    ],
)
def test_few_of_many_jumps_may_look_early(every: int, early: int, on_lines: int, all_on_lines: bool) -> None:
    """Those that the torque tells; few jumps, or as many early ones as jumps at any sample have, are not on the lines."""
    assert command_timing._on_the_lines(np.arange(early + on_lines) < early, every) == all_on_lines


@pytest.mark.parametrize("resonance", [200.0, 270.0])
def test_small_jumps_behind_large_ones_on_the_lines_are_not_taken_for_early(resonance: float) -> None:
    """A random binary signal of 0.2 rad/s beside levels of up to 80: behind those the shaft rings between the lines."""
    every, rng = 8, np.random.default_rng(int(resonance))
    reduced = 9.8e-4 * 7.4e-4 / (9.8e-4 + 7.4e-4)
    K = reduced * (2 * np.pi * resonance) ** 2
    shaft = {"KG": K, "DG": 0.03 * reduced * 2 * np.pi * resonance}
    loop = ga.Cascade(ga.PI(0.5, 60.0), T)
    drive = Plant(J=9.8e-4, D=9e-4, JL=7.4e-4, DL=9e-4, kp=0.5, ki=60.0, dt=T * every, cascade=loop, **shaft)
    large = np.repeat(rng.uniform(-80.0, 80.0, 20), 170)
    small = np.repeat(rng.choice([-0.1, 0.1], len(large) // 2), 2)
    log = rig(drive, np.concatenate([np.zeros(40), large + small]), {"torque_lag": {"time_constant": 0.33e-3}}, FINE, settle=0)
    assert timed([log], loop)[0] is log


def test_short_ramps_are_told_from_jumps() -> None:
    """A ramp that begins and ends within two lines.

    Off by 0.71 rad/s, by 0.67 with a spline through the lines: without their noise the bends of the velocity are rounder, too.
    """
    every = 8
    whole = np.convolve(levels(every, 3), np.ones(7) / 7)[: 1000 * every]
    rec = record(whole, every, LOOP)
    (found,) = timed([rec], LOOP)
    assert isinstance(found, TimedRecord) and found.command_between is not None
    assert means_off(between_lines(whole[::every], every), whole, every) > 10.0
    assert means_off(found.command_between, whole, every) < 0.75


ON_LINES = {
    "bare": LOOP,
    "P alone": ga.Cascade(ga.PI(0.1, 0.0), T),
    "backward": ga.Cascade(ga.PI(0.1, 6.0, rule="backward"), T),
    "feedforward": ga.Cascade(ga.PI(0.1, 6.0), T, acceleration_feedforward=4e-4),
    "hold": ga.Cascade(ga.PI(0.1, 6.0, torque_limit=3.0, anti_windup="hold"), T),
    "tracking": ga.Cascade(ga.PI(0.1, 6.0, torque_limit=3.0, anti_windup="tracking", tracking_time=0.01), T),
    "winds up": ga.Cascade(ga.PI(0.1, 6.0, torque_limit=3.0), T),
}


@pytest.mark.parametrize("every", [2, 4, 8])
@pytest.mark.parametrize("name", ON_LINES)
def test_jumps_on_the_lines_stay_there(every: int, name: str) -> None:
    """Also where the velocity alone would tell, which is half a sample old, and bent by the shaft."""
    loop = ON_LINES[name]
    for seed in (5, 9):
        rec = record(levels(every, seed, on_lines=True), every, loop)
        assert timed([rec], loop)[0] is rec


def test_another_rule_of_integration_is_no_jump_half_a_sample_early() -> None:
    rec = record(levels(8, 9, on_lines=True), 8, ON_LINES["backward"])
    assert timed([rec], LOOP)[0] is rec


def test_a_record_in_motion_tells_no_time() -> None:
    """Whether its torque follows from the controller cannot be seen: with kp 10 % off jumps on the lines were moved."""
    rec = record(levels(8, 9, on_lines=True), 8, LOOP)[150:]
    wrong = ga.Cascade(ga.PI(0.09, 6.0), T)
    assert timed([rec], wrong)[0] is rec


def test_what_is_identified_contains_the_records_as_they_were_logged() -> None:
    rec = record(levels(8, 9), 8, LOOP)
    idn = ga.identify(rec, LOOP, seed=1)
    assert type(idn.records[0]) is ga.Record and idn.records[0] == rec
    (found,) = timed([rec], LOOP)
    assert isinstance(found, TimedRecord) and type(timed([found], ga.Cascade(ga.PI(None, None), T))[0]) is ga.Record


def test_what_tells_nothing_changes_nothing() -> None:
    whole = levels(8, 6)
    rec = record(whole, 8, LOOP)
    assert timed([rec], None) == (rec,)
    unknown = ga.Cascade(ga.PI(None, None), T)
    for one, loop in (
        (rec.with_channels(torque=None), LOOP),
        (rec.with_channels(torque_is="measured"), LOOP),
        (rec, unknown),
        (rec, ga.PI(0.1, 6.0)),
        (record(whole, 1, LOOP), LOOP),
    ):
        assert timed([one], loop)[0] is one


def test_a_limit_that_acts_between_the_lines_tells_no_time() -> None:
    """Where the anti-windup holds, the integral at the lines is not what the lines make."""
    limited = ga.Cascade(ga.PI(0.1, 6.0, torque_limit=1.5, anti_windup="hold"), T)
    rec = record(levels(2, 7, on_lines=True), 2, limited)
    assert rec.torque is not None and np.mean(np.abs(rec.torque) >= 1.5) > 0.02
    assert timed([rec], limited)[0] is rec


def test_a_timed_record_is_cut_and_changed_like_any_other() -> None:
    whole = levels(4, 8)
    rec = record(whole, 4, LOOP)
    (found,) = timed([rec], LOOP)
    assert isinstance(found, TimedRecord) and found.command_between is not None
    part = found[100:400]
    assert isinstance(part, TimedRecord) and part == rec[100:400]
    assert np.array_equal(part.command_between, found.command_between[100:400])
    other = found.with_channels(torque=2.0 * np.asarray(rec.torque))
    assert isinstance(other, TimedRecord) and other.command_between is found.command_between
    for plain in (found.with_channels(command=rec.velocity), found.with_channels(dt=1e-3), found.plain):
        assert type(plain) is ga.Record
    again = pickle.loads(pickle.dumps(found))
    assert isinstance(again, TimedRecord) and again == found
    assert np.array_equal(again.command_between, found.command_between)
    assert isinstance(timed([found], LOOP)[0], TimedRecord), "timed anew"


@pytest.mark.parametrize("every", [2, 3, 8])
def test_shares_are_means_between_the_lines(every: int) -> None:
    line = np.array([0.0, 0.0, 0.0, 5.0, 5.0, 6.0, 9.0, 13.0, 16.0, 16.5, 16.5, 4.0, 4.0, 4.0])
    unsure = unsure_between(line, every)
    assert {2, 10} <= set(unsure.at[unsure.jump])
    for share in (0.0, 0.3, 1.0):
        made = unsure.early(np.full(len(unsure.at), share))
        assert np.array_equal(made[:, 0], line)
        assert np.allclose(made[unsure.at, 1:].mean(axis=1), line[unsure.at] + share * unsure.rise)
    assert np.all((unsure.usual >= 0.0) & (unsure.usual <= 1.0))


@pytest.mark.long
def test_jumps_between_the_lines_are_no_cause() -> None:
    """They were named as friction, a resonance, a delay; J was 2 to 30 % off."""
    for every, seed in ((4, 2), (8, 3)):
        dia = ga.diagnose(record(levels(every, seed), every, LOOP), LOOP)
        assert (dia.verdict, [f.effect for f in dia.causes]) == ("adequate", []), every
        assert dia.mechanics["motor_inertia"].value == pytest.approx(4e-4, rel=5e-3)
        assert dia.mechanics["load_inertia"].value == pytest.approx(4e-4, rel=5e-3)


@pytest.mark.long
def test_friction_is_named_under_jumps_between_the_lines() -> None:
    rec = record(levels(8, 4), 8, LOOP, coulomb_friction={"torque": 0.05})
    dia = ga.diagnose(rec, LOOP)
    assert [f.effect for f in dia.causes] == ["coulomb_friction"]
    assert dia.causes[0].parameters["torque"].value == pytest.approx(0.05, rel=0.05)


def test_an_identification_takes_the_means_between_the_lines() -> None:
    idn = ga.identify(record(levels(8, 9), 8, LOOP), LOOP, seed=1)
    assert pytest.approx(8e-4, rel=5e-3) == idn.mechanics.J


def test_jumps_before_their_line_are_counted_in_words() -> None:
    command = np.repeat([0.0, 10.0, -5.0, 20.0], 50)
    between = np.repeat(command[:, None], 4, axis=1)
    between[49, 1:] = 10.0  # three samples early; the second jump stays on its line
    between[149, 3:] = 20.0  # one sample early
    rec = ga.Record(1e-3, command=command, velocity=0.9 * command, torque=command)
    (note,) = jump_notes([TimedRecord.of(rec, between)])
    assert str(note).startswith("Of 3 jumps of the velocity command 2 came before the line that shows them")
    assert jump_notes([rec]) == [] and jump_notes([TimedRecord.of(rec, np.repeat(command[:, None], 4, axis=1))]) == []
