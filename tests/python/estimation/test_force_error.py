"""The force error of drives simulated apart from the library: nothing is left at the truth, what is hidden shows in size."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, rig, skip_without_library

skip_without_library()

ONE = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.9, dt=1e-3)
TWO = Plant(J=3e-4, D=2e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=1e-3, kp=0.04, ki=1.2, dt=1e-3)
TIME = 1e-3 * np.arange(4000)
COMMAND = 30.0 * np.sin(2.0 * np.pi * 1.3 * TIME) + 10.0 * np.sin(2.0 * np.pi * 3.1 * TIME)
EFFECTS: dict[str, dict[str, float]] = {
    "coulomb_friction": {"torque": 0.05},
    "stribeck_friction": {"torque": 0.05, "static_torque": 0.08, "stribeck_velocity": 2.0},
    "presliding_friction": {"torque": 0.05, "stiffness": 5.0},
    "quadratic_drag": {"coefficient": 2e-5},
    "load_torque": {"torque": 0.03},
    "unbalance": {"amplitude": 0.05, "phase": 0.4},
    "torque_saturation": {"limit": 0.1},
    "torque_dead_band": {"width": 0.03},
    "transport_delay": {"delay": 3e-3},
    "torque_lag": {"time_constant": 4e-3},
    "velocity_filter": {"time_constant": 4e-3},
}


def mechanism(plant: Plant) -> ga.Model:
    if plant.two_masses:
        return ga.TwoMass(plant.J, plant.D, plant.JL, plant.DL, plant.KG, plant.DG).model()
    return ga.OneMass(plant.J, plant.D).model()


@pytest.mark.parametrize("plant", [ONE, TWO], ids=["one mass", "two masses"])
@pytest.mark.parametrize("effect", EFFECTS)
def test_the_true_model_needs_the_logged_torque(effect: str, plant: Plant) -> None:
    rec = rig(plant, COMMAND, {effect: EFFECTS[effect]}, noise="none")
    true = mechanism(plant).with_effect(effect, **EFFECTS[effect])
    at_truth = ga.force_error(true, rec)
    without = ga.force_error(mechanism(plant), rec, cutoff_hz=at_truth.cutoff_hz)
    assert at_truth.percent < 1.0, at_truth
    assert without.rms > 30.0 * at_truth.rms, (without, at_truth)


def test_steps_of_two_masses_leave_little_at_the_truth() -> None:
    """Up to half of the antiresonance, where the motor's inertia alone is not what the loop leads."""
    rec = rig(TWO, np.repeat([20.0, -30.0, 10.0, -5.0, 40.0, 0.0, -20.0, 15.0], 500), {}, noise="none")
    assert ga.force_error(mechanism(TWO), rec).percent < 0.2


def test_a_missing_friction_is_missing_in_its_size() -> None:
    rec = rig(ONE, COMMAND, {"coulomb_friction": {"torque": 0.05}}, noise="none")
    assert ga.force_error(mechanism(ONE), rec).rms == pytest.approx(0.05, rel=0.02)


@pytest.mark.parametrize("torque_noise", [0.0, 0.01])
def test_noise_leaves_what_the_floor_says(torque_noise: float) -> None:
    rec = rig(ONE, COMMAND, {}, noise="white", seed=2)
    if torque_noise:
        noisy = rec.torque + torque_noise * np.random.default_rng(3).standard_normal(len(rec))
        rec = ga.Record(rec.dt, velocity=rec.velocity, torque=noisy, torque_is="measured")
    found = ga.force_error(mechanism(ONE), rec)
    assert 0.7 * found.noise_floor < found.rms < 1.1 * found.noise_floor


def test_a_swing_that_the_free_run_loses_has_a_small_force_error() -> None:
    """An integrating axis under a small load: the free run drifts away, the force error says how small the load is."""
    plant = Plant(J=3e-4, D=0.0, kp=0.03, ki=1.9, dt=1e-3)
    rec = rig(plant, COMMAND, {"load_torque": {"torque": 2e-3}}, noise="none")
    model = ga.Model(1.0 / 3e-4, [0.0])
    drift = rec.velocity - ga.simulate(model, ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque))
    assert np.sqrt(np.mean(drift**2)) > 0.5 * np.sqrt(np.mean(rec.velocity**2))
    assert ga.force_error(model, rec).rms == pytest.approx(2e-3, rel=0.05)


def test_from_a_sample_on_only_these_samples_count() -> None:
    rec = rig(ONE, COMMAND, {}, noise="none")
    torque = rec.torque + np.where(np.arange(len(rec)) < 2000, 0.5, 0.0)
    spoiled = rec.with_channels(torque=torque)
    assert ga.force_error(mechanism(ONE), spoiled, first=2200).percent < 0.5
    assert ga.force_error(mechanism(ONE), [rec, spoiled], first=[0, 2200]).percent < 0.5
    assert ga.force_error(mechanism(ONE), spoiled).rms == pytest.approx(0.5 * np.sqrt(0.5), rel=0.02)


def test_a_regression_and_a_function_are_models_too() -> None:
    rec = rig(ONE, COMMAND, {"coulomb_friction": {"torque": 0.05}}, noise="white", seed=4)
    found = ga.inverse_dynamics(rec)
    by_result = ga.force_error(found, rec, cutoff_hz=found.cutoff_hz)
    assert by_result.percent < 4.0
    assert ga.force_error(found.torque, rec, cutoff_hz=found.cutoff_hz).rms == by_result.rms


def test_a_commanded_torque_is_held_and_a_measured_one_is_not() -> None:
    rec = rig(ONE, COMMAND, {}, noise="none")
    assert rec.torque is not None
    at_once = 0.5 * (rec.torque + np.append(0.0, rec.torque[:-1]))  # at a sample, between the torques held before and after it
    for torque, is_true, is_not in ((rec.torque, "commanded", "measured"), (at_once, "measured", "commanded")):
        true, other = (
            ga.force_error(
                mechanism(ONE), ga.Record(rec.dt, velocity=rec.velocity, torque=torque, torque_is=said), cutoff_hz=50.0
            )
            for said in (is_true, is_not)
        )
        assert true.rms < 0.15 * other.rms


def test_what_cannot_be_compared_is_refused() -> None:
    rec = rig(ONE, COMMAND, {}, noise="none")
    still = ga.Record(1e-3, velocity=np.zeros(500), torque=np.zeros(500))
    with pytest.raises(ga.errors.RecordError, match="torque"):
        ga.force_error(mechanism(ONE), ga.Record(1e-3, command=COMMAND, velocity=COMMAND))
    with pytest.raises(ga.errors.RecordError, match="nothing moves"):
        ga.force_error(mechanism(ONE), still)
    for model in (ga.Model(-10.0, [-1.0]), ga.Model(10.0, [-1.0, -2.0]), ga.Model(10.0, [-1.0, -2.0], [3.0])):
        with pytest.raises(ga.errors.ModelError, match="cannot be led"):
            ga.force_error(model, rec)
    with pytest.raises(ga.errors.SettingsError, match="cutoff_hz"):
        ga.force_error(mechanism(ONE), rec, cutoff_hz=500.0)
    with pytest.raises(ga.errors.SettingsError, match="first has 2"):
        ga.force_error(mechanism(ONE), rec, first=[0, 1])
    with pytest.raises(ga.errors.SettingsError, match="order"):
        ga.force_error(mechanism(ONE), rec, order=0)
    with pytest.raises(ga.errors.SettingsError, match="shape"):
        ga.force_error(lambda r: np.zeros(3), rec)
