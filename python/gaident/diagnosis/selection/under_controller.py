"""Fits of a model that is driven by what a controller with unknown numbers makes of command and velocity.

    w_model = G(x) u(z),   u(z): the torque that the controller makes of command and measured velocity

x, numbers of the model, and z, numbers of the controller, are fitted in turn: x by least squares for one z, z by a step of Gauss
and Newton from which what x can explain is projected out (variable projection, Golub and Pereyra 1973).

What comes out is held against a selected model. One that is fitted before whitening and stays far behind it is not followed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.found import STEP, FoundNumbers
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE, NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.projection import WORST, project_out
from gaident.policy.table import POLICY

__all__ = ["STEP", "UnderController", "out_of_reach"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

STEPS = 12  # no decision: work, of Gauss and Newton


@dataclass(frozen=True, eq=False)
class UnderController:
    """Models of records without a torque under the controllers of z (k,), low <= z <= high."""

    data: DataSet
    controller: Callable[[Vector], Controller]
    low: Vector
    high: Vector

    def of(self, hypothesis: Hypothesis, z: Vector) -> Hypothesis:
        """A model driven by what the controller of z makes."""
        data = self.data.under(self.controller(z))
        return hypothesis.over(data)

    def fitted(self, space: ModelSpace, objective: Objective, fit: Fit, z: Vector, beyond: float) -> tuple[Vector, Fit] | None:
        """(z, model) of the least cost, under a noise model of its own; None where it diverges or its score stays beyond.

        objective: that of the space, with a memory of its own: every controller tried makes a data set.
        """

        def too_far(found: Fit) -> bool:
            return space.score(ls.scored(objective, found)) > beyond

        z, found = self.closest(objective, fit, WHITE, z, too_far)
        if too_far(found):
            return None
        if space.whitens:
            z, found = self.closest(objective, found, objective.own_noise(found), z, too_far)
        found = ls.reestimated(objective, found)
        return None if found.cost >= WORST else (z, found)

    def closest(
        self, objective: Objective, fit: Fit, noise: NoiseFilter, z: Vector, too_far: Callable[[Fit], bool]
    ) -> tuple[Vector, Fit]:
        """(z, model) of the least cost under one noise filter, or on the way there, where it stays too far behind."""
        found = ls.fit(objective, self.of(fit.hypothesis, z), fit.x, noise, POLICY.usual)
        for _ in range(STEPS):
            v, C = self.slopes(objective, found.hypothesis, found.x, noise, z)
            step = -np.linalg.lstsq(C.T, v, rcond=1e-9)[0]
            for part in (1.0, 0.3, 0.1):  # no decision: of a step
                to = np.clip(z + part * step, self.low, self.high)
                trial = ls.fit(objective, self.of(found.hypothesis, to), found.x, noise, POLICY.usual)
                if trial.cost < found.cost:
                    break
            else:
                break
            fall, z, found = found.cost - trial.cost, to, trial
            if ls.negligible(objective, fall, found.cost) or (fall < POLICY.slow_fall * found.cost and too_far(found)):
                break
        return z, found

    def slopes(
        self, objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, z: Vector
    ) -> tuple[Vector, Matrix]:
        """(whitened errors, their slopes with z beside what the model's own numbers can explain)."""
        v, J = objective.linearised(self.of(hypothesis, z), x, noise)
        rows = []
        for i in range(len(z)):
            to = z.copy()
            to[i] += STEP if z[i] < self.high[i] - STEP else -STEP
            E = objective.errors(self.of(hypothesis, to), x[None, :])
            rows.append((objective.whitened(E, noise)[0] - v) / (to[i] - z[i]))
        return v, project_out(J, np.array(rows))

    def found(self, z: Vector) -> FoundNumbers:
        """The numbers of z, which the errors of the model show."""
        return FoundNumbers(self.controller, z, None, self.low, self.high)

    def deviations(self, objective: Objective, fit: Fit, z: Vector) -> Vector:
        """Standard deviations of z (k,) at a fit."""
        v, C = self.slopes(objective, fit.hypothesis, fit.x, fit.noise, z)
        variance = float(v @ v) / objective.information
        spread = np.linalg.pinv(C @ C.T * objective.information / max(objective.count, 1.0)) * variance
        return np.sqrt(np.maximum(np.diag(spread), 0.0))


def out_of_reach(space: ModelSpace, selected: Fit) -> float:
    """Score from which on a model that is fitted before whitening is not followed beside a selected one.

    The selected model itself, fitted before whitening too, scores worse than it does, and a beam follows what is behind by less
    than its reach.
    """
    plain = ls.scored(space.objective, ls.fit(space.objective, selected.hypothesis, selected.x, WHITE, POLICY.usual))
    return max(space.score(plain), space.score(selected)) + POLICY.beam_reach * space.penalty
