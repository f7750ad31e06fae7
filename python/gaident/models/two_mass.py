"""The equations between a two-mass drive and its transfer function, on plain numbers.

    c = (K, sum A, pairwise A, prod A, sum B, prod B): G(s) = K (s^2 + c4 s + c5)/(s^3 + c1 s^2 + c2 s + c3)

Per unit of motor inertia, with K = 1/J_M, R = J_L/J_M, b0 = K_G/J_L, d = D_G/J_M,
m = (D_M + D_G)/J_M and l = (D_L + D_G)/J_L, they are polynomials:

    sum A = m + l, pairwise A = b0 (R + 1) + m l - d^2/R, prod A = b0 (m + l R - 2 d), sum B = l, prod B = b0

At D_G = 0 these are six equations for the five unknowns phi = (K, m, l, b0, R).
mechanics = (J_M, D_M, J_L, D_L, K_G, D_G) in SI units.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.models.factors import FactorCounts

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

# Zeros with a damping ratio below half of this do not determine K_G by the product equation.
WEAK_DAMPING = 1e-3  # no decision: the weight of one equation beside another where no damping gives it one


def coefficients_of_mechanics(mechanics: Vector) -> Vector:
    """c (6) of the mechanics (6); exact."""
    JM, DM, JL, DL, KG, DG = mechanics
    m, load = (DM + DG) / JM, (DL + DG) / JL
    return np.array(
        [
            1.0 / JM,
            m + load,
            KG * (1.0 / JM + 1.0 / JL) + (DM * DL + (DM + DL) * DG) / (JM * JL),
            (DM + DL) * KG / (JM * JL),
            load,
            KG / JL,
        ]
    )


def coefficients_of_parameters(x: Vector, structure: FactorCounts) -> Vector:
    """c (6) of the natural parameters x of a model with three poles and two zeros (factors.py)."""
    poles_end = 1 + structure.real_poles + 2 * structure.pole_pairs
    denominator = _expanded(x[1:poles_end], structure.real_poles)
    numerator = _expanded(x[poles_end:], structure.real_zeros)
    return np.concatenate([x[:1], denominator[1:], numerator[1:]])


def phi_by_pairwise(c: Vector) -> Vector:
    """phi at D_G = 0 from all equations but that of prod A; b0 must not be 0."""
    K, sum_a, pair_a, _, sum_b, b0 = c
    m = sum_a - sum_b
    return np.array([K, m, sum_b, b0, (pair_a - m * sum_b) / b0 - 1.0])


def phi_by_product(c: Vector) -> Vector:
    """phi at D_G = 0 from all equations but the pairwise one (the paper's way); l and b0 must not be 0."""
    K, sum_a, _, prod_a, sum_b, b0 = c
    m = sum_a - sum_b
    return np.array([K, m, sum_b, b0, (prod_a / b0 - m) / sum_b])


def stiffness_gap(c: Vector) -> float:
    """(K_G by product - K_G by pairwise)/(K_G by pairwise) at D_G = 0: how far the sixth number contradicts.

    The product equation gives l R = prod A/b0 - m, so the gap is measured in l R; where l itself is next to
    nothing (lossless load) it does not make the gap large.
    """
    _, _, _, prod_a, sum_b, b0 = c
    _, m, _, _, R = phi_by_pairwise(c)
    weight = max(abs(sum_b), WEAK_DAMPING * abs(b0) ** 0.5) * max(abs(R), 1e-9)
    return float((prod_a / b0 - m - sum_b * R) / weight)


def mechanics_of_phi(phi: Vector) -> Vector:
    """The mechanics (6) of phi, with D_G = 0."""
    K, m, load, b0, R = phi
    return np.array([1.0 / K, m / K, R / K, load * R / K, b0 * R / K, 0.0])


def coefficients_of_phi(phi: Vector) -> Vector:
    """c (6) of phi (5)."""
    K, m, load, b0, R = phi
    return np.array([K, m + load, b0 * (R + 1.0) + m * load, b0 * (m + load * R), load, b0])


def jacobian_of_phi(phi: Vector) -> Matrix:
    """d coefficients_of_phi / d phi, 6 x 5."""
    _, m, load, b0, R = phi
    return np.array(
        [
            [1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 1.0, 1.0, 0.0, 0.0],
            [0.0, load, m, R + 1.0, b0],
            [0.0, b0, b0 * R, m + load * R, b0 * load],
            [0.0, 0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0],
        ]
    )


def mechanics_with_shaft_damping(c: Vector) -> Vector | None:
    """The mechanics (6) that give all six numbers with D_G free, or None where there are none.

    d = (m + l R - prod A/b0)/2 put into the pairwise equation leaves a quadratic for R; of two inertias the
    positive one with the smaller shaft damping is taken.
    """
    K, sum_a, pair_a, prod_a, load, b0 = c
    m = sum_a - load
    d0, d1 = 0.5 * (m - prod_a / b0), 0.5 * load  # d = d0 + d1 R
    a, b, e = b0 - d1 * d1, -(pair_a - b0 - m * load + 2.0 * d0 * d1), -d0 * d0
    discriminant = b * b - 4.0 * a * e  # no decision: a formula: the roots of a quadratic
    if discriminant < 0.0:
        return None
    half = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))  # no decision: a formula: the roots of a quadratic
    roots = [half / a] if a != 0.0 else []
    roots += [e / half] if half != 0.0 else []
    if not roots:
        return None
    R = min(roots, key=lambda ratio: (ratio <= 0.0, abs(d0 + d1 * ratio)))
    d = d0 + d1 * R
    return np.array([1.0 / K, (m - d) / K, R / K, (load * R - d) / K, b0 * R / K, d / K])


def _expanded(x: Vector, reals: int) -> Vector:
    polynomial = np.ones(1)
    for a in x[:reals]:
        polynomial = np.convolve(polynomial, [1.0, a])
    for e1, e0 in x[reals:].reshape(-1, 2):
        polynomial = np.convolve(polynomial, [1.0, e1, e0])
    return polynomial
