"""What a sensor at the load shows, and what models leave of it.

    y = s (theta + (theta_L - theta_M)) + o + noise          of a position; of a velocity w in the place of theta

theta: angle of the motor as measured; theta_L: of the simulated load; theta_M: of the simulated motor as it would be measured.
For one mass theta_L is theta_M.
So only how the load follows counts, and not what turns motor and load alike.
Where the motor's angle is the integral of its measured velocity, theta_M is the same sum over the simulated velocity.
Scale s and offset o, one of each record, are least squares of each model (separable least squares; Golub and Pereyra, SIAM
J. Numer. Anal. 10(2):413-432, 1973).

The noise is white, that of the sensor, with s times the motor's beside it.
Where the motor's angle is the integral of its velocity, that part is a random walk, and the errors are whitened by

    (1 - q^-1)/(1 - c q^-1),   c = 1 + r/2 - sqrt(r + r^2/4),   r = (s s_w dt)^2/s_L^2

s_w, s_L: standard deviations of the motor's velocity and of the sensor (random walk and white noise; J. F. Muth, J. Am. Stat.
Assoc. 55:299-306, 1960).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.dataset import DataSet
from gaident.estimation.hypothesis import Hypothesis
from gaident.estimation.noise_model import WHITE, NoiseFilter
from gaident.estimation.projection import orthonormal_rows
from gaident.models.starts import noise_std

__all__ = ["LoadReading", "LoadSensor"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

CHANNELS = ("load_position", "load_velocity")
"""Those of a load; the first that all records have counts."""
ROUNDING = 1e-6  # no decision: rounding: the least noise beside a random walk, in its steps


class LoadReading(NamedTuple):
    """How the sensor reads the load under one model: scale and offsets with deviations, and the errors that are left (n,)."""

    scale: float
    scale_std: float
    offsets: Vector
    offset_stds: Vector
    errors: Vector


@dataclass(frozen=True, eq=False)
class LoadSensor:
    """channel: of the records; measured: its values; motor: the same quantity of the motor as it was measured; used: 1 or 0."""

    channel: str
    measured: Vector
    motor: Vector
    lengths: tuple[int, ...]
    used: Vector
    whitens: NoiseFilter
    noise: float  # standard deviation of the whitened noise, in the sensor's own unit

    @classmethod
    def of(cls, data: DataSet, channel: str, signals: Sequence[Vector], used: Vector) -> LoadSensor:
        """Of one channel of all records. used: (n,), 0 for samples that are left out."""
        motor = data.angle if channel == CHANNELS[0] else data.velocity
        plain = cls(channel, np.concatenate(signals), motor, data.lengths, used, WHITE, 0.0)
        return plain._with_noise(data, float(np.mean([noise_std(s) for s in signals])))

    def _with_noise(self, data: DataSet, own: float) -> LoadSensor:
        """own: standard deviation of the sensor's noise, as its third differences show it."""
        z, y = self._free(np.vstack([self.motor, self.measured]))
        scale = abs(float(z @ y) / max(float(z @ z), 1e-300))
        if self.channel != CHANNELS[0]:
            return replace(self, noise=float(np.hypot(own, scale * data.noise)))
        if data.angle_logged:
            at_motor = float(np.mean([noise_std(part) for part in np.split(data.angle, np.cumsum(data.lengths)[:-1])]))
            return replace(self, noise=float(np.hypot(own, scale * at_motor)))
        walk = scale * data.noise * data.dt
        if not walk > 0.0:
            return replace(self, noise=own)
        own = max(own, ROUNDING * walk)
        r = (walk / own) ** 2
        c = 1.0 + 0.5 * r - float(np.sqrt(r + 0.25 * r**2))  # no decision: a formula
        return replace(self, whitens=NoiseFilter(np.array([1.0, -1.0]), np.array([1.0, -c]), 1), noise=own / np.sqrt(c))

    @property
    def count(self) -> float:
        """Number of samples that count."""
        return float(self.used.sum())

    def follows(self, hypothesis: Hypothesis, X: Matrix) -> Matrix:
        """Rows of the load's motion less the motor's as it would be measured; 0 for a model that has no load."""
        made, predictor = hypothesis.parameters, hypothesis.predictor
        if made.masses == 1 or any(t.resonates for t in made.terms):
            return np.zeros((len(X), len(self.measured)))

        def rows(shown: str) -> Matrix:
            return replace(predictor, shown=shown).velocities(made, X)  # type: ignore[type-var]

        if self.channel != CHANNELS[0]:
            return rows("load velocity") - rows("velocity")
        if predictor.data.angle_logged:
            return rows("lag")
        return rows("angle") - self._integrated(rows("velocity"), predictor.data.dt)

    def _integrated(self, W: Matrix, dt: float) -> Matrix:
        """The angles of rows of velocities, each record from 0, as `DataSet` integrates a measured one."""
        angles = np.zeros_like(W)
        at = np.cumsum((0, *self.lengths))
        for first, end in pairwise(at):
            part = W[:, first:end]
            angles[:, first + 1 : end] = np.cumsum(0.5 * dt * (part[:, 1:] + part[:, :-1]), axis=1)
        return angles

    def errors(self, hypothesis: Hypothesis, X: Matrix, told: Matrix | None = None) -> Matrix:
        """Rows of whitened errors in the sensor's unit, with the best scale and offsets of each; 0 where samples do not count.

        told: rows of what else is known of them, which is taken away.
        """
        Z, Y = self._free(self.motor + self.follows(hypothesis, X)), self._free(self.measured[None, :])
        if told is not None:
            Y = Y - self._beside_constants(told * self.used)
        with np.errstate(invalid="ignore", over="ignore"):
            power = np.sum(Z**2, axis=1)
            scales = np.divide(np.sum(Z * Y, axis=1), power, out=np.zeros(len(Z)), where=power > 0.0)
            return np.asarray(Y - scales[:, None] * Z)

    def reading(self, hypothesis: Hypothesis, x: Vector) -> LoadReading:
        """How it reads the load of one model."""
        z = self.motor + self.follows(hypothesis, x[None, :])[0]
        A, y = np.vstack([self._filtered(z[None, :]), self._constants]), self._filtered(self.measured[None, :])[0]
        inverse = np.linalg.pinv(A @ A.T)
        values = inverse @ (A @ y)
        left = y - values @ A
        stds = np.sqrt(np.maximum(np.diag(inverse), 0.0) * float(left @ left) / max(self.count - len(values), 1.0))
        return LoadReading(float(values[0]), float(stds[0]), values[1:], stds[1:], left)

    def _filtered(self, rows: Matrix) -> Matrix:
        return np.asarray(self.whitens.of(rows, self.lengths) * self.used)

    @cached_property
    def _constants(self) -> Matrix:
        """One row for each record: what a constant is behind the filter."""
        at, rows = np.cumsum((0, *self.lengths)), np.zeros((len(self.lengths), len(self.measured)))
        for i, row in enumerate(rows):
            row[at[i] : at[i + 1]] = 1.0
        return self._filtered(rows)

    @cached_property
    def _basis(self) -> Matrix:
        return orthonormal_rows(self._constants)

    def of_rates(self, rows: Matrix, dt: float) -> Matrix:
        """Rows of the load's velocity less the motor's as this sensor shows them, with scale 1, behind its filter."""
        return self._free(rows if self.channel != CHANNELS[0] else self._integrated(rows, dt))

    def _free(self, rows: Matrix) -> Matrix:
        """Rows behind the filter, without what constants of the records explain."""
        return self._beside_constants(self._filtered(rows))

    def _beside_constants(self, rows: Matrix) -> Matrix:
        return np.asarray(rows - (rows @ self._basis.T) @ self._basis)
