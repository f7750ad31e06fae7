"""Proposed experiments keep to the drive's limits and trigger what they are meant to trigger."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.experiments.excitation import excitation
from gaident.diagnosis.experiments.first_experiment import candidate_commands, first_experiment
from gaident.errors import SettingsError
from gaident.results.experiment import Limits

DT = 1e-3
MASS = ga.OneMass(J=2e-4, D=3e-3)
GAINS = {"kp": 0.02, "ki": 0.5}
CASES = [
    (Limits(100.0, 1.5, math.inf, 3.5), {}),
    (Limits(100.0, 1.5, 20.0, 3.5), {"inertia": 2e-4, "kp": 0.02}),
    (Limits(300.0, 3.0, 1.0, 2.0), {}),
    (Limits(300.0, 3.0, 1.0, 2.0), {"inertia": 2e-4, "kp": 0.02}),
    (Limits(100.0, 0.5, 3.0, 20.0), {"inertia": 5e-3, "kp": 0.02}),
]
EFFECTS = {
    *("coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "quadratic_drag", "load_torque"),
    *("unbalance", "cogging", "friction_drift", "backlash", "hardening_stiffness", "torque_saturation", "torque_dead_band"),
    *("transport_delay", "torque_lag", "integrator_clamp", "command_rate_limit", "velocity_filter", "velocity_ripple"),
    *("extra_resonance", "lugre_friction", "load_dependent_friction", "hysteretic_coupling", "square_root_drag"),
    *("position_friction", "torque_hum", "position_inertia", "velocity_difference", "velocity_observer"),
}


def everything(limits: Limits, known: dict[str, float]) -> list[tuple[str, np.ndarray]]:
    items = [(item.name, item.command) for item in candidate_commands(DT, limits, **known)]
    return [("first", first_experiment(DT, limits, **known).command), *items]


@pytest.mark.parametrize(("limits", "known"), CASES)
def test_every_command_keeps_to_the_limits(limits: Limits, known: dict[str, float]) -> None:
    for name, command in everything(limits, known):
        angle = DT * np.concatenate([[0.0], np.cumsum(command)])
        assert np.abs(command).max() <= 0.9 * limits.speed * (1 + 1e-12), name
        assert np.ptp(angle) <= 0.9 * limits.travel * (1 + 1e-9), name
        assert len(command) * DT <= limits.duration * (1 + 1e-9), name
        assert command[-1] == 0.0 and abs(angle[-1]) <= 1e-9 * max(np.ptp(angle), 1.0), name
        assert len(command) > 100 and np.abs(command).max() > 0.0, name


@pytest.mark.parametrize("known", [{"inertia": 2e-4, "kp": 0.02}, {"kp": 0.02}])
def test_a_simulated_drive_without_limits_keeps_to_them_too(known: dict[str, float]) -> None:
    """Speed, travel and torque, overshoot included, where the controller's gain is known."""
    limits = Limits(100.0, 1.5, 20.0, 3.5)
    for name, command in everything(limits, known):
        done = ga.run(MASS, ga.Record(DT, command, 0.0 * command), ga.PI(**GAINS))
        assert np.abs(done.velocity).max() <= limits.speed, name
        assert np.ptp(done.position) <= limits.travel, name
        assert np.abs(done.torque).max() <= limits.torque, name


def test_in_half_a_second_no_command_asks_for_more_torque_than_there_is() -> None:
    """A move between two holds is as fast as the time wants it, and no steeper than the torque allows."""
    limits = Limits(100.0, 1.5, 20.0, 0.5)
    for name, command in everything(limits, {"inertia": 2e-4, "kp": 0.02}):
        done = ga.run(MASS, ga.Record(DT, command, 0.0 * command), ga.PI(**GAINS))
        assert np.abs(done.torque).max() <= limits.torque, name


def test_the_first_experiment_keeps_a_stiff_loop_within_its_limits() -> None:
    """kp = 0.06 N m s/rad at 2.4 N m: full steps would ask for 7 N m; the shaft is soft and the loop overshoots by a quarter."""
    drive = ga.TwoMass(JM=4e-4, DM=1.5e-3, JL=6e-4, DL=5e-4, KG=28.0)
    command = first_experiment(5e-4, Limits(80.0, 2.4), kp=0.06).command
    done = ga.run(drive, ga.Record(5e-4, command, 0.0 * command), ga.PI(kp=0.06, ki=1.5))
    assert 40.0 < np.abs(done.velocity).max() <= 80.0
    assert 1.2 < np.abs(done.torque).max() <= 2.4


def test_the_first_experiment_triggers_the_whole_library() -> None:
    limits = Limits(100.0, 1.5, math.inf, 3.5)
    proposal = first_experiment(DT, limits, kp=0.02)
    assert set(proposal.separates) == EFFECTS - {"torque_saturation"}
    assert "every effect but torque saturation" in proposal.reason and "asks for 1.2 of 1.5 N m" in proposal.reason
    assert math.isnan(proposal.margin)
    low, high = proposal.reach
    assert low >= -0.01 and high > 0.8 * math.tau
    still = ga.Record(DT, proposal.command, 0.0 * proposal.command)
    done = ga.run(MASS, still, ga.PI(**GAINS))
    found = excitation(ga.Record(DT, proposal.command, done.velocity, torque=done.torque), ga.PI(**GAINS))
    assert set(found.not_testable) == {"velocity_difference"}  # the simulated velocities are not rounded to an encoder's counts
    assert len(found.steps) >= 5 and found.reversals > 20 and found.repeated
    assert 0.75 < found.highest_torque <= 1.5


def test_what_the_first_experiment_cannot_keep_it_says() -> None:
    limits = Limits(100.0, 1.5, math.inf, 3.5)
    proposal = first_experiment(DT, limits)
    jump = np.abs(proposal.command[2:] - proposal.command[:-2]).max()
    assert set(proposal.separates) == EFFECTS and jump == pytest.approx(144.0)
    for said in (
        "Torque and speed limit are not promised",
        "of 144 rad/s, asks for kp times that",
        "above 0.0104 N m s/rad",
        "give kp",
    ):
        assert said in proposal.reason
    assert "give the inertia" in proposal.reason
    assert "give" not in first_experiment(DT, limits, inertia=2e-4, kp=0.02).reason


def test_menu_items_say_what_they_are_for() -> None:
    items = candidate_commands(DT, Limits(100.0, 1.5, 50.0, 4.0))
    assert len({item.name for item in items}) == len(items) >= 11
    assert {effect for item in items for effect in item.separates} == EFFECTS
    assert all(item.reason.endswith(".") and len(item.reason) < 120 for item in items)
    asked = items[0].proposal(["stribeck_friction", "presliding_friction"], 87.0)
    assert asked.margin == 87.0 and asked.separates == ("stribeck_friction", "presliding_friction")
    again = candidate_commands(DT, Limits(100.0, 1.5, 50.0, 4.0))
    assert all(np.array_equal(a.command, b.command) for a, b in zip(items, again, strict=True))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: Limits(0.0, 1.0, 1.0, 1.0), "speed is 0: give one number > 0"),
        (lambda: Limits(1.0, 1.0, -2.0, 1.0), "travel is -2"),
        (lambda: Limits(1.0, 1.0, 1.0, math.inf), "duration is inf"),
        (lambda: Limits("fast", 1.0, 1.0, 1.0), "speed is 'fast'"),
        (lambda: first_experiment(DT, Limits(1.0, 1.0, 1.0, 0.1)), "duration is 0.1 s, 100 samples: give 0.4 s or more"),
        (lambda: first_experiment(-DT, Limits(1.0, 1.0)), "dt is -0.001"),
        (lambda: candidate_commands(DT, (1.0, 2.0)), r"give gaident.Limits"),
        (lambda: candidate_commands(DT, Limits(1.0, 1.0), inertia=0.0), "inertia is 0"),
    ],
)
def test_impossible_limits_are_refused(wrong: object, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        wrong()  # type: ignore[operator]


def test_limits_of_records_are_what_the_records_did() -> None:
    command = np.repeat([30.0, -20.0], 300)
    done = ga.run(MASS, ga.Record(DT, command, 0.0 * command), ga.PI(**GAINS))
    rec = ga.Record(DT, command, done.velocity, torque=done.torque)
    limits = Limits.of(rec, ga.PI(**GAINS))
    assert limits.speed == pytest.approx(30.0 / 0.9) and limits.torque == np.abs(done.torque).max()
    assert limits.travel == math.inf and limits.duration == pytest.approx(0.6)  # more than a turn: it turns freely
    short = Limits.of([rec[:60], rec[:100]], ga.PI(**GAINS, torque_limit=2.0))
    assert short.torque == 2.0 and short.travel == pytest.approx(np.ptp(done.position[:100]) / 0.9, rel=1e-3)
    with pytest.raises(SettingsError, match="speed is 0"):
        Limits.of(ga.Record(DT, 0.0 * command, 0.0 * command), ga.PI(**GAINS))


def test_without_a_torque_a_load_that_was_stored_before_does_not_show() -> None:
    w = 20.0 * np.sin(0.02 * np.arange(600))
    loop = ga.PI(**GAINS)
    said = excitation(ga.Record(DT, command=w, velocity=w), loop).one_sided["load_torque"]
    assert said == "no torque is logged: a load that the integrator stored when the record began shows in no other signal"
    assert "load_torque" not in excitation(ga.Record(DT, command=w, velocity=w, torque=w), loop).one_sided
    assert "load_torque" not in excitation(ga.Record(DT, command=w, velocity=w), ga.PI(kp=0.02, ki=0.0)).one_sided
