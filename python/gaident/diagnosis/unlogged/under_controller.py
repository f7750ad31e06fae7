"""Fits of a model that is driven by what a controller with unknown numbers makes of command and velocity.

    w_model = G(x) u(z),   u(z): the torque that the controller makes of command and measured velocity

x, numbers of the model, and z, numbers of the controller, are fitted together (`gaident.estimation.found_numbers`).
No torque showed z.

What comes out is compared with a selected model. One that is fitted before whitening and stays far behind it is not followed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.found import NUMBER_STEP, FoundNumbers
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.found_numbers import covariance_of_numbers, numbers_in, refined, slopes
from gaident.estimation.noise_model import WHITE, NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.projection import WORST, project_out
from gaident.policy.table import POLICY

__all__ = ["UnderController", "out_of_reach"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class UnderController:
    """Models of records without a torque under the controllers of z (k,), low <= z <= high."""

    data: DataSet
    controller: Callable[[Vector], Controller]
    low: Vector
    high: Vector

    def over(self, z: Vector) -> DataSet:
        """The records as the controller of z drives them."""
        return replace(self.data.under(self.controller(z)), found=self.found(z))

    def of(self, hypothesis: Hypothesis, z: Vector) -> Hypothesis:
        """A model driven by what the controller of z makes."""
        return hypothesis.over(self.over(z))

    def fitted(self, space: ModelSpace, objective: Objective, fit: Fit, z: Vector, beyond: float) -> tuple[Vector, Fit] | None:
        """(z, model) of the least cost, under a noise model of its own; None where it diverges or its score stays beyond.

        objective: that of the space, with a memory of its own: every controller tried makes a data set.
        """

        def too_far(found: Fit) -> bool:
            return space.score(ls.scored(objective, found)) > beyond

        found = refined(objective, fit, self.over(z), WHITE, too_far)
        if too_far(found):
            return None
        if space.whitens:
            found = refined(objective, found, noise=objective.own_noise(found), too_far=too_far)
        found = ls.reestimated(objective, found)
        return None if found.cost >= WORST else (numbers_in(found.hypothesis).at, found)

    def slopes(
        self, objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, z: Vector
    ) -> tuple[Vector, Matrix]:
        """(whitened errors, their slopes with z beside what the model's own numbers can explain)."""
        v, J, E = slopes(objective, self.of(hypothesis, z), x, noise)
        return v, project_out(J, E) / NUMBER_STEP

    def found(self, z: Vector) -> FoundNumbers:
        """The numbers of z, which the errors of the model show."""
        return FoundNumbers(self.controller, z, None, self.low, self.high)

    def deviations(self, objective: Objective, fit: Fit, z: Vector) -> Vector:
        """Standard deviations of z (k,) at a fit."""
        there = replace(fit, hypothesis=self.of(fit.hypothesis, z))
        return np.asarray(np.sqrt(np.maximum(np.diag(covariance_of_numbers(objective, there)), 0.0)))


def out_of_reach(space: ModelSpace, selected: Fit) -> float:
    """Score from which on a model that is fitted before whitening is not followed beside a selected one.

    The selected model itself, fitted before whitening too, scores worse than it does, and a beam follows what is behind by less
    than its reach.
    """
    plain = ls.scored(space.objective, ls.fit(space.objective, selected.hypothesis, selected.x, WHITE, POLICY.usual))
    return max(space.score(plain), space.score(selected)) + POLICY.beam_reach * space.penalty
