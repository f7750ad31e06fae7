"""How large an effect may be that was not found.

Beside the model found, a small effect of size s changes the whitened errors v by s d, d beyond what all other parameters take up:

    s = -d'v/(d'd),   sd^2 = |v|^2/(n d'd),   at most  max(s, 0) + not_there sd,   n independent samples

Of a harmonic it is the largest over its orders, |s| of two components with the deviation of the worse known direction.
Where something is left unexplained no bound is given: what is left may hide the effect, or stand for it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.screening.columns import harmonic_columns, tone_columns
from gaident.estimation.objective import LOST, Fit
from gaident.estimation.projection import orthonormal_rows
from gaident.estimation.term import Term
from gaident.models.effects import row_of
from gaident.policy.table import POLICY
from gaident.results.finding import Bound

__all__ = ["bounds_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def bounds_of(space: Moves, final: Fit, answered: Collection[str]) -> dict[str, Bound]:
    """Effect -> how large it may be; answered: effects on which something else is said."""
    if sum(space.objective.data.lengths) > POLICY.most_samples:
        return {}
    terms = [t for t in space.candidates(final) if t.from_nothing and not t.nested and name_of(t.name) not in answered]
    J, error = space.objective.sensitivities(final.hypothesis, final.x)
    basis = orthonormal_rows(space.objective.whitened(J, final.noise))
    rest = _beyond(basis, space.objective.whitened(error[None, :], final.noise))[0]
    deviation = float(np.sqrt(rest @ rest / space.objective.information))
    found: dict[str, float] = {}
    for term in terms:
        sizes = _of_waves if term.harmonic or term.in_time else _of_starts
        most = max(sizes(space, final, term, error, basis, rest, deviation), default=np.inf)
        if np.isfinite(most):  # at either end of the shaft the larger one
            found[name_of(term.name)] = max(most, found.get(name_of(term.name), 0.0))
    return {name: Bound(row_of(name).parameters[0].name, most, row_of(name).parameters[0].unit) for name, most in found.items()}


def _beyond(basis: Matrix, V: Matrix) -> Matrix:
    """What an orthonormal basis cannot take up."""
    return np.asarray(V - (V @ basis.T) @ basis)


def _of_waves(
    space: Moves, final: Fit, term: Term, error: Vector, basis: Matrix, rest: Vector, deviation: float
) -> Iterator[float]:
    """The largest amplitude of each order or frequency."""
    of_term = harmonic_columns if term.harmonic else tone_columns
    _, columns = of_term(space.objective, final.hypothesis, final.x, term, error)
    if len(columns) == 0:
        return
    D = _beyond(basis, space.objective.whitened(columns, final.noise))
    for pair in D.reshape(-1, 2, D.shape[1]):
        values, directions = np.linalg.eigh(pair @ pair.T)
        if values[0] > 0.0:
            size = (directions.T @ (pair @ rest)) / values
            yield float(np.linalg.norm(size)) + POLICY.not_there * deviation / float(np.sqrt(values[0]))


def _of_starts(
    space: Moves, final: Fit, term: Term, error: Vector, basis: Matrix, rest: Vector, deviation: float
) -> Iterator[float]:
    """The bound by the change between no effect and the start nearest to it."""
    parameters = final.parameters
    rows = np.array(term.starts(parameters.scales))
    if rows.size == 0:
        return
    longer = final.hypothesis.extended(term)
    errors = space.objective.errors(longer, np.vstack([parameters.inserted(final.x, z) for z in rows]))
    known = np.all(np.abs(errors) < LOST, axis=1) & np.all(np.isfinite(errors), axis=1)
    D = _beyond(basis, space.objective.whitened(errors[known] - error, final.noise))
    squares = np.einsum("ij,ij->i", D, D)
    if not np.any(squares > 0.0):
        return
    natural, squares, D = np.abs(term.natural(rows[known])[:, 0])[squares > 0.0], squares[squares > 0.0], D[squares > 0.0]
    steps = np.maximum(-(D @ rest) / squares, 0.0) + POLICY.not_there * deviation / np.sqrt(squares)
    yield float((steps * natural)[np.argmin(np.abs(np.log(steps)))])
