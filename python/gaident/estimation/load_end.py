"""The load's end of two masses, as the linear part of a model has it: what its torques do to the motor, and its angle.

With x = theta_M - theta_L, the motor fixed and a torque T_L at the load, the shaft drives the motor with T_M; and with the motor
moved by w_M the load follows with w_L. Both are one transfer function:

    T_M/T_L = w_L/w_M = F(s) = (DG/JL s + f0)/(s^2 + f1 s + f0),  f1 = (DL + DG)/JL, f0 = KG/JL

So T_L moves the motor as the torque F T_L at the motor does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import filtered
from gaident.estimation.dataset import DataSet
from gaident.estimation.parameterisation import Parameterisation
from gaident.models.two_mass import mechanics_with_shaft_damping

__all__ = ["LoadEnd"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class LoadEnd:
    """F(s) at the sample time of the data, exact for signals that go evenly from sample to sample."""

    numerator: Vector
    denominator: Vector
    lengths: tuple[int, ...]  # samples of each record
    inertia: float  # of the load [kg m^2]; nan where the model is no such mechanism

    @classmethod
    def of(cls, parameters: Parameterisation, x: Vector, data: DataSet) -> LoadEnd:
        """Of the linear part of the model x, two masses that swing; a damping is taken for a positive one."""
        from scipy.signal import cont2discrete

        K, a, e1, e0, f1, f0 = parameters.base_values(x[None, :])[0]
        f1 = abs(f1)
        mechanics = mechanics_with_shaft_damping(np.array([K, a + e1, e0 + a * e1, a * e0, f1, f0]))
        damping = 0.0 if mechanics is None else mechanics[5] / mechanics[2]
        b, denominator, _ = cont2discrete(([damping, f0], [1.0, f1, f0]), parameters.scales.dt, method="foh")
        inertia = np.nan if mechanics is None else mechanics[2]
        return cls(np.ravel(b), np.asarray(denominator), tuple(data.lengths), float(inertia))

    def carried(self, torques: Matrix) -> Matrix:
        """Rows of torque at the load as torques at the motor, the shaft at rest before each record."""
        return filtered(self.numerator, self.denominator, torques, self.lengths)

    def angle(self, motor: Vector) -> Vector:
        """The load's angle for the motor's, both in rad; it starts where the motor's does and at its velocity."""
        evenly = []
        for part in np.split(motor, np.cumsum(self.lengths)[:-1]):
            evenly.append(part[0] + (part[1] - part[0]) * np.arange(len(part)))
        even = np.concatenate(evenly)
        return np.asarray(even + self.carried((motor - even)[None, :])[0])
