"""The global search near a fit: its coordinates, and a valley beyond what a box around the model's own numbers contains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.estimation.global_search import _coordinates, _reach, evolved
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.term import Scales

Matrix = NDArray[np.float64]

SCALES = Scales(1e-3, 1.0, 1.0, 1.0, 1.0, 1.0, 0.02, float("nan"), float("nan"), False, 1.0)
SOFT = ga.TwoMass(JM=0.01, DM=0.01, JL=0.02, DL=0.02, KG=50.0, DG=0.05).model()
STIFF = ga.TwoMass(JM=0.012, DM=0.011, JL=0.018, DL=0.019, KG=120.0, DG=0.08).model()


def test_the_coordinates_are_those_of_the_mechanics_and_lead_back() -> None:
    parameters = Parameterisation.of(SOFT, SCALES, [False])
    x = parameters.start(STIFF)
    coordinates, back = _coordinates(parameters, x)
    y = coordinates(x)
    resonance, antiresonance = (np.abs(r[np.abs(np.imag(r)) > 0.0][0]) for r in map(np.array, (STIFF.poles, STIFF.zeros)))
    assert y[0] == pytest.approx(np.log(0.03), rel=1e-6), "the inertia of both masses"
    assert y[3] == pytest.approx(2.0 * np.log(resonance)) and y[5] == pytest.approx(2.0 * np.log(antiresonance / resonance))
    np.testing.assert_allclose(back(np.vstack([y, y])), np.vstack([x, x]), rtol=1e-12)
    assert np.all(_reach(parameters, x) > 0.0)


def test_one_mass_is_searched_in_its_own_numbers() -> None:
    parameters = Parameterisation.of(ga.OneMass(J=0.01, D=0.01).model(), SCALES, [False])
    x = parameters.start(ga.OneMass(J=0.02, D=0.02).model())
    coordinates, back = _coordinates(parameters, x)
    np.testing.assert_array_equal(back(coordinates(x)[None, :])[0], x)


@dataclass
class Rough:
    """An objective that knows two things: the inertia to 1 %, and a shaft whose cost has ripples that stop a slope."""

    truth: NDArray[np.float64]
    coordinates: object

    def costs(self, hypothesis: Hypothesis, X: Matrix, noise: object) -> Matrix:
        off = np.array([self.coordinates(x) for x in X]) - self.truth  # type: ignore[operator]
        far = (off[:, 0] / 0.01) ** 2 + np.sum((off[:, 1:] / 0.3) ** 2, axis=1)
        return np.asarray(1e-6 + far + 0.3 * np.sum(1.0 - np.cos(40.0 * off[:, 2:]), axis=1))


def test_a_shaft_of_more_than_twice_the_stiffness_is_found_whatever_the_ripples(monkeypatch: pytest.MonkeyPatch) -> None:
    from gaident.estimation import global_search

    parameters = Parameterisation.of(SOFT, SCALES, [False])
    start, truth = parameters.start(SOFT), parameters.start(STIFF)
    coordinates, _ = _coordinates(parameters, truth)
    hypothesis = Hypothesis(parameters, None)  # type: ignore[arg-type]
    objective = Rough(coordinates(truth), coordinates)
    monkeypatch.setattr(global_search, "fit", lambda objective, h, x, noise, n: Fit(h, x, WHITE, 0.0, 0.0))
    found = evolved(objective, Fit(hypothesis, start, WHITE, 0.0, 0.0), 150)  # type: ignore[arg-type]
    again = evolved(objective, Fit(hypothesis, start, WHITE, 0.0, 0.0), 150)  # type: ignore[arg-type]
    np.testing.assert_allclose(coordinates(found.x)[[0, 3, 5]], coordinates(truth)[[0, 3, 5]], atol=0.02)
    np.testing.assert_array_equal(found.x, again.x)
