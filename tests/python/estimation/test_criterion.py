"""The criterion: information, independent samples, the specification test, against formulas, SciPy and drawn noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

import gaident as ga
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import bic, chi_square_bound, effective_samples, gained_by_chance, specification_statistic
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Scales

Vector = NDArray[np.float64]

DT = 1e-3
INERTIA, DAMPING = 0.01, 0.02
SCALES = Scales(DT, 12.0, 1.0, 1.0, 1.0, 1.0, 0.02, float("nan"), float("nan"), False, 1.0)


def autoregressive(phi: float, samples: int, seed: int) -> Vector:
    return np.asarray(lfilter([1.0], [1.0, -phi], np.random.default_rng(seed).standard_normal(samples)))


def test_bic_is_minus_twice_the_log_likelihood_and_a_cost_per_number() -> None:
    e = np.random.default_rng(0).standard_normal(300)
    variance = float(np.mean(e**2))
    likelihood = -0.5 * float(np.sum(e**2 / variance + np.log(2.0 * np.pi * variance)))
    constant = 300.0 * (1.0 + np.log(2.0 * np.pi))
    assert bic(variance, 300.0, 4) == pytest.approx(-2.0 * likelihood - constant + 4.0 * np.log(300.0), rel=1e-12)
    # Half as many independent samples: half of the fall counts, against nearly the same cost per number.
    fall = bic(2.0, 1000.0, 3) - bic(1.0, 1000.0, 3)
    assert bic(2.0, 500.0, 3) - bic(1.0, 500.0, 3) == pytest.approx(0.5 * fall)


def test_bic_stays_a_number() -> None:
    assert np.isfinite(bic(0.0, 1000.0, 3)), "a model without an error"
    assert bic(2.0, 0.0, 3) == 0.0, "no information, and no cost below one sample"


@pytest.mark.parametrize("samples", [200, 4000, 30_000])
def test_every_sample_of_white_noise_is_independent(samples: int) -> None:
    found = effective_samples(np.random.default_rng(1).standard_normal(samples))
    assert 0.7 * samples < found <= samples


@pytest.mark.parametrize("phi", [0.3, 0.5, 0.8, 0.9, 0.97])
def test_independent_samples_of_an_autoregression(phi: float) -> None:
    """rho(k) = phi^k: I/N = 1/(1 + 2 phi/(1 - phi)) = (1 - phi)/(1 + phi) (Bartlett 1946)."""
    samples = 60_000
    found = [effective_samples(autoregressive(phi, samples, seed)) / samples for seed in range(4)]
    # What lies below a twentieth is cut off: by up to a tenth of the sum.
    assert np.mean(found) == pytest.approx((1.0 - phi) / (1.0 + phi), rel=0.1)


def test_independent_samples_are_between_one_and_all() -> None:
    alternating = np.asarray(lfilter([1.0], [1.0, 0.6], np.random.default_rng(2).standard_normal(1000)))
    of_a_mean_square = 1000.0 * (1.0 - 0.36) / (1.0 + 0.36)
    assert effective_samples(alternating) == pytest.approx(of_a_mean_square, rel=0.15), "they tell a power as badly as slow ones"
    assert 1.0 <= effective_samples(np.linspace(0.0, 1.0, 1000)) < 4.0, "a drift"
    assert effective_samples(np.zeros(50)) == 50.0, "no error says nothing about its colour"


def test_independent_samples_are_of_the_shape_alone() -> None:
    e = autoregressive(0.8, 3000, 3)
    assert effective_samples(1e-9 * e) == pytest.approx(effective_samples(e), rel=1e-9)
    assert effective_samples(np.repeat(e, 4)) < 1.3 * effective_samples(e), "repeating samples adds none"


@pytest.mark.parametrize("level", [0.05, 0.01, 1e-6])
@pytest.mark.parametrize("freedom", [1, 2, 5, 20])
def test_the_bound_is_that_of_chi_square(freedom: int, level: float) -> None:
    assert chi_square_bound(freedom, level) == pytest.approx(chi2.isf(level, freedom), rel=1e-9)


def test_the_statistic_counts_only_what_the_whitened_estimate_loses() -> None:
    assert specification_statistic(1.0, 1.0, 100.0) == 0.0
    assert specification_statistic(0.9, 1.0, 100.0) == 0.0
    assert specification_statistic(1.1, 1.0, 100.0) == pytest.approx(100.0 * np.log(1.1))
    assert specification_statistic(1.1, 0.0, 100.0) == 0.0


def statistic_of_noise(phi: float, slow: bool, seed: int) -> float:
    """H of two coefficients by generalised and by ordinary least squares, under true autoregressive noise."""
    samples = 1500
    X = np.random.default_rng(1000 + seed).standard_normal((2, samples))
    if slow:
        X = lfilter([1.0], [1.0, -0.98], X)
    e = autoregressive(phi, samples, seed)
    plain = e - np.linalg.lstsq(X.T, e, rcond=None)[0] @ X
    white = np.array([1.0, -phi])
    generalised = np.linalg.lstsq(lfilter(white, 1.0, X).T, lfilter(white, 1.0, e), rcond=None)[0]
    whitened = e - generalised @ X
    return specification_statistic(float(whitened @ whitened), float(plain @ plain), effective_samples(plain))


@pytest.mark.parametrize("slow", [False, True])
@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_the_size_under_stationary_noise_is_no_larger_than_its_level(phi: float, slow: bool) -> None:
    """Of 400 draws at a level of 5 %: fewer than 20 + 3 sqrt(19) are above the bound."""
    found = np.array([statistic_of_noise(phi, slow, seed) for seed in range(400)])
    assert np.count_nonzero(found > chi_square_bound(2, 0.05)) < 33
    assert found.max() < chi_square_bound(2, 1e-6)


@dataclass(frozen=True)
class Estimates:
    """Inertias [kg m^2] of the plain and the whitened estimate, H and its bound at the level of the policy."""

    plain: float
    whitened: float
    statistic: float
    bound: float


def estimated(torque_noise: float, seed: int, colour: float = 0.0, samples: int = 12_000) -> Estimates:
    """An axis driven by steps of torque, the torque as logged with white noise, the velocity with noise of a colour."""
    rng = np.random.default_rng(seed)
    torque = np.repeat(rng.uniform(-1.0, 1.0, samples // 100), 100)
    model = ga.OneMass(J=INERTIA, D=DAMPING).model()
    w = ga.simulate(model, ga.Record(DT, velocity=np.zeros(samples), torque=torque))
    w = w + 0.01 * lfilter([1.0], [1.0, -colour], rng.standard_normal(samples))
    rec = ga.Record(DT, velocity=w, torque=torque + torque_noise * rng.standard_normal(samples))
    data = DataSet.of([rec], None)
    objective = Objective(data, np.ones(samples))
    parameters = Parameterisation.of(model, SCALES, data.moving)
    plain = ls.fit(objective, Hypothesis(parameters, OpenLoop(data)), parameters.start(model) + 0.1, WHITE, 20)
    whitened = ls.reestimated(objective, plain)

    def squares(fit: Fit) -> float:
        e = objective.error(fit) * objective.counted
        return float(e @ e)

    information = min(effective_samples(objective.error(plain) * objective.counted), objective.count)
    inertias = (1.0 / parameters.linear(f.x).gain for f in (plain, whitened))
    statistic = specification_statistic(squares(whitened), squares(plain), information)
    return Estimates(*inertias, statistic, chi_square_bound(parameters.size, 1e-6))


@pytest.mark.parametrize("colour", [0.0, 0.9])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_with_noise_on_the_velocity_alone_both_estimates_agree(colour: float, seed: int) -> None:
    found = estimated(0.0, seed, colour)
    assert found.plain == pytest.approx(INERTIA, rel=5e-3) and found.whitened == pytest.approx(INERTIA, rel=5e-3)
    assert found.statistic < found.bound


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_torque_that_is_itself_measured_biases_the_whitened_estimate_and_the_test_says_so(seed: int) -> None:
    """Errors in variables (Soderstrom 2007): e = -G n is slow, and its whitening trusts the fast part, where n outweighs u.

    There the least gain explains n best; the plain error weighs the slow part, where the axis answers to u alone.
    The power is a matter of the independent samples of the plain error:
    of 20 such records of 12 s all are above the bound, of 4 s 16.
    """
    found = estimated(0.3, seed)
    assert found.plain == pytest.approx(INERTIA, rel=0.05)
    assert found.whitened > 1.5 * INERTIA
    assert found.statistic > found.bound


def test_a_torque_of_next_to_no_noise_is_no_contradiction() -> None:
    found = estimated(0.005, 0)
    assert found.whitened == pytest.approx(INERTIA, rel=0.02) and found.statistic < found.bound


def test_output_errors_count_their_independent_samples() -> None:
    rec = ga.Record(DT, velocity=np.zeros(200), torque=np.zeros(200))
    objective = Objective(DataSet.of([rec], None), np.ones(200))
    assert objective.information == objective.count == 200.0 - objective.head
    assert objective.under(OutputErrors(12.5)).information == 12.5
    assert objective.under(OutputErrors(1e9)).information == objective.count, "no more than there are"
    assert objective.under(OutputErrors(12.5)).noise_of(np.sin(np.arange(200.0)), False) is WHITE


def test_what_noise_gives_a_fuller_model_by_chance() -> None:
    """White noise: chi-square. What wanders gives a slow column more; what the model leaves bounds it."""
    rng, level = np.random.default_rng(5), 1e-3
    white = rng.standard_normal((2000, 50))
    simpler, fuller = np.eye(50)[:1], np.eye(50)[:4]
    assert gained_by_chance(white, simpler, fuller, np.inf, level) == pytest.approx(chi_square_bound(3, level), rel=0.1)
    assert gained_by_chance(white, fuller, simpler, np.inf, level) <= 0.0
    assert gained_by_chance(white, simpler, simpler, np.inf, level) == 0.0
    half = gained_by_chance(white, simpler, fuller, 23.0, level)  # of the 46 that the draws leave
    assert half == pytest.approx(0.5 * chi_square_bound(3, level), rel=0.1)
    # One column of large weight beside one of little is no chi-square of two.
    weights = np.array([3.0, 0.3, *np.ones(48)])
    gains = np.sum((weights[:2] * rng.standard_normal((200000, 2))) ** 2, axis=1)
    told = gained_by_chance(weights * white, np.zeros((0, 50)), np.eye(50)[:2], np.inf, level)
    assert told == pytest.approx(np.quantile(gains, 1.0 - level), rel=0.15)
