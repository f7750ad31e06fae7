"""Deviations of parameters: larger where errors go with the motion, and by what the steps of a simulation move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

import gaident as ga
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import uncertainty
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.regression.regression import long_run
from gaident.estimation.uncertainty import covariance_of

Vector = NDArray[np.float64]

DT, N = 1e-3, 3000
MODEL = ga.OneMass(J=3e-4, D=2e-3).model()
TORQUE = 0.15 * np.sign(np.sin(2.0 * np.pi * np.arange(N) * DT / 0.6)) + 0.1


def record(errors: Vector) -> ga.Record:
    still = ga.Record(DT, velocity=np.zeros(N), torque=TORQUE)
    return ga.Record(DT, velocity=ga.simulate(MODEL, still) + errors, torque=TORQUE)


def one_mass(data: DataSet) -> tuple[Objective, Fit]:
    objective = Objective(data, np.ones(len(data.velocity)))
    parameters = Parameterisation.of(MODEL, scales_of(data), (False,))
    return objective, fitted(objective, Hypothesis(parameters, OpenLoop(data)), parameters.start(MODEL), WHITE, 60)


def stationary(objective: Objective, fit: Fit) -> Vector:
    """Deviations where the errors are white and alike throughout."""
    v, J = objective.linearised(fit.hypothesis, fit.x, fit.noise)
    return np.asarray(np.sqrt(np.diag(float(v @ v) / (len(v) - len(fit.x)) * np.linalg.inv(J @ J.T))))


def test_the_long_run_covariance_is_newey_and_wests() -> None:
    scores = np.random.default_rng(3).standard_normal((150, 2)).cumsum(axis=0)
    lags = int(np.ceil(1.3 * np.sqrt(150)))
    expected = scores.T @ scores
    for lag in range(1, lags + 1):
        product = scores[lag:].T @ scores[:-lag]
        expected += (1.0 - lag / (lags + 1.0)) * (product + product.T)
    np.testing.assert_allclose(long_run(scores), expected, rtol=1e-10)


def test_of_white_errors_they_are_those_of_least_squares() -> None:
    objective, fit = one_mass(DataSet.of([record(0.1 * np.random.default_rng(1).standard_normal(N))], None))
    ratio = np.sqrt(np.diag(covariance_of(objective, fit))) / stationary(objective, fit)
    assert np.all((ratio >= 1.0 - 1e-9) & (ratio < 1.2))


def test_errors_that_go_with_the_motion_make_them_larger() -> None:
    """Of a fit whose error is a slow share of the velocity, over 24 records: those of least squares are too small."""
    w = ga.simulate(MODEL, ga.Record(DT, velocity=np.zeros(N), torque=TORQUE))
    off: dict[str, list[Vector]] = {"plain": [], "said": []}
    for seed in range(24):
        slow = lfilter([np.sqrt(1.0 - 0.97**2)], [1.0, -0.97], np.random.default_rng(seed).standard_normal(N))
        objective, fit = one_mass(DataSet.of([record(0.02 * slow * w)], None))
        error = fit.x - fit.parameters.base_vector(MODEL)
        off["plain"].append(error / stationary(objective, fit))
        off["said"].append(error / np.sqrt(np.diag(covariance_of(objective, fit))))
    plain, said = (np.sqrt(np.mean(np.square(off[key]), axis=0)) for key in ("plain", "said"))
    assert np.all(plain > 3.0) and np.all(said < 1.6), (plain, said)


def test_what_the_steps_of_a_simulation_move_is_in_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cogging, simulated with finer steps: with next to no noise the steps are all that is wrong."""
    term = LIBRARY["cogging"]
    data = DataSet.of([record(np.zeros(N))], None)
    parameters = Parameterisation.of(MODEL, scales_of(data), (False,)).extended(term)
    truth = np.concatenate([parameters.base_vector(MODEL), term.coordinates({"amplitude": 0.02, "order": 18.0, "phase": 0.4})])
    fine = Hypothesis(parameters, OpenLoop(replace(data, finest=data.finest / 16.0), True))
    velocity = fine.predictor.velocities(parameters, truth[None, :])[0]
    velocity = velocity + 1e-6 * np.random.default_rng(1).standard_normal(N)
    data = DataSet.of([ga.Record(DT, velocity=velocity, torque=TORQUE)], None)
    objective = Objective(data, np.ones(N))
    fit = fitted(objective, Hypothesis(parameters, OpenLoop(data, True)), truth, WHITE, 60)
    wave = slice(2, 4)  # amplitude and phase
    off = np.abs(fit.x - truth)[wave]
    assert np.all(off < 2.0 * np.sqrt(np.diag(covariance_of(objective, fit)))[wave])
    monkeypatch.setattr(uncertainty, "_of_the_steps", lambda objective, fit: 0.0)
    without = Objective(data, np.ones(N))
    assert np.max(off / np.sqrt(np.diag(covariance_of(without, fit)))[wave]) > 3.0
