"""Dry friction that records show without a simulation, and what a diagnosis makes of it beside effects it does not know."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Effects, Plant, run_drive
from gaident.estimation.regression.reversal import jump_at_reversal, steep_drag, torque_held_at_rest
from gaident.estimation.regression.sensor_lag import velocity_lag

JOINT = Plant(J=15.0, D=18.0, kp=300.0, ki=1500.0, dt=1e-3)
EVERY = 10  # samples of the controller in a line of the log
GRAVITY = {"unbalance": {"amplitude": 113.0, "phase": -1.57}}
LOADED = {**GRAVITY, "load_dependent_friction": {"torque": 10.5, "share": 0.07}}
ROOT = {"square_root_drag": {"coefficient": 20.0}}


def joint(effects: Effects, n: int = 3000) -> ga.Record:
    """A robot joint under slow sines, with a measured torque and 2 % of noise on it."""
    t, rng = JOINT.dt * np.arange(EVERY * n), np.random.default_rng(0)
    command = sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in ((0.5, 0.11, 0.0), (0.35, 0.29, 1.0), (0.2, 0.83, 0.0)))
    log = run_drive(JOINT, np.asarray(command), effects)
    velocity, torque, position = (x[::EVERY] for x in (log.velocity, log.torque, log.position))
    velocity = velocity + 1e-3 * rng.standard_normal(n)
    torque = torque + 0.02 * float(np.std(torque)) * rng.standard_normal(n)
    return ga.Record(EVERY * JOINT.dt, velocity=velocity, torque=torque, position=position, torque_is="measured")


def test_the_torque_jumps_at_a_reversal_with_dry_friction_and_not_with_a_steep_drag() -> None:
    dry, root = (jump_at_reversal([joint(e)]) for e in ({"coulomb_friction": {"torque": 10.0}}, ROOT))
    assert dry is not None and root is not None
    assert dry.value == pytest.approx(10.0, abs=4.0 * dry.std) and dry.value > 10.0 * dry.std
    assert root.value < 4.0 * root.std
    alone = ga.inverse_dynamics(joint(ROOT)).parameters["coulomb"]
    assert alone.value > 10.0 * alone.std, "without a steep column the drag passes for dry friction"


def test_the_jump_is_seen_beside_friction_that_grows_with_the_load() -> None:
    jump = jump_at_reversal([joint(LOADED, 6000)])
    assert jump is not None and jump.value > 4.0 * jump.std
    assert jump.value == pytest.approx(10.5, abs=2.0 * jump.std)


def test_one_direction_shows_no_jump() -> None:
    t = 1e-3 * np.arange(4000)
    w = 5.0 + np.sin(3.0 * t)
    rec = ga.Record(1e-3, velocity=w, torque=0.01 * 3.0 * np.cos(3.0 * t) + 0.1 + 0.02 * w)
    assert jump_at_reversal([rec]) is None
    assert jump_at_reversal([ga.Record(1e-3, velocity=w, command=w)]) is None


@pytest.mark.parametrize(("effects", "level"), [({"coulomb_friction": {"torque": 0.4}}, 0.4), ({}, None)])
def test_a_torque_that_changes_at_rest_is_held_by_dry_friction(effects: Effects, level: float | None) -> None:
    """A torque from -0.39 to 0.39 N m does not move the axis; without friction it does."""
    plant = Plant(J=0.02, D=0.04, kp=0.0, ki=0.0, dt=1e-3)
    torque = np.concatenate([np.linspace(0.0, -0.39, 1000), np.linspace(-0.39, 0.39, 4000), np.full(1500, 0.9)])
    log = run_drive(plant, None, effects, torque=torque)
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, len(torque)))
    rec = ga.Record(1e-3, velocity=log.velocity + noise[0], torque=torque + noise[1])
    found = torque_held_at_rest([rec])
    if level is None:
        assert found is None or found.value < 0.05
    else:
        assert found is not None and 0.9 * level < found.value < level and found.std < 0.01 * level


def test_a_filtered_velocity_is_late_behind_the_position_and_a_plain_one_is_not() -> None:
    t = 1e-3 * np.arange(6000)
    command = 10.0 * np.sin(8.0 * t) + 6.0 * np.sin(21.0 * t)
    plant = Plant(J=3e-3, D=0.02, kp=0.3, ki=6.0, dt=1e-3)
    for effects, late in (({}, 0.0), ({"velocity_filter": {"time_constant": 4e-3}}, 4.0)):
        log = run_drive(plant, command, effects)
        lag = velocity_lag(ga.Record(1e-3, velocity=log.velocity, position=log.position, torque=log.torque))
        assert lag is not None and lag == pytest.approx(late, abs=0.3)
    other = ga.Record(1e-3, velocity=log.velocity, position=3.0 * log.position, torque=log.torque)
    assert velocity_lag(other) is None, "a velocity that is not that of the position"


@pytest.mark.long
def test_friction_beside_gravity_is_seen_to_grow_with_the_load() -> None:
    dia = ga.diagnose(joint(LOADED))
    assert {f.effect for f in dia.causes} == {"unbalance", "load_dependent_friction"}
    assert not any(f.alternatives for f in dia.causes)
    assert dia.verdict == "explained" and dia.driver is None
    found = {f.effect: {name: e.value for name, e in f.parameters.items()} for f in dia.causes}
    assert found["unbalance"]["amplitude"] == pytest.approx(113.0, rel=0.01)
    assert found["load_dependent_friction"] == pytest.approx({"torque": 10.5, "share": 0.07}, rel=0.02)
    assert not any("disagree" in note for note in dia.notes), "a regression without it has no one number to compare"


@pytest.mark.long
def test_friction_of_one_size_beside_gravity_is_not_seen_to_grow_with_the_load() -> None:
    dia = ga.diagnose(joint({**GRAVITY, "coulomb_friction": {"torque": 10.5}}))
    assert {f.effect for f in dia.causes} == {"unbalance", "coulomb_friction"}
    assert not any(f.alternatives for f in dia.causes) and dia.verdict == "explained"


@pytest.mark.long
def test_a_steep_drag_alone_is_no_dry_friction() -> None:
    (cause,) = ga.diagnose(joint(ROOT)).causes
    assert cause.effect == "square_root_drag" and not cause.alternatives
    assert cause.parameters["coefficient"].value == pytest.approx(20.0, rel=0.02)


@pytest.mark.long
def test_dry_friction_and_a_steep_drag_stand_beside_each_other() -> None:
    """Bearings in grease: a level, and a drag that grows more slowly than the speed. Neither alone is the friction."""
    dia = ga.diagnose(joint({**ROOT, "coulomb_friction": {"torque": 8.0}}))
    found = {f.effect: {name: e.value for name, e in f.parameters.items()} for f in dia.causes}
    assert found == {
        "coulomb_friction": pytest.approx({"torque": 8.0}, rel=0.1),
        "square_root_drag": pytest.approx({"coefficient": 20.0}, rel=0.05),
    }
    assert not any(f.alternatives for f in dia.causes) and dia.verdict == "explained"
    assert dia.mechanics["viscous_friction"].value == pytest.approx(18.0, rel=0.1)


@pytest.mark.parametrize(
    ("effects", "steep"),
    [
        (ROOT, True),
        ({**ROOT, "coulomb_friction": {"torque": 8.0}}, True),
        ({"coulomb_friction": {"torque": 8.0}}, False),
        ({}, False),
    ],
)
def test_a_drag_steeper_than_viscous_friction_shows_beside_a_jump(effects: Effects, steep: bool) -> None:
    found = steep_drag([joint(effects)])
    assert found is not None and (found.value > 4.0 * found.std) is steep
