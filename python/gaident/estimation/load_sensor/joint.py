"""The errors at the motor and at a sensor of the load, minimised together.

    V = V_M + q V_L,   q = (V_M/N_M)/(V_L/N_L) of the model from which a search begins, V_L/N_L the noise's where that is larger

    BIC = I_M ln(V_M/N_M) + I_L ln(V_L/N_L) + k ln I_M

Each sensor has a noise of its own, which the criterion does not mix; the weight q only says what a fit minimises.
I_L: independent samples among the errors at the load (`effective_samples`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.criterion import effective_samples
from gaident.estimation.least_squares import scored
from gaident.estimation.load_sensor.signals import LoadSensor
from gaident.estimation.noise_model import NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, NoiseFamily, Objective
from gaident.estimation.projection import WORST, slopes, sums_of_squares

__all__ = ["JointObjective"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class JointObjective(Objective):
    """Errors over one data set and over the signal of a sensor at its load.

    Raw errors, noise filter and what follows from them are those of the motor; costs, slopes and criterion are those of both.
    """

    alone: Objective = field(kw_only=True)  # that of the motor
    sensor: LoadSensor = field(kw_only=True)
    share: float = field(kw_only=True)  # q
    samples: float = field(kw_only=True)  # I_L

    @classmethod
    def of(cls, alone: Objective, sensor: LoadSensor, fit: Fit) -> JointObjective:
        """Beside an objective, weighed by what a fit leaves at motor and load."""
        left = sensor.errors(fit.hypothesis, fit.x[None, :])[0]
        at_load = max(float(left @ left) / sensor.count, sensor.noise**2, 1e-300)
        share, samples = fit.cost / alone.count / at_load, min(effective_samples(left), sensor.count)
        return cls._beside(alone, sensor, share, samples)

    @classmethod
    def _beside(cls, alone: Objective, sensor: LoadSensor, share: float, samples: float) -> JointObjective:
        given = alone.data, alone.weight, alone.family, alone.measured, alone.counter
        return cls(*given, alone=alone, sensor=sensor, share=share, samples=samples)

    def of_the_motor(self, fit: Fit) -> tuple[Objective, Fit]:
        """The objective of the motor alone, and the fit there."""
        return self.alone, scored(self.alone, fit)

    def under_beside(self, family: NoiseFamily, fit: Fit) -> JointObjective:
        """The same under another noise family."""
        alone = self.alone.under(family)
        return self.of(alone, self.sensor, scored(alone, fit))

    def weighted(self, weight: Vector) -> JointObjective:
        """The same with other samples left out."""
        sensor = replace(self.sensor, used=self.sensor.used * (weight > 0.0))
        return self._beside(self.alone.weighted(weight), sensor, self.share, self.samples)

    @property
    def count(self) -> float:
        """Number of samples that count, of both sensors."""
        return self.alone.count + self.sensor.count

    def by_record(self, rows: Matrix) -> list[Matrix]:
        """Rows over v, motor and load summed at each sample, as (samples, rows) of each record.

        What noise of the motor's sensor makes of both is in one sum, so that a covariance of it contains their correlation.
        """
        at_motor, at_load = np.hsplit(rows, 2)
        return super().by_record(at_motor + at_load)

    def noise_of(self, error: Vector, closed: bool) -> NoiseFilter:
        """The noise filter of one row of raw errors of the motor."""
        return self.alone.noise_of(error, closed)

    def at_load(self, fit: Fit) -> float:
        """Mean square of the whitened errors at the load, in the sensor's unit."""
        key = "at load", fit.hypothesis, fit.x.tobytes()
        return self.once(key, lambda: float(self._at_load(fit.hypothesis, fit.x[None, :])[0])) / self.sensor.count

    def _at_load(self, hypothesis: Hypothesis, X: Matrix) -> Vector:
        return sums_of_squares(self.sensor.errors(hypothesis, X))

    def cost_under(self, fit: Fit, noise: NoiseFilter) -> float:
        """V of a fit's x under another filter at the motor."""
        return super().cost_under(fit, noise) + self.share * self.at_load(fit) * self.sensor.count

    def costs_and_errors(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter) -> tuple[Vector, Matrix]:
        """(V of each row, WORST where a model diverges; rows of raw errors at the motor)."""
        at_motor, errors = super().costs_and_errors(hypothesis, X, noise)
        both = at_motor + self.share * self._at_load(hypothesis, X)
        return np.minimum(np.where(np.isnan(both), WORST, both), WORST), errors

    def whitened_at(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter) -> Vector:
        """v at x, first that of the motor, then that of the load."""
        at_load = np.sqrt(self.share) * self.sensor.errors(hypothesis, x[None, :])[0]
        return np.append(super().whitened_at(hypothesis, x, noise), at_load)

    def linearised(
        self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, error: Vector | None = None
    ) -> tuple[Vector, Matrix]:
        """(v, J) at x, first those of the motor, then those of the load; v'v is the cost."""
        v, J = super().linearised(hypothesis, x, noise, error)
        X, h = self._neighbours(hypothesis, x)
        E = np.sqrt(self.share) * self.sensor.errors(hypothesis, X)
        return np.append(v, E[0]), np.hstack([J, slopes(E, h)])

    def fitted(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, cost: float, converged: bool = False) -> Fit:
        """A fit of this cost."""
        fit = Fit(hypothesis, x, noise, cost, np.inf, converged)
        if not cost < WORST:
            return fit
        at_load = max(self.at_load(fit), 1e-300)
        at_motor = self.alone.bic(cost - self.share * at_load * self.sensor.count, noise, hypothesis.parameters.size)
        return replace(fit, bic=float(at_motor + self.samples * np.log(at_load)))
