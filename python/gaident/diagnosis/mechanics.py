"""The mechanical parameters of the linear part of an extended model, with standard deviations.

One mass: J = 1/|K|, D = a/|K|, and k = c/|K| of a spring to the ground.
Two masses, motor and load on a damped shaft, with the numerator s^2 + f1 s + f0 and

    (s + a)(s^2 + e1 s + e0) = s^3 + (a + e1) s^2 + (e0 + a e1) s + a e0

are six equations for six numbers, which `gaident.models.two_mass` solves. The whole axis has D = a e0/(f0 |K|).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.estimation.objective import Fit, Objective
from gaident.estimation.uncertainty import age_part, controller_part, covariance_of
from gaident.models.two_mass import mechanics_with_shaft_damping
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["MECHANICS", "base_shift", "mechanics_of", "moved", "of_no_axis", "of_the_age", "slopes_of"]

Vector = NDArray[np.float64]

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
    "ground_stiffness": "N m/rad",
    "ground_resonance": "Hz",
}
"""Names and units; inertia and viscous friction are of the whole axis, the last two of a spring between it and the ground."""
WHOLE = 2  # no decision: how many of these every axis has


def mechanics_of(objective: Objective, fit: Fit, more: NDArray[np.float64] | None = None) -> dict[str, Estimate]:
    """Name -> Estimate, fitted together with the effects; deviations to first order; more: added to the covariance of x.

    Of a pair of poles or zeros that does not swing (damping ratio 1 or more), or where an undamped shaft would need a negative
    stiffness, e0 + a e1 <= f0, only inertia and viscous friction of the whole are given.
    """
    parameters = fit.parameters
    base = slice(parameters.base)
    cov, of_controller = covariance_of(objective, fit)[base, base], controller_part(objective, fit)[base, base]
    if more is not None:
        cov = cov + more[base, base]
    found, slopes = _with_slopes(fit)
    known = np.isfinite(np.diag(cov))
    finite = np.where(known[:, None] & known[None, :], cov, 0.0)
    variances, parts = (np.maximum(np.einsum("ij,ik,kj->j", slopes, C, slopes), 0.0) for C in (finite, of_controller))
    lost = np.any((np.abs(slopes) > 0.0) & ~known[:, None], axis=0)
    std = np.where(lost, np.inf, np.sqrt(variances))
    return {
        name: Estimate(float(value), float(s), MECHANICS[name], False, bool(s < abs(value)), float(part))
        for name, value, s, part in zip(MECHANICS, found, std, np.sqrt(parts), strict=False)
        if np.isfinite(value)
    }


def of_the_age(objective: Objective, fit: Fit) -> dict[str, float]:
    """Name -> the part of its standard deviation that the age of the velocity brings in, where the records do not show it."""
    base = slice(fit.parameters.base)
    _, slopes = _with_slopes(fit)
    part = np.sqrt(np.maximum(np.einsum("ij,ik,kj->j", slopes, age_part(objective, fit)[base, base], slopes), 0.0))
    return {name: float(value) for name, value in zip(MECHANICS, part, strict=False)}


def slopes_of(fit: Fit) -> dict[str, Vector]:
    """Name -> its slopes over the base parameters, which come first in x; of what a mechanism of its kind has."""
    found, slopes = _with_slopes(fit)
    return {name: row for name, value, row in zip(MECHANICS, found, slopes.T, strict=False) if np.isfinite(value)}


def _with_slopes(fit: Fit) -> tuple[Vector, NDArray[np.float64]]:
    """(values, [i, k]: slope of value k over base parameter i)."""
    parameters = fit.parameters
    found = _numbers(parameters.base_values(fit.x[None, :])[0])
    h = 1e-6 * np.maximum(np.abs(fit.x[: parameters.base]), 1.0)
    X = np.repeat(fit.x[None, :], len(h), axis=0)
    X[np.arange(len(h)), np.arange(len(h))] += h
    return found, np.array([(_numbers(row) - found) / step for row, step in zip(parameters.base_values(X), h, strict=True)])


def of_no_axis(mechanics: Mapping[str, Estimate]) -> str | None:
    """The first damping below 0 beyond its deviation: a mechanism that drives itself stands for something else; None without."""
    found = ((name, mechanics.get(name)) for name in ("viscous_friction", "resonance_damping", "antiresonance_damping"))
    return next((name for name, e in found if e is not None and e.value < -POLICY.contradiction * e.std), None)


def moved(before: Fit, after: Fit) -> dict[str, tuple[float, float]]:
    """Name -> (before, after) of what both have."""
    pair = [_numbers(fit.parameters.base_values(fit.x[None, :])[0]) for fit in (before, after)]
    return {name: (float(b), float(a)) for name, b, a in zip(MECHANICS, *pair, strict=False) if np.isfinite(b) and np.isfinite(a)}


def base_shift(before: Fit, after: Fit) -> dict[str, tuple[float, float]]:
    """Base parameters and mechanics before (the linear fit) and after (with the effects); none of mechanisms of two kinds."""
    if before.parameters.kind != after.parameters.kind:
        return {}
    if after.parameters.on_a_spring:
        return moved(before, after)
    names = ("gain", "pole", "pole_pair_e1", "pole_pair_e0", "zero_pair_e1", "zero_pair_e0")
    pair = [fit.parameters.base_values(fit.x[None, :])[0] for fit in (before, after)]
    coefficients = {n: (float(b), float(a)) for n, b, a in zip(names, *pair, strict=False)}
    return coefficients | moved(before, after)


def _numbers(values: Vector) -> Vector:
    """In the order of MECHANICS, from [K, a], [K, a, c] or [K, a, e1, e0, f1, f0]; nan where there is none."""
    K, a, *pairs = (float(v) for v in values)
    JM = 1.0 / abs(K)
    if not pairs:
        return np.array([JM, a * JM])
    none = np.full(len(MECHANICS), np.nan)
    if len(pairs) == 1:
        none[:WHOLE] = JM, a * JM
        none[-2:] = pairs[0] * JM, np.sqrt(max(pairs[0], 0.0)) / (2.0 * np.pi)
        return none
    e1, e0, f1, f0 = pairs
    if f0 == 0.0:
        return none
    D = a * e0 * JM / f0
    none[:WHOLE] = abs(e0 * JM / f0), D
    poles, zeros = e1 * e1 - 4.0 * e0, f1 * f1 - 4.0 * f0
    swings = poles < 0.0 and zeros < 0.0
    if not (swings and e0 + a * e1 > f0):
        return none
    mechanics = mechanics_with_shaft_damping(np.array([abs(K), a + e1, e0 + a * e1, a * e0, f1, f0]))
    if mechanics is None or not mechanics[2] > 0.0:
        return none
    _, _, JL, _, KG, _ = mechanics
    wp, wz, turn = np.sqrt(e0), np.sqrt(f0), 2.0 * np.pi
    none[:-2] = JM + JL, D, JM, JL, KG, wp / turn, 0.5 * e1 / wp, wz / turn, 0.5 * f1 / wz
    return none
