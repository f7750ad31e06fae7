"""Which values of the mechanism the remaining error can have biased.

With whitened errors v, slopes J of the parameters and C of the free functions of the signal that drives what is left, the
parameters beside these functions are those of

    min |v - J'd - C'c|^2 over d, c

so that a value s'x of the mechanism moves by s'd.
It can be biased where |s'd| is more than its standard deviation.
It can also be biased where the free functions alone explain what the value explains: then no d is determined along s.
A ripple of the position, for example, does not bias an inertia.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.mechanics import slopes_of
from gaident.diagnosis.selection.dependence import Dependence, families
from gaident.estimation.objective import Fit, Objective
from gaident.results.estimate import Estimate
from gaident.results.fitness import Fitness
from gaident.results.relevance import Relevance

__all__ = ["relevance_of"]

SINGULAR_RANK = 1e-6  # no decision: of the largest singular value: less is rounding

Matrix = NDArray[np.float64]


def _bent_by(
    driver: str | None, left: Dependence, objective: Objective, fit: Fit, mechanics: Mapping[str, Estimate]
) -> tuple[str, ...]:
    """The names of what a free function of a signal that counts can have moved beyond its deviation; () where nothing is left.

    Where no single signal explains what is left, nothing is known of its form: all of them.
    """
    if driver is None:
        return ()
    counted = [d for d, gain in left.gains.items() if gain > left.needed]
    if not counted:
        return tuple(mechanics)
    spans = families(objective, fit)
    bent = {name for d in counted for name in _bent_beside(spans[d], objective, fit, mechanics)}
    return tuple(name for name in mechanics if name in bent)


def _bent_beside(C: Matrix, objective: Objective, fit: Fit, mechanics: Mapping[str, Estimate]) -> set[str]:
    """Those that the free functions C of one signal move."""
    error, J = objective.linearised(fit.hypothesis, fit.x, fit.noise)
    sizes = np.sqrt(np.einsum("ij,ij->i", J, J))
    moved = (fit.parameters.steps() > 0.0) & (sizes > 0.0) & np.isfinite(sizes)
    if not np.all(np.isfinite(C)):
        return set(mechanics)
    C = _orthonormal(objective.whitened(C, fit.noise))
    rows = J[moved] / sizes[moved][:, None]
    rows, rest = rows - (rows @ C.T) @ C, error - (error @ C.T) @ C
    U, values, Vt = np.linalg.svd(rows, full_matrices=False)
    known = values > SINGULAR_RANK
    step = np.zeros(len(fit.x))
    step[moved] = -(U[:, known] @ ((Vt[known] @ rest) / values[known])) / sizes[moved]
    base = fit.parameters.base
    of_base = np.flatnonzero(moved[:base])
    found = set()
    for name, slope in slopes_of(fit).items():
        if name not in mechanics:
            continue
        scaled = slope[of_base] / sizes[of_base]
        lost = np.abs(scaled @ U[: len(of_base), ~known]).max(initial=0.0)
        undetermined = float(lost) > SINGULAR_RANK * float(np.abs(scaled).max(initial=0.0))
        if undetermined or abs(float(slope @ step[:base])) > mechanics[name].std:
            found.add(name)
    return found


def relevance_of(
    after: Fitness,
    floor: float,
    driver: str | None,
    left: Dependence,
    objective: Objective,
    fit: Fit,
    mechanics: Mapping[str, Estimate],
) -> Relevance:
    """What is left beyond the noise, and what it bends; floor: what noise leaves of the free run [rad/s]."""
    bent = _bent_by(driver, left, *objective.of_the_motor(fit), mechanics)
    torque = None
    if after.force_error is not None and after.force_floor is not None:
        torque = _beyond(after.force_error, after.force_floor)
    torque_floor = after.force_floor if torque is not None else None
    return Relevance(_beyond(after.rmse, floor), floor, torque, torque_floor, bent=bent, shares=left.shares)


def _beyond(error: float, noise: float) -> float:
    """sqrt(error^2 - noise^2), 0 where the error is below the noise."""
    return math.sqrt(max(error * error - noise * noise, 0.0))


def _orthonormal(rows: Matrix) -> Matrix:
    """Orthonormal rows that span the same."""
    sizes = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    unit: Matrix = rows[sizes > 0.0] / sizes[sizes > 0.0][:, None]
    if not len(unit):
        return unit
    _, values, Vt = np.linalg.svd(unit, full_matrices=False)
    spanned: Matrix = Vt[values > SINGULAR_RANK * values[0]]
    return spanned
