"""The moves of harmonics of the angle: one wave more or less of an effect, and one wave, or all of them, as those of another.

Torque, ripple and inertia of one order are alike at each speed: one of them explains the most of another one.
So a search may have found some waves of an effect as another's, and what is right for one wave need not be for the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.kinds import of_waves
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.diagnosis.selection.screening.score_test import ScoreTest, Screened
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.term import Term

__all__ = ["WaveMoves", "causes"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


def causes(fit: Fit) -> int:
    """How many things a model has: its effects, of one with several waves each of these."""
    return sum(t.waves for t in fit.parameters.terms)


def _with_waves(hypothesis: Hypothesis, x: Vector, term: Term, rows: Matrix) -> tuple[Hypothesis, Vector]:
    """A model with these waves of an effect, a row each, in the place of what it has of it; none where there is no row."""
    if term.name in hypothesis.effects:
        x, hypothesis = hypothesis.parameters.removed(x, term.name), hypothesis.without(term.name)
    if not len(rows):
        return hypothesis, x
    one = LIBRARY[term.name]
    return hypothesis.extended(of_waves(one, len(rows))), hypothesis.parameters.inserted(x, rows.ravel())


@dataclass(frozen=True, eq=False)
class WaveMoves(ModelSpace):
    """The models over one objective, and the moves of their harmonics."""

    def with_more_waves(self, test: ScoreTest, now: Fit) -> None:
        """Screens another wave of each effect of a model that may have one."""
        for term in now.parameters.terms:
            if term.waves < term.most_waves:
                short, x = now.hypothesis.without(term.name), now.parameters.removed(now.x, term.name)
                test.more_waves(now, short, x, of_waves(LIBRARY[term.name], term.waves + 1))

    def apart(self, ranking: Sequence[Screened]) -> tuple[list[Screened], list[Screened]]:
        """(other candidates, another wave of an effect that promises something): they take no other's place."""
        single, more = [s for s in ranking if s.term.waves == 1], [s for s in ranking if s.term.waves > 1]
        return single, [s for s in more if s.fall > 0.0][: self.policy.screened]

    def fewer_waves(self, fit: Fit) -> list[Fit]:
        """Without each of the waves of effects that have several."""
        found = []
        for term in (t for t in fit.parameters.terms if t.waves > 1):
            rows = fit.x[fit.parameters.slot(term.name)].reshape(term.waves, -1)
            for k in range(term.waves):
                hypothesis, x = _with_waves(fit.hypothesis, fit.x, term, np.delete(rows, k, axis=0))
                found.append(self.continued(hypothesis, fit, x))
        return found

    def other_wave(self, fit: Fit) -> list[Fit]:
        """Each harmonic of the angle as another one of the same orders, where more than noise is left."""
        if self.quiet(fit):
            return []
        return [f for t in fit.parameters.terms for f in (*self.as_other_wave(fit, t), *self.one_wave_moved(fit, t))]

    def as_other_wave(self, fit: Fit, term: Term) -> list[Fit]:
        """The model with another harmonic of the same orders in the place of one; empty for what is no harmonic."""
        if not term.chooses_order or term.levels:
            return []
        short, x = fit.hypothesis.without(term.name), fit.parameters.removed(fit.x, term.name)
        orders = term.orders_in(fit.x[fit.parameters.slot(term.name)])
        found = []
        for other in self._other_harmonics(short, fit.effects):
            if other.most_waves < term.waves or orders.min() < other.orders[0]:
                continue
            longer, start = _with_waves(short, x, other, _of_orders(other, orders))
            found.append(self.refitted(longer, start))
        return found

    def one_wave_moved(self, fit: Fit, term: Term) -> list[Fit]:
        """The model with one wave of an effect as one more of another one that it has; of several waves also as a new effect."""
        if not term.chooses_order or term.levels:
            return []
        rows = fit.x[fit.parameters.slot(term.name)].reshape(term.waves, -1)
        there = [t for t in fit.parameters.terms if t.chooses_order and not t.levels and t.name != term.name]
        found = []
        for k, order in enumerate(term.orders_in(rows.ravel())):
            hypothesis, x = _with_waves(fit.hypothesis, fit.x, term, np.delete(rows, k, axis=0))
            for other in there:
                own = x[hypothesis.parameters.slot(other.name)].reshape(other.waves, -1)
                if other.waves == other.most_waves or order in other.orders_in(own.ravel()) or order < other.orders[0]:
                    continue
                longer, start = _with_waves(hypothesis, x, other, np.vstack([own, _of_orders(other, np.array([order]))]))
                found.append(self.refitted(longer, start))
            for other in self._other_harmonics(hypothesis, fit.effects) if term.waves > 1 else ():
                if order >= other.orders[0]:
                    longer, start = _with_waves(hypothesis, x, other, _of_orders(other, np.array([order])))
                    found.append(self.refitted(longer, start))
        return found

    def _other_harmonics(self, short: Hypothesis, taken: Sequence[str]) -> list[Term]:
        """Harmonics that a model may have, none of those that are `taken`."""
        blocked = {name for t in short.parameters.terms for name in t.excludes} | {*taken}
        wanted = [o for o in self.allowed if o.chooses_order and not o.levels and o.name not in blocked]
        return [o for o in wanted if o.excludes.isdisjoint(short.effects)]


def _of_orders(term: Term, orders: Vector) -> Matrix:
    """Rows of coordinates of waves of these orders, without a size."""
    rows = np.zeros((len(orders), LIBRARY[term.name].size))
    rows[:, -1] = orders
    return rows
