"""The errors at the motor and at a sensor of the load, minimised together.

    V = (V_M + q V_L)/2,   q = V_M/V_L of the model by which they are weighed

    BIC = I_M ln(V_M/N) + I_L ln(V_L/N) + k ln I_M

Each sensor has a noise of its own, which the criterion does not mix; the weight q only says what a fit minimises.
I_L: independent samples among the errors at the load (`effective_samples`).

The motor's sensor is in both errors, and what chance gives at the motor must not count a second time at the load.
So V_L is of what the motor's errors e do not tell of the load's, the second factor of the likelihood p(e) p(v | e),

    v(n) - sum_k g(k) e(n-k)

with g by least squares of the errors of the model from which a search begins; whatever g is, this changes no volume.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import filtered
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
    taps: Vector = field(kw_only=True)  # g

    @classmethod
    def of(cls, alone: Objective, sensor: LoadSensor, fit: Fit) -> JointObjective:
        """Beside an objective, weighed by what a fit leaves at motor and load."""
        left, own = sensor.errors(fit.hypothesis, fit.x[None, :])[0], alone.bridged(alone.error(fit)[None, :])
        late = np.vstack([filtered(tap, np.ones(1), own, alone.lengths) for tap in np.eye(alone.head + 1)]) * sensor.used
        taps = np.asarray(np.linalg.lstsq(late.T, left, rcond=None)[0])
        left = left - taps @ late
        at_load = max(float(left @ left) / sensor.count, 1e-300)
        share, samples = fit.cost / alone.count / at_load, min(effective_samples(left), sensor.count)
        return cls._beside(alone, sensor, share, samples, taps)

    @classmethod
    def _beside(cls, alone: Objective, sensor: LoadSensor, share: float, samples: float, taps: Vector) -> JointObjective:
        given = alone.data, alone.weight, alone.family, alone.measured, alone.counter
        return cls(*given, alone=alone, sensor=sensor, share=share, samples=samples, taps=taps)

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
        return self._beside(self.alone.weighted(weight), sensor, self.share, self.samples, self.taps)

    @property
    def sensors(self) -> int:
        """That of the motor and that of the load."""
        return 2

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
        """Mean square of the errors at the load, in the sensor's unit."""
        left = self.left_at_load(fit)
        return float(left @ left) / self.sensor.count

    def left_at_load(self, fit: Fit) -> Vector:
        """The errors at the load, whitened by the sensor's filter and without what the motor's tell, in the sensor's unit."""
        key = "at load", fit.hypothesis, fit.x.tobytes()
        return self.once(key, lambda: self._at_load(fit.hypothesis, fit.x[None, :], self.error(fit)[None, :])[0])

    def _at_load(self, hypothesis: Hypothesis, X: Matrix, errors: Matrix) -> Matrix:
        """Rows of errors at the load beside these raw errors of the motor."""
        self.counter.add(len(X))
        told = filtered(self.taps, np.ones(1), self.bridged(errors), self.lengths)
        return self.sensor.errors(hypothesis, X, told)

    def cost_under(self, fit: Fit, noise: NoiseFilter) -> float:
        """V of a fit's x under another filter at the motor."""
        return 0.5 * (
            super().cost_under(fit, noise) + self.share * self.at_load(fit) * self.sensor.count
        )  # no decision: a formula

    def costs_and_errors(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter) -> tuple[Vector, Matrix]:
        """(V of each row, WORST where a model diverges; rows of raw errors at the motor)."""
        at_motor, errors = super().costs_and_errors(hypothesis, X, noise)
        both = 0.5 * (at_motor + self.share * sums_of_squares(self._at_load(hypothesis, X, errors)))  # no decision: a formula
        return np.minimum(np.where(np.isnan(both), WORST, both), WORST), errors

    def whitened_at(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter) -> Vector:
        """v at x, first that of the motor, then that of the load."""
        return np.asarray(self.rows_at(hypothesis, x[None, :], noise)[0])

    def rows_at(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter) -> Matrix:
        """The same at rows of x."""
        return self._rows(hypothesis, X, noise, self.errors(hypothesis, X))

    def linearised(
        self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, error: Vector | None = None
    ) -> tuple[Vector, Matrix]:
        """(v, J) at x, first those of the motor, then those of the load; v'v is the cost."""
        X, h = self._neighbours(hypothesis, x)
        V = self._rows(hypothesis, X, noise, self._errors_around(hypothesis, X, error))
        return V[0], slopes(V, h)

    def _rows(self, hypothesis: Hypothesis, X: Matrix, noise: NoiseFilter, errors: Matrix) -> Matrix:
        at_motor = self.whitened(errors, noise, self.inertias(hypothesis, X))
        both = np.hstack([at_motor, np.sqrt(self.share) * self._at_load(hypothesis, X, errors)])
        return np.asarray(np.sqrt(0.5) * both)  # no decision: a formula

    def fitted(self, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, cost: float, converged: bool = False) -> Fit:
        """A fit of this cost."""
        fit = Fit(hypothesis, x, noise, cost, np.inf, converged)
        if not cost < WORST:
            return fit
        at_load = max(self.at_load(fit), 1e-300)
        at_motor = 2.0 * cost - self.share * at_load * self.sensor.count  # no decision: a formula
        worth = self.alone.bic(at_motor, noise, hypothesis.parameters.size) + self.samples * np.log(at_load)
        return replace(fit, bic=float(worth))
