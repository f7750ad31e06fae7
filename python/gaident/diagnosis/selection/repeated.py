"""The same model again: from all starts and globally, with another resonance, under the predictor that shows most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.selection.mechanisms import as_one_mass, is_mechanism, on_a_shaft, resonance
from gaident.diagnosis.selection.side_moves import SideMoves
from gaident.estimation import least_squares as ls
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.projection import WORST
from gaident.estimation.term import Term

__all__ = ["Repeated"]

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Repeated(SideMoves):
    """The models over one objective, and the moves that keep a model and look for other numbers."""

    def search(self, fit: Fit) -> Fit:
        """Where more than noise is left: every effect from all of its starts, multimodal ones by a global search nearby.

        Then under the best predictor: the one that a model grew under was chosen beside other values.
        """
        for term in fit.parameters.terms[::-1]:
            if self.quiet(fit):
                break
            fit = min((fit, self.restarted(fit, term)), key=lambda f: f.bic)
            if term.multimodal and not self.quiet(fit):
                draws = range(self.policy.draws_of_impacts if term.impacts else 1)
                fit = min((fit, *(self.evolved(fit, draw) for draw in draws)), key=lambda f: f.bic)
        return self.with_best_resonance(self.under_best_predictor(fit) if fit.effects else fit)

    def with_best_resonance(self, fit: Fit) -> Fit:
        """The fit or, where these score better, two masses with another resonance.

        A fit at the wrong resonance may leave small errors: its noise filter treats the ringing that it misses as noise.
        There a delay may do better than the lag that is there: each is tried in the place of the other, with its own resonance.
        """
        others = [] if self.quiet(fit) else self.in_other_series(fit.hypothesis, fit.x)
        tries = [fit, *(replace(fit, hypothesis=h, x=x) for h, x in others)]
        return min((fit, *(found for one in tries for found in self.elsewhere(one))), key=self.score)

    def elsewhere(self, fit: Fit) -> list[Fit]:
        """Two masses with the same effects, their resonance searched again: that of the fit was found before the effects.

        An extra resonance or an effect of the shaft is left out: it may replace a resonance at the wrong place.
        """
        bare = self.as_one(fit)
        return [] if bare is None or not bare[0].parameters.terms else self.on_its_shaft(*bare, resonance(fit))

    def as_one(self, fit: Fit) -> tuple[Hypothesis, Vector] | None:
        """Two masses as one with their effects but those of the shaft; None without a shaft, and with effects behind it."""
        bare, x = fit.hypothesis, fit.x
        for t in fit.parameters.terms:
            if t.in_coupling or t.resonates:
                x, bare = bare.parameters.removed(x, t.name), bare.without(t.name)
        if fit.parameters.masses == 1 or any(t.at_load for t in bare.parameters.terms):
            return None
        return as_one_mass(replace(fit, hypothesis=bare, x=x))

    def on_its_shaft(self, bare: Hypothesis, x: Vector, known: float = 0.0) -> list[Fit]:
        """One mass with its effects, refitted, as two masses with the best resonance that is not the known one [rad/s]."""
        one = ls.fit(self.objective, bare, x, WHITE, self.policy.usual)
        starts = on_a_shaft(self.objective, one, known) if one.cost < WORST else []
        short = [ls.fit(self.objective, h, x, WHITE, self.policy.short) for h, x in starts]
        best = min(short, key=lambda f: f.cost, default=None)
        return [] if best is None else [self.refitted(best.hypothesis, best.x, self.policy.long)]

    def behind_a_lag(self, fit: Fit) -> Fit:
        """The fit or, where that scores better, two masses behind a lag; only where it leaves more than noise.

        A shaft that is fitted without the lag has another resonance, which makes up for it, and a fit from there does not return.
        So the lag is fitted to one mass, and the resonance is searched beside it; then what the coupling has comes back.
        """
        lag = next((t for t in self.allowed if t.late), None)  # a filter acts as a lag of the torque does, see `EQUIVALENT`
        if lag is None or self.quiet(fit) or any(t.in_series for t in fit.parameters.terms) or (one := self.as_one(fit)) is None:
            return fit
        bare, x = one
        longer = bare.extended(lag)
        X = np.array([bare.parameters.inserted(x, np.array(row)) for row in lag.starts(fit.parameters.scales)])
        start = X[int(np.argmin(self.objective.costs(longer, X, WHITE)))]
        found = [f for f in self.on_its_shaft(longer, start) if is_mechanism(f.parameters, f.x) and self.swings(f)]
        found += [self.coupled_as(fit, f) for f in found if any(t.in_coupling for t in fit.parameters.terms)]
        return min((fit, *found), key=self.score)

    def coupled_as(self, fit: Fit, bare: Fit) -> Fit:
        """Two masses with the effects that the coupling of another fit has; beside impacts by a global search nearby."""
        hypothesis, x = bare.hypothesis, bare.x
        for t in [t for t in fit.parameters.terms if t.in_coupling]:
            x = hypothesis.parameters.inserted(x, fit.x[fit.parameters.slot(t.name)])
            hypothesis = hypothesis.extended(t)
        found = self.refitted(hypothesis, x)
        return self.evolved(found) if found.impacts else found

    def restarted(self, fit: Fit, term: Term) -> Fit:
        """The best fit from an effect's starts beside the present rest: its first fit began beside other values of the rest."""
        rows = term.starts(fit.parameters.scales)
        if not rows:
            return fit
        limits = np.array(term.limits(fit.parameters.scales)).T
        X = np.repeat(fit.x[None, :], len(rows), axis=0)
        X[:, fit.parameters.slot(term.name)] = np.clip(np.array(rows), *limits)
        order = np.argsort(self.objective.costs(fit.hypothesis, X, fit.noise))[: self.policy.starts]
        tries = [ls.scored(self.objective, ls.fit(self.objective, fit.hypothesis, X[i], WHITE, self.policy.usual)) for i in order]
        best = min(tries, key=lambda f: f.bic)
        return self.refitted(best.hypothesis, best.x)

    def instead(self, fit: Fit, term: Term) -> list[Fit]:
        """Each other effect with impacts in the place of one, from its best start beside this mechanism, searched globally."""
        short, x = fit.hypothesis.without(term.name), fit.parameters.removed(fit.x, term.name)
        found = []
        for other in (t for t in self.allowed if t.impacts and t.name not in fit.effects):
            longer, rows = short.extended(other), other.starts(fit.parameters.scales)
            if not rows:
                continue
            X = np.array([short.parameters.inserted(x, np.array(row)) for row in rows])
            start = X[int(np.argmin(self.objective.costs(longer, X, WHITE)))]
            found.append(self.evolved(ls.scored(self.objective, ls.fit(self.objective, longer, start, WHITE, self.policy.short))))
        return [f for f in found if f.cost < WORST and is_mechanism(f.parameters, f.x)]

    def in_its_place(self, fit: Fit, term: Term, other: Fit, reach: float) -> Fit:
        """A model with another effect in the place of one, fitted as closely as a fit with impacts is.

        Its own fit began beside the values that the rest has without that effect, where other impacts make the least errors.
        So it is fitted beside the values of the rest too, and searched globally where it comes within `reach` of the fit.
        """
        (name,) = set(other.effects) - set(fit.effects)
        short, x = fit.hypothesis.without(term.name), fit.parameters.removed(fit.x, term.name)
        if other.parameters.kind == fit.parameters.kind and set(other.effects) - {name} == set(short.effects):
            longer = short.extended(other.parameters.term(name)).driven_by(other.predictor)
            start = short.parameters.inserted(x, other.x[other.parameters.slot(name)])
            beside = self.refitted(longer, start, self.policy.long)
            if beside.cost < WORST and is_mechanism(beside.parameters, beside.x) and self.swings(beside):
                other = min((other, beside), key=self.score)
        return self.deepened(other) if self.score(other) < self.score(fit) + reach else other

    def in_other_series(self, hypothesis: Hypothesis, x: Vector) -> list[tuple[Hypothesis, Vector]]:
        """A model with another delay, lag or filter in the place of each one that it has, at the same number."""
        found = []
        for term in (t for t in hypothesis.parameters.terms if t.in_series):
            short, rest = hypothesis.without(term.name), hypothesis.parameters.removed(x, term.name)
            z = x[hypothesis.parameters.slot(term.name)]
            for other in self.allowed:
                if other.in_series and other.size == term.size and other.name not in hypothesis.effects:
                    found.append((short.extended(other), short.parameters.inserted(rest, z)))
        return found

    def searched_alike(self, now: Fit, fits: Sequence[Fit]) -> list[Fit]:
        """Models that a model grew to: all with impacts are searched where one of these leads, as local fits tell nothing."""
        if now.impacts or not (lead := min(fits, key=self.score)).impacts or self.quiet(lead):
            return list(fits)
        return [min((f, self.evolved(f)), key=self.score) if f.impacts else f for f in fits]
