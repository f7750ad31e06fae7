"""Fits of a model that is driven by what a controller with unknown numbers makes of command and velocity.

    w_model = G(x) u(z),   u(z): the torque that the controller makes of command and measured velocity

x, numbers of the model, and z, numbers of the controller, are fitted in turn: x by least squares for one z, z by a step of Gauss
and Newton from which what x can explain is projected out (variable projection, Golub and Pereyra 1973).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.projection import project_out
from gaident.policy.table import POLICY

__all__ = ["STEP", "UnderController"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

STEP = 1e-3  # no decision: of a number of the controller, for a difference
STEPS = 6  # no decision: work, of Gauss and Newton
SETTLED = 1e-4  # no decision: of a number of the controller, a step that ends them


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
        return hypothesis.driven_by(replace(hypothesis.predictor, data=data))  # type: ignore[type-var]

    def closest(self, objective: Objective, fit: Fit, noise: NoiseFilter, z: Vector) -> tuple[Vector, Fit]:
        """(z, model) of the least cost under one noise filter."""
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
            moved, z, found = float(np.abs(to - z).max()), to, trial
            if moved < SETTLED:
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

    def deviations(self, objective: Objective, fit: Fit, z: Vector) -> Vector:
        """Standard deviations of z (k,) at a fit."""
        v, C = self.slopes(objective, fit.hypothesis, fit.x, fit.noise, z)
        variance = float(v @ v) / objective.information
        spread = np.linalg.pinv(C @ C.T * objective.information / max(objective.count, 1.0)) * variance
        return np.sqrt(np.maximum(np.diag(spread), 0.0))
