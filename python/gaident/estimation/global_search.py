"""A global search near a fit, for models whose cost is multimodal: a stop or an impact more or less makes it so.

Two masses, K (s^2 + f1 s + f0)/((s + a)(s^2 + e1 s + e0)), are searched in coordinates that a record determines one by one:

    ln J, a, ln zeta_p, ln e0, ln zeta_z, ln(f0/e0),   J = e0/(K f0), e1 = 2 zeta_p sqrt(e0), f1 = 2 zeta_z sqrt(f0)

A damping that is less than `LEAST_DAMPING`, or negative, is taken for that: the search begins beside such a fit.
The inertia J of both masses is known closely from the slow motion, whatever the shaft does.
In K, e and f it is a product: a box around these is nearly all of another inertia.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.least_squares import fit
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.policy.table import POLICY

__all__ = ["evolved"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Coordinates: TypeAlias = tuple[Callable[[Vector], Vector], Callable[[Matrix], Matrix]]
"""(coordinates of one x, rows of x of rows of coordinates)."""

PART, LEAST = 0.15, 0.3  # no decision: a start; where one mass is searched: part of a base parameter, and of its unit at least
STEPS, STEPS_IMPACTS = 0.7, 5.0  # no decision: a start; the same of an effect, in its steps, and of one with impacts
SHAFT = np.array([0.05, 1.0, 1.6, 1.0, 1.6, 0.5])  # no decision: a start; the same of two masses, in the coordinates above
LEAST_DAMPING = 5e-3  # no decision: a start; the damping ratio from which one is searched that is less, or negative
NEAREST = 0.01  # no decision: a start; the share of the reach within which the nearest members are drawn


def evolved(objective: Objective, found: Fit, generations: int, draw: int = 0) -> Fit:
    """Differential evolution around a fit (Storn and Price 1997), then least squares from where it ends.

    The first members are near the fit in some coordinates and far in others.
    Each is drawn within a share of the reach: 1 in half of them, and from 0.01 to 1, evenly in its logarithm, in the others.
    draw: of several searches from the same fit, whose members differ.
    """
    from scipy.optimize import differential_evolution

    hypothesis, parameters = found.hypothesis, found.parameters
    if not np.all(np.isfinite(found.x)):
        return found
    coordinates, back = _coordinates(parameters, found.x)
    at, reach, limits = coordinates(found.x), _reach(parameters, found.x), parameters.limits()
    low, high = at - reach, at + reach
    own = slice(parameters.base, None)  # effects and start states stand in either vector alike
    low[own], high[own] = np.maximum(low[own], limits[0][own]), np.minimum(high[own], limits[1][own])
    if _on_a_shaft(parameters, found.x) and at[5] < 0.0:  # no decision: a formula: the place of ln(f0/e0), below 0 on a shaft
        high[5] = min(high[5], 0.0)  # no decision: the same
    moved = np.flatnonzero(reach > 0.0)
    if np.any(low[moved] >= high[moved]):
        return found
    low, high = low[moved], high[moved]
    # no decision: of a solver: inside of the bounds
    start = low + (high - low) * np.clip((at[moved] - low) / (high - low), 1e-6, 1.0 - 1e-6)
    rng, shape = np.random.default_rng(draw), (POLICY.population * len(moved), len(moved))
    shares = NEAREST ** np.maximum(rng.uniform(-1.0, 1.0, shape), 0.0) * rng.uniform(-1.0, 1.0, shape)
    members = np.clip(start + shares * reach[moved], low, high)

    def of(columns: Matrix) -> Matrix:
        Y = np.repeat(at[None, :], columns.shape[1], axis=0)
        Y[:, moved] = columns.T
        return back(Y)

    best = differential_evolution(
        lambda columns: np.log(objective.costs(hypothesis, of(columns), WHITE)),
        list(zip(low, high, strict=True)), init=members, x0=start, maxiter=generations, rng=draw, vectorized=True,
        updating="deferred", polish=False, tol=1e-4, mutation=(0.4, 0.9), recombination=0.9,
    )  # fmt: skip
    return fit(objective, hypothesis, of(best.x[:, None])[0], WHITE, POLICY.usual)


def _reach(parameters: Parameterisation, x: Vector) -> Vector:
    """How far from a fit each coordinate is searched; 0: it is not moved."""
    reach = STEPS * parameters.steps()
    for t in parameters.terms:
        if t.impacts:
            reach[parameters.slot(t.name)] *= STEPS_IMPACTS / STEPS
    base = parameters.base
    reach[:base] = SHAFT if _on_a_shaft(parameters, x) else PART * np.maximum(np.abs(x[:base]), LEAST)
    if not _on_a_shaft(parameters, x):
        reach[0] = PART  # ln K
    return np.asarray(reach)


def _on_a_shaft(parameters: Parameterisation, x: Vector) -> bool:
    """Whether x is of two masses with e0 and f0 above 0."""
    return parameters.masses == 2 and bool(
        np.all(parameters.base_values(x[None, :])[0, [3, 5]] > 0.0)
    )  # no decision: a formula: e0, f0


def _coordinates(parameters: Parameterisation, x: Vector) -> Coordinates:
    """Those of the mechanics for two masses on a shaft, else x itself."""
    if not _on_a_shaft(parameters, x):
        return np.copy, np.copy
    units, base = np.array(parameters.units), parameters.base

    def coordinates(x: Vector) -> Vector:
        e1, e0, f1, f0 = (x[1:base] * units)[1:]
        # no decision: a formula: zeta = e1/(2 w)
        damping = [np.log(max(0.5 * b / np.sqrt(c), LEAST_DAMPING)) for b, c in ((e1, e0), (f1, f0))]
        lower = np.log(f0 / e0)
        return np.concatenate([[-x[0] - lower, x[1], damping[0], np.log(e0), damping[1], lower], x[base:]])

    def back(Y: Matrix) -> Matrix:
        X = Y.copy()
        e0, f0 = np.exp(Y[:, 3]), np.exp(Y[:, 3] + Y[:, 5])  # no decision: a formula: the places of ln e0 and ln(f0/e0)
        X[:, 0] = -Y[:, 0] - Y[:, 5]  # no decision: a formula: the same
        e1, f1 = 2.0 * np.exp(Y[:, 2]) * np.sqrt(e0), 2.0 * np.exp(Y[:, 4]) * np.sqrt(f0)  # no decision: a formula: 2 zeta w
        X[:, 2:base] = np.column_stack([e1, e0, f1, f0]) / units[1:]
        return X

    return coordinates, back
