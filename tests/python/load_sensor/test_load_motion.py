"""The load's simulated motion, against the drive that shares no code with the library."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from scipy.signal import cont2discrete

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.errors import ModelError

skip_without_library()

PLANT = Plant(J=1e-3, D=1e-3, JL=2e-3, DL=1e-3, KG=80.0, DG=0.02, kp=0.05, ki=1.0, dt=1e-3)
COMMAND = np.repeat([0.0, 20.0, -20.0, 5.0, 0.0], 150)
DRIVE = ga.TwoMass(JM=PLANT.J, DM=PLANT.D, JL=PLANT.JL, DL=PLANT.DL, KG=PLANT.KG, DG=PLANT.DG)
EFFECTS: dict[str, dict[str, dict[str, float]]] = {
    "none": {},
    "friction at the load": {"coulomb_friction@load": {"torque": 0.1}},
    "friction at both ends": {"coulomb_friction": {"torque": 0.06}, "coulomb_friction@load": {"torque": 0.08}},
    "gap": {"backlash": {"gap": 0.01}},
    "hardening": {"hardening_stiffness": {"cubic_stiffness": 2e4}},
    "hysteresis": {"hysteretic_coupling": {"torque": 0.3, "stiffness": 60.0}},
    "gravity at the load": {"unbalance@load": {"amplitude": 0.1, "phase": 0.5}},
}


def model_with(effects: Mapping[str, Mapping[str, float]]) -> ga.Model:
    model = DRIVE.model()
    for key, values in effects.items():
        name, _, end = key.partition("@")
        model = model.with_effect(name, side=end, **values) if end else model.with_effect(name, **values)
    return model


@pytest.mark.parametrize("effects", EFFECTS.values(), ids=list(EFFECTS))
def test_the_load_moves_as_in_the_simulated_drive(effects: dict[str, dict[str, float]]) -> None:
    """Angle and velocity of the load within 1 % of its swing against the motor."""
    log = run_drive(PLANT, COMMAND, effects)
    rec = ga.Record(PLANT.dt, command=COMMAND, velocity=log.velocity)
    found = ga.run(model_with(effects), rec, PLANT.controller, load=True)
    assert found.load_velocity is not None and found.load_position is not None
    for simulated, motor, measured, at_motor in (
        (found.load_position, found.position, log.load_position, log.position),
        (found.load_velocity, found.velocity, log.load_velocity, log.truth),
    ):
        swing = float(np.std(measured - at_motor))
        twisted = (simulated - motor) - (measured - at_motor)
        assert float(np.sqrt(np.mean(twisted**2))) < 0.01 * swing


def test_under_a_held_torque_the_load_is_exact() -> None:
    """Against the matrix exponential of the two masses, x = (w_M, w_L, twist)."""
    d = DRIVE
    A = np.array(
        [
            [-(d.DM + d.DG) / d.JM, d.DG / d.JM, -d.KG / d.JM],
            [d.DG / d.JL, -(d.DL + d.DG) / d.JL, d.KG / d.JL],
            [1.0, -1.0, 0.0],
        ]
    )
    B = np.array([[1.0 / d.JM], [0.0], [0.0]])
    held, rise, *_ = cont2discrete((A, B, np.eye(3), np.zeros((3, 1))), 1e-3)
    torque, x, states = 0.01 * COMMAND, np.zeros(3), []
    for u in torque:
        states.append(x)
        x = held @ x + rise[:, 0] * u
    exact = np.array(states).T
    got = ga.run(d, ga.Record(1e-3, torque=torque, velocity=np.zeros(len(torque))), load=True)
    assert got.load_velocity is not None and got.load_position is not None
    for found, true in ((got.velocity, exact[0]), (got.load_velocity, exact[1]), (got.position - got.load_position, exact[2])):
        np.testing.assert_allclose(found, true, rtol=0.0, atol=1e-12 * float(np.abs(exact[0]).max()))


@pytest.mark.parametrize("loop", ["continuous", "sampled", "cascade"])
def test_the_load_obeys_its_own_equation_in_every_loop(loop: str) -> None:
    """J_L w_L(n+1) - J_L w_L(n) = integral of K x + d dx/dt - D_L w_L over the sample, by the trapezoidal rule."""
    controllers = {
        "continuous": ga.PI(kp=0.05, ki=1.0, loop="continuous"),
        "sampled": ga.PI(kp=0.05, ki=1.0),
        "cascade": ga.Cascade(velocity=ga.PI(kp=0.05, ki=1.0), period=2.5e-4),
    }
    rec = ga.Record(1e-3, command=COMMAND, velocity=np.zeros(len(COMMAND)))
    got = ga.run(DRIVE, rec, controllers[loop], load=True)
    assert got.load_velocity is not None and got.load_position is not None
    twist, w = got.position - got.load_position, got.load_velocity
    middle = DRIVE.KG * 0.5 * (twist[1:] + twist[:-1]) + DRIVE.DG * np.diff(twist) / rec.dt - DRIVE.DL * 0.5 * (w[1:] + w[:-1])
    left = DRIVE.JL * np.diff(w) / rec.dt - middle
    assert float(np.sqrt(np.mean(left**2))) < 0.01 * float(np.std(middle))


def test_asking_for_the_load_changes_nothing_else() -> None:
    rec = ga.Record(1e-3, command=COMMAND, velocity=np.zeros(len(COMMAND)), position=np.linspace(0.3, 9.0, len(COMMAND)))
    for effects in EFFECTS.values():
        with_load, without = (ga.run(model_with(effects), rec, PLANT.controller, load=load) for load in (True, False))
        for name in ("velocity", "torque", "position"):
            np.testing.assert_array_equal(getattr(with_load, name), getattr(without, name))
        assert without.load_velocity is None and without.load_position is None
        assert with_load.load_position is not None and with_load.load_position[0] == pytest.approx(0.3)


def test_a_model_without_a_load_is_refused() -> None:
    rec = ga.Record(1e-3, command=COMMAND, velocity=np.zeros(len(COMMAND)))
    with pytest.raises(ModelError, match=r"load is True, but the model is .*two masses.*leave it out"):
        ga.run(ga.OneMass(J=1e-3, D=0.0), rec, PLANT.controller, load=True)
    swinging = DRIVE.model().with_effect(
        "extra_resonance", frequency=300.0, damping=0.02, zero_frequency=250.0, zero_damping=0.02
    )
    with pytest.raises(ModelError, match="load is True"):
        ga.run(swinging, rec, PLANT.controller, load=True)
