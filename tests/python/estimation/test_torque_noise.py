"""A measured torque with noise: what that noise makes of a free run is no cause, and no reason to doubt one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Noise, Plant, rig
from gaident.estimation.criterion import effective_samples
from gaident.estimation.prediction import torque_noise_in


def noisy(record: ga.Record, share: float, seed: int) -> ga.Record:
    """The record as one whose torque was measured, with white noise of a share of its rms."""
    torque = np.asarray(record.torque)
    noise = share * float(np.sqrt(np.mean(torque**2))) * np.random.default_rng(seed).standard_normal(len(torque))
    return replace(record, command=None, torque=torque + noise, torque_is="measured")


def test_torque_noise_of_a_drive_without_effects_is_no_cause() -> None:
    """A stiff shaft, which the noise lets swing: 3500 samples had the information of 440, and cogging seemed to be there."""
    record, validation, _, truth = random_case(211000000, (), "multi", "white")
    assert validation is not None and truth.plant.two_masses
    dia = ga.diagnose(noisy(record, 0.05, 0), validation=noisy(validation, 0.05, 1))
    assert (dia.verdict, dia.findings, dia.driver) == ("adequate", (), None)
    inertia = dia.mechanics["inertia"]
    assert abs(inertia.value - truth.plant.J - truth.plant.JL) < 3.0 * inertia.std
    assert any("noise of the measured torque" in note for note in dia.notes)


@pytest.mark.long
def test_friction_beside_torque_noise_is_explained() -> None:
    record, validation, _, truth = random_case(212000000, "coulomb_friction", "multi", "white")
    assert validation is not None
    dia = ga.diagnose(noisy(record, 0.1, 0), validation=noisy(validation, 0.1, 1))
    assert dia.verdict == "explained"
    (finding,) = (f for f in dia.findings if not f.is_noise)
    assert finding.effect == "coulomb_friction"
    torque = finding.parameters["torque"]
    assert abs(torque.value - truth.effects["coulomb_friction"]["torque"]) < 4.0 * torque.std


@pytest.mark.parametrize("damping", [0.02, 0.1])
def test_errors_that_swing_contain_little_information(damping: float) -> None:
    """An autoregression of order 2 that rings: the mean square varies by sqrt(2/I), which 400 draws measure."""
    omega, count = 0.27, 2000
    pole = np.exp(complex(-damping * omega, omega * np.sqrt(1.0 - damping**2)))
    from scipy.signal import lfilter

    rng = np.random.default_rng(5)
    errors = lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], rng.standard_normal((400, count + 1000)), axis=1)[:, 1000:]
    powers = np.mean(errors**2, axis=1)
    measured = 2.0 * float(np.mean(powers) ** 2 / np.var(powers))
    said = float(np.median([effective_samples(e) for e in errors]))
    assert 0.7 * measured < said < 1.4 * measured


def test_added_up_is_what_white_torque_noise_makes_of_a_free_run() -> None:
    """Of a rigid axis: sigma^2 dt^2 / J^2 times the mean number of samples so far, with little damping."""
    model = ga.OneMass(J=1e-3, D=1e-3).model()
    rng, dt, count = np.random.default_rng(2), 1e-3, 4000
    noise = [ga.Record(dt, torque=0.1 * rng.standard_normal(count), velocity=np.zeros(count)) for _ in range(40)]
    measured = float(np.mean([np.mean(ga.simulate(model, r) ** 2) for r in noise]))
    said = float(np.mean([torque_noise_in(model, [replace(r, torque_is="measured")]) ** 2 for r in noise]))
    assert abs(said - measured) < 0.15 * measured
    assert torque_noise_in(model, noise) == 0.0  # commanded torques have no noise
    steps = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], count // 10), 10)
    quiet = ga.Record(dt, torque=steps, velocity=np.zeros(count), torque_is="measured")
    assert torque_noise_in(model, [quiet]) == 0.0  # a command in steps is no noise


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_load_that_comes_on_is_no_torque_noise(seed: int) -> None:
    """A noise model of torques takes it for noise; the free run says that no noise of this torque is so large."""
    load, count, dt = (0.05, 0.1, 0.03)[seed], 3000, 0.5e-3
    rng = np.random.default_rng(seed)
    command = 0.1 * np.repeat(rng.choice([-1.0, 1.0], count // 10), 10)
    torque = command + np.where(dt * np.arange(count) > 0.7, load, 0.0)
    model = ga.OneMass(J=3e-4, D=1.5e-3).model()
    velocity = ga.simulate(model, ga.Record(dt, torque=torque, velocity=np.zeros(count))) + 0.01 * rng.standard_normal(count)
    logged = command + 0.002 * rng.standard_normal(count)
    dia = ga.diagnose(ga.Record(dt, torque=logged, velocity=velocity, torque_is="measured"))
    assert (dia.verdict, dia.causes) == ("unexplained", ()), dia.summary()


def measured(seed: int, share: float, effects: dict[str, dict[str, float]] | None = None) -> ga.Record:
    """A log under steps of speed that reach the torque limit; the torque with white noise, as a share of its rms."""
    rng = np.random.default_rng(seed)
    limited = ga.Cascade(ga.PI(0.05, 0.5, torque_limit=1.0), period=1e-3)
    plant = Plant(J=1e-3, D=2e-3, kp=0.05, ki=0.5, dt=1e-3, cascade=limited)
    speeds = np.repeat(rng.choice([50.0, -50.0, 20.0, -20.0, 80.0, -80.0, 10.0, -10.0, 0.0], 20), 150)
    rec = rig(plant, speeds, effects or {}, Noise(white=0.1), seed=seed)
    noise = share * np.sqrt(np.mean(rec.torque**2)) * rng.standard_normal(len(rec))
    return ga.Record(1e-3, velocity=rec.velocity, torque=rec.torque + noise, torque_is="measured")


@pytest.mark.long
@pytest.mark.parametrize("share", [0.02, 0.05])
@pytest.mark.parametrize("seed", [0, 2, 7])
def test_the_noise_of_a_measured_torque_is_no_cause(seed: int, share: float) -> None:
    dia = ga.diagnose(measured(seed, share))
    assert dia.verdict == "adequate" and not dia.causes, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)
    assert dia.before.rmse == dia.after.rmse and dia.after.fit_percent > 90.0


def test_a_cause_shows_through_that_noise() -> None:
    dia = ga.diagnose(measured(3, 0.05, {"coulomb_friction": {"torque": 0.08}}))
    (found,) = dia.causes
    assert found.effect == "coulomb_friction" and found.parameters["torque"].value == pytest.approx(0.08, rel=0.1)
