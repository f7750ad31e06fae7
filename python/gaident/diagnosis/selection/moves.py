"""The moves of the search.

A model is a mechanism (one mass or two) with effects. The moves are

    add         an effect, or a generalisation in the place of a simpler one of its family     (score test, then fits)
    drop        an effect                                                                      (backward elimination)
    simplify    a generalisation to what it contains
    waves       one wave more or less of a harmonic, or as one of another                      (wave_moves)
    exchange    an effect for one of its equivalence class, where only others tell them apart
    other side  a shaft effect of two masses at the other end of the shaft
    a load      one mass with effects of its shaft as two masses, these at the load
    own         the mechanism's resonance at the place of an extra one
    ground      one mass on a spring to the ground
    demote      two masses to one, with another delay or lag too, or the spring away
    close       the open loop to the closed one
    search      the same model again, from all starts, globally beside stops and impacts, under the best predictor
    alike       all models with impacts that were grown, searched globally where one of them leads
    instead     another effect with impacts in the place of one, searched globally
    in place    another effect in the place of one beside impacts, fitted as closely
    elsewhere   two masses with the same effects, with another resonance

Whether an effect is added is one decision, `ModelSpace.worth`; a search of the same model compares its BIC alone.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.kinds import of_waves
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.mechanisms import (
    as_one_mass,
    as_two_masses,
    balanced_on_a_spring,
    is_mechanism,
    moved_to,
    put_on_a_spring,
    released,
)
from gaident.diagnosis.selection.model_space import words
from gaident.diagnosis.selection.repeated import Repeated
from gaident.diagnosis.selection.screening.score_test import ScoreTest
from gaident.diagnosis.selection.side_moves import better_sides
from gaident.diagnosis.selection.wave_moves import WaveMoves, causes
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import gained
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import WORST, orthonormal_rows
from gaident.estimation.term import Term
from gaident.models.effect_rows import SHAFT

__all__ = ["MISSED", "Moves"]

MISSED = 0.05  # no decision: of the largest torque, a level of friction to start from where the fitted one is lower
LEAST = 1e-4  # no decision: the same, of a level that was fitted as 0


def _nested(hypothesis: Hypothesis, x: NDArray[np.float64], term: Term, simple: Term) -> tuple[Hypothesis, NDArray[np.float64]]:
    """A hypothesis with a simpler effect in the place of one that contains it, at its level."""
    level = x[hypothesis.parameters.slot(term.name)][list(term.shared.get(simple.name, (0,)))]
    shorter = hypothesis.without(term.name)
    return shorter.extended(simple), shorter.parameters.inserted(hypothesis.parameters.removed(x, term.name), level)


@dataclass(frozen=True, eq=False)
class Moves(Repeated, WaveMoves):
    """The models over one objective, and the moves between them."""

    # Moves that add.

    def candidates(self, fit: Fit) -> list[Term]:
        """What may be added to a model."""
        there = fit.parameters.terms
        blocked = {name for t in there for name in t.excludes} | set(fit.effects)
        return [
            t
            for t in self.allowed
            if t.name not in blocked
            and not t.excluded_in(there, self.shown)
            and t.stands_with(fit.effects)
            and (fit.parameters.masses == 2 or not t.needs_two_masses)
            and (self.whitens or not t.in_controller or fit.predictor.closed)
        ]

    def add(self, now: Fit) -> list[Fit]:
        """Finished models with one effect more, or a generalisation in a simpler one's place; best first."""
        if len(now.effects) >= self.policy.most_effects:
            return []
        key = "add", now.key, self.allowed
        self.grown.note(self.objective, self._model(now), now)
        return self.objective.once(key, lambda: self._best(now, [*self.ground(now), *self.with_a_load(now), *self.extended(now)]))

    def extended(self, now: Fit) -> list[Fit]:
        """Those of them that have the mechanism of the model, or one that took an effect's place."""
        return self.objective.once(("extended", now.key, self.allowed), lambda: self._add(now))

    def known(self, fit: Fit) -> Fit:
        """A fit of the same model that was grown already, unless it is worse by more than `swap`: what it grows to is known."""
        near = [f for f in self.grown.of(self.objective, self._model(fit)) if f.bic < fit.bic + self.policy.swap]
        return min(near, key=lambda f: f.bic) if near else fit

    def _model(self, fit: Fit) -> Hashable:
        """The same for fits of the same model that grow to the same."""
        return fit.parameters.kind, frozenset((t.name, t.waves) for t in fit.parameters.terms), self.allowed

    def _add(self, now: Fit) -> list[Fit]:
        self.note(f"looking beyond {words(now.effects) or 'the linear model'}")
        test = ScoreTest(self.objective)
        addable = [t for t in self.candidates(now) if not t.nested] + self.screened_at_load(now)
        test.add(now.hypothesis, now.x, addable)
        fits: list[Fit] = []
        families = [t for t in now.parameters.terms if t.family]
        for simple in families:
            self._generalisations(test, now, now, simple)
        if all(t.at_load for t in families):
            for first in [t for t in addable if t.family]:
                # The simplest of a family first: its generalisations are tried at its level.
                start = next((s for s in test.ranked(WHITE) if s.term is first), None)
                if start is not None:
                    fits.append(self.refitted(start.hypothesis, start.starts[0]))
                    self._generalisations(test, now, fits[-1], first)
        self.with_more_waves(test, now)
        if not test.trials:
            return []
        rankings = [test.ranked(WHITE), test.ranked(None)] if self.whitens else [test.ranked(WHITE)]
        if self.whitens and self.quiet(now):
            # Where only noise is left the linearised gains are accurate enough: only effects with a promising one are fitted.
            # Many candidates explain a part of that noise, and the filter of what they leave misses an effect that is there.
            rankings.append(test.ranked(now.noise))
            rankings = [[s for s in ranking if s.hope > self.policy.hope * self.penalty] for ranking in rankings]
            if not any(rankings):
                return self._best(now, fits)
        done = {f.parameters.terms[-1] for f in fits}
        short: dict[Term, Fit] = {}
        for ranking in rankings:
            single, more = self.apart(ranking)
            for s in better_sides([s for s in single if s.term not in done])[: self.policy.screened] + more:
                # Of a resonance the cost has a local minimum at each frequency: it is fitted from all its starts.
                for x in s.starts if s.term.resonates else s.starts[: self.policy.starts_each]:
                    fit = ls.scored(self.objective, ls.fit(self.objective, s.hypothesis, x, s.noise, self.policy.glance))
                    if s.term not in short or fit.bic < short[s.term].bic:
                        short[s.term] = fit
        glanced = self._promising(now, test, short.values()) if self.whitens and self.quiet(now) else short.values()
        ordered = sorted((f for f in glanced if f.cost < WORST), key=lambda f: f.bic)
        best = [f for f in ordered if f.parameters.terms[-1].waves == 1][: self.policy.finished]
        best += [f for f in ordered if f.parameters.terms[-1].waves > 1][:1]
        best = sorted((self.completed(f) for f in best), key=self.score)
        reach = self.policy.beam_reach * self.penalty
        fits += [self.under_best_predictor(f) if self.score(f) < self.score(best[0]) + reach else f for f in best]
        if fits:
            fits = self.searched_alike(now, fits)
            fits += self.as_own_resonance(min(fits, key=self.score))
            fits += self.at_the_load(now, fits)
        return self._best(now, fits)

    def _promising(self, now: Fit, test: ScoreTest, short: Collection[Fit]) -> list[Fit]:
        """Of short fits beside a model that leaves noise those that are fitted to the end.

        Before whitening any effect can fit coloured noise.
        So they are compared with this model, fitted before whitening too, each under the filter of its own errors.
        A short fit may have stopped too early.
        So an effect with a promising linearised gain is fitted to the end too.
        Its gain is taken under the noise of this model, or under that of the error that no effect explains.
        """
        plain = ls.scored(self.objective, ls.fit(self.objective, now.hypothesis, now.x, WHITE, self.policy.usual))
        found, others = [f for f in short if f.bic < plain.bic], [f for f in short if not f.bic < plain.bic]
        if not others:
            return found
        rankings = test.ranked(now.noise), test.ranked(None)
        hopeful = {s.term for ranking in rankings for s in ranking if s.hope > self.policy.hope * self.penalty}
        return found + [f for f in others if f.parameters.terms[-1] in hopeful]

    def _best(self, now: Fit, fits: Sequence[Fit]) -> list[Fit]:
        """Those that are mechanisms, best first, in the loop where the one of lowest BIC is: another predictor has other errors.

        A second mass that took the place of an effect has to swing on its shaft; one that does not describes something else.
        """
        fits = [f for f in fits if f.parameters.masses == now.parameters.masses or self.swings(f)]
        found = sorted((f for f in fits if f.cost < WORST and is_mechanism(f.parameters, f.x)), key=self.score)
        if found and (lead := min(found, key=lambda f: f.bic)).predictor.closed:
            count = self.policy.screened
            found = [self.under_predictor_of(f, lead) for f in found[:count]] + found[count:]
            found = sorted(found, key=self.score)
        return found

    def _generalisations(self, test: ScoreTest, now: Fit, source: Fit, simple: Term) -> None:
        """The rest of a family in the place of one of its members, at its level and at one that its own fit may have missed.

        now: the model that candidates extend; source: the fit with the member, which may be the same fit.
        """
        parameters = source.parameters.without(simple.name)
        x = source.parameters.removed(source.x, simple.name)
        rows = [LIBRARY[t.other_side] for t in self.allowed if t.other_side] if simple.at_load else self.allowed
        wanted = [t for t in rows if t.family == simple.family and simple.name in t.nested and t.stands_with(now.effects)]
        level = abs(float(source.x[source.parameters.slot(simple.name)][0]))
        torque = parameters.scales.torque
        turning = [t for t in wanted if t.harmonic]
        if turning:  # the part of the simple effect that changes with the angle is linear, and is added to it
            test.replace(source, simple.name, Hypothesis(parameters, source.predictor), x, turning)
            wanted = [t for t in wanted if not t.harmonic]
        levels = [(friction, x) for friction in {max(level, LEAST * torque), max(level, MISSED * torque)}]
        falling = self._undamped(parameters, x, level)
        for friction, start in levels + falling:
            scales = replace(parameters.scales, friction=friction)
            bare = Hypothesis(replace(parameters, scales=scales), source.predictor)
            if source is now:
                test.replace(source, simple.name, bare, start, wanted)
            else:
                test.add(bare, start, wanted)

    @staticmethod
    def _undamped(parameters: Parameterisation, x: NDArray[np.float64], level: float) -> list[tuple[float, NDArray[np.float64]]]:
        """[(friction at the largest speed, x without damping)] of one mass whose damping is below 0; else [].

        Beside dry friction of one size a friction that falls with the speed is a damping below 0: C + B w, half of C at least.
        """
        model = parameters.linear(x)
        if parameters.kind != "one mass" or not (pole := float(model.poles[0].real)) > 0.0:
            return []
        friction = max(level - pole / model.gain * parameters.scales.speed, 0.5 * level)  # no decision: a start
        base = parameters.base_vector(replace(model, poles=(0.0,)))
        return [(max(friction, LEAST * parameters.scales.torque), np.concatenate([base, x[len(base) :]]))]

    def ground(self, fit: Fit) -> list[Fit]:
        """One mass with its effects, on a spring to the ground; none where the linear test gives a spring too little.

        Its stiffness is that of a linear test, a torque -k theta beside the model and a constant, or of the momentum's balance.
        """
        data = self.data
        if fit.parameters.kind != "one mass" or data.travel > 2.0 * np.pi * self.policy.spring_turns:
            return []
        J, error = self.objective.sensitivities(fit.hypothesis, fit.x)
        response = fit.predictor.torque_response(fit.parameters, fit.x, np.vstack([-data.angle, np.ones(len(data.angle))]))
        best, stiffness = 0.0, 0.0
        for noise in (WHITE, fit.noise):
            rows = self.objective.whitened(np.vstack([J, response[1:], response[:1], error]), noise)
            basis = orthonormal_rows(rows[:-2])
            column, rest = (v - (v @ basis.T) @ basis for v in rows[-2:])
            size, slope = float(column @ column), float(column @ rest)
            if size > 0.0 and 0.0 < slope * slope < np.inf:  # infinite where the fit has diverged
                power = float(rest @ rest)
                fall = gained(power, power - slope * slope / size, self.objective.information)
                if fall > best:
                    best, stiffness = fall, slope / size
        starts = [put_on_a_spring(fit, stiffness, data)] if stiffness > 0.0 and best > self.policy.hope * self.penalty else []
        if not fit.effects and not self.quiet(fit) and (balanced := balanced_on_a_spring(data)) is not None:
            starts.append(moved_to(balanced, fit))
        fits = [self.refitted(h, x, self.policy.long) for h, x in starts]
        return [f for f in fits if f.cost < WORST and is_mechanism(f.parameters, f.x)]

    def as_own_resonance(self, fit: Fit) -> list[Fit]:
        """The two masses with the resonance that was found as their own, alone or with a simple effect beside it.

        What delays the torque or blocks the shaft biases the resonance of two masses so far that a local fit does not return.
        The true one is then found as an extra resonance, which explains more than any other effect.
        Of the effects beside it the few best short fits are fitted to the end: their starts have the resonance already.
        """
        if fit.parameters.masses == 1 or not fit.parameters.terms[-1:] or not fit.parameters.terms[-1].resonates:
            return []
        shorter, y = as_two_masses(fit)
        shorter = shorter.driven_by(OpenLoop(self.data, fit.predictor.own_angle)) if self.whitens else shorter
        tries = [self.refitted(shorter, y, self.policy.long)]
        short: list[Fit] = []
        for t in self.candidates(tries[0]):
            if t.size > 1 or t.place == SHAFT:
                continue
            rows = t.starts(shorter.parameters.scales)
            if not rows:
                continue
            longer = shorter.extended(t)
            if t.multimodal and self.data.fits_in_loop:
                longer = longer.driven_by(self.closed(longer.predictor))
            X = np.array([shorter.parameters.inserted(y, np.array(row)) for row in rows])
            x = X[int(np.argmin(self.objective.costs(longer, X, WHITE)))]
            short.append(ls.scored(self.objective, ls.fit(self.objective, longer, x, WHITE, self.policy.short)))
        best = sorted(short, key=lambda f: f.bic)[: self.policy.starts]
        return tries + [self.refitted(f.hypothesis, f.x, self.policy.long) for f in best]

    # Moves that reduce.

    def drop(self, fit: Fit) -> list[Fit]:
        """Without each of the effects, and without each of the waves of one that has several."""
        return [*(self.without(fit, e) for e in fit.effects), *self.fewer_waves(fit)]

    def without(self, fit: Fit, effect: str) -> Fit:
        """The model refitted without one of its effects; where the cost jumps, after a search of its own.

        Effects that depended on its torque become the simplest effect that they contain.
        """
        hypothesis, x = fit.hypothesis.without(effect), fit.parameters.removed(fit.x, effect)
        for term in [t for t in hypothesis.parameters.terms if not t.stands_with(hypothesis.effects)]:
            hypothesis, x = _nested(hypothesis, x, term, LIBRARY[term.nested[0]])
        less = self.continued(hypothesis, fit, x)
        if self.jumps(less) and self.data.fits_in_loop and not self.quiet(less):
            less = min((less, self.evolved(less)), key=lambda f: f.bic)
        return less

    def simplify(self, fit: Fit) -> list[Fit]:
        """Each generalisation replaced by an effect that it contains, at its level."""
        return [
            self.as_nested(fit, t, LIBRARY[name]) for t in fit.parameters.terms for name in t.nested if self.may(LIBRARY[name])
        ]

    def as_nested(self, fit: Fit, term: Term, simple: Term) -> Fit:
        """The model refitted with a simpler effect in the place of one that contains it, at its level."""
        hypothesis, x = _nested(fit.hypothesis, fit.x, term, simple)
        return self.continued(hypothesis, fit, x)

    def demote(self, fit: Fit) -> list[Fit]:
        """Two masses with effects as one mass with these effects; one mass on a spring without the spring."""
        if fit.parameters.on_a_spring:
            hypothesis, x = released(fit)
            return [self.continued(hypothesis, fit, x, self.policy.long)]
        return self.demoted(fit) if fit.effects else []

    def demoted(self, fit: Fit) -> list[Fit]:
        """Two masses as one mass with the same effects; none where an effect acts on the shaft or is an extra resonance."""
        if fit.parameters.masses == 1 or any(t.needs_two_masses or t.resonates for t in fit.parameters.terms):
            return []
        hypothesis, x = as_one_mass(fit)
        found = [self.continued(hypothesis, fit, x, self.policy.long)]
        # A second mass may only have made a delay of a lag, or a lag of a delay.
        found += [self.refitted(h, y, self.policy.long) for h, y in self.in_other_series(hypothesis, x)]
        return found

    def close(self, fit: Fit) -> list[Fit]:
        """A model with dry friction in closed loop, whose controller keeps the simulation near the record between its stops.

        In open loop disturbance torques are integrated between the stops, and other effects fit the result.
        """
        rests = any(t.levels for t in fit.parameters.terms)
        if not self.whitens or fit.predictor.closed or not self.data.fits_in_loop or not rests or self.quiet(fit):
            return []
        return [self.predicted_by(fit, self.closed(fit.predictor))]

    def exchange(self, fit: Fit) -> list[Fit]:
        """An effect as one of its equivalence class, where something else turns with an angle that was not logged.

        Alone they are the same. But the angle of a filtered velocity is late, and a ripple depends on the true angle.
        """
        if self.data.angle_logged or not any(t.harmonic for t in fit.parameters.terms):
            return []
        found = []
        for t in fit.parameters.terms:
            for other in [LIBRARY[n] for n in equivalents(t.name)]:
                if other.seen_angle is None or other not in self.allowed or other.size != LIBRARY[t.name].size:
                    continue
                short = fit.hypothesis.without(t.name)
                z, x = fit.x[fit.parameters.slot(t.name)], fit.parameters.removed(fit.x, t.name)
                found.append(self.refitted(short.extended(of_waves(other, t.waves)), short.parameters.inserted(x, z)))
        return found

    def prefers(self, other: Fit, fit: Fit) -> bool:
        """Whether a reduced model takes the place of a model."""
        if self.leaves_the_shaft(other, fit):
            return False
        if causes(other) == causes(fit) and other.parameters.kind == fit.parameters.kind:
            nested = any(set(t.nested) & set(other.effects) for t in fit.parameters.terms)
            if not nested:
                return self.score(other) < self.score(fit)
        return not self.worth(fit, other)

    def valleys(self, base: Fit) -> list[Fit]:
        """Each multimodal effect alone beside a base, by a global search."""
        found = []
        for t in [t for t in self.candidates(base) if t.multimodal]:
            hypothesis = base.hypothesis.extended(t)
            rows = t.starts(base.parameters.scales)
            if not rows:
                continue
            X = np.array([base.parameters.inserted(base.x, np.array(z)) for z in rows])
            x = X[int(np.argmin(self.objective.costs(hypothesis, X, WHITE)))]
            found.append(self.evolved(ls.scored(self.objective, ls.fit(self.objective, hypothesis, x, WHITE, self.policy.short))))
        return found
