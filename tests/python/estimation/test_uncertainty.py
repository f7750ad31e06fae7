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
from gaident.estimation.regression.regression import larger_of, long_run
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


def test_the_larger_of_two_covariances_is_so_for_every_function_of_the_numbers() -> None:
    """Of two numbers that are nearly opposite the sum is known well: it has a deviation of its own that must not be too small."""
    rng = np.random.default_rng(5)
    first = np.array([[100.0, -99.9, 0.0], [-99.9, 100.0, 0.0], [0.0, 0.0, 1e-12]])
    second = np.outer([1.0, 1.0, 1e-5], [1.0, 1.0, 1e-5]) + 1e-9 * np.diag([1.0, 1.0, 1e-3])
    both = larger_of(first, second)
    for c in rng.standard_normal((200, 3)) * [1.0, 1.0, 1e6]:
        assert c @ both @ c >= (1.0 - 1e-9) * max(c @ first @ c, c @ second @ c)
    total = np.array([1.0, 1.0, 0.0])
    assert total @ both @ total == pytest.approx(4.0, rel=0.1) and total @ first @ total == pytest.approx(0.2)
    np.testing.assert_allclose(larger_of(first, 0.5 * first), first, rtol=1e-9, atol=1e-15)
    assert not np.any(larger_of(np.zeros((2, 2)), np.eye(2)))


def test_of_white_errors_they_are_those_of_least_squares() -> None:
    objective, fit = one_mass(DataSet.of([record(0.1 * np.random.default_rng(1).standard_normal(N))], None))
    ratio = np.sqrt(np.diag(covariance_of(objective, fit))) / stationary(objective, fit)
    assert np.all((ratio >= 1.0 - 1e-9) & (ratio < 1.3))


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


@pytest.mark.parametrize(("dt", "substeps"), [(1e-3, 8), (8e-3, 32)])
def test_what_the_steps_of_a_simulation_move_is_in_them(dt: float, substeps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cogging, simulated with 64 steps a line: with next to no noise the steps are all that is wrong.

    At 8 ms a line has as many steps as the library takes.
    """
    term = LIBRARY["cogging"]
    still = ga.Record(dt, velocity=np.zeros(N), torque=TORQUE * 1e-3 / dt)
    data = DataSet.of([still.with_channels(velocity=ga.simulate(MODEL, still))], None)
    assert data.substeps(None) == substeps
    parameters = Parameterisation.of(MODEL, scales_of(data), (False,)).extended(term)
    wave = {"amplitude": 0.02 * 1e-3 / dt, "order": 30.0 * 1e-3 / dt, "phase": 0.4}
    truth = np.concatenate([parameters.base_vector(MODEL), term.coordinates(wave)])
    fine = Hypothesis(parameters, OpenLoop(replace(data, finer=64 // substeps), True))
    velocity = fine.predictor.velocities(parameters, truth[None, :])[0]
    velocity = velocity + 1e-6 * np.random.default_rng(1).standard_normal(N)
    data = DataSet.of([still.with_channels(velocity=velocity)], None)
    objective = Objective(data, np.ones(N))
    fit = fitted(objective, Hypothesis(parameters, OpenLoop(data, True)), truth, WHITE, 60)
    places = slice(2, 4)  # amplitude and phase
    off = np.abs(fit.x - truth)[places]
    assert np.all(off < 2.0 * np.sqrt(np.diag(covariance_of(objective, fit)))[places])
    monkeypatch.setattr(uncertainty, "_of_the_steps", lambda objective, fit, J: 0.0)
    without = Objective(data, np.ones(N))
    assert np.max(off / np.sqrt(np.diag(covariance_of(without, fit)))[places]) > 2.0, "outside of a 95 % interval"


def test_slopes_are_those_at_a_point_however_soon_the_errors_bend() -> None:
    """A cogging under the simulated angle: 0.1 % of the gain moves it by a part of its period in 3 s, and errors bend before."""
    term = LIBRARY["cogging"]
    push = 0.2 + 0.1 * np.sin(2.0 * np.pi * np.arange(N) * DT / 1.1)
    still = ga.Record(DT, velocity=np.zeros(N), torque=push)
    data = DataSet.of([still.with_channels(velocity=ga.simulate(MODEL, still))], None)
    parameters = Parameterisation.of(MODEL, scales_of(data), (False,)).extended(term)
    truth = np.concatenate([parameters.base_vector(MODEL), term.coordinates({"amplitude": 0.05, "order": 6.0, "phase": -1.0})])
    clean = Hypothesis(parameters, OpenLoop(data, True)).predictor.velocities(parameters, truth[None, :])[0]
    off: list[Vector] = []
    for seed in range(8):
        noisy = clean + 0.1 * np.random.default_rng(seed).standard_normal(N)
        data = DataSet.of([still.with_channels(velocity=noisy)], None)
        objective = Objective(data, np.ones(N))
        fit = fitted(objective, Hypothesis(parameters, OpenLoop(data, True)), truth, WHITE, 60)
        off.append((fit.x - truth)[:4] / np.sqrt(np.diag(covariance_of(objective, fit)))[:4])
    assert np.all(np.abs(off) < 4.0) and 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5, np.array(off)
