"""Uncertainty of the identified parameters.

The estimate minimises the plain simulation error e; its covariance to first order, for noise of any colour, is

    cov = (J'J)^-1 J' S J (J'J)^-1,    S = s^2 (F'F)^-1

with J = de/dx, F the whitening filter of the residual and s the standard deviation of F e; S is that of stationary noise, so that
the first samples have their share of it too. For white residuals this is s^2 (J'J)^-1.
J itself is never stored: the core sums its products.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.models.factors import factor_parameters, gain_unit
from gaident.models.model import Model
from gaident.results.estimate import Estimate

__all__ = ["covariance_of_factors", "estimates"]

Matrix = NDArray[np.float64]


def core_layout(model: Model) -> tuple[Matrix, list[int]]:
    """(T, order): T = d(factor_parameters)/d(core parameters).

    The core's parameters are [ln K | e1, e0 of pole pairs | single pole | zeros likewise], complex pairs first, then real
    roots paired from the largest down, the smallest left single.
    """
    n = len(factor_parameters(model)[1])
    T = np.zeros((n, n))
    T[0, 0] = model.gain
    of_core = [0]
    row = column = 1
    for roots in (model.poles, model.zeros):
        reals = [-r.real for r in roots if r.imag == 0.0]
        pairs = sum(r.imag > 0.0 for r in roots)
        for k in range(2 * pairs):
            T[row + len(reals) + k, column] = 1.0
            of_core.append(row + len(reals) + k)
            column += 1
        left = sorted(range(len(reals)), key=lambda i: -abs(reals[i]))
        while len(left) >= 2:
            i, j = left.pop(0), left.pop(0)
            gap = reals[i] - reals[j] or 1e-9 * max(abs(reals[i]), 1e-9)
            T[row + i, column : column + 2] = np.array([reals[i], -1.0]) / gap
            T[row + j, column : column + 2] = np.array([reals[j], -1.0]) / -gap
            of_core += [row + i, row + j]
            column += 2
        if left:
            T[row + left[0], column] = 1.0
            of_core.append(row + left[0])
            column += 1
        row += len(reals) + 2 * pairs
    return T, of_core


def covariance_of_factors(model: Model, plain: Matrix, coloured: Matrix, std: float, at_bound: Sequence[bool]) -> Matrix:
    """Covariance of factor_parameters(model).

    plain, coloured: J'J and J'S J for s = 1, in the core's order of parameters, start states last; std: s. at_bound: per
    parameter of the model, core order.
    Rows and columns of parameters at a bound are nan; directions that the record does not determine have infinite variance.
    """
    count = len(at_bound)
    bound = np.array([*at_bound, *[False] * (len(plain) - count)])
    scale = np.sqrt(np.diag(plain))
    shown = np.flatnonzero(~bound & (scale > 0.0) & np.isfinite(scale))
    cov = np.full((count, count), np.nan)
    free = np.flatnonzero(~bound[:count])
    cov[free, free] = np.inf
    if len(shown):
        size = np.outer(scale[shown], scale[shown])
        block = np.ix_(shown, shown)
        values, vectors = np.linalg.eigh(plain[block] / size)
        known = values > 1e-13 * values[-1]
        inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
        small = std**2 * inverse @ (coloured[block] / size) @ inverse
        lost = np.sum(vectors[:, ~known] ** 2, axis=1) > 1e-6  # no decision: rounding of eigenvectors
        small[lost, :] = small[:, lost] = 0.0
        small[lost, lost] = np.inf
        own = shown < count
        cov[np.ix_(shown[own], shown[own])] = (small / size)[np.ix_(own, own)]
    return _transform(core_layout(model)[0], 0.5 * (cov + cov.T))


def _transform(T: Matrix, cov: Matrix) -> Matrix:
    """T cov T', where nan and inf spread only to what depends on them."""
    usable = np.isfinite(np.diag(cov))
    inner = np.where(usable[:, None] & usable[None, :], cov, 0.0)
    result: Matrix = T @ np.nan_to_num(inner) @ T.T
    for i in np.flatnonzero(~usable):
        touched = np.flatnonzero(T[:, i])
        result[touched, :] = result[:, touched] = np.nan
        result[touched, touched] = cov[i, i]
    return result


def estimates(model: Model, cov: Matrix, at_bound_core: Sequence[bool]) -> dict[str, Estimate]:
    """The parameters as an engineer reads them: roots by real part, imaginary part, frequency and damping ratio.

    "pole_1" is the real root itself [rad/s]; "pole_pair_1_real", "_imaginary", "_frequency" [rad/s] and "_damping" [1] describe
    a conjugate pair, "zero..." likewise.
    """
    names, values, _ = factor_parameters(model)
    bound = [False] * len(names)
    for of, flag in zip(core_layout(model)[1], at_bound_core, strict=True):
        bound[of] = bound[of] or flag
    found: dict[str, Estimate] = {}

    def add(name: str, value: float, gradient: dict[int, float], unit: str, flag: bool, size: float) -> None:
        rows = list(gradient)
        g = np.array([gradient[r] for r in rows])
        block = cov[np.ix_(rows, rows)]
        with np.errstate(invalid="ignore"):
            variance = float(g @ block @ g) if np.all(np.isfinite(block)) else float(np.max(np.diag(block)))
        std = float(np.sqrt(variance)) if variance >= 0.0 else float("nan")
        if flag:
            std = float("nan")
        found[name] = Estimate(value, std, unit, flag, bool(std < abs(size)))

    for i, name in enumerate(names):
        if name == "gain":
            add(name, float(values[i]), {i: 1.0}, gain_unit(model.p), bound[i], float(values[i]))
        elif name.endswith("_e1"):
            stem = name[: -len("_e1")]
            e1, e0 = float(values[i]), float(values[i + 1])
            w, im = np.sqrt(e0), np.sqrt(max(e0 - 0.25 * e1**2, 1e-300))  # no decision: a formula: the roots of a quadratic
            add(f"{stem}_real", -0.5 * e1, {i: -0.5}, "rad/s", bound[i], w)
            of_imaginary = {i: -0.25 * e1 / im, i + 1: 0.5 / im}  # no decision: a formula
            of_damping = {i: 0.5 / w, i + 1: -0.25 * e1 / w**3}  # no decision: a formula
            add(f"{stem}_imaginary", float(im), of_imaginary, "rad/s", bound[i + 1], float(w))
            add(f"{stem}_frequency", float(w), {i + 1: 0.5 / w}, "rad/s", bound[i + 1], float(w))
            add(f"{stem}_damping", float(0.5 * e1 / w), of_damping, "1", bound[i] or bound[i + 1], 1.0)
        elif not name.endswith("_e0"):
            add(name, -float(values[i]), {i: -1.0}, "rad/s", bound[i], float(values[i]))
    return found


def usable_covariance(model: Model, cov: Matrix) -> Matrix | None:
    """The covariance with parameters at a bound taken as known, or None where the record does not determine one.

    As known means: a standard deviation of 1e-9 of their size, since a covariance of mechanics cannot use an exact 0.
    """
    variance = np.diag(cov)
    bound = np.isnan(variance)
    if np.any(np.isinf(variance)):
        return None
    _, values, _ = factor_parameters(model)
    fixed = np.where(bound[:, None] | bound[None, :], 0.0, cov)
    scale = np.maximum(np.abs(values), 1e-9 * max(1.0, float(np.max(np.abs(values[1:]), initial=0.0))))
    fixed[bound, bound] = (1e-9 * scale[bound]) ** 2
    if not np.all(np.isfinite(fixed)) or np.any(np.diag(fixed) <= 0.0):
        return None
    size = np.sqrt(np.diag(fixed))
    correlation = fixed / np.outer(size, size)
    # no decision: a formula: a symmetric part
    return fixed if np.linalg.eigvalsh(0.5 * (correlation + correlation.T))[0] > -1e-9 else None
