"""How large an effect may be that was not found.

Beside the model found, a small effect of size s changes the whitened errors v by s d, d beyond what all other parameters take up:

    s = -d'v/(d'd),   sd^2 = |v|^2/(n d'd),   at most  max(s, 0) + not_there sd,   n independent samples

d is the change that one as large as the bound makes, by a simulation: near rest, dry friction takes a small torque up.
Of a harmonic it is the largest over its orders, |s| of two components with the deviation of the worse known direction.
Where something is left unexplained no bound is given: what is left may hide the effect, or stand for it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.screening.columns import harmonic_columns
from gaident.estimation.objective import LOST, Fit
from gaident.estimation.projection import orthonormal_rows
from gaident.estimation.term import Term
from gaident.models.effects import row_of
from gaident.policy.table import POLICY
from gaident.results.finding import Bound

__all__ = ["bounds_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

ROUNDS = 5  # no decision: of a solver: simulations at the bound, by which it is found
CLOSE = 0.05  # no decision: of a solver: ends that, a twentieth of the bound


@dataclass(frozen=True, eq=False)
class _Known:
    """The model found: its error, what its parameters take up (orthonormal rows), the rest, its deviation."""

    space: Moves
    final: Fit
    error: Vector
    basis: Matrix
    rest: Vector
    deviation: float

    def beyond(self, errors: Matrix) -> Matrix:
        """Whitened, what the parameters of the model cannot take up."""
        V = self.space.objective.whitened(errors, self.final.noise)
        return np.asarray(V - (V @ self.basis.T) @ self.basis)

    def changes(self, term: Term, rows: Matrix) -> Matrix | None:
        """What the effect changes at such coordinates, beyond the parameters; None where a simulation is lost."""
        parameters = self.final.parameters
        X = np.vstack([parameters.inserted(self.final.x, z) for z in rows])
        errors = self.space.objective.errors(self.final.hypothesis.extended(term), X)
        if not np.all(np.abs(errors) < LOST):
            return None
        return self.beyond(errors - self.error)

    def most(self, change: Vector, size: float) -> float:
        """The largest size [of its parameter], by the change that one of `size` makes."""
        square = float(change @ change)
        if not square > 0.0:
            return np.inf
        step = max(-float(change @ self.rest) / square, 0.0) + POLICY.not_there * self.deviation / float(np.sqrt(square))
        return step * size

    def largest(self, pair: Matrix) -> float:
        """The largest amplitude of two components, by the change that each makes per unit."""
        values, directions = np.linalg.eigh(pair @ pair.T)
        if not values[0] > 0.0:
            return np.inf
        found = (directions.T @ (pair @ self.rest)) / values
        return float(np.linalg.norm(found)) + POLICY.not_there * self.deviation / float(np.sqrt(values[0]))


def bounds_of(space: Moves, final: Fit, answered: Collection[str]) -> dict[str, Bound]:
    """Effect -> how large it may be; answered: effects on which something else is said."""
    if sum(space.objective.data.lengths) > POLICY.most_samples:
        return {}
    terms = [t for t in space.candidates(final) if t.from_nothing and not t.nested and name_of(t.name) not in answered]
    J, error = space.objective.sensitivities(final.hypothesis, final.x)
    basis = orthonormal_rows(space.objective.whitened(J, final.noise))
    v = space.objective.whitened(error[None, :], final.noise)[0]
    rest = v - (v @ basis.T) @ basis
    known = _Known(space, final, error, basis, rest, float(np.sqrt(rest @ rest / space.objective.information)))
    found: dict[str, float] = {}
    for term in terms:
        most = max(_of_waves(known, term) if term.harmonic else _of_starts(known, term), default=np.inf)
        if row_of(name_of(term.name)).parameters[0].unit == "N m" and most > final.parameters.scales.torque:
            continue  # larger than every torque of the records: the loop hides it, and such a bound says nothing
        if np.isfinite(most):  # at either end of the shaft the larger one
            found[name_of(term.name)] = max(most, found.get(name_of(term.name), 0.0))
    return {name: Bound(row_of(name).parameters[0].name, most, row_of(name).parameters[0].unit) for name, most in found.items()}


def _of_waves(known: _Known, term: Term) -> Iterator[float]:
    """The largest amplitude of each order: by columns, which are linear, then by simulations of two phases at that size."""
    space, final = known.space, known.final
    orders, columns = harmonic_columns(space.objective, final.hypothesis, final.x, term, known.error)
    if len(columns) == 0:
        return
    pairs = known.beyond(columns).reshape(len(orders), 2, -1)
    sizes = np.array([known.largest(pair) for pair in pairs])
    rows = np.zeros((len(orders), 2, term.size))
    if term.size > 2:  # no decision: coordinates: its order is one of them
        rows[:, :, -1] = orders[:, None]
    for phase in (0, 1):
        rows[:, phase, term.components + phase] = np.where(np.isfinite(sizes), sizes, 0.0)
    changes = known.changes(term, rows.reshape(-1, term.size))
    if changes is None:
        return
    for size, pair in zip(sizes, changes.reshape(len(orders), 2, -1), strict=True):
        if 0.0 < size < np.inf:
            yield known.largest(pair / size)


def _of_starts(known: _Known, term: Term) -> Iterator[float]:
    """The bound by the change between no effect and one as large as the bound, found by simulations of it."""
    parameters = known.final.parameters
    rows = np.array(term.starts(parameters.scales))
    if rows.size == 0 or (D := known.changes(term, rows)) is None:
        return
    sizes = np.abs(term.natural(rows)[:, 0])
    bounds = [known.most(d, size) for d, size in zip(D, sizes, strict=True)]
    reach = np.abs(np.log(np.array(bounds) / sizes))
    at = int(np.argmin(reach))
    size, name = bounds[at], row_of(name_of(term.name)).parameters[0].name
    for _ in range(ROUNDS):
        if not 0.0 < size < np.inf or (one := known.changes(term, term.coordinates({name: size})[None, :])) is None:
            return
        before, size = size, known.most(one[0], size)
        if abs(np.log(size / before)) < CLOSE:
            break
    yield max(size, before)
