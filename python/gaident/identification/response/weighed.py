"""Measured frequency responses as the core takes them, and what a model leaves of them.

    e_k = sqrt(2) scale (G_k - G(s_k; x)) / sigma_k,   sigma_k = sqrt(mean |error of G_k|^2)

so that real and imaginary part each have the variance scale^2: 1 where responses stand alone, beside records that of the whitened
velocity.
Without a stated deviation sigma is in proportion to `relative_std`, and what a model leaves says how large it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.data.frequency.response import FrequencyResponse
from gaident.identification.noise import autocorrelation, chi2_tail, ljung_box_of
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.adequacy import Adequacy

__all__ = ["Weighed", "assessed_responses", "weighed"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

NEIGHBOURS = 5  # no decision: a grid: frequencies apart at most; what a missing mass leaves shows in the nearest


@dataclass(frozen=True)
class Weighed:
    """A response with the deviation that counts, over its magnitude: `relative_std` times `size`, 1 where a deviation is stated.

    continuous: whether the loop beside it is the paper's, in which the plant is bilinear.
    turned: 1/H of its torque's path, by which the path is taken out; 1: there is none.
    """

    response: FrequencyResponse
    size: float
    scale: float
    continuous: bool
    turned: Complex | float = 1.0

    @property
    def known(self) -> bool:
        """Whether its deviations are stated."""
        return self.response.std is not None

    @property
    def value(self) -> Complex:
        """From torque to velocity, without the path."""
        made: Complex = self.response.velocity_response * self.turned
        return made

    @property
    def weight(self) -> Vector:
        """Of the complex error."""
        sigma = self.size * self.response.relative_std * np.abs(self.value)
        made: Vector = math.sqrt(2.0) * self.scale / sigma
        return made

    def core(self) -> _core.Response:
        """For the core."""
        omega, dt = self.response.omega, self.response.dt
        at = np.asarray(1j * omega, complex)
        if dt is not None:
            at = np.asarray(2j / dt * np.tan(0.5 * omega * dt) if self.continuous else np.expm1(1j * omega * dt), complex)
        hold = 0.0 if dt is None or self.continuous else dt
        noise = 2.0 * len(omega) * self.scale**2 if self.known else 0.0
        band = float(omega[0]), float(omega[-1])
        return _core.Response(at=at, value=self.value, weight=self.weight, sample_time=hold, band=band, noise=noise)

    def errors(self, model: Model) -> Complex:
        """e_k of a model, shape (n,)."""
        poles, zeros = np.array(model.poles, complex), np.array(model.zeros, complex)
        made: Complex = self.weight * (self.value - self.core().plant(model.gain, poles, zeros))
        return made

    def resized(self, model: Model) -> Weighed:
        """With the size that a model leaves, where none is stated."""
        if self.known:
            return self
        left = float(np.sqrt(np.mean(np.abs(self.errors(model)) ** 2) / 2.0)) / self.scale
        return replace(self, size=self.size * left) if left > 0.0 else self


def weighed(responses: Sequence[FrequencyResponse], continuous: bool, scale: float, size: float = 1.0) -> list[Weighed]:
    """size: what is taken for a deviation that is not stated, over `relative_std`."""
    return [Weighed(r, 1.0 if r.std is not None else size, scale, continuous) for r in responses]


def assessed_responses(parts: Sequence[Weighed], model: Model, unknowns: int) -> Adequacy:
    """The verdict on a model by what it leaves of responses; unknowns: numbers that were fitted.

    Errors of neighbouring frequencies are independent where only noise is left (Ljung-Box test over the frequencies), and as
    large as stated (chi-square test).
    Where no deviation is stated the first alone decides.
    """
    found = [p.errors(model) / p.scale for p in parts]
    numbers = 2 * sum(len(e) for e in found)
    lags = min(NEIGHBOURS, min(len(e) for e in found) // 2)  # no decision: a formula: half of a response has them all
    products: Vector = np.sum([autocorrelation(x, lags) for e in found for x in (e.real.copy(), e.imag.copy())], axis=0)
    power = float(products[0])
    white_p = ljung_box_of(products, numbers)
    known = all(p.known for p in parts)
    freedom = max(1, numbers - unknowns)
    size_p = chi2_tail(power, freedom) if known else white_p
    excess = math.sqrt(power / freedom)
    predictable = (float(products[1]) / power) ** 2 if lags > 0 and power > 0.0 else 0.0
    falsified = white_p < POLICY.test_level and size_p < POLICY.test_level
    return Adequacy(white_p, 0, excess, predictable, excess if known else 1.0, size_p, falsified, False, of="response")
