"""The two-mass mechanics of an identified model: weighted least squares, exact solution, deviations."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gaident.models.factors import FactorCounts, factor_parameters
from gaident.models.model import Model
from gaident.models.two_mass import (
    WEAK_DAMPING,
    Matrix,
    Vector,
    coefficients_of_parameters,
    coefficients_of_phi,
    jacobian_of_phi,
    mechanics_of_phi,
    mechanics_with_shaft_damping,
    phi_by_pairwise,
    stiffness_gap,
)

NAMES = ("JM", "DM", "JL", "DL", "KG", "DG", "J", "D")


class TwoMassFit(NamedTuple):
    """Mechanics as vectors (J_M, D_M, J_L, D_L, K_G, D_G), SI; deviations by name, {} if unknown."""

    mechanics: Vector  # least squares at D_G = 0
    inconsistency: float  # abs(two_mass.stiffness_gap)
    std: dict[str, float]
    shaft: Vector | None  # exact, D_G free
    shaft_std: dict[str, float]


def fit_two_masses(model: Model, cov: Matrix | None) -> TwoMassFit | None:
    """The mechanics of a model with p = 1, q = 2; `cov` (6 x 6) over its natural parameters (factors.py).

    None where a zero of the model lies at 0: then K_G is 0 and there is no second mass to speak of; and where its roots are so
    far apart that a mass or the stiffness is beyond all numbers.
    """
    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            return _fitted(model, cov)
    except (FloatingPointError, np.linalg.LinAlgError):
        return None


def _fitted(model: Model, cov: Matrix | None) -> TwoMassFit | None:
    """See `fit_two_masses`; raises FloatingPointError and LinAlgError."""
    _, x, units = factor_parameters(model)
    structure = FactorCounts.of(model)
    c = coefficients_of_parameters(x, structure)
    if c[5] == 0.0:
        return None
    scales = coefficient_scales(c)
    inconsistency, shaft = abs(stiffness_gap(c)), mechanics_with_shaft_damping(c)
    if cov is None or not np.any(cov):
        phi = least_squares_phi(c, np.diag(1.0 / scales))
        return TwoMassFit(mechanics_of_phi(phi), inconsistency, {}, shaft, {})

    frequency = max(abs(root) for root in model.poles + model.zeros)
    powers = np.array([{"rad/s": 1, "rad^2/s^2": 2}.get(unit, 0) for unit in units])
    steps = np.where(powers > 0, np.maximum(np.abs(x), WEAK_DAMPING * frequency**powers), np.abs(x))
    to_c = jacobian(lambda v: coefficients_of_parameters(v, structure), x, steps)
    cov_c = to_c @ cov @ to_c.T
    whitening = whitening_of(cov_c, scales)
    phi = least_squares_phi(c, whitening)

    size = phi_scales(phi)
    to_phi = size[:, None] * np.linalg.pinv(whitening @ jacobian_of_phi(phi) * size) @ whitening
    to_mechanics = jacobian(lambda v: _with_totals(mechanics_of_phi(v)), phi, size)
    std = deviations(to_mechanics @ to_phi, cov_c, NAMES)
    del std["DG"]
    std |= deviations(jacobian(lambda v: np.array([stiffness_gap(v)]), c, scales), cov_c, ("inconsistency",))
    shaft_std = {}
    if shaft is not None:
        shaft_std = deviations(jacobian(_shaft_with_totals, c, scales), cov_c, NAMES)
    return TwoMassFit(mechanics_of_phi(phi), inconsistency, std, shaft, shaft_std)


def least_squares_phi(c: Vector, whitening: Matrix) -> Vector:
    """phi at D_G = 0 with the smallest norm of whitening @ (coefficients_of_phi(phi) - c).

    Levenberg-Marquardt from the pairwise solution, the parameters scaled to one.
    """
    from scipy.optimize import least_squares

    start = phi_by_pairwise(c)
    size = phi_scales(start)

    def error(moved: Vector) -> Vector:
        return whitening @ (coefficients_of_phi(start + size * moved) - c)

    def slope(moved: Vector) -> Matrix:
        return whitening @ jacobian_of_phi(start + size * moved) * size

    # no decision: the end of a solver
    found = least_squares(error, np.zeros(5), slope, method="lm", xtol=1e-11, ftol=1e-15, gtol=1e-15)
    phi: Vector = start + size * np.asarray(found.x)
    return phi


def coefficient_scales(c: Vector) -> Vector:
    """The magnitude that a relative deviation of each of the six numbers refers to.

    A damping next to nothing is measured against the natural frequency instead of against itself.
    """
    frequency = max(abs(c[5]), abs(c[2])) ** 0.5
    floor = WEAK_DAMPING * frequency ** np.array([0.0, 1.0, 2.0, 3.0, 1.0, 2.0])
    floor[0] = 0.0
    scales: Vector = np.maximum(np.abs(c), floor)
    return scales


def phi_scales(phi: Vector) -> Vector:
    """The magnitude of each unknown, for scaling and for numeric derivatives; like `coefficient_scales`."""
    floor = np.array([0.0, 1.0, 1.0, 0.0, 1.0]) * WEAK_DAMPING
    floor[1:3] *= abs(phi[3]) ** 0.5
    sizes: Vector = np.maximum(np.abs(phi), floor)
    return sizes


def whitening_of(cov: Matrix, scales: Vector) -> Matrix:
    """W with W cov W' = 1; directions (nearly) without variance get 1e-16 of the largest."""
    variance, directions = np.linalg.eigh(cov / np.outer(scales, scales))
    variance = np.maximum(variance, 1e-16 * variance[-1])
    whitening: Matrix = (directions / np.sqrt(variance)).T / scales
    return whitening


def jacobian(function: Callable[[Vector], Vector], x: Vector, scale: Vector) -> Matrix:
    """d function / d x by central differences of 1e-6 scale."""
    columns = []
    for i, step in enumerate(1e-6 * scale):  # no decision: the step of a difference
        up, down = x.copy(), x.copy()
        up[i] += step
        down[i] -= step
        columns.append((function(up) - function(down)) / (up[i] - down[i]))
    return np.column_stack(columns)


def deviations(gradient: Matrix, cov: Matrix, names: tuple[str, ...]) -> dict[str, float]:
    """Standard deviations of the quantities `names` with the rows of `gradient` (delta method)."""
    variance = np.einsum("ij,jk,ik->i", gradient, cov, gradient)
    return {name: float(np.sqrt(max(v, 0.0))) for name, v in zip(names, variance, strict=True)}


def _with_totals(mechanics: Vector) -> Vector:
    return np.append(mechanics, [mechanics[0] + mechanics[2], mechanics[1] + mechanics[3]])


def _shaft_with_totals(c: Vector) -> Vector:
    shaft = mechanics_with_shaft_damping(c)
    return np.full(len(NAMES), np.nan) if shaft is None else _with_totals(shaft)
