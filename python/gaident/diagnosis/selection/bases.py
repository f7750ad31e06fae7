"""The linear models that a search starts from, on one grid of time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY, of_inverse_dynamics
from gaident.diagnosis.selection.attribution import shown_without_model
from gaident.diagnosis.selection.mechanisms import is_mechanism, on_no_shaft, one_mass, reduced, resonant, rigid, swings
from gaident.diagnosis.selection.model_space import Grown
from gaident.diagnosis.selection.moves import MISSED, Moves
from gaident.diagnosis.selection.screening.score_test import ScoreTest
from gaident.errors import GaidentError, RecordError, SettingsError
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import Specification, chi_square_bound, effective_samples, gained, specification_statistic
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE, ShaftNoise
from gaident.estimation.objective import Fit, Hypothesis, Innovations, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import ClosedLoop, OpenLoop, Predictor
from gaident.estimation.prefilter import Prefilter
from gaident.estimation.projection import WORST
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.regression.motion import ORDER, cutoff_of
from gaident.estimation.regression.torque_terms import TERMS
from gaident.estimation.term import Scales, Term
from gaident.models.model import Model
from gaident.models.roots import quadratic_roots
from gaident.models.simulate import simulate
from gaident.policy.table import POLICY
from gaident.results.inverse_dynamics import InverseDynamics

__all__ = ["ByOutputErrors", "Task", "linear_bases", "noise_floor", "output_error_bases", "specification"]


@dataclass(frozen=True, eq=False)
class Task:
    """One selection on its grid of time.

    most: effects in a model at most; shown: families and names of effects that the records show by themselves; rigid_below: the
    records show one rigid body below it [rad/s], so that two masses with a slower resonance are no shaft.
    """

    objective: Objective
    scales: Scales
    model: Model
    allowed: tuple[Term, ...]
    note: Callable[[str], None]
    most: int = POLICY.most_effects
    shown: frozenset[str] = frozenset()
    rigid_below: float = 0.0
    grown: Grown = field(default_factory=Grown)

    @property
    def data(self) -> DataSet:
        return self.objective.data

    def space(self) -> Moves:
        policy = replace(POLICY, most_effects=self.most)
        return Moves(self.objective, policy, self.allowed, self.note, self.shown, self.rigid_below, self.grown)

    def under(self, family: Innovations | OutputErrors) -> Task:
        return replace(self, objective=self.objective.under(family))

    @cached_property
    def by_output_errors(self) -> ByOutputErrors:
        """The task under output errors: made when it is first asked for, and once for each grid of time."""
        return _by_output_errors(self)

    def predictor(self) -> Predictor:
        """The predictor of linear models: the closed loop only where no torque is available."""
        return ClosedLoop(self.data) if self.data.loop_only else OpenLoop(self.data)

    def start(self, model: Model, iterations: int = POLICY.long) -> Fit:
        """A mechanism fitted to the raw errors of the records."""
        parameters = Parameterisation.of(model, self.scales, self.data.moving, self.data.begun)
        return ls.fit(self.objective, Hypothesis(parameters, self.predictor()), parameters.start(model), WHITE, iterations)

    def one_mass(self) -> Fit:
        return self.start(one_mass(self.data, self.model))

    def two_masses(self, one: Fit) -> tuple[list[Fit], list[Fit]]:
        """Short fits of two masses: from the identified model, and from the resonances that help one mass most."""
        starts = (reduced(self.model), resonant(self.objective, one))
        fits = [[self.start(m, POLICY.short) for m in models] for models in starts]
        known, other = ([f for f in part if f.cost < WORST and is_mechanism(f.parameters, f.x)] for part in fits)
        return known, other


def linear_bases(task: Task) -> tuple[Task, list[Fit]]:
    """(the task with torques at the shaft in its noise family, linear fits that the search starts from).

    One mass, two masses, or both where only the effects can decide.
    Two masses alone where their resonance is that of a shaft and no model of one mass leaves an error as small, else one mass
    first. Without other effects a delay or a lag is fitted as a resonance, and a load or a saturation can mask one.
    """
    one = task.one_mass()
    known, others = task.two_masses(one)
    space = task.space()
    one = ls.reestimated(task.objective, one)
    fits = known + others
    if not fits:
        return task, [one]
    chosen = sorted(fits, key=lambda f: f.cost)[:1] + sorted(known, key=lambda f: f.cost)[:1]
    two = min((space.refitted(f.hypothesis, f.x, POLICY.long) for f in chosen), key=lambda f: f.bic)
    best = min((one, two), key=lambda f: f.bic)
    family = task.objective.family
    shaft = ShaftNoise(best.parameters.linear(best.x), task.scales.dt, task.data.pi)
    task = task.under(Innovations(shaft, family.floor))
    one, two = (ls.reestimated(task.objective, f) for f in (one, two))
    if one.bic < two.bic or on_no_shaft(two) or task.scales.blocks > 1:
        return task, [one, two]
    space = task.space()
    test = ScoreTest(task.objective)
    test.add(one.hypothesis, one.x, [t for t in space.candidates(one) if not t.nested and not t.resonates])
    tried: set[str] = set()
    for noise in (WHITE, two.noise):
        for s in test.ranked(noise)[: POLICY.starts]:
            if s.term.name not in tried:
                short = ls.scored(task.objective, ls.fit(task.objective, s.hypothesis, s.starts[0], noise, POLICY.short))
                if space.score(short) < space.score(two) + POLICY.beam_reach * space.penalty:
                    return task, [one, two]
            tried.add(s.term.name)
    return task, [two]


def output_error_bases(task: Task, bases: Sequence[Fit]) -> list[Fit]:
    """The best linear fit of one mass and of two by output errors: from the bases, and from the identified mechanism.

    In closed loop where the log shows that the simulated loop is the drive's.
    A replayed torque that ignores a limit of the controller biases these fits, and the model was identified in closed loop.
    """
    closed = task.data.left_in_loop
    predictor: Predictor = ClosedLoop(task.data) if closed else OpenLoop(task.data)
    starts = [(f.parameters, f.x) for f in bases]
    for model in rigid(task.model) + reduced(task.model):
        parameters = Parameterisation.of(model, task.scales, task.data.moving, task.data.begun)
        starts.append((parameters, parameters.start(model)))
    fits = [ls.fit(task.objective, Hypothesis(p, predictor), x, WHITE, POLICY.usual) for p, x in starts]
    fits.sort(key=lambda f: (not swings(f), f.cost))
    return [next(f for f in fits if f.parameters.masses == m) for m in sorted({f.parameters.masses for f in fits})]


def noise_floor(task: Task, one: Fit) -> float:
    """Variance of what counts as noise beside the noise that the velocity shows [(rad/s)^2]."""
    objective, data = task.objective, task.data

    def beyond(power: float) -> float:
        return max(POLICY.immaterial**2 * power - data.noise * data.noise, 0.0)

    used = objective.weight > 0.0
    floor = beyond(float(np.mean(objective.error(one)[used] ** 2)))
    if not np.isfinite(floor):
        return 0.0
    if floor > 0.0 and data.fits_in_loop:  # the error in the loop bounds it too: in the open loop a load is integrated
        inside = np.concatenate([r.velocity - simulate(task.model, r, data.loop) for r in data.records])
        floor = min(floor, beyond(float(np.mean(inside[used] ** 2))))
    if floor > 0.0:  # the error of one mass on a drive with a resonant shaft is no noise
        fits = [f for part in task.two_masses(one) for f in part if swings(f)]
        floor = min([floor, *(beyond(f.cost / objective.count) for f in fits)])
    return floor


@dataclass(frozen=True, eq=False)
class ByOutputErrors:
    """A selection by output errors: the task, and the rigid axis that was regressed where the records show one.

    With it the errors are weighed as torques (`estimation/prefilter.py`).
    """

    task: Task
    axis: InverseDynamics | None

    @property
    def objective(self) -> Objective:
        return self.task.objective

    def informed(self, samples: float) -> Task:
        """The task of a search: so many independent samples, and what the records show by themselves.

        Both are computed here only: the specification test, which most records need, uses neither.
        """
        task, family = self.task, self.objective.family
        assert isinstance(family, OutputErrors)
        # On a coarse grid too little of the velocity is left to tell a drag from a friction that is smaller near rest.
        may = [t for t in task.allowed if task.scales.blocks == 1 or not t.bends]
        shown = shown_without_model(task.data, task.model, may, self.axis)
        return replace(task.under(replace(family, samples=samples)), shown=shown)

    def regressed(self, predictor: Predictor) -> Fit | None:
        """The regressed axis, fitted by output errors; None where there is none.

        The regression needs no start values. It gives them to a fit whose cost has several minima, as with gravity.
        """
        if self.axis is None:
            return None
        first, *others = _readings(self.axis, self.task.data, MISSED * self.task.scales.torque)
        best = self._fitted(self.axis, first, predictor)
        for values in others:
            if not {*of_inverse_dynamics(values)} - {*of_inverse_dynamics(first)} <= {*self.task.allowed}:
                continue
            other = self._fitted(self.axis, values, predictor)
            more = other.parameters.size - best.parameters.size
            samples = effective_samples(self.objective.unwhitened_errors(best))
            if gained(best.cost, other.cost, samples, more) > (POLICY.effect_penalty if more else 0.0):
                best = other
        return best if best.cost < WORST else None

    def _fitted(self, axis: InverseDynamics, values: Mapping[str, float], predictor: Predictor) -> Fit:
        """The axis of these parameters of the regression, fitted by output errors."""
        task, data = self.task, self.task.data
        slowest = 1.0 / data.duration
        inertia, damping, stiffness = values["inertia"], max(_corner(axis), slowest), values.get("spring", 0.0)
        rigid_axis = Model(1.0 / inertia, [-damping])
        if stiffness > 0.0:
            rigid_axis = Model(1.0 / inertia, quadratic_roots(damping, stiffness / inertia), [0.0])
        parameters = Parameterisation.of(rigid_axis, task.scales, data.moving, data.begun)
        x = parameters.base_vector(rigid_axis)
        for term, own in of_inverse_dynamics(values).items():
            if term in task.allowed:
                low, high = np.array(term.limits(parameters.scales)).T
                x = np.concatenate([x, np.clip(term.coordinates(own), low, high)])
                parameters = parameters.extended(term)
        x = np.concatenate([x, np.zeros(sum(parameters.starts))])
        return ls.fit(task.objective, Hypothesis(parameters, predictor), x, WHITE, POLICY.long)


def _readings(axis: InverseDynamics, data: DataSet, little: float) -> list[dict[str, float]]:
    """The parameters of the regression, and, where it has no dry friction, with some.

    Of an axis that hardly turns back an offset is a load or dry friction; what it did at rest tells, which a free run shows.
    Without an offset there is then nothing that could be dry friction.
    Elsewhere dry friction starts from a little [N m]: behind the regression's filter a fast motion may not show it.
    """
    values = {name: e.value for name, e in axis.parameters.items()}
    if any(name.startswith("coulomb") for name in values):
        return [values]
    if "coulomb" not in axis.terms_not_tried:
        return [values, {**values, "coulomb": little}]
    if "offset" not in values:
        return [values]
    rest = {name: value for name, value in values.items() if name != "offset"}
    forward = float(sum(r.velocity.sum() for r in data.records)) > 0.0  # no decision: a formula: the direction
    return [values, {**rest, "coulomb": values["offset"] if forward else -values["offset"]}]


def _by_output_errors(task: Task) -> ByOutputErrors:
    """The task under output errors.

    Their corner is where the error of the regressed axis has as much power in its slope as in itself: free run and torque then
    count alike, and a cause that only the torque shows is found. Parameters are estimated otherwise, see `Selection.estimated`.
    Of a measured torque an inertia is free up to `heavier` deviations above that of the regression.
    """
    raw = ByOutputErrors(task.under(OutputErrors(1.0)), _axis(task.data))
    fit = raw.regressed(task.predictor())
    if raw.axis is None or fit is None:
        return ByOutputErrors(raw.task, None)
    axis, objective = raw.axis, raw.objective
    inertia = axis.parameters["inertia"]
    weight = Prefilter(axis.dt, 0.0, axis.cutoff_hz, axis.order)
    weight = replace(
        weight, corner=max(weight.balance(objective.bridged(objective.error(fit)[None, :])[0], objective.lengths), _corner(axis))
    )
    heaviest = inertia.value + POLICY.heavier * inertia.std if task.data.torque_measured else None
    rigid = axis.force_error**2 < POLICY.rigid_left
    below = 2.0 * np.pi * POLICY.rigid_band * axis.cutoff_hz if rigid else 0.0  # no decision: a unit; rad/s of Hz
    return ByOutputErrors(replace(raw.task, rigid_below=below).under(OutputErrors(1.0, weight, heaviest)), axis)


def _axis(data: DataSet) -> InverseDynamics | None:
    """The regressed axis; None where the records show none.

    Records of held speeds show no acceleration beyond its noise, and the cutoff that leaves only the acceleration leaves no rows:
    they show friction all the same, behind the lowest cutoff that leaves some, and an inertia beyond its deviations.
    """
    if not data.torque_logged:
        return None
    records, highest = list(data.records), POLICY.highest_band / data.records[0].dt
    cutoffs = [min(cutoff_of(r, ORDER) for r in records)]
    while 2.0 * cutoffs[-1] <= highest:  # no decision: a grid: octaves
        cutoffs.append(2.0 * cutoffs[-1])  # no decision: a grid: octaves
    doubtful: InverseDynamics | None = None
    for cutoff in cutoffs:
        try:
            found = inverse_dynamics(records, cutoff_hz=cutoff, axis=data.axis)
        except RecordError:
            pass
        except SettingsError:
            return None
        else:
            inertia = found.parameters["inertia"]
            if inertia.value > POLICY.heavier * inertia.std:
                return found
            doubtful = found if inertia.value > 0.0 and doubtful is None else doubtful
    return doubtful


def heaviest(data: DataSet, fit: Fit) -> float | None:
    """The inertia [kg m^2] from which a model counts as heavier than an axis that is regressed with its own terms.

    The regression has only the terms of the model: another term, such as gravity, a load or a spring, changes the inertia.
    None where that regression shows no inertia beyond its deviations.
    """
    axis = _axis(data)
    if axis is None:
        return None
    causes = of_inverse_dynamics({name: e.value for name, e in axis.parameters.items()})
    turns_back = any(cause.levels for cause in causes)
    terms = tuple(term for term in axis.terms if _contains(fit, term, turns_back))
    if terms != axis.terms:
        try:
            axis = inverse_dynamics(list(data.records), terms=terms, cutoff_hz=axis.cutoff_hz, axis=data.axis)
        except GaidentError:
            return None
    inertia = axis.parameters["inertia"]
    return inertia.value + POLICY.heavier * inertia.std if inertia.value > POLICY.heavier * inertia.std else None


def _contains(fit: Fit, term: str, turns_back: bool) -> bool:
    """Whether a model contains the effect of a term of the regression; equivalent forms of friction count as the same.

    turns_back: whether the regression contains dry friction, which it cannot tell from a constant torque in one direction.
    """
    names = [p.name for p in TERMS[term].parameters]
    if "spring" in names:
        return fit.parameters.on_a_spring
    causes = of_inverse_dynamics(dict.fromkeys(names, 1.0))
    effects = {name_of(effect) for effect in fit.effects}
    there = {name for effect in effects for name in (effect, *equivalents(effect))}
    families = {LIBRARY[effect].family for effect in effects} - {""}
    return not causes or any(
        cause.name in there or cause.family in families or (cause.constant and bool(families) and not turns_back)
        for cause in causes
    )


def _corner(axis: InverseDynamics) -> float:
    """B/J [rad/s], with the smaller B of two directions."""
    values = {name: e.value for name, e in axis.parameters.items()}
    viscous = values.get("viscous", min(values.get("viscous_positive", 0.0), values.get("viscous_negative", 0.0)))
    return max(viscous / values["inertia"], 0.0)


def specification(space: Moves, task: Task, fit: Fit) -> Specification:
    """The specification test: the output errors of the whitened and of the output-error estimate of one model.

    task: the one whose output errors are taken.
    What no estimate moves by slope, the order of a harmonic, is the same in both and no degree of freedom.
    H is 0 where the whitened estimate's errors are no larger than noise, as torques and in the free run.
    Where they are that, and white without a filter, the two estimates are one: no prefilter keeps white noise from being noise.
    """
    freedom = int(np.count_nonzero(fit.parameters.steps()))
    bound = chi_square_bound(freedom, space.policy.noise_level)
    free = space.small_unwhitened(fit)
    if free and fit.noise.size == 0 and space.is_noise(fit):
        return Specification(0.0, bound)
    output = task.by_output_errors.objective
    whole = float(np.sum(output.unwhitened_errors(fit) ** 2))
    if free and whole < output.count * (space.policy.noise_ratio * space.noise_beside(fit)) ** 2:
        return Specification(0.0, bound)
    least = output.unwhitened_errors(ls.fit(output, fit.hypothesis, fit.x, WHITE, space.policy.usual))
    information = min(effective_samples(least), output.count)
    return Specification(specification_statistic(whole, float(least @ least), information), bound)
