"""Sparse localisation with a sample-split F test.

On one half of the record (blocks of time in turn):

    1. where in the state space the linear model's residual is not zero: cells of velocity, torque, angle and time whose mean or
       whose power stands out;
    2. every candidate effect is fitted to a quarter of the record and judged on another one, in those cells; of candidates that
       are within a standard error of the best one, the one with the fewest columns is taken.

On the other half, which none of this has seen, the best candidate is tested by an exact F test against the model without it.
Rows are as far apart as the low pass makes them independent.
An accepted effect joins the model, and the next one is looked for.
"""

from __future__ import annotations

import numpy as np
from case import Answer, Case
from library import Candidate, Library
from names import library_of, with_parameters
from numpy.typing import NDArray
from scipy.stats import f as fisher

LEVELS = (1e-3, 1e-6, 1e-12, 1e-20, 1e-30, 1e-50, 1e-80, 1e-120, 1e-170, 1e-250)
"""Thresholds: the p-value below which an effect is accepted."""
BLOCKS, BINS, OUT = 24, 8, 3.5
"""Blocks of time; bins of each coordinate; deviations by which a cell stands out."""
MOST = 3

Rows = NDArray[np.bool_]


def localised(case: Case, kind: str) -> dict[float, Answer]:
    """The answer at each level; kind: of the derivatives."""
    library = library_of(case, kind)
    stride = max(1, round(0.5 / (library.m.cutoff * library.m.dt)))
    at = np.arange(0, len(library.u), stride)
    block = at * BLOCKS // len(library.u)
    quarter = block % 4
    taken: list[Candidate] = []
    steps: list[tuple[float, str]] = []
    while len(steps) < MOST:
        known = np.column_stack([library.base, *(x for c in taken for x in c.atoms.values())])[at]
        u = library.u[at]
        regime = _regime(library, at, _residual(known, u, quarter < 2), quarter < 2)
        judged = (quarter == 1) & regime
        judged = judged if judged.sum() > 3 * known.shape[1] else quarter == 1
        rest = [c for c in library.candidates if c not in taken]
        X = [np.column_stack([known, library.matrix(c.atoms)[at]]) for c in rest]
        best = rest[_simplest(np.array([_residual(x, u, quarter == 0)[judged] ** 2 for x in X]), [len(c.atoms) for c in rest])]
        p = _p_value(known, library.matrix(best.atoms)[at], u, quarter >= 2)
        if not p < LEVELS[0]:
            break
        steps.append((p, best.effect))
        taken.append(best)
    found = {}
    for level in LEVELS:
        count = next((i for i, (p, _) in enumerate(steps) if p >= level), len(steps))
        found[level] = Answer(with_parameters(case, library, [effect for _, effect in steps[:count]]))
    return found


def _simplest(squares: NDArray[np.float64], columns: list[int]) -> int:
    """Of candidates that come as close as the best one within a standard error, one with the fewest columns."""
    sums = squares.sum(axis=1)
    more = squares - squares[int(np.argmin(sums))]
    near = more.mean(axis=1) <= more.std(axis=1) / np.sqrt(squares.shape[1])
    return min(np.flatnonzero(near), key=lambda i: (columns[i], sums[i]))


def _residual(X: NDArray[np.float64], u: NDArray[np.float64], rows: Rows) -> NDArray[np.float64]:
    """Of all rows, fitted to some."""
    return u - X @ np.linalg.lstsq(X[rows], u[rows], rcond=None)[0]


def _regime(library: Library, at: NDArray[np.intp], left: NDArray[np.float64], rows: Rows) -> Rows:
    """The rows in cells whose mean residual, or its power, stands out."""
    m, of = library.m, library.rows[at]
    chosen = np.zeros(len(at), dtype=bool)
    scale = 1.4826 * float(np.median(np.abs(left[rows]))) + 1e-300
    for x in (m.w[of], m.u[of], np.mod(m.theta[of], 2.0 * np.pi), of.astype(np.float64)):
        edges = np.quantile(x, np.linspace(0, 1, BINS + 1)[1:-1])
        cell = np.digitize(x, edges)
        for i in range(BINS):
            inside = (cell == i) & rows
            n = int(inside.sum())
            if n < 5:
                continue
            z = left[inside] / scale
            stands = abs(z.mean()) * np.sqrt(n) > OUT or (np.mean(z**2) - 1.0) * np.sqrt(0.5 * n) > OUT
            chosen |= (cell == i) & bool(stands)
    return chosen


def _p_value(known: NDArray[np.float64], more: NDArray[np.float64], u: NDArray[np.float64], rows: Rows) -> float:
    """Of the F test of the columns `more` beside the known ones, on these rows."""

    def left(X: NDArray[np.float64]) -> tuple[float, int]:
        _, _, rank, _ = np.linalg.lstsq(X[rows], u[rows], rcond=1e-10)
        return float(np.sum(_residual(X[rows], u[rows], np.ones(int(rows.sum()), dtype=bool)) ** 2)), int(rank)

    before, less = left(known)
    after, whole = left(np.column_stack([known, more]))
    freedom = int(rows.sum()) - whole
    if whole <= less or freedom < 5:
        return 1.0
    return float(fisher.sf((before - after) / (whole - less) / (after / freedom), whole - less, freedom))
