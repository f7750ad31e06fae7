"""The factored model as a chain of first-order sections, discretised; Riccati's equation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import say
from gaident.control.filtering import recursion
from gaident.control.pi import PI
from gaident.errors import ModelError
from gaident.models.model import Model

__all__ = ["Discretised", "discretised", "disturbed", "steady_covariance", "steady_covariances"]

Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Discretised:
    """x(n+1) = A x(n) + B u(n), w(n) = C x(n) + D u(n); complex coordinates, real from u to w.

    first_response: the velocity [rad/s] that a torque of 1 N m held for one sample leaves behind (largest of the first samples).
    """

    A: Complex
    B: Complex
    C: Complex
    D: float

    def response(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """w of the input u from rest, shape (n,) each."""
        w: NDArray[np.float64] = np.einsum("ni,i->n", recursion(self.A, np.outer(u, self.B)), self.C).real + self.D * u
        return w

    @property
    def first_response(self) -> float:
        x, largest = self.B, abs(self.D)
        for _ in range(3):  # no decision: how many samples of a response it takes
            largest = max(largest, abs(float((self.C @ x).real)))
            x = self.A @ x
        return largest


def discretised(model: Model, dt: float, loop: str = "sampled") -> Discretised:
    """The model at sample time dt [s]: zero-order hold, or bilinear for loop="continuous".

    A chain of sections keeps each root as it is: with input v, x' = pole x + v, the section (s - zero)/(s - pole) gives
    v + (pole - zero) x, the section 1/(s - pole) gives x. Raises ModelError for p = 0 outside the continuous loop.
    """
    from scipy.linalg import expm

    if model.p == 0 and loop != "continuous":
        raise ModelError('the model has p = 0, which exists with loop="continuous" only: use more poles than zeros')
    m = model.order
    A, B = np.zeros((m, m), dtype=np.complex128), np.zeros(m, dtype=np.complex128)
    row, through = np.zeros(m, dtype=np.complex128), 1.0 + 0.0j  # what the chain gives so far: row x + through u
    for i, pole in enumerate(model.poles):
        A[i], B[i] = row, through
        A[i, i] += pole
        if i < model.q:
            row = row.copy()
            row[i] += pole - model.zeros[i]
        else:
            row, through = np.zeros(m, dtype=np.complex128), 0.0j
            row[i] = 1.0
    C, D = model.gain * row, model.gain * through.real
    if loop != "continuous":
        both = np.zeros((m + 1, m + 1), dtype=np.complex128)
        both[:m, :m], both[:m, m] = A * dt, B * dt
        transition = expm(both)
        return Discretised(transition[:m, :m], transition[:m, m], C, 0.0)
    half = np.linalg.inv(np.eye(m) - 0.5 * dt * A)
    D += float((C @ half @ B).real) * 0.5 * dt
    return Discretised(half @ (np.eye(m) + 0.5 * dt * A), dt * (half @ B), C @ half, D)


def disturbed(plant: Discretised, controller: PI | None, dt: float) -> Discretised:
    """From a torque added to the controller's to the measured velocity: the plant in its loop, limits left out.

        w (1 + D (kp + h)) = C x + D (J + f),  u = J - (kp + h) w,  J(n+1) = J(n) - 2 h w,  h = ki dt/2

    with J what the integrator stores of the past. Without a controller the plant itself.
    """
    if controller is None:
        return plant
    m, h = len(plant.B), 0.5 * controller.ki * dt
    k = controller.kp + h
    scale = 1.0 / (1.0 + plant.D * k)
    C: Complex = np.append(plant.C, plant.D).astype(np.complex128) * scale  # w = C [x, J] + D f
    D = plant.D * scale
    A = np.zeros((m + 1, m + 1), dtype=np.complex128)
    A[:m, :m], A[:m, m], A[m, m] = plant.A, plant.B, 1.0
    A[:m] -= k * np.outer(plant.B, C)
    A[m] -= 2.0 * h * C
    B = np.append((1.0 - k * D) * plant.B, -2.0 * h * D)  # no decision: a formula
    return Discretised(A, B, C, D)


def steady_covariance(A: Complex, H: Complex, Q: Complex) -> Complex:
    """P of the steady Kalman filter with noise variance 1: P = A P A* - A P H*(H P H* + 1)^-1 H P A* + Q.

    Raises ModelError where there is none: a state is not seen at the output and does not fade.
    """
    P: Complex = steady_covariances(A[None], H, Q[None])[0]
    if not np.all(np.isfinite(P)):
        raise ModelError(
            say("a missing {torque} does not show in this model's velocity: it has a zero at 0, or a pole that no {torque} moves")
        )
    return P


def steady_covariances(A: Complex, H: Complex, Q: Complex) -> Complex:
    """`steady_covariance` of many A and Q (k, m, m) by doubling, side by side; nan where there is none."""
    a, g, p = A.conj().swapaxes(1, 2), np.broadcast_to(np.outer(H.conj(), H), A.shape), Q
    eye = np.eye(A.shape[-1])
    converged = np.zeros(len(A), dtype=bool)
    out = np.full_like(A, np.nan)
    with np.errstate(all="ignore"):
        for _ in range(60):  # no decision: of a solver, which ends by its tolerance
            before, inverse = a.conj().swapaxes(1, 2), _inverses(eye + g @ p)
            after = inverse @ a
            step = before @ p @ after
            g = g + a @ inverse @ g @ before
            a = a @ after
            p = p + step
            p = 0.5 * (p + p.conj().swapaxes(1, 2))
            new = ~converged & (np.abs(step).max(axis=(1, 2)) <= 1e-12 * np.abs(p).max(axis=(1, 2)))
            out[new] = p[new]
            converged |= new
            if np.all(converged | ~np.isfinite(p).all(axis=(1, 2))):
                break
    return out


def _inverses(M: Complex) -> Complex:
    """Of many matrices (k, m, m); nan where there is none."""
    try:
        out: Complex = np.asarray(np.linalg.inv(M), dtype=np.complex128)
    except np.linalg.LinAlgError:
        out = np.full_like(M, np.nan)
        for i, matrix in enumerate(M):
            try:
                out[i] = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                continue
    return out
