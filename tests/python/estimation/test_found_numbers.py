"""What numbers of the controller that were found bring into the deviations of a model, and what the model says of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.control.found import FoundNumbers, loosened
from gaident.diagnosis.mechanics import mechanics_of
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import found_numbers
from gaident.estimation.dataset import DataSet
from gaident.estimation.found_numbers import covariance_of_numbers, moved, numbers_in, of_controller, refined, slopes, worth
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.uncertainty import covariance_of
from gaident.policy.table import POLICY
from one_mass import DT, PI, TAU, D, J, data_of, filtered, loop_record

Vector = NDArray[np.float64]

STD = 0.05  # of ln tau


@pytest.fixture(scope="module")
def record() -> ga.Record:
    """One mass in the loop with the filter, without a torque in the log."""
    return loop_record()


def fit_of(record: ga.Record, found: FoundNumbers) -> tuple[Objective, Fit]:
    """One mass, fitted under the controller with the found numbers."""
    return fit_over(data_of(record, found))


def fit_over(data: DataSet) -> tuple[Objective, Fit]:
    """One mass, fitted over data of one record."""
    objective = Objective(data, np.ones(len(data.velocity)))
    model = ga.OneMass(J=J, D=D).model()
    parameters = Parameterisation.of(model, scales_of(data), (False,))
    start = parameters.start(model)
    return objective, fitted(objective, Hypothesis(parameters, OpenLoop(data)), start, WHITE, 60)


def test_the_part_of_the_controller_is_how_far_its_numbers_move_the_optimum(record: ga.Record) -> None:
    z = np.log([TAU])
    objective, fit = fit_of(record, FoundNumbers(filtered, z, np.array([[STD**2]])))
    part = of_controller(objective, fit)
    there = [fit_of(record, FoundNumbers(filtered, z + by))[1].x - fit.x for by in (STD, -STD)]
    np.testing.assert_allclose(np.sqrt(np.diag(part)), 0.5 * np.abs(there[0] - there[1]), rtol=0.1)
    without = fit_of(record, FoundNumbers(filtered, z, np.zeros((1, 1))))
    inertia = [mechanics_of(*one)["inertia"].std for one in ((objective, fit), without)]
    assert inertia[0] > 10.0 * inertia[1], "beside it the noise counts for nothing"


@pytest.mark.parametrize("off", [-2.0, 1.0])
def test_the_model_moves_numbers_that_the_torque_showed_less_closely(record: ga.Record, off: float) -> None:
    z = np.log([TAU])
    objective, fit = fit_of(record, FoundNumbers(filtered, z + off * STD, np.array([[STD**2]])))
    better = refined(objective, fit)
    found = better.predictor.data.found
    assert found is not None and found.shown is not None
    std = float(np.sqrt(covariance_of_numbers(objective, better)[0, 0]))
    assert abs(float(found.at[0] - z[0])) < 3.0 * std < 0.3 * STD
    assert found.deviations_off == pytest.approx([-off], abs=0.2)
    assert worth(objective, better) == pytest.approx(off**2 + np.log(objective.information), abs=1.5)
    before, after = (mechanics_of(objective, one)["inertia"] for one in (fit, better))
    assert abs(after.value - J) < 3.0 * after.std < 0.3 * before.std
    assert abs(before.value - J) < 3.0 * before.std


def test_numbers_that_no_torque_showed_are_in_the_covariance_as_parameters_are(record: ga.Record) -> None:
    """S M S' beside (J J')^-1 is the block of x of the inverse of both together."""
    objective, fit = fit_of(record, FoundNumbers(filtered, np.log([TAU])))
    best = refined(objective, fit)
    v, rows = objective.linearised(best.hypothesis, best.x, WHITE)
    data = moved(best.predictor.data, np.array([1e-3]))
    assert data is not None
    change = (objective.errors(best.hypothesis.over(data), best.x[None, :])[0] - objective.error(best)) * objective.counted
    both = np.vstack([rows, change / 1e-3])
    whole = float(v @ v) / (objective.count - 2) * np.linalg.inv(both @ both.T)
    alone = float(v @ v) / (objective.count - 2) * np.linalg.inv(rows @ rows.T)
    np.testing.assert_allclose(alone + of_controller(objective, best), whole[:2, :2], rtol=1e-3)


def test_torque_and_model_share_a_number_by_their_variances(record: ga.Record) -> None:
    """(z - z_0)' C^-1 (z - z_0) beside the errors of the model: z is the mean of both, weighed by 1/C and 1/M."""
    objective, fit = fit_of(record, FoundNumbers(filtered, np.log([TAU])))
    free = refined(objective, fit)
    by_model = float(covariance_of_numbers(objective, free)[0, 0])
    shown = numbers_in(free.hypothesis).at + 2.0 * np.sqrt(by_model)
    for by_torque in (by_model, 3.0 * by_model):
        objective, fit = fit_of(record, FoundNumbers(filtered, shown, np.array([[by_torque]])))
        both = refined(objective, fit)
        moved_by = float(numbers_in(both.hypothesis).at[0] - shown[0]) / np.sqrt(by_model)
        assert moved_by == pytest.approx(-2.0 * by_torque / (by_torque + by_model), abs=0.05)
        assert covariance_of_numbers(objective, both)[0, 0] == pytest.approx(
            by_torque * by_model / (by_torque + by_model), rel=0.1
        )


def test_a_model_that_is_too_far_behind_is_left_where_its_cost_falls_slowly(
    record: ga.Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is asked where a step brought less than `slow_fall` of the cost, and followed to the end where it is near."""
    near, far_off = (fit_of(record, FoundNumbers(filtered, np.log([TAU]) + off)) for off in (0.002, 0.05))
    asked: list[float] = []

    def too_far(trial: Fit) -> bool:
        asked.append(trial.cost)
        return True

    def simulations(objective: Objective, fit: Fit, rule: Callable[[Fit], bool] | None) -> int:
        before = objective.counter.simulations
        refined(replace(objective), fit, too_far=rule)
        return objective.counter.simulations - before

    followed = simulations(*near, None)
    assert simulations(*near, lambda trial: False) == followed
    assert simulations(*near, too_far) < followed
    assert len(asked) == 1 and asked[0] > (1.0 - POLICY.slow_fall) * near[1].cost
    ended = refined(*far_off, too_far=too_far)
    monkeypatch.setattr(found_numbers, "POLICY", replace(POLICY, usual=1))
    one_step = refined(*far_off)
    assert one_step.cost < (1.0 - POLICY.slow_fall) * far_off[1].cost
    assert asked[1:] == [ended.cost] and ended.cost < one_step.cost, "its first step brings more, and is no reason"


def changes(objective: Objective, fit: Fit, by: float) -> Vector:
    """How the errors change where the number of the controller is moved so far."""
    data = moved(fit.predictor.data, np.array([by]))
    assert data is not None
    errors = objective.errors(fit.hypothesis.over(data), fit.x[None, :])[0] - objective.error(fit)
    return np.asarray(errors * objective.counted)


def test_by_a_deviation_the_larger_change_counts_and_a_difference_goes_where_it_can(record: ga.Record) -> None:
    z, step = np.log([TAU]), 1e-3
    # A filter that is slower by one deviation changes more than one that is faster, whichever way its number counts.
    for made, at, slower in ((filtered, z, 1.0), (lambda y: filtered(-y), -z, -1.0)):
        objective, fit = fit_of(record, FoundNumbers(made, at, np.array([[1.0]])))
        more, less = (changes(objective, fit, by) for by in (slower, -slower))
        assert np.linalg.norm(more) > 1.5 * np.linalg.norm(less)
        E = slopes(objective, fit.hypothesis, fit.x, fit.noise)[2]
        np.testing.assert_allclose(np.abs(E), np.abs(more)[None, :], atol=1e-12)
    for high, sign in ((np.inf, 1.0), (z + 0.5 * step, -1.0)):
        objective, fit = fit_of(record, FoundNumbers(filtered, z, high=high))
        E = slopes(objective, fit.hypothesis, fit.x, fit.noise)[2]
        np.testing.assert_allclose(E[0], sign * changes(objective, fit, sign * step), atol=1e-12)


def test_moves_are_deviations_in_independent_directions() -> None:
    root = np.array([[1.0, 0.0, 0.0], [0.5, 1e-6, 0.0], [0.0, 0.0, 0.0]])
    found = FoundNumbers(filtered, np.zeros(3), root @ root.T, low=np.array([-1.0, 0.0, 0.0]))
    np.testing.assert_allclose(found.directions.T @ found.directions, root @ root.T, atol=1e-12)
    further = found.joined().moved(2.0 * found.directions[0])
    np.testing.assert_allclose(np.abs(further.deviations_off)[0], 2.0, rtol=1e-6)
    assert found.moved(np.array([-5.0, -5.0, 0.0])).at.tolist() == [-1.0, 0.0, 0.0]
    np.testing.assert_allclose(loosened(np.array([[4.0, 2.0], [2.0, 1.0]])), [[4.0, 1.0], [1.0, 1.0]])


def test_a_controller_that_refuses_its_numbers_is_none() -> None:
    def no_filter(z: Vector) -> ga.Cascade:
        return ga.Cascade(PI, velocity_filters=(ga.LowPass(float(z[0])),))

    found = FoundNumbers(no_filter, np.array([1e-3]), np.array([[1.0]]))
    assert found.controller is not None and found.moved(np.array([-1.0])).controller is None
    assert found.then(lambda one: one.with_limits(2.0, None)).controller.limits[0] == 2.0  # type: ignore[union-attr]


def aged(noise: float, *others: float, follows: bool = True, clocked: bool = False) -> tuple[Objective, Fit]:
    """The one mass under a torque of slow waves, whose velocity may have other ages as well [lines]; noise: on it [rad/s]."""
    n = 720
    torque = 0.05 * np.sin(2.0 * np.pi * 3.0 * DT * np.arange(n)) + 0.02 * np.sin(2.0 * np.pi * 11.0 * DT * np.arange(n))
    driven = ga.Record(DT, torque=torque, velocity=np.zeros(n))
    model = ga.OneMass(J=J, D=D).model()
    seen = ga.simulate(model, driven) + noise * np.random.default_rng(3).standard_normal(n)
    data = replace(DataSet.of([driven.with_channels(velocity=seen)], None), loop_follows=follows, clocked=clocked).aged(
        0.0, others
    )
    return fit_over(data)


def alone(fit: Fit) -> Fit:
    """The same fit where its age is the only one."""
    return replace(fit, hypothesis=fit.hypothesis.over(fit.predictor.data.aged(0.0)))


def test_an_age_that_the_model_does_not_exclude_widens_the_deviations_by_what_it_moves() -> None:
    """Beside that much noise half a line more leaves as little."""
    objective, fit = aged(1.0, 0.5)
    older = fitted(objective, fit.hypothesis.over(fit.predictor.data.aged(0.5)), fit.x, WHITE, 12)
    move = older.x - fit.x
    assert np.abs(move).max() > 1e-3
    np.testing.assert_allclose(of_controller(objective, fit), np.outer(move, move))
    wide, narrow = (covariance_of(objective, one) for one in (fit, alone(fit)))
    np.testing.assert_allclose(wide, narrow + np.outer(move, move))


def test_beside_numbers_that_are_fitted_too_the_other_age_moves_all_of_them(record: ga.Record) -> None:
    data = data_of(record, FoundNumbers(filtered, np.log([TAU])))
    objective, fit = fit_over(replace(data, loop_follows=False).aged(0.0, (0.5,)))
    best = refined(objective, fit)
    move = refined(objective, best, best.predictor.data.aged(0.5)).x - best.x
    part = of_controller(objective, best) - of_controller(objective, alone(best))
    np.testing.assert_allclose(part, np.outer(move, move))
    moved = fitted(objective, best.hypothesis.over(best.predictor.data.aged(0.5)), best.x, WHITE, 12).x - best.x
    assert np.abs(moved - move).max() > 0.1 * np.abs(move).max(), "under the numbers of the first age it would be another"


def test_an_age_that_leaves_clearly_more_is_excluded_where_the_torque_follows_from_its_controller() -> None:
    objective, fit = aged(0.003, 0.5)
    assert not of_controller(objective, fit).any()
    # A torque that does not follow may go on between the lines: a model that leaves less may only make up for it.
    objective, fit = aged(0.003, 0.5, follows=False)
    assert of_controller(objective, fit)[0, 0] > 0.0
    # But not where each line is a sample of the controller, which was given: that torque is held.
    objective, fit = aged(0.003, 0.5, follows=False, clocked=True)
    assert not of_controller(objective, fit).any()


def test_of_several_ages_the_one_that_moves_the_model_furthest_counts() -> None:
    far, near, *both = (of_controller(*aged(1.0, *others)) for others in ((0.5,), (0.25,), (0.25, 0.5), (0.5, 0.25)))
    assert far[0, 0] > 2.0 * near[0, 0] > 0.0
    for part in both:
        np.testing.assert_allclose(part, far)
