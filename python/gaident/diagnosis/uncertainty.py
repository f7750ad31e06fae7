"""Standard deviations of the parameters of an extended model.

Whitened, least squares has the covariance s^2 (J J')^-1 over x; parameters in the table's own units follow to first order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.problem import Fit, Problem
from gaident.identification.covariance import Estimate
from gaident.models.effects import table

__all__ = ["covariance_of", "estimates_of", "mechanics_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def covariance_of(problem: Problem, fit: Fit) -> Matrix:
    """Covariance of x; infinite where the record says nothing, 0 for entries that were not moved."""
    v, J, _ = problem.linearised(fit.layout, fit.x, fit.noise)
    moved = np.flatnonzero(fit.layout.steps() > 0.0)
    sizes = np.sqrt(np.einsum("ij,ij->i", J, J))
    cov = np.zeros((len(fit.x), len(fit.x)))
    seen = [i for i in moved if sizes[i] > 0.0 and np.isfinite(sizes[i])]
    for i in moved:
        cov[i, i] = np.inf
    if seen:
        rows = J[seen] / sizes[seen][:, None]
        dof = max(problem.count - len(moved), 1.0)
        small = float(v @ v) / dof * np.linalg.pinv(rows @ rows.T, rcond=1e-12, hermitian=True)
        cov[np.ix_(seen, seen)] = small / np.outer(sizes[seen], sizes[seen])
    return cov


def estimates_of(problem: Problem, fit: Fit) -> dict[str, dict[str, Estimate]]:
    """Effect -> parameter -> Estimate."""
    cov = covariance_of(problem, fit)
    limits = fit.layout.limits()
    result: dict[str, dict[str, Estimate]] = {}
    for effect in fit.layout.effects:
        slot = fit.layout.slot(effect)
        z, part = fit.x[slot], cov[slot, slot]
        values = CANDIDATES[effect].natural(z[None, :])[0]
        h = 1e-6 * np.maximum(np.abs(z), np.array(CANDIDATES[effect].steps(fit.layout.scales)))
        h[h == 0.0] = 1.0
        moved = CANDIDATES[effect].natural(z + np.diag(h))
        slopes = (moved - values) / h[:, None]
        finite = np.where(np.isfinite(part), part, 0.0)
        variances = np.einsum("ij,ik,kj->j", slopes, finite, slopes)
        lost = np.any((np.abs(slopes) > 0.0) & ~np.isfinite(np.diag(part))[:, None], axis=0)
        span = np.maximum(limits[1, slot] - limits[0, slot], 1e-300)
        near = (z <= limits[0, slot] + 1e-6 * span) | (z >= limits[1, slot] - 1e-6 * span)
        bound = np.any((np.abs(slopes) > 0.0) & near[:, None], axis=0)
        row = next(r for r in table() if r.name == effect)
        result[effect] = {}
        for i, (name, unit) in enumerate((p.name, p.unit) for p in row.parameters):
            std = float("inf") if lost[i] else float(np.sqrt(max(variances[i], 0.0)))
            value = float(values[i])
            known = std < abs(value) if value != 0.0 else np.isfinite(std)
            result[effect][name] = Estimate(value, std, unit, bool(bound[i]), bool(known))
    return result


def mechanics_of(problem: Problem, fit: Fit) -> dict[str, Estimate]:
    """What the linear part of a model is mechanically, fitted together with its effects: name -> Estimate.

    One mass: inertia J = 1/|K|, viscous friction a J. Two: J = e0/(|K| f0), J_M = 1/|K|, J_L = J - J_M, stiffness f0 J_L (exact
    without damping in the shaft), and frequency and damping ratio of both pairs. Of a pair that does not swing (damping ratio
    1 or more), or where a mass or the stiffness would be negative, only inertia and friction are given.
    """
    layout = fit.layout
    cov = covariance_of(problem, fit)[: layout.base, : layout.base]
    x = fit.x[: layout.base]
    h = 1e-6 * np.maximum(np.abs(x), 1.0)
    values = layout.base_values(fit.x[None, :])[0]
    names, found = _mechanical(values)
    moved = np.repeat(fit.x[None, :], len(x), axis=0)
    moved[np.arange(len(x)), np.arange(len(x))] += h
    slopes = np.array(
        [(_mechanical(row, len(names) > 2)[1] - found) / step for row, step in zip(layout.base_values(moved), h, strict=True)]
    )
    known = np.isfinite(np.diag(cov))
    variances = np.einsum("ij,ik,kj->j", slopes, np.where(known[:, None] & known[None, :], cov, 0.0), slopes)
    lost = np.any((np.abs(slopes) > 0.0) & ~known[:, None], axis=0)
    std = np.where(lost, np.inf, np.sqrt(np.maximum(variances, 0.0)))
    return {
        name: Estimate(float(value), float(s), MECHANICS[name], False, bool(s < abs(value)))
        for name, value, s in zip(names, found, std, strict=True)
    }


MECHANICS = {
    "inertia": "kg m^2",
    "viscous_friction": "N m s/rad",
    "motor_inertia": "kg m^2",
    "load_inertia": "kg m^2",
    "stiffness": "N m/rad",
    "resonance": "Hz",
    "resonance_damping": "1",
    "antiresonance": "Hz",
    "antiresonance_damping": "1",
}
"""Names and units of `mechanics_of`."""


def _mechanical(values: Vector, swings: bool | None = None) -> tuple[tuple[str, ...], Vector]:
    """Names and numbers of `mechanics_of` from [K, a] or [K, a, e1, e0, f1, f0]; swings: with the pairs, None: where they are."""
    K, a = abs(values[0]), values[1]
    names = tuple(MECHANICS)
    if len(values) == 2:
        return names[:2], np.array([1.0 / K, a / K])
    e1, e0, f1, f0 = values[2:]
    if e0 <= 0.0 or f0 <= 0.0:
        return names[:2], np.array([1.0 / K, a / K])
    J, JM = e0 / (K * f0), 1.0 / K
    wp, wz = np.sqrt(e0), np.sqrt(f0)
    if swings is None:
        swings = abs(e1) < 2.0 * wp and abs(f1) < 2.0 * wz and J > JM
    if not swings:
        return names[:2], np.array([J, a * J])
    turn = 2.0 * np.pi
    return names, np.array([J, a * J, JM, J - JM, f0 * (J - JM), wp / turn, 0.5 * e1 / wp, wz / turn, 0.5 * f1 / wz])
