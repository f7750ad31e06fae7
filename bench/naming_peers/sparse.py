"""Sparse regression of the torque over the library, by PySINDy's optimisers: STLSQ, SR3, and STLSQ on resampled rows.

The linear model is projected out first, so that only effects are thresholded.
Columns have an rms of 1 beyond it, and so has what it leaves of the torque: a threshold is a share of that.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from case import Answer, Case
from names import library_of, own_columns, with_parameters
from numpy.typing import NDArray

SHARES = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)
"""Thresholds: of the rms of what the linear model leaves."""
BAGS = 20
MOST_ROWS = 1200
"""Rows of one bag."""
INCLUDED = 0.6
"""Share of the bags in which a column has to stay."""
ALIKE = 0.9
"""Correlation from which columns are nearly the same."""
NOT_INDEPENDENT = 1e-3
"""A column that the linear model explains to this share of its rms is left out."""


def stlsq(threshold: float) -> Any:
    import pysindy

    return pysindy.STLSQ(threshold=threshold, alpha=1e-4)


def sr3(threshold: float) -> Any:
    """Its hard threshold: a coefficient stays above sqrt(2 lambda nu)."""
    import pysindy

    return pysindy.SR3(reg_weight_lam=0.5 * threshold**2, relax_coeff_nu=1.0, regularizer="L0", max_iter=100)


def active(optimiser: Any, X: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which columns stay."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimiser.fit(X, y[:, None])
    return np.asarray(optimiser.coef_[0] != 0.0)


def sparse(case: Case, kind: str, make: Any, bagged: bool = False) -> dict[float, Answer]:
    """The answer at each threshold; kind: of the derivatives; bagged: a column has to stay on most resamplings of the rows."""
    library = library_of(case, kind)
    pooled = {name: x for c in library.candidates for name, x in c.atoms.items()}
    beyond = {name: library.beyond(x) for name, x in pooled.items()}
    power = {name: float(np.sqrt(np.mean(x**2))) for name, x in beyond.items()}
    names = [n for n in pooled if power[n] > NOT_INDEPENDENT * float(np.sqrt(np.mean(pooled[n] ** 2)))]
    y = library.rest / float(np.sqrt(np.mean(library.rest**2)))
    names = _apart({n: beyond[n] / power[n] for n in names}, y)
    X = np.column_stack([beyond[n] / power[n] for n in names])
    bags = []
    if bagged:
        rng = np.random.default_rng(0)
        bags = [_square(X, y, rng.choice(len(y), min(len(y), MOST_ROWS))) for _ in range(BAGS)]
    whole = _square(X, y, np.arange(len(y)))
    found = {}
    for threshold in SHARES:
        stays = active(make(threshold), *whole)
        if bagged:
            stays = np.mean([active(make(threshold), *bag) for bag in bags], axis=0) > INCLUDED
        there = {name for name, s in zip(names, stays, strict=True) if s}
        effects = [c.effect for c in library.candidates if there & set(own_columns(c))]
        found[threshold] = Answer(with_parameters(case, library, effects))
    return found


def _apart(columns: dict[str, NDArray[np.float64]], y: NDArray[np.float64]) -> list[str]:
    """Of columns that are nearly the same, the one that explains the most; a threshold says nothing of the others."""
    kept: list[str] = []
    for name in sorted(columns, key=lambda n: -abs(float(columns[n] @ y))):
        if all(abs(float(columns[name] @ columns[other])) < ALIKE * len(y) for other in kept):
            kept.append(name)
    return kept


def _square(X: NDArray[np.float64], y: NDArray[np.float64], rows: NDArray[np.intp]) -> tuple[Any, Any]:
    """The same least squares with as many rows as columns."""
    Q, R = np.linalg.qr(X[rows])
    scale = 1.0 / np.sqrt(len(rows))
    return R * scale, Q.T @ y[rows] * scale
