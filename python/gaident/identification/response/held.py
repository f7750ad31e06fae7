"""The frequency response of a model between held torque and the samples of its velocity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gaident.models.discrete import require_strictly_proper
from gaident.models.effects_linear import LINEAR
from gaident.models.model import Model

__all__ = ["held_response", "held_transfer"]

Column = NDArray[np.float64]
Roots = NDArray[np.complex128]

NEARLY = 1e-6  # no decision: rounding: of partial fractions, whose terms grow with the inverse
LEAST = 1e-8  # no decision: rounding: of a root, over the sampling rate


def held_response(model: Model, omega: NDArray[np.float64], dt: float) -> NDArray[np.complex128]:
    """From held torque to velocity at the samples, at omega [rad/s] (n,): the linear part of a model, its delay and lag exactly.

    dt: sample time [s]. Raises ModelError for p = 0.
    """
    linear = model.linear
    require_strictly_proper(linear.p, None)
    parts = [LINEAR[e.name](e.values) for e in linear.effects]
    (made,) = held_transfer(
        np.array([[linear.gain * math.prod(part.gain for part in parts)]]),
        np.array([[*linear.poles, *(pole for part in parts for pole in part.poles)]], complex),
        np.array([[*linear.zeros, *(zero for part in parts for zero in part.zeros)]], complex),
        np.array([[sum(part.delay for part in parts)]]),
        omega,
        dt,
    )
    shown: NDArray[np.complex128] = made
    return shown


def held_transfer(gain: Column, poles: Roots, zeros: Roots, delay: Column, omega: NDArray[np.float64], dt: float) -> Roots:
    """The same of gain prod(s - zeros)/prod(s - poles) exp(-s delay), with more poles than zeros, by its partial fractions.

    gain, delay: shape (m, 1), poles and zeros: (m, .), each row a system; the answer: (m, n).
    One fraction, c/(s - p), behind a hold and a delay of d + f samples, 0 <= f < 1, with z = exp(j omega dt):

        z^-d c/p ((exp(p dt (1 - f)) - 1) + (exp(p dt) - exp(p dt (1 - f))) / z) / (z - exp(p dt))
    """
    poles = _apart(poles, LEAST / dt)
    between = poles[:, :, None] - poles[:, None, :]
    between[:, range(poles.shape[1]), range(poles.shape[1])] = 1.0
    c = gain * np.prod(poles[:, :, None] - zeros[:, None, :], axis=2) / np.prod(between, axis=2)
    d, f = np.divmod(delay / dt, 1.0)
    z = np.exp(1j * omega * dt)
    early, whole = np.expm1(poles * dt * (1.0 - f)), np.expm1(poles * dt)
    over = 1.0 / (z - 1.0 - whole[:, :, None])
    parts = c / poles
    made: Roots = np.einsum("mk,mkn->mn", parts * early, over) + np.einsum("mk,mkn->mn", parts * (whole - early), over) / z
    late: Roots = made * z**-d
    return late


def _apart(roots: Roots, least: float) -> Roots:
    """Roots of which no two of a row are the same and none is 0: what is nearer is moved by so much; least: of a root [rad/s]."""
    made = np.where(np.abs(roots) < least, -least, roots).astype(complex)
    for i in range(1, made.shape[1]):
        between = np.maximum(NEARLY * np.abs(made[:, i]), least)
        near = np.min(np.abs(made[:, :i] - made[:, i : i + 1]), axis=1) < between
        made[near, i] -= 2.0 * i * between[near]
    return made
