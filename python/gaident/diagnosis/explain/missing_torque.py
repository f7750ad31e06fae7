"""The missing torque: what must be added to the model's torque so that it moves as measured, with its standard deviation.

    x(n+1) = A x(n) + B (u(n) + d(n)),   w(n) = C x(n) + D (u(n) + d(n)) + e(n)
    d(n+1) = d(n) + v(n),                var e = noise^2, var v = walk^2 dt

A random-walk torque d rides on the model's input; a Kalman filter and its smoother (fixed interval, de Jong's backward form,
no covariance is inverted) estimate it from the whole record.
Coulomb friction shows as -Tc sign(w), a load T as -T. No derivative is taken, resonances are undone correctly,
and what the sensor's noise hides stays within `std`.

The gains are the steady ones, so that the recursions are linear ones of constant coefficients; the initial state is the
one that makes the innovations smallest.
The plant is discretised as the loop says: by zero-order hold, or bilinearly for loop="continuous".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.checks import real_number
from gaident.control.filtering import recursion
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import ModelError, RecordError
from gaident.estimation.projection import inverse_of
from gaident.estimation.state_space import Discretised, discretised, steady_covariance
from gaident.models.drive_torque import torque_of
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["MissingTorque", "missing_torque"]

Vector = NDArray[np.float64]

FORGETS = 1e-3, 0.9998  # no decision: poles that bound its memory: a start is forgotten, exact to 1e-9, in 5 to 103 600 steps
LEAST_NOISE = 1e-5  # no decision: of the velocity's range; a log smoothed beyond that would make any torque of its last digits
DECADES = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0)  # no decision: a grid
"""Of walk per sample over the noise, seen at the velocity after one sample."""


@dataclass(frozen=True, eq=False)
class MissingTorque:
    """dhat(t) [N m], shape (n,), and what it is worth.

    dhat         the torque that must be added to the model's; dhat[n] acts from sample n to n+1
    std          its standard deviation [N m], shape (n,), larger towards the ends
    velocity     the smoothed velocity [rad/s], shape (n,)
    innovations  one-step prediction errors of the filter [rad/s], shape (n,): white where the random walk describes d well
    noise        standard deviation of the velocity noise [rad/s]
    walk         of the torque's random walk [N m/sqrt(s)]
    log_likelihood  of the tuning part of the record
    """

    dhat: Vector
    std: Vector
    velocity: Vector
    innovations: Vector
    noise: float
    walk: float
    log_likelihood: float


def missing_torque(
    model: Model,
    rec: Record,
    controller: PI | None = None,
    torque: Vector | None = None,
    noise: float | None = None,
    walk: float | None = None,
) -> MissingTorque:
    """Smooths the missing torque out of one record.

    model   the linear model, torque to velocity
    torque  what drives it [N m], shape (n,); None: the record's, or what the controller makes of command and velocity
    noise   standard deviation of the velocity noise [rad/s]; None: chosen with the walk by likelihood
    walk    of the random walk [N m/sqrt(s)]; None: chosen by likelihood on a grid

    Raises ModelError for p = 0 outside the continuous loop, for a model that shows no torque at standstill (a zero at 0) and for
    deviations <= 0, RecordError where torque is missing or of another length.
    """
    u = torque_of(rec, controller) if torque is None else np.asarray(torque, dtype=np.float64)
    if u.shape != rec.velocity.shape:
        raise RecordError(f"torque has the shape {u.shape}, the record has {len(rec)} samples: give one number per sample")
    for name, value in (("noise", noise), ("walk", walk)):
        if value is not None and not real_number(value, name, ModelError, "give one number > 0, or None") > 0.0:
            raise ModelError(f"{name} is {value!r}: give one number > 0, or None to have it chosen")
    loop = "sampled" if controller is None else controller.loop
    plant = discretised(model, rec.dt, loop)
    tuned = slice(0, POLICY.tuned_samples)
    if walk is not None:
        walk *= float(np.sqrt(rec.dt))
    if noise is None or walk is None:
        free = noise is None and walk is None
        noise, walk, likelihood = _tuned(plant, u[tuned], rec.velocity[tuned], noise, walk)
        if free and noise < (least := LEAST_NOISE * float(np.ptp(rec.velocity))):
            noise, walk, likelihood = _tuned(plant, u[tuned], rec.velocity[tuned], least, None)
    else:
        steady = _Filter(plant, noise, walk)
        likelihood = steady.log_likelihood(steady.innovations(u[tuned], rec.velocity[tuned]))
    smoother = _Filter(plant, noise, walk)
    dhat, velocity, innovations = smoother.smooth(u, rec.velocity)
    std = smoother.deviation(len(rec))
    return MissingTorque(dhat, std, velocity, innovations, noise, walk / float(np.sqrt(rec.dt)), likelihood)


def _tuned(plant: Discretised, u: Vector, w: Vector, noise: float | None, walk: float | None) -> tuple[float, float, float]:
    """(noise, walk per sample, log-likelihood): the most likely on the grid and a finer one around its best."""
    tried: dict[float, tuple[float, float, float]] = {}

    def value(decade: float) -> float:
        if decade not in tried:
            ratio = 10.0**decade / plant.first_response
            # Innovations depend on the ratio alone; with neither given, their size says which scale is the most likely.
            level = noise if noise is not None else 1.0 if walk is None else walk / ratio
            steady = _Filter(plant, level, ratio * level)
            v = steady.innovations(u, w)
            scale = float(np.sqrt(v @ v / len(v) / steady.F)) if noise is None and walk is None else 1.0
            tried[decade] = (scale * level, ratio * scale * level, steady.log_likelihood(v, scale))
        return tried[decade][2]

    best = max(DECADES, key=value)
    for step in (0.5, 0.25):
        best = max((best - step, best, best + step), key=value)
    return tried[best]


class _Filter:
    """The steady Kalman filter of (x, d) for one pair of deviations: noise [rad/s], walk per sample [N m]."""

    def __init__(self, plant: Discretised, noise: float, walk: float) -> None:
        m = len(plant.B)
        self.A = np.zeros((m + 1, m + 1), dtype=np.complex128)
        self.A[:m, :m], self.A[:m, m], self.A[m, m] = plant.A, plant.B, 1.0
        self.B = np.append(plant.B, 0.0)
        self.H = np.append(plant.C, plant.D)
        self.D = plant.D
        # In units of the noise, so that the covariances stay near 1.
        Q = np.zeros((m + 1, m + 1), dtype=np.complex128)
        Q[m, m] = (walk / noise) ** 2
        P = steady_covariance(self.A, self.H, Q)
        self.P = P * noise**2
        self.F = float((self.H @ self.P @ self.H.conj()).real) + noise**2
        self.K = self.A @ self.P @ self.H.conj() / self.F
        self.L = self.A - np.outer(self.K, self.H)
        # Samples after which the filter has forgotten its start to 1e-9.
        slowest = float(np.clip(np.abs(np.linalg.eigvals(self.L)).max(), *FORGETS))
        self.memory = 2 + int(np.log(1e-9) / np.log(slowest))

    def predict(self, u: Vector, w: Vector) -> tuple[Vector, NDArray[np.complex128]]:
        """(innovations (n,), predicted states (n, m+1)) from the initial state that makes the innovations smallest."""
        states, v, fitted = self._run(u, w)
        head = min(len(w), self.memory)
        states[:head] += recursion(self.L, np.zeros((head, len(self.B))), fitted)
        return v, states

    def innovations(self, u: Vector, w: Vector) -> Vector:
        """The innovations (n,) of `predict` alone."""
        return self._run(u, w)[1]

    def _run(self, u: Vector, w: Vector) -> tuple[NDArray[np.complex128], Vector, NDArray[np.complex128]]:
        """States predicted from 0 (n, m+1), innovations (n,) from the initial state that makes them smallest, and that state."""
        states = recursion(self.L, np.outer(u, self.B - self.K * self.D) + np.outer(w, self.K))
        v = w - self.D * u - np.einsum("ni,i->n", states, self.H).real
        columns, inverse = self.start(len(w))
        head = len(columns)
        parts = inverse @ np.einsum("ni,n->i", columns, v[:head])
        v[:head] -= np.einsum("ni,i->n", columns, parts)
        return states, v, parts[: len(self.B)] + 1j * parts[len(self.B) :]

    def start(self, samples: int) -> tuple[Vector, Vector]:
        """How the initial state shows in the velocity until it is forgotten, and the inverse of the Gram matrix of that.

        (head, 2m+2): H L^n per real and imaginary part of each state; what the record does not show of it stays smallest.
        """
        head = min(samples, self.memory)
        seen = self.powers(self.H, head)
        columns = np.hstack([seen.real, -seen.imag])
        # The sizes are those of the complex columns: the imaginary part of a real one is rounding.
        return columns, inverse_of(columns.T @ columns, np.tile(np.linalg.norm(seen, axis=0), 2))

    def powers(self, row: NDArray[np.complex128], samples: int) -> NDArray[np.complex128]:
        """row L^n, n = 0.. (samples, m+1)."""
        return recursion(self.L.T, np.zeros((samples, len(self.B))), row)

    def log_likelihood(self, v: Vector, scale: float = 1.0) -> float:
        """Of innovations, Gaussian; scale: of both deviations, which changes the variance of innovations alone."""
        F = self.F * scale**2
        return -0.5 * (len(v) * float(np.log(2.0 * np.pi * F)) + float(v @ v) / F)

    def smooth(self, u: Vector, w: Vector) -> tuple[Vector, Vector, Vector]:
        """(dhat, smoothed velocity, innovations)."""
        v, states = self.predict(u, w)
        smoothed = states + self.corrections(v)
        return smoothed[:, -1].real.copy(), np.einsum("ni,i->n", smoothed, self.H).real + self.D * u, v

    def corrections(self, v: Vector) -> NDArray[np.complex128]:
        """What later innovations add to the predicted states (n, m+1): P r(n-1), r(n-1) = H' v(n)/F + L' r(n)."""
        back = recursion(self.L.conj().T, np.outer(v[::-1] / self.F, self.H.conj()), newest=True)
        added: NDArray[np.complex128] = np.einsum("ij,nj->ni", self.P, back[::-1])
        return added

    def deviation(self, samples: int) -> Vector:
        """Standard deviation of dhat (n,).

        var(n) = P_dd - sum_{k < N-n} |H L^k P_d|^2 / F, what the samples from n on tell, plus what the fitted initial state
        leaves open: F s(n) Gram^-1 s(n)', s the sensitivity of dhat(n) to it.
        """
        head, m, prior = min(samples, self.memory), len(self.B), self.P[-1, -1].real
        columns, inverse = self.start(samples)
        told = (columns[:, :m] - 1j * columns[:, m:]) @ self.P[:, -1]
        left = np.maximum(prior - np.cumsum(np.abs(told) ** 2) / self.F, 1e-12 * prior)
        var = np.full(samples, left[-1])
        var[samples - head :] = left[::-1]
        own = self.powers(np.eye(m)[-1], head)
        own = np.hstack([own.real, -own.imag])
        s = own - np.stack([self.corrections(c)[:, -1].real for c in columns.T], axis=1)
        var[:head] += self.F * np.einsum("ni,ij,nj->n", s, inverse, s)
        std: Vector = np.sqrt(var)
        return std
