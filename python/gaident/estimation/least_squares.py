"""Fits of one hypothesis: least squares from a start, noise re-estimated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.noise_model import WHITE, NoiseFilter
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.projection import WORST
from gaident.policy.table import POLICY

__all__ = ["fit", "negligible", "reestimated", "scored"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

DAMPINGS = 10.0 ** np.arange(-3.0, 5.0)  # no decision: of a solver; times the damping of the step before
NEGLIGIBLE_FALL = 0.02  # no decision: of the noise variance: a fall of the cost by less changes no decision


def fit(objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, iterations: int) -> Fit:
    """Least squares by Levenberg and Marquardt from x, eight dampings side by side, bounds by projection."""
    key = "fit", hypothesis, x.tobytes(), noise.key, iterations
    return objective.once(key, lambda: _fit(objective, hypothesis, x, noise, iterations))


def _fit(objective: Objective, hypothesis: Hypothesis, x: Vector, noise: NoiseFilter, iterations: int) -> Fit:
    limits, steps = hypothesis.parameters.limits(), hypothesis.parameters.steps()
    x = np.clip(x, *limits)
    damping, converged = 1e-2, False  # no decision: a start
    v, J = objective.linearised(hypothesis, x, noise, objective.known_error(hypothesis, x))
    cost = min(float(v @ v), WORST) if np.all(np.isfinite(v)) else WORST
    last: Vector | None = None  # the raw error at x
    moved = False  # since the model was linearised
    for _ in range(iterations):
        if cost >= WORST:
            break
        if moved:
            v, J = objective.linearised(hypothesis, x, noise, last)
            moved = False
        A, g = J @ J.T, J @ v
        diagonal = A.diagonal().copy()
        usable = (diagonal > 0.0) & (steps > 0.0) & (diagonal < WORST)
        # At a bound with the descent pointing outward: not moved in this step.
        usable &= ~(((x <= limits[0]) & (g > 0.0)) | ((x >= limits[1]) & (g < 0.0)))
        if not usable.any():
            break
        index = np.flatnonzero(usable)
        sub, gradient, scale = A[index][:, index], g[index], diagonal[index]
        factors = damping * DAMPINGS
        X = np.repeat(x[None, :], len(factors), axis=0)
        moves = damped_steps(sub, gradient, factors[:, None] * scale + 1e-18 * scale.max())
        X[:, index] -= moves
        np.minimum(np.maximum(X, limits[0], out=X), limits[1], out=X)
        costs, errors = objective.costs_and_errors(hypothesis, X, noise)
        best = int(np.argmin(costs))
        if not costs[best] < cost:
            # Nothing is gained by smaller steps, nor where the linear model promises nothing of the largest one.
            if damping > 1e5 or negligible(objective, float(gradient @ moves[0]), cost):  # no decision: a grid
                converged = True
                break
            damping *= 1e5
            continue
        fall = cost - float(costs[best])
        x, cost, last, moved = X[best], float(costs[best]), errors[best], True
        damping = min(max(damping * 10.0 ** (best - 3.0), 1e-9), 1e9)  # no decision: the grid of a solver
        if negligible(objective, fall, cost):
            converged = True
            break
    if last is not None:
        objective.remember_error(hypothesis, x, last)
    return objective.fitted(hypothesis, x, noise, cost, converged)


def negligible(objective: Objective, fall: float, cost: float) -> bool:
    """Whether a fall of the cost changes no decision."""
    return fall < NEGLIGIBLE_FALL * cost / max(objective.count, 1.0)


def damped_steps(A: Matrix, g: Vector, damping: Matrix) -> Matrix:
    """(A + diag(d))^-1 g for each row d of damping; 0 where there is none."""
    M = np.repeat(A[None, :, :], len(damping), axis=0)
    M[:, range(len(g)), range(len(g))] += damping
    try:
        return np.asarray(np.linalg.solve(M, np.repeat(g[None, :, None], len(M), axis=0))[:, :, 0])
    except np.linalg.LinAlgError:
        return np.array([_solved(m, g) for m in M])


def _solved(M: Matrix, g: Vector) -> Vector:
    try:
        return np.asarray(np.linalg.solve(M, g))
    except np.linalg.LinAlgError:
        return np.zeros_like(g)


def scored(objective: Objective, found: Fit) -> Fit:
    """The same x under the filter of what it leaves."""
    if found.cost >= WORST:
        return found
    return objective.once(("scored", found.key), lambda: _scored(objective, found))


def _scored(objective: Objective, found: Fit) -> Fit:
    noise = objective.own_noise(found)
    return objective.fitted(found.hypothesis, found.x, noise, objective.cost_under(found, noise), found.converged)


def reestimated(objective: Objective, found: Fit, iterations: int = POLICY.short) -> Fit:
    """The fit under the filter of what it leaves itself (two rounds of generalised least squares)."""
    if found.cost >= WORST:
        return found
    return objective.once(("reestimated", found.key, iterations), lambda: _reestimated(objective, found, iterations))


def _reestimated(objective: Objective, found: Fit, iterations: int) -> Fit:
    best = found
    for n in (iterations, max(iterations // 2, 2)):
        noise = objective.own_noise(found)
        found = fit(objective, found.hypothesis, found.x, noise, n)
        if found.bic < best.bic:
            best = found
        if found.converged and found.noise.key == noise.key == WHITE.key:
            break
    return best
