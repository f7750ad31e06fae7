"""From the difference equation (7) back to factor modules: the inverse of `Model.discrete`, without the core.

With z^N - sum beta_i z^(N-i) = D(z) and sum alpha_i z^(N-i) = A(z), controller Cn/Cd and plant b/a in z,

    A = Cn b,    D = Cd a + Cn b                                                          (the loop w/r = Cn b/(Cd a + Cn b))

are *linear* in the plant's coefficients.
They are more equations than unknowns (the loop adds nothing that is unknown), so noisy coefficients meet them by least squares,
weighted with their covariance. Then to s, exactly:

    continuous loop   b = (z+1)^p b_q, and z = (2 + s Ts)/(2 - s Ts) root by root (bilinear transformation)
    held torque       b/a = sum_i r_i/(z - z_i),  s_i = ln(z_i)/Ts,  G = sum_i r_i s_i/(z_i - 1) / (s - s_i)  (zero-order hold)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.control.pi import PI
from gaident.errors import ModelError
from gaident.models.model import Model

__all__ = ["Plant", "plant_of_discrete"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Plant(NamedTuple):
    """The plant behind a difference equation; None with the reason in `note` where there is none with real time behind it.

    misfit: how far the loop of the plant is from the given coefficients, relative to the largest of them: 0 where they are
    those of a plant in this loop, more where noise or something else is in them.
    """

    model: Model | None
    misfit: float
    note: str


def plant_of_discrete(
    alpha: Vector, beta: Vector, dt: float, controller: PI | None = None, covariance: Vector | None = None
) -> Plant:
    """The model with p = 1 whose equation (7) is (alpha, beta), as nearly as there is one.

    alpha, beta  N + 1 and N numbers; with a controller N = 2 + q, in open loop N = 1 + q
    dt           sample time [s]
    controller   the loop they belong to (its limits are left out); None: torque to velocity, held torque
    covariance   (2N+1, 2N+1) of (alpha, beta): the weights; None: all coefficients alike

    Raises ModelError for coefficients of the wrong number.
    """
    alpha, beta = np.asarray(alpha, dtype=np.float64), np.asarray(beta, dtype=np.float64)
    lowest = 1 if controller is None else 2
    if alpha.ndim != 1 or beta.ndim != 1 or len(alpha) != len(beta) + 1 or len(beta) < lowest:
        raise ModelError(
            f"alpha and beta have the shapes {alpha.shape} and {beta.shape}: give N + 1 and N numbers, N >= {lowest}"
        )
    bilinear = controller is not None and controller.loop == "continuous"
    b, a, misfit = _plant_in_z(alpha, beta, dt, controller, covariance, bilinear)
    poles, zeros = np.roots(a).astype(np.complex128), np.roots(b).astype(np.complex128)
    if bilinear:
        # (z - z_i) = (2 - s Ts)^-1 ((1 + z_i) Ts) (s - s_i), and z + 1 = 4 (2 - s Ts)^-1
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = float(4.0 / dt * b[0] / a[0] * np.prod(1.0 + zeros).real / np.prod(1.0 + poles).real)
            s_poles, s_zeros = (2.0 / dt * (z - 1.0) / (z + 1.0) for z in (poles, zeros))
    else:
        backwards = [z.real for z in poles if z.imag == 0.0 and z.real <= 0.0]
        if backwards:
            note = f"the polynomial has a pole at z = {backwards[0]:.4g}, which no plant in continuous time has"
            return Plant(None, misfit, note)
        gain, s_poles, s_zeros = _held_to_s(b / a[0], poles, dt)
    if not np.all(np.isfinite(np.r_[gain, s_poles, s_zeros])) or gain == 0.0:
        return Plant(None, misfit, "the polynomial has coinciding poles, none that acts, or a root at z = -1")
    try:
        return Plant(Model(gain, _paired(s_poles), _paired(s_zeros)), misfit, "")
    except ModelError as reason:  # a gain or a root that no drive has
        return Plant(None, misfit, f"the polynomial is none of a drive: {reason}")


def _plant_in_z(
    alpha: Vector, beta: Vector, dt: float, controller: PI | None, covariance: Vector | None, bilinear: bool
) -> tuple[Vector, Vector, float]:
    """(b without the factor z + 1 of a bilinear plant, a, misfit), highest power first."""
    N = len(beta)
    if controller is None:
        return alpha[1:], np.r_[1.0, -beta], float(abs(alpha[0]) / np.max(np.abs(alpha)))
    half = 0.5 * controller.ki * dt
    # Cn = (kp + half) z + (half - kp), Cd = z - 1; u(n) = kp e(n) + I(n) is the same in both loops.
    Cn, Cd = np.array([controller.kp + half, half - controller.kp]), np.array([1.0, -1.0])
    known = np.convolve(Cn, [1.0, 1.0]) if bilinear else np.r_[0.0, Cn]  # b has one more pole than zeros, or a sample's delay
    B = _convolution(known, N - 1)
    A = _convolution(Cd, N)
    # (alpha; D) = M (b; a); the first coefficient of D is 1 by definition: met exactly.
    M = np.block([[B, np.zeros((N + 1, N))], [B, A]])
    target = np.r_[alpha, 1.0, -beta]
    x0 = M[N + 1] / (M[N + 1] @ M[N + 1])
    free = np.linalg.svd(M[N + 1 : N + 2])[2][1:].T
    rows = np.delete(np.arange(2 * N + 2), N + 1)
    W = np.eye(2 * N + 1) if covariance is None else _whitening(covariance)
    y = np.linalg.lstsq(W @ M[rows] @ free, W @ (target - M @ x0)[rows], rcond=None)[0]
    x = x0 + free @ y
    misfit = float(np.max(np.abs(M @ x - target)) / np.max(np.abs(target)))
    return x[: N - 1], x[N - 1 :], misfit


def _convolution(factor: Vector, size: int) -> Vector:
    """The matrix M with M x = convolve(factor, x) for x of length `size`."""
    return np.column_stack([np.convolve(factor, unit) for unit in np.eye(size)])


def _whitening(covariance: Vector) -> Vector:
    """W with W cov W' = 1 (sign of beta does not matter: both its rows and columns turn); weak directions at 1e-14."""
    N = (len(covariance) - 1) // 2
    sign = np.r_[np.ones(N + 1), -np.ones(N)]
    variance, directions = np.linalg.eigh(covariance * np.outer(sign, sign))
    variance = np.maximum(variance, 1e-14 * variance[-1])
    whitening: Vector = (directions / np.sqrt(variance)).T
    return whitening


def _held_to_s(b: Vector, poles: Complex, dt: float) -> tuple[float, Complex, Complex]:
    """(gain, poles, zeros) in s of b(z)/prod(z - z_i) with held input; gain nan where poles coincide."""
    n = len(poles)
    s = (np.log(poles) / dt).astype(np.complex128)
    others = [np.delete(poles, i) for i in range(n)]
    with np.errstate(divide="ignore", invalid="ignore"):
        residue = np.array([np.polyval(b, z) / np.prod(z - rest) for z, rest in zip(poles, others, strict=True)])
    if not np.all(np.isfinite(residue)):
        return float("nan"), s, np.zeros(0, dtype=np.complex128)
    # (z - 1)/s -> Ts where the pole is an integrator
    ratio = np.array([dt if abs(s_i) * dt < 1e-9 else (z - 1.0) / s_i for z, s_i in zip(poles, s, strict=True)])
    parts = [g * np.atleast_1d(np.poly(np.delete(s, i))) for i, g in enumerate(residue / ratio)]
    numerator = np.sum(parts, axis=0).real
    return float(numerator[0]), s, np.roots(numerator).astype(np.complex128)


def _paired(roots: Complex) -> Complex:
    """Conjugate symmetry as exact as `Model` wants it: each root of positive imaginary part brings its partner."""
    scale = np.max(np.abs(roots), initial=0.0)
    upper = roots[roots.imag > 1e-9 * scale]
    real = roots[np.abs(roots.imag) <= 1e-9 * scale].real
    return np.concatenate([real, upper, upper.conj()])
