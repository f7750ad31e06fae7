"""How noisy a velocity is, where the log is so slow that the motion itself has third differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.estimation.dataset import DataSet
from gaident.models.starts import noise_std

T, NOISE = 125e-6, 2e-3
DRIVE = ga.TwoMass(JM=4e-4, DM=0.004, JL=3e-4, DL=0.006, KG=600.0, DG=0.01).model()  # resonance at 300 Hz


def log(every: int) -> tuple[ga.Record, ga.Cascade, np.ndarray]:
    """Steps of 20 rad/s, noise at the log alone; and the velocity without it."""
    cascade = ga.Cascade(ga.PI(0.15, 4.0), period=T)
    command = np.where(np.arange(1200) // 60 % 2 == 1, 20.0, -20.0)
    command[:60] = 0.0
    still = ga.Record(every * T, command=command, velocity=np.zeros(1200))
    run = ga.run(DRIVE, still, cascade)
    noisy = run.velocity + NOISE * np.random.default_rng(1).standard_normal(1200)
    return ga.Record(every * T, command=command, velocity=noisy, torque=run.torque), cascade, run.velocity


def test_a_slow_log_shows_its_noise_in_what_a_model_leaves() -> None:
    rec, cascade, true = log(8)
    data = DataSet.of([rec], cascade)
    assert data.noise == noise_std(rec.velocity) > 5.0 * NOISE
    assert data.noise_of(rec.velocity - true) == pytest.approx(NOISE, rel=0.1)
    assert data.noise_of(rec.velocity - 0.5 * true) < data.noise  # a misfit is no noise either, where it is smooth
    assert data.noise_of(np.full(len(rec), np.inf)) == data.noise


def test_a_given_noise_and_a_log_at_the_controllers_rate_stay_as_they_are() -> None:
    rec, cascade, true = log(8)
    known = replace(DataSet.of([rec], cascade), known_noise=0.1)
    assert known.noise_of(rec.velocity - true) == 0.1
    fast, cascade, true = log(1)
    data = DataSet.of([fast], ga.PI(0.15, 4.0))
    assert data.noise_of(1e-9 * (fast.velocity - true)) == data.noise
