"""The models that can be made of a library over one objective, what they are worth, and how they are fitted.

A fuller model is *worth* its effects where its score

    BIC + penalty per effect (a generalisation counts as two, a second mass as one)

is lower than the simpler model's, both under the same predictors, and where what it explains is material.
This is the one decision of the search; its numbers stand in the policy.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaident.control.cascade import cascade_of
from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.sides import called_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.mechanisms import as_two_masses, on_no_shaft, resonance, swings
from gaident.diagnosis.selection.noise_level import NoiseLevel
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import cost_of, effective_samples, gained_by_chance
from gaident.estimation.global_search import evolved
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import LOST, Fit, Hypothesis, Objective, OutputErrors
from gaident.estimation.prediction import ObserverLoop, OpenLoop, Predictor, torque_noise_draws
from gaident.estimation.projection import WORST, orthonormal_rows
from gaident.estimation.term import Term
from gaident.policy.table import POLICY

__all__ = ["Grown", "ModelSpace", "representative", "words"]

Vector = NDArray[np.float64]


def words(effects: Iterable[str]) -> str:
    """Effects as people write them."""
    return ", ".join(map(called_of, effects))


def representative(term: Term) -> str:
    """Of effects that no record tells apart and that have as many parameters, the first."""
    alike = (n for n in equivalents(term.name) if LIBRARY[n].size == LIBRARY[term.name].size)
    return min((*alike, term.name))


def _depth(term: Term) -> int:
    """1 for each wave, and one more for each effect that is nested in the next."""
    return term.waves + max((_depth(LIBRARY[name]) for name in term.nested), default=0)


def _linear_part(fit: Fit) -> tuple[Hypothesis, Vector]:
    """A model without its effects, at the same values."""
    hypothesis, x = fit.hypothesis, fit.x
    for effect in fit.effects:
        x, hypothesis = hypothesis.parameters.removed(x, effect), hypothesis.without(effect)
    return hypothesis, x


class Grown:
    """The fits from which a search has grown others, of each model over each objective, in the order in which it did."""

    def __init__(self) -> None:
        self._fits: WeakKeyDictionary[Objective, dict[Hashable, list[Fit]]] = WeakKeyDictionary()

    def note(self, objective: Objective, model: Hashable, fit: Fit) -> None:
        """One more fit of a model."""
        self._fits.setdefault(objective, {}).setdefault(model, []).append(fit)

    def of(self, objective: Objective, model: Hashable) -> Sequence[Fit]:
        """Those of a model."""
        return self._fits.get(objective, {}).get(model, ())


@dataclass(frozen=True, eq=False)
class ModelSpace(NoiseLevel):
    """The models that can be made of a library over one objective, and the moves between them."""

    allowed: tuple[Term, ...]
    note: Callable[[str], None]
    shown: frozenset[str] = frozenset()  # families and names of effects that the records show by themselves
    rigid_below: float = 0.0  # rad/s, below which the records show one rigid body
    grown: Grown = field(default_factory=Grown)

    # What a model is worth.

    @property
    def penalty(self) -> float:
        """BIC units that an effect costs."""
        short = self.policy.short_record / self.objective.count if self.whitens else 0.0
        return self.policy.effect_penalty * (1.0 + short)

    @property
    def margin(self) -> float:
        """BIC units within which two explanations are not told apart."""
        short = self.policy.rival_short / self.objective.count if self.whitens else 0.0
        return self.policy.rival_margin * (1.0 + short)

    def swings(self, fit: Fit) -> bool:
        """Whether two masses may be a shaft: damped like one, and neither too slow nor too fast for what the records show.

        One mass has no such bounds. Below `rigid_below` the records show one rigid body.
        A resonance faster than the controller's samples show replaces another fast effect.
        A measured torque is known at its samples only: what it does between them shows as a fast resonance sooner.
        """
        line = fit.parameters.scales.dt / fit.parameters.scales.blocks  # of the log, also on a coarse grid
        every = 1 if self.data.controller is None else self.data.controller.log_every(line)
        band = self.policy.seen_measured if self.data.torque_measured else self.policy.seen_band
        seen = band * np.pi * every / line
        return swings(fit) and (fit.parameters.masses == 1 or self.rigid_below <= resonance(fit) < seen)

    def score(self, fit: Fit) -> float:
        """BIC and the penalties of the effects; the lower the better."""
        # The penalty is for candidates tried: what records show without a model, or a spring's tension at first, costs one less.
        made, spring = fit.parameters, fit.parameters.on_a_spring
        friction = {t.family for t in made.terms} & self.shown
        known = len(friction) + sum(spring and LIBRARY[t.name].constant for t in made.terms)
        effects = sum(_depth(t) for t in made.terms) - known + made.masses - 1 + spring  # a second mass or a spring is one, too
        return fit.bic + self.penalty * effects + sum(t.search_cost for t in made.terms) - self._shown_bends(fit)

    def _shown_bends(self, fit: Fit) -> float:
        """What friction that bends over the velocity costs less where the records show that it does [BIC units].

        A drag beside dry friction, or a friction that falls from rest, costs what tells two explanations apart: the records show
        that there is one, not which.
        """
        bent = [t for t in fit.parameters.terms if t.bends and t.name in self.shown]
        with_level = {t.family for t in fit.parameters.terms if t.levels}
        return (self.penalty - self.margin) * sum(t.family in with_level for t in bent)

    def key(self, fit: Fit) -> Hashable:
        """The same for the same mechanism with the same effects, or with equivalent ones."""
        return fit.parameters.kind, frozenset((representative(t), t.waves) for t in fit.parameters.terms)

    def worth(self, fuller: Fit, simpler: Fit) -> bool:
        """The decision: whether a fuller model is worth its effects against a simpler one."""
        simpler = self.under_predictor_of(simpler, fuller)
        if not self.score(fuller) < self.score(simpler) or self.leaves_the_shaft(fuller, simpler):
            return False
        more = [t for t in fuller.parameters.terms if t.name not in simpler.effects]
        if any(fuller.parameters.effect_values(fuller.x[None, :], t.name)[0, 0] < t.least for t in more if t.least):
            return False
        if any(set(t.nested) & set(simpler.effects) for t in more) and not self.generalises(simpler, fuller):
            return False
        alike = any({*equivalents(t.name)} & {*simpler.effects} for t in more)
        if (alike or (simpler.effects and not fuller.impacts)) and not self.beyond_steps(simpler, fuller):
            return False
        if fuller.parameters.on_a_spring and not (simpler.parameters.on_a_spring or self.beyond_simulation(simpler, fuller)):
            return False
        return self.material(simpler, fuller) and self.beyond_torque_noise(simpler, fuller)

    def jumps(self, fit: Fit) -> bool:
        """Whether the cost jumps with the parameters: an impact more, or a sample more at a limit that holds the integrator."""
        controller = self.data.controller
        holds = controller is not None and cascade_of(controller).velocity.anti_windup == "hold"
        return fit.impacts or (fit.predictor.closed and holds)

    def rank(self, fit: Fit) -> tuple[bool, bool, float]:
        """Of ends of a search, the lower the better: a model that diverges is last, before it two masses that are on no shaft."""
        return not fit.cost < WORST, on_no_shaft(fit), self.score(fit)

    @staticmethod
    def leaves_the_shaft(other: Fit, fit: Fit) -> bool:
        """Whether another model has two masses that are on no shaft, and the model has not: it takes no place then.

        A linear fit of a shaft with a gap may be on none: effects are added to that.
        """
        return on_no_shaft(other) and not on_no_shaft(fit)

    def beyond_torque_noise(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether a fuller model gains more than noise on a measured torque would give it by chance; true without one.

        That noise lets a free run wander slowly: a constant torque, or a wave of it, explains much of that.
        """
        if not (self.hears_torque_noise(fuller) and fuller.parameters.size > simpler.parameters.size):
            return True
        objective = self.objective
        rows = torque_noise_draws(
            fuller.predictor, fuller.parameters, fuller.x, self.noise_beside(fuller), self.policy.noise_draws
        )
        sensitivities = (objective.sensitivities(f.hypothesis, f.x)[0] for f in (simpler, fuller))
        less, more = (orthonormal_rows(objective.whitened(J, WHITE)) for J in sensitivities)
        by_chance = gained_by_chance(objective.whitened(rows, WHITE), less, more, fuller.cost, self.policy.noise_level)
        return simpler.cost - fuller.cost > by_chance

    def generalises(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether what a generalisation adds is that of the drive: more than the simulation is exact to, and in both loops."""
        return self.beyond_simulation(simpler, fuller) and self.in_both_loops(simpler, fuller)

    def beyond_simulation(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether a generalisation, or a spring, changes the velocity by more than the simulation is exact to.

        The simulation is exact to a share of what all effects change, with and without them (docs/effects.md).
        """
        hypothesis, x = _linear_part(fuller)
        driven = simpler.hypothesis.driven_by(fuller.predictor)
        pairs = (fuller.hypothesis, fuller.x), (driven, simpler.x), (hypothesis, x)
        with_effects, refined, linear = (self.objective.errors(h, y[None, :])[0] for h, y in pairs)
        changed = float(np.sum((linear - with_effects) ** 2))
        if np.max(np.abs(linear)) >= LOST:  # without its effects the model diverges: what they change has no size
            return True
        return bool(np.sum((refined - with_effects) ** 2) > self.policy.simulation_exact**2 * changed)

    def beyond_steps(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether what a model has more than another changes the velocity by more than the steps of the simulation do.

        What the simulation of a lag gets wrong looks like another lag, what it gets wrong of friction like more friction.
        An error of first order is twice what half the step changes.
        Beside impacts, whose times steps move, this is asked of another effect of the same class only.
        """
        half = fuller.hypothesis.over(replace(fuller.predictor.data, finer=2))  # no decision: half the step
        pairs = (half, fuller.x), (simpler.hypothesis.driven_by(fuller.predictor), simpler.x)
        finer, without = (self.objective.errors(h, x[None, :])[0] for h, x in pairs)
        errors = self.objective.error(fuller)
        return bool(np.linalg.norm(without - errors) > 2.0 * np.linalg.norm(finer - errors))  # no decision: a formula

    def under_predictor_of(self, fit: Fit, other: Fit) -> Fit:
        """The fit under the other's predictor, where that is better: models are compared under the same predictors."""
        if fit.predictor == other.predictor:
            return fit
        return min((fit, self.predicted_by(fit, other.predictor)), key=lambda f: f.bic)

    def material(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether a model explains more than a set share of what a simpler one leaves beyond the noise, or leaves noise.

        Significance is not enough where a model is wrong: many effects then reduce the error a little.
        The share of either the whitened or the unwhitened errors is enough: a noise filter may whiten the larger misfit.
        Beside impacts the share is larger: one impact too many leaves an error even with the true parameters.
        Other effects can fit that error.
        """
        impacts = simpler.impacts
        if self.quiet(fuller) and not impacts:
            return True
        noise = self.objective.count * self.noise_in_errors(fuller) ** 2
        share = self.policy.material_beside_impacts if impacts else self.policy.material_share
        if simpler.cost - fuller.cost > share * (simpler.cost - noise):
            return True
        before, after = (self.unwhitened_cost(f) for f in (simpler, fuller))
        return before - after > share * (before - noise)

    def hidden(self, whitened: Fit, other: Fit) -> bool:
        """Whether whitening hides a cause that another model contains, because the noise filter described it.

        The two models are different, so that the specification test does not apply.
        Both are fitted to the errors before whitening, under the same predictor.
        There the model without the cause leaves more than noise; the other one leaves at most the share `overrules` of that,
        and its score is better by the margin of two explanations.
        The score counts independent samples: those of the space of output errors,
        else those in the errors of the model without the cause.
        """
        if {(t.name, k) for t in other.parameters.terms for k in range(t.waves)} <= {
            (t.name, k) for t in whitened.parameters.terms for k in range(t.waves)
        }:
            return False
        space = self.of_output_errors()
        predictor = space.free_predictor(other)
        without, beside = (space.unwhitened(f, predictor) for f in (whitened, other))
        if not beside.cost < self.policy.overrules * without.cost or self.ratio(without) < self.policy.free_run_ratio:
            return False
        if self.whitens:
            space = space.of_output_errors(effective_samples(space.objective.unwhitened_errors(without)))
            without, beside = (space.objective.rescored(f) for f in (without, beside))
        return space.score(beside) < space.score(without) - space.margin

    def of_output_errors(self, samples: float = np.inf) -> ModelSpace:
        """The same models under output errors, with so many independent samples; this space where it does not whiten."""
        if not self.whitens:
            return self
        return replace(self, objective=self.objective.under(OutputErrors(samples)))

    def unwhitened_cost(self, fit: Fit) -> float:
        """Sum of squared errors before whitening, of the model refitted to these; in the loop where it is the drive's."""
        return self.unwhitened(fit, self.free_predictor(fit)).cost

    def unwhitened(self, fit: Fit, predictor: Predictor) -> Fit:
        """A model fitted to the errors before whitening."""
        return ls.fit(self.objective, fit.hypothesis.driven_by(predictor), fit.x, WHITE, self.policy.usual)

    def free_predictor(self, fit: Fit) -> Predictor:
        """The predictor of the free run: the loop where it is that of the drive, else the torque that drives the model."""
        return self.closed(fit.predictor) if self.data.left_in_loop else fit.predictor

    def in_both_loops(self, simpler: Fit, fuller: Fit) -> bool:
        """Whether a generalisation is worth its cost in closed loop too, and not only because it is simulated with more substeps.

        Driven by the torque, a model with dry friction comes to rest a little before or after the drive wherever a disturbance
        torque has turned the shaft, and two levels of friction may describe that better than one.
        Where a model leaves white noise, there was no such torque.
        """
        if self.neutral_score(simpler, fuller) <= self.score(fuller):
            return False
        if fuller.predictor.closed or not self.data.fits_in_loop or fuller.noise.size == 0:
            return True
        inside = [self.predicted_by(f, self.closed(f.predictor)) for f in (simpler, fuller)]
        return self.score(inside[1]) < self.score(inside[0])

    def neutral_score(self, simpler: Fit, fuller: Fit) -> float:
        """Score of a nested model, simulated as the neutral case of its generalisation."""
        terms = [t for t in fuller.parameters.terms if set(t.nested) & set(simpler.effects)]
        if len(terms) != 1:
            return np.inf
        (term,) = terms
        if term.neutral is None:
            return np.inf
        (inner,) = (t for t in simpler.parameters.terms if t.name in term.nested)
        own = simpler.parameters
        level = float(simpler.x[own.slot(inner.name)][0])
        base, bare = own.removed(simpler.x, inner.name), own.without(inner.name)
        if set(bare.effects) != set(fuller.parameters.without(term.name).effects) or bare.kind != fuller.parameters.kind:
            return np.inf
        neutral = np.array(term.neutral(level, fuller.parameters.scales))
        hypothesis = Hypothesis(bare.extended(term), fuller.predictor)
        x = bare.inserted(base, neutral)
        as_fuller = ls.scored(self.objective, Fit(hypothesis, x, fuller.noise, 0.0, np.inf))
        freedom = term.size - inner.size
        return as_fuller.bic - cost_of(freedom, self.objective.information) + self.score(simpler) - simpler.bic

    # Fits.

    def predicted_by(self, fit: Fit, predictor: Predictor) -> Fit:
        """A model fitted under another predictor."""
        if fit.predictor == predictor:
            return fit
        return self.refitted(fit.hypothesis.driven_by(predictor), fit.x)

    def refitted(self, hypothesis: Hypothesis, x: Vector, iterations: int = POLICY.usual) -> Fit:
        """Least squares before whitening from x, then under a noise model of its own."""
        return ls.reestimated(self.objective, ls.fit(self.objective, hypothesis, x, WHITE, iterations))

    def continued(self, hypothesis: Hypothesis, fit: Fit, x: Vector, iterations: int = POLICY.usual) -> Fit:
        """Least squares from x under the noise model of the fit that x was made of, then under a noise model of its own."""
        return ls.reestimated(self.objective, ls.fit(self.objective, hypothesis, x, fit.noise, iterations))

    def finished(self, fit: Fit) -> Fit:
        """A short fit continued to the end, under the best of the predictors that may suit it."""
        return self.under_best_predictor(self.completed(fit))

    def completed(self, fit: Fit) -> Fit:
        """A short fit continued to the end under its own noise model."""
        fit = fit if fit.converged else ls.fit(self.objective, fit.hypothesis, fit.x, fit.noise, self.policy.usual)
        return ls.reestimated(self.objective, fit)

    def under_best_predictor(self, fit: Fit) -> Fit:
        """A fit under the predictor with the lowest BIC, of those that may suit it."""
        predictors: list[Predictor] = []
        if fit.predictor.closed and self.whitens and not self.data.loop_only:
            # Parameters found in closed loop may be a good start for the open loop, whose errors show more.
            predictors.append(OpenLoop(self.data, fit.predictor.own_angle))
            if ObserverLoop.possible(self.data) and fit.impacts:
                predictors.append(ObserverLoop(self.data, fit.predictor.own_angle))
        if not fit.predictor.own_angle and not self.data.angle_logged and any(t.harmonic for t in fit.parameters.terms):
            predictors.append(replace(fit.predictor, own_angle=True))  # type: ignore[type-var]
        best = min((fit, *(self.predicted_by(fit, p) for p in predictors)), key=lambda f: f.bic)
        return self.canonical(best)

    def bare(self, fit: Fit) -> Fit:
        """The linear part of a model, fitted without its effects."""
        return self.refitted(*_linear_part(fit))

    def canonical(self, fit: Fit) -> Fit:
        """One mass with an extra resonance is a drive of two masses: part of the linear model, not an effect."""
        if fit.parameters.kind != "one mass" or not any(t.resonates for t in fit.parameters.terms):
            return fit
        hypothesis, x = as_two_masses(fit)
        return self.continued(hypothesis, fit, x)

    def evolved(self, fit: Fit, draw: int = 0) -> Fit:
        """A global search nearby, in the loop where there is one; draw: of several from the same fit."""
        predictor = self.closed(fit.predictor) if self.data.fits_in_loop else fit.predictor
        start = replace(fit, hypothesis=fit.hypothesis.driven_by(predictor))
        key = "evolved", start.key, self.policy.evolution, draw
        return self.objective.once(key, lambda: self.finished(evolved(self.objective, start, self.policy.evolution, draw)))

    def deepened(self, fit: Fit) -> Fit:
        """A model with impacts, searched globally nearby until further draws bring no more.

        The cost has a local minimum for each number of impacts, also where the errors are as small as the noise of the velocity.
        """
        if not fit.impacts:
            return fit
        in_vain = 0
        for draw in range(self.policy.deepenings):
            found = self.evolved(fit, draw)
            found = min((found, self.refitted(found.hypothesis, found.x, self.policy.long)), key=self.score)
            gained = self.score(fit) - self.score(found)
            fit = found if gained > 0.0 else fit
            in_vain = 0 if gained > self.margin else in_vain + 1
            if in_vain == self.policy.draws_in_vain or (in_vain and self.quiet(fit)):
                break
        return fit
