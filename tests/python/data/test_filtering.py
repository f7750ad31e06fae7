"""Filters and sums that run in the core, against SciPy and NumPy."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfiltfilt

import gaident as ga
from gaident.control.filtering import clamped_sum, filtered, filtered_powers, recursion, zero_phase
from gaident.errors import ModelError
from gaident.estimation.dataset import DataSet
from gaident.estimation.least_squares import damped_steps
from gaident.estimation.noise_model import WHITE, NoiseFilter, ShaftNoise, autoregression
from gaident.estimation.objective import Objective
from gaident.estimation.state_space import _inverses, steady_covariance, steady_covariances
from gaident.identification.noise import autocorrelation

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("zeros", [0, 1, 5, 20])
@pytest.mark.parametrize("poles", [0, 1, 2, 7, 16])
@pytest.mark.parametrize("rows", [1, 4, 7])
def test_rows_are_filtered_record_by_record(zeros: int, poles: int, rows: int) -> None:
    b = RNG.standard_normal(zeros + 1)
    a = np.poly(0.8 * np.exp(1j * np.linspace(0.1, 3.0, poles))).real if poles else np.ones(1)
    E = RNG.standard_normal((rows, 300))
    found = filtered(b, a, E, (100, 3, 197))
    wanted = np.concatenate([lfilter(b, a, part, axis=1) for part in np.split(E, [100, 103], axis=1)], axis=1)
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.abs(wanted).max())


def test_what_cannot_be_filtered_is_refused() -> None:
    E = np.ones((2, 10))
    with pytest.raises(ValueError, match="add up to the 10 columns"):
        filtered(np.ones(1), np.ones(1), E, (4, 5))
    with pytest.raises(ValueError, match="add up to the 10 columns"):
        filtered(np.ones(1), np.ones(1), E, (2**64 - 1, 11))
    with pytest.raises(ValueError, match=r"a\[0\] = 1"):
        filtered(np.ones(1), np.array([2.0, 1.0]), E, (10,))
    with pytest.raises(ValueError, match="at most 16 more"):
        filtered(np.ones(1), np.ones(18), E, (10,))


@pytest.mark.parametrize("size", [1, 2, 5, 17])
@pytest.mark.parametrize("filters", [1, 4, 9])
def test_powers_are_those_of_the_filtered_row(size: int, filters: int) -> None:
    lengths, row, weight = (100, 3, 197), RNG.standard_normal(300), RNG.integers(0, 2, 300).astype(float)
    poles = [np.poly(0.1 * k * np.exp(1j * np.linspace(0.1, 3.0, size - 1))).real for k in range(filters)]
    a = np.array([np.atleast_1d(p) for p in poles])
    b = RNG.standard_normal((filters, size))
    wanted = [float(np.sum((weight * filtered(*pair, row[None, :], lengths)[0]) ** 2)) for pair in zip(b, a, strict=True)]
    np.testing.assert_allclose(filtered_powers(b, a, row, weight, lengths), wanted, rtol=1e-9)


def test_powers_of_what_does_not_fit_are_refused() -> None:
    row = np.ones(10)
    with pytest.raises(ValueError, match="add up to the 10 columns"):
        filtered_powers(np.ones((2, 1)), np.ones((2, 1)), row, row, (4, 5))
    with pytest.raises(ValueError, match="rows of as many numbers"):
        filtered_powers(np.ones((2, 3)), np.ones((2, 1)), row, row, (10,))
    with pytest.raises(ValueError, match="at most 17"):
        filtered_powers(np.ones((1, 18)), np.ones((1, 18)), row, row, (10,))
    with pytest.raises(ValueError, match="begins with 1"):
        filtered_powers(np.ones((1, 1)), np.zeros((1, 1)), row, row, (10,))
    with pytest.raises(ValueError, match="one number for each sample"):
        filtered_powers(np.ones((1, 1)), np.ones((1, 1)), row, np.ones(9), (10,))


@pytest.mark.parametrize("n", [1, 3, 8, 501])
def test_lagged_products(n: int) -> None:
    e = RNG.standard_normal(n)
    wanted = [float(np.sum(e[k:] * e[: max(n - k, 0)])) if k < n else 0.0 for k in range(7)]
    np.testing.assert_allclose(autocorrelation(e, 6), wanted, rtol=1e-12, atol=1e-13 * n)
    np.testing.assert_allclose(autocorrelation(e, 50)[:7], wanted, rtol=1e-9, atol=1e-13 * n)  # by transform


def test_an_autoregression_is_the_least_squares_of_each_sample_on_those_before() -> None:
    parts = [lfilter([1.0], [1.0, -1.6, 0.7], RNG.standard_normal(n)) for n in (400, 90)]
    phi = autoregression(parts)
    order = len(phi)
    assert order == 2
    rows = [np.lib.stride_tricks.sliding_window_view(e[:-1], order)[:, ::-1] for e in parts]
    wanted = np.linalg.lstsq(np.vstack(rows), np.concatenate([e[order:] for e in parts]), rcond=None)[0]
    np.testing.assert_allclose(phi, wanted, rtol=1e-9)


def test_covariances_side_by_side_are_those_of_each() -> None:
    from scipy.linalg import solve_discrete_are

    A = np.array([[[0.9, 0.1], [0.0, phi]] for phi in (0.5, 0.99)], dtype=np.complex128)
    H, Q = np.array([1.0, 0.0], dtype=np.complex128), np.array([np.diag([0.0, q]) for q in (1e-3, 2.0)], dtype=np.complex128)
    both = steady_covariances(A, H, Q)
    for a, q, p in zip(A, Q, both, strict=True):
        np.testing.assert_array_equal(p, steady_covariance(a, H, q))
        np.testing.assert_allclose(p, solve_discrete_are(a.T.real, H.real[:, None], q.real, np.eye(1)), rtol=1e-9)
    unseen = np.diag([0.9, 1.0]).astype(np.complex128)[None]
    alone = steady_covariances(np.concatenate([A[:1], unseen]), H, np.stack([Q[0], np.eye(2, dtype=np.complex128)]))
    np.testing.assert_allclose(alone[0], both[0], rtol=1e-9)
    assert not np.isfinite(alone[1]).any()
    with pytest.raises(ModelError, match="does not show in this model's velocity"):
        steady_covariance(unseen[0], H, np.eye(2, dtype=np.complex128))


def test_a_singular_step_is_nan_beside_the_others() -> None:
    M = np.stack([np.eye(2), np.zeros((2, 2)), 2.0 * np.eye(2)]).astype(np.complex128)
    found = _inverses(M)
    np.testing.assert_array_equal(found[[0, 2]], np.stack([np.eye(2), 0.5 * np.eye(2)]))
    assert np.isnan(found[1]).all()
    # An unstable pole under a zero: no filter of its shaft's noise, and no error.
    assert None in ShaftNoise(ga.Model(1e3, [50.0, -10.0], [50.0]), 1e-3, None).filters([(0, 0), (4, 7)])


@pytest.mark.parametrize("m", [1, 4])
def test_a_recursion_of_complex_states(m: int) -> None:
    A = 0.6 / m * (RNG.standard_normal((m, m)) + 1j * RNG.standard_normal((m, m)))
    drive, start = RNG.standard_normal((50, m)), RNG.standard_normal(m) + 1j
    states = [start]
    for f in drive:
        states.append(A @ states[-1] + f)
    np.testing.assert_allclose(recursion(A, drive, start), states[:-1], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(recursion(A, drive, start, newest=True), states[1:], rtol=1e-12, atol=1e-14)
    # Whatever the order in memory; without a start from rest.
    np.testing.assert_array_equal(recursion(A.T, drive), recursion(A.T.copy(), drive, np.zeros(m)))
    with pytest.raises(ValueError, match="A, drive, start"):
        recursion(A, drive, np.zeros(m + 1))


def test_a_clamped_sum() -> None:
    np.testing.assert_array_equal(clamped_sum(np.array([1.0, 1.0, 1.0, -1.0, -5.0, 0.5]), 2.0), [1.0, 2.0, 2.0, 1.0, -2.0, -1.5])
    np.testing.assert_array_equal(clamped_sum(np.array([1.0, -1.0]), 2.0, 1.5), [2.0, 1.0])


def test_rows_that_overflow_are_whitened_without_a_warning_and_the_callers_rows_stay() -> None:
    weight = np.ones(100)
    weight[40:50] = 0.0
    data = DataSet.of([ga.Record(1e-3, velocity=np.zeros(100), torque=np.zeros(100))], None)
    for w in (np.ones(100), weight):
        objective = Objective(data, w)
        E = RNG.standard_normal((2, 100))
        E[0, 60] = E[1, 2] = np.inf  # the second one does not count
        before = E.copy()
        for noise in (WHITE, NoiseFilter(np.array([1.0, -0.5]), np.ones(1), 1)):
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                V = objective.whitened(E, noise)
            assert not np.isfinite(V[0]).all() and np.isfinite(V[1]).all()
            np.testing.assert_array_equal(V[1, objective.counted == 0.0], 0.0)
            np.testing.assert_array_equal(E, before)


def test_a_damped_step_that_has_no_solution_is_none() -> None:
    steps = damped_steps(np.ones((2, 2)), np.array([1.0, 2.0]), np.array([[0.0, 0.0], [1.0, 1.0]]))
    np.testing.assert_array_equal(steps[0], 0.0)
    np.testing.assert_allclose((np.ones((2, 2)) + np.eye(2)) @ steps[1], [1.0, 2.0])


@pytest.mark.parametrize(("order", "cutoff"), [(1, 0.3), (4, 0.01), (4, 0.2), (10, 0.05)])
@pytest.mark.parametrize("extension", [0, 1, 60, 299])
def test_a_zero_phase_filter_is_that_of_scipy(order: int, cutoff: float, extension: int) -> None:
    rows = np.random.default_rng(3).standard_normal((9, 300)).cumsum(axis=1) + 1e3
    sections = butter(order, cutoff, output="sos")
    wanted = sosfiltfilt(sections, rows, axis=1, padlen=extension)
    np.testing.assert_allclose(zero_phase(sections, rows, extension), wanted, rtol=1e-9)
    np.testing.assert_array_equal(zero_phase(sections, rows[4:5], extension)[0], zero_phase(sections, rows, extension)[4])
