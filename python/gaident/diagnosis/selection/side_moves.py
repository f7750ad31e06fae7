"""The moves between the ends of an elastic shaft: a shaft effect of two masses at the other one, or at both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaident.diagnosis.library.kinds import of_waves
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.mechanisms import moved_to, resonance, shafts
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.diagnosis.selection.screening.score_test import Screened
from gaident.estimation import least_squares as ls
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.projection import WORST
from gaident.estimation.term import Term

__all__ = ["SideMoves", "better_sides"]


def better_sides(ranking: Sequence[Screened]) -> list[Screened]:
    """Of an effect at both ends of the shaft the one that promises more; ranking: the most promising first."""
    names = [s.term.name for s in ranking]
    return [s for i, s in enumerate(ranking) if s.term.other_side not in names[:i]]


@dataclass(frozen=True, eq=False)
class SideMoves(ModelSpace):
    """The models over one objective, and the moves between the ends of the shaft."""

    def may(self, term: Term) -> bool:
        """Whether a model may have it: at the load what it may have at the motor."""
        return term in self.allowed or (term.at_load and LIBRARY[term.other_side] in self.allowed)

    def other_side(self, fit: Fit) -> list[Fit]:
        """Each shaft effect of two masses at the other end of the shaft; not where little is left for that to explain."""
        if fit.parameters.masses == 1 or self.quiet(fit):
            return []
        found = (self.at_other_side(fit, t) for t in fit.parameters.terms)
        return [f for f in found if f is not None]

    def at_other_side(self, fit: Fit, term: Term) -> Fit | None:
        """The model refitted with an effect at the other end of the shaft, from its values; None where it cannot be there."""
        short, x = fit.hypothesis.without(term.name), fit.parameters.removed(fit.x, term.name)
        other = self._beside(short, term)
        if other is None:
            return None
        return self.refitted(short.extended(other), short.parameters.inserted(x, fit.x[fit.parameters.slot(term.name)]))

    def at_the_load(self, now: Fit, fits: Sequence[Fit]) -> list[Fit]:
        """The most promising of some grown models with what they have more at the other end; and dry friction at both ends.

        now: what they are grown from. None where the best of them leaves little.
        """
        best = sorted((f for f in fits if f.cost < WORST), key=self.score)
        if now.parameters.masses == 1 or not best or self.quiet(best[0]):
            return []
        last = [f for f in best if f.parameters.masses == 2 and f.effects and f.parameters.terms[-1].other_side]
        found = [self.at_other_side(f, f.parameters.terms[-1]) for f in last[: self.policy.starts]]
        rests = [t for t in now.parameters.terms if t.levels]
        simplest = next((t for t in self.allowed if t.simplest and t.levels), None)
        if len(rests) == 1 and not rests[0].at_load and simplest and (other := self._beside(now.hypothesis, simplest)):
            longer = now.hypothesis.extended(other)
            X = np.array([now.parameters.inserted(now.x, np.array(z)) for z in other.starts(now.parameters.scales)])
            start = X[int(np.argmin(self.objective.costs(longer, X, WHITE)))]
            found.append(self.refitted(longer, start))
        return [f for f in found if f is not None]

    def with_a_load(self, fit: Fit) -> list[Fit]:
        """One mass with effects of its shaft as two masses that have these at the load; not where little is left to explain.

        Friction at the load damps what swings there: a second mass beside friction at the motor may explain nothing, and friction
        at the load has no place without one.
        """
        moved = [t for t in fit.parameters.terms if t.other_side]
        if fit.parameters.kind != "one mass" or not moved or self.quiet(fit):
            return []
        starts = []
        for model in shafts(fit):
            hypothesis, x = moved_to(model, fit)
            for term in moved:
                values = x[hypothesis.parameters.slot(term.name)]
                bare, y = hypothesis.without(term.name), hypothesis.parameters.removed(x, term.name)
                other = self._beside(bare, term)
                if other is None:
                    return []
                hypothesis, x = bare.extended(other), bare.parameters.inserted(y, values)
            starts.append((float(self.objective.costs(hypothesis, x[None, :], WHITE)[0]), hypothesis, x))
        # With the effects at the motor the best shaft is another one, from which a fit does not come to this.
        nearest = sorted(starts, key=lambda start: start[0])[: self.policy.starts]
        short = [ls.fit(self.objective, h, x, WHITE, self.policy.short) for _, h, x in nearest]
        best = min(short, key=lambda f: f.cost)
        shown = resonance(best) < self.policy.seen_band * np.pi / self.data.dt
        return [] if best.cost >= WORST or not shown else [self.refitted(best.hypothesis, best.x, self.policy.long)]

    def screened_at_load(self, now: Fit) -> list[Term]:
        """What is screened at the load, beside what is screened at the motor: the effects of the shaft that generalise no other.

        A log may have nothing of them that one at the motor explains.
        """
        if now.parameters.masses == 1 or not self.swings(now):
            return []
        wanted = [t for t in self.allowed if t.other_side and not t.nested]
        found = [self._beside(now.hypothesis, t) for t in wanted]
        return [t for t in found if t is not None]

    def _beside(self, hypothesis: Hypothesis, term: Term) -> Term | None:
        """The same effect, its waves with it, at the other end of the shaft, where the rest of a model leaves room for it."""
        key, there = term.other_side, hypothesis.parameters.terms
        if not key or hypothesis.parameters.masses == 1 or any(t.name == key or t.resonates for t in there):
            return None
        if (other := LIBRARY[key]).excluded_in(there, self.shown) or not self.may(other):
            return None
        other = of_waves(other, term.waves) if term.waves > 1 else other
        effects = (*hypothesis.effects, key)
        return other if all(t.stands_with(effects) for t in (*there, other)) else None
