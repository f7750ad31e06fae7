"""What numbers of the controller that were found bring into the deviations of a model, and what the model says of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.control.found import FoundNumbers, loosened
from gaident.diagnosis.mechanics import mechanics_of
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation.dataset import DataSet
from gaident.estimation.found_numbers import covariance_of_numbers, moved, of_controller, refined, worth
from gaident.estimation.least_squares import fit as fitted
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop

Vector = NDArray[np.float64]

DT, TAU = 1e-3, 3e-3
PI = ga.PI(0.05, 1.5)
J, D = 3e-4, 2e-3
STD = 0.05  # of ln tau


def filtered(z: Vector) -> ga.Cascade:
    """The PI behind a low pass of the velocity; z: the logarithm of its time constant."""
    return ga.Cascade(PI, velocity_filters=(ga.LowPass(float(np.exp(z[0]))),))


@pytest.fixture(scope="module")
def record() -> ga.Record:
    """One mass in that loop, without a torque in the log."""
    rng = np.random.default_rng(3)
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25], 90)
    noise = 0.03 * rng.standard_normal(len(levels))
    still = ga.Record(DT, command=levels - noise, velocity=np.zeros(len(levels)))
    done = ga.run(ga.OneMass(J=J, D=D).model(), still, filtered(np.log([TAU])))
    return ga.Record(DT, command=levels, velocity=done.velocity + noise)


def fit_of(record: ga.Record, found: FoundNumbers) -> tuple[Objective, Fit]:
    """One mass, fitted under the controller with the found numbers."""
    controller = found.controller
    assert controller is not None
    whole = record.with_channels(torque=controller.torque_of(record), command=None)
    data = replace(DataSet.of([whole], controller, read=[record]), found=found)
    objective = Objective(data, np.ones(len(record)))
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


def test_moves_are_deviations_in_independent_directions() -> None:
    root = np.array([[1.0, 0.0, 0.0], [0.5, 1e-6, 0.0], [0.0, 0.0, 0.0]])
    found = FoundNumbers(filtered, np.zeros(3), root @ root.T, low=np.array([-1.0, 0.0, 0.0]))
    np.testing.assert_allclose(found.moves.T @ found.moves, root @ root.T, atol=1e-12)
    further = found.joined().moved(2.0 * found.moves[0])
    np.testing.assert_allclose(np.abs(further.deviations_off)[0], 2.0, rtol=1e-6)
    assert found.moved(np.array([-5.0, -5.0, 0.0])).at.tolist() == [-1.0, 0.0, 0.0]
    np.testing.assert_allclose(loosened(np.array([[4.0, 2.0], [2.0, 1.0]])), [[4.0, 1.0], [1.0, 1.0]])


def test_a_controller_that_refuses_its_numbers_is_none() -> None:
    def no_filter(z: Vector) -> ga.Cascade:
        return ga.Cascade(PI, velocity_filters=(ga.LowPass(float(z[0])),))

    found = FoundNumbers(no_filter, np.array([1e-3]), np.array([[1.0]]))
    assert found.controller is not None and found.moved(np.array([-1.0])).controller is None
    assert found.then(lambda one: one.with_limits(2.0, None)).controller.limits[0] == 2.0  # type: ignore[union-attr]
