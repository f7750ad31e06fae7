"""The controller of the simulated drive against two others: servo_referee.py, and the library's `ga.run`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_servo import CASES, KI, KP, POSITION_CASES, T, command, path

import gaident as ga
import servo_referee as referee
from drive_rig import Array, Plant, between_lines, rig, run_drive, skip_without_library

skip_without_library()

DRIVES = {
    "one mass": (Plant(J=1e-3, D=0.01, kp=KP, ki=KI, dt=T), referee.Axis(1e-3, 0.01), ga.OneMass(J=1e-3, D=0.01)),
    "two masses": (
        Plant(J=4e-4, D=0.004, JL=9e-4, DL=0.006, KG=60.0, DG=0.02, kp=KP, ki=KI, dt=T),
        referee.Axis(4e-4, 0.004, 9e-4, 0.006, 60.0, 0.02),
        ga.TwoMass(JM=4e-4, DM=0.004, JL=9e-4, DL=0.006, KG=60.0, DG=0.02),
    ),
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", CASES)
def test_velocity_loops_agree_with_both(name: str, drive: str) -> None:
    pi, around, given = CASES[name]
    plant, axis, model = DRIVES[drive]
    cascade = ga.Cascade(ga.PI(KP, KI, **pi), period=T, **around)
    r = command(2400)
    log = run_drive(replace(plant, cascade=cascade), r)
    w, u, q = referee.simulate(axis, r, T, 1, kp=KP, ki=KI, **given())
    run = ga.run(model, ga.Record(T, command=r, velocity=w), cascade)
    assert np.abs(w).max() > 10.0
    for mine, others in ((log.velocity, (w, run.velocity)), (log.torque, (u, run.torque))):
        for other in others:
            assert np.abs(mine - other).max() < 1e-8
    assert np.abs(log.position - q).max() < 1e-9


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", POSITION_CASES)
def test_position_loops_agree_with_both(name: str, drive: str) -> None:
    around, given = POSITION_CASES[name]
    plant, axis, model = DRIVES[drive]
    cascade = ga.Cascade(ga.PI(KP, KI), period=T, position=ga.P(50.0), **around)
    q_ref = path(2400)
    log = run_drive(replace(plant, cascade=cascade), q_ref)
    w, u, q = referee.simulate(axis, q_ref, T, 1, kp=KP, ki=KI, position_gain=50.0, **given)
    run = ga.run(model, ga.Record(T, velocity=w, torque=u, position_command=q_ref), cascade)
    inside = slice(-9)  # behind its end the referee holds the command
    for mine, other in ((log.velocity, w), (log.torque, u), (log.position, q)):
        assert np.abs(mine - other)[inside].max() < 1e-8
    # The library's angle is the sum of trapezoids under the velocity.
    assert np.abs(log.velocity - run.velocity)[inside].max() < 1e-5 * np.abs(w).max()
    assert np.abs(log.torque - run.torque)[inside].max() < 1e-5 * np.abs(u).max()


@pytest.mark.parametrize("placed", [False, True], ids=["velocity", "position"])
def test_a_slower_log_is_every_so_manyth_sample(placed: bool) -> None:
    plant = DRIVES["two masses"][0]
    cascade = ga.Cascade(ga.PI(KP, KI, rule="backward"), period=T, position=ga.P(50.0) if placed else None)
    line = path(2400)[::4] if placed else command(2400)[::4]
    slow = replace(plant, dt=4 * T, cascade=cascade)
    rec = rig(slow, line, noise="none", position_logged=True)
    ticks = between_lines(slow, line)
    log = run_drive(replace(plant, cascade=cascade), ticks, substeps=10)  # as many as the slower log gives one of its samples
    assert rec.dt == 4 * T
    assert rec.velocity.tobytes() == log.velocity[::4].tobytes()
    assert rec.torque is not None and rec.torque.tobytes() == log.torque[::4].tobytes()
    assert rec.position is not None and rec.position.tobytes() == log.position[::4].tobytes()
    assert (rec.position_command is not None) is placed and (rec.command is None) is placed
    assert not placed or np.array_equal(ticks[::4], line)


def by_hand(plant: Plant, r: Array, w: Array, limit: float) -> Array:
    """The bare PI of the rig before it had others, line by line in floating-point numbers."""
    integral = last = 0.0
    torque = []
    for asked, velocity in zip(r.tolist(), w.tolist(), strict=True):
        error = asked - velocity
        integral = integral + plant.ki * plant.dt / 2 * (error + last)
        torque.append(min(max(plant.kp * error + integral, -limit), limit))
        last = error
    return np.array(torque)


@pytest.mark.parametrize("limit", [None, 0.6])
def test_a_bare_pi_is_what_it_was_bit_for_bit(limit: float | None) -> None:
    plant = DRIVES["one mass"][0]
    noise = 0.1 * np.random.default_rng(1).standard_normal(2400)
    effects = {"coulomb_friction": {"torque": 0.05}}
    bare = run_drive(plant, command(2400), effects, velocity_noise=noise)
    pi = ga.PI(KP, KI, torque_limit=limit)
    log = run_drive(replace(plant, cascade=ga.Cascade(pi)), command(2400), effects, velocity_noise=noise)
    if limit is None:
        assert log.velocity.tobytes() == bare.velocity.tobytes() and log.torque.tobytes() == bare.torque.tobytes()
    else:
        assert np.any(np.abs(bare.torque) > limit)
    assert log.torque.tobytes() == by_hand(plant, command(2400), log.velocity, limit or np.inf).tobytes()


def test_an_integrator_limit_of_the_controller_is_a_setting_and_the_effect_acts_over_it() -> None:
    plant = DRIVES["one mass"][0]
    known = replace(plant, cascade=ga.Cascade(ga.PI(KP, KI, integrator_limit=0.1)))
    hidden = run_drive(plant, command(2400), {"integrator_clamp": {"limit": 0.1}})
    assert run_drive(known, command(2400)).torque.tobytes() == hidden.torque.tobytes()
    both = run_drive(known, command(2400), {"integrator_clamp": {"limit": 0.05}})
    assert np.abs(both.torque - hidden.torque).max() > 1e-3
