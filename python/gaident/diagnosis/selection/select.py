"""The selection of a model: mechanism, effects, and what could stand in their place.

    1. The search under innovations, each hypothesis whitened by a noise model of its own.
    2. Where more than noise is left, or the free run of the loop is missed: the same search under output errors.
       What it finds is also fitted under innovations, and counts there if it is better.
       Only this search is made where the torque was measured: no noise model of the output describes noise of the input.
    3. Whitened errors decide where they leave noise (variance ratio) and pass the specification test of the selected model.
       Else its errors are no stationary noise. The result is then what output errors select, counted in independent samples.
    4. That model is also the result where it contains a cause that whitening hides: both models are compared before whitening.
    5. The rivals of every effect.

Long records are searched on a coarser grid of time first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gaident.diagnosis.selection.bases import (
    ByOutputErrors,
    Task,
    heaviest,
    linear_bases,
    noise_floor,
    output_error_bases,
    specification,
)
from gaident.diagnosis.selection.beam import Beam
from gaident.diagnosis.selection.beam import reduced as reduced_by
from gaident.diagnosis.selection.decimated import blocks_of, decimated_objective, moved
from gaident.diagnosis.selection.mechanisms import drives_itself, on_no_shaft, resonance, swings
from gaident.diagnosis.selection.model_space import words
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.rivals import Classes, Replacement, of_each_effect
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import Specification, effective_samples
from gaident.estimation.noise_model import WHITE, ShaftNoise
from gaident.estimation.objective import Fit, Innovations, Objective, OutputErrors
from gaident.estimation.term import Scales, Term
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["Selection", "by_whitened_errors", "compared", "grown", "selected", "specification", "with_rivals"]


@dataclass(frozen=True, eq=False)
class Selection:
    """The selected model.

    space: of the noise family that decided; base: its linear part, fitted alone; final: the model; rivals: effect -> (gain in BIC
    units, explanations in its place); specification: the test of the model of whitened errors, None where it was not asked.
    whitened: what whitened errors had selected, where output errors decided and both searches ran.
    """

    space: Moves
    base: Fit
    final: Fit
    rivals: dict[str, tuple[float, list[Replacement]]]
    specification: Specification | None
    whitened: _Found | None = None

    def estimated(self) -> tuple[Objective, Fit]:
        """What the parameters of the selected model are estimated under, and the model with them.

        Output errors weighed as torques show a cause best, but a torque that the model lacks biases the inertia there.
        So the minimised error is nearly all velocity (`velocity_part`), and torque for the rest.
        Where the torque was measured, the inertia is at most that of the regression with the terms of this model.
        """
        objective, final = self.space.objective, self.final
        family = objective.family
        if not isinstance(family, OutputErrors) or family.prefilter is None:
            return objective, final
        ratio = float(np.sqrt(POLICY.velocity_part / (1.0 - POLICY.velocity_part)))
        family = replace(family, prefilter=replace(family.prefilter, corner=ratio * family.prefilter.corner))
        if family.inertia is not None:
            family = replace(family, inertia=heaviest(objective.data, final) or family.inertia)
        fit = ls.fit(objective.under_beside(family, final), final.hypothesis, final.x, WHITE, POLICY.usual)
        samples = effective_samples(objective.under(family).unwhitened_errors(fit))
        objective = objective.under_beside(replace(family, samples=samples), final)
        return objective, objective.rescored(fit)


def selected(
    objective: Objective,
    scales: Scales,
    model: Model,
    allowed: Sequence[Term],
    classes: Classes,
    note: Callable[[str], None],
    most: int = POLICY.most_effects,
    beside: Fit | None = None,
) -> Selection:
    """The model of the records, with the rivals of its effects.

    objective: over all samples; model: the identified linear one; classes: effect -> what these records cannot tell from it;
    most: effects at most; beside: a model that takes the place of the one found where it scores better.
    """
    task = Task(objective, scales, model, tuple(allowed), note, most)
    one = task.one_mass()
    error = objective.error(one)
    task = task.under(Innovations(floor=noise_floor(task, one)))
    blocks = blocks_of(task.data, error)
    if blocks == 1:
        return _compared(_or(_decided(task, note), beside), classes, note)
    grid = decimated_objective(task.objective, blocks)
    coarse_scales = replace(scales, dt=task.data.dt * blocks, blocks=blocks)
    outside = tuple(t for t in task.allowed if not t.in_controller)
    outline = _decided(Task(grid, coarse_scales, model, outside, note, most), note)
    found = _on_all_samples(task, outline, note)
    if task.data.fits_in_loop and not (found.space.is_noise(found.final) and found.space.small_unwhitened(found.final)):
        note("searching all samples, in the loop")
        # On a coarse grid the controller's torque drives the model, and beside stops and impacts its error grows.
        found = _or(_decided(task, note), found.final)
    return _compared(_or(found, beside), classes, note)


@dataclass(frozen=True, eq=False)
class _Found:
    """What a search came to: its space, the linear part of its model, the model; further as in `Selection`."""

    space: Moves
    base: Fit
    final: Fit
    specification: Specification | None = None
    whitened: _Found | None = None

    def of(self, final: Fit) -> _Found:
        """The same with another model, and its linear part."""
        base = self.base if self.base.parameters.kind == final.parameters.kind else self.space.bare(final)
        return replace(self, base=base, final=final)


def _decided(task: Task, note: Callable[[str], None]) -> _Found:
    """Steps 1 to 4; where the linear model leaves a large misfit, step 2 first: what that finds may make step 1 needless.

    Where it finds nothing, the test is of a model that lacks the cause, and says nothing of the noise.
    """
    task, bases = linear_bases(task)
    space = task.space()
    if task.data.torque_measured:
        # Noise on the input makes a whitened inertia too large, whatever the noise model; at the slow end there is little of it.
        return _by_output_errors(task.by_output_errors, bases, note)
    by_output: _Found | None = None
    again: Fit | None = None
    if min(space.ratio(b) for b in bases) > POLICY.noise_ratio:
        by_output = _by_output_errors(task.by_output_errors, bases, note)
        again = _as_innovations(space, by_output.final)
        test = specification(space, task, again)
        if test.contradicts and by_output.final.effects:
            return replace(by_output, specification=test)
    if again is not None and again.effects and space.is_noise(again) and space.small_unwhitened(again):
        # It leaves noise: no other explanation of the same is searched, only effects that this model may lack.
        final = grown(space, again)
        base = space.bare(final)
    else:
        base, final = _explored(task, space, bases)
    test = specification(space, task, final)
    if by_output is None and (test.contradicts or not (space.is_noise(final) and space.small_unwhitened(final))):
        by_output = _by_output_errors(task.by_output_errors, bases, note)
    if by_output is not None:
        better = _improved(space, again or _as_innovations(space, by_output.final), final)
        if better is not final:
            base, final = space.bare(better), better
        test = specification(space, task, final)
        by_output = _offered(by_output, final)
    if by_output is None:
        return _Found(space, base, final, test)
    whitened = _Found(space, base, final, test)
    impossible = bool(by_output.final.effects) and drives_itself(final) and not space.small_unwhitened(final)
    if test.contradicts or impossible or not space.is_noise(final) or by_output.space.hidden(final, by_output.final):
        return replace(by_output, specification=test, whitened=whitened)
    return whitened


def _offered(by_output: _Found, whitened: Fit) -> _Found:
    """The result of output errors, or the model of whitened errors in its place where it scores better there."""
    space = by_output.space
    better = _improved(space, ls.fit(space.objective, whitened.hypothesis, whitened.x, WHITE, POLICY.usual), by_output.final)
    return by_output if better is by_output.final else by_output.of(better)


def _by_output_errors(output: ByOutputErrors, bases: Sequence[Fit], note: Callable[[str], None]) -> _Found:
    """Step 2: the search under output errors.

    The information is that of the errors which the best linear model or the regressed axis leaves.
    Where that axis with its effects leaves noise, only effects that it may lack are searched.
    """
    note("looking at the output errors")
    starts = output_error_bases(output.task, bases)
    least = min(starts, key=lambda f: f.cost)
    axis = output.regressed(least.predictor)
    task = _informed(output, least, axis)
    space = task.space()
    rigid = None if axis is None else task.objective.rescored(axis)
    if rigid is not None and rigid.effects and space.quiet(rigid) and space.small_unwhitened(rigid):
        final = grown(space, rigid)
        return _Found(space, space.bare(final), final)
    bases = [task.objective.rescored(f) for f in starts]
    base, final = _explored(task, space, bases)
    if rigid is not None:
        final = _improved(space, rigid, final)
    return _by_noise(output, _Found(space, base, base).of(final), bases)


def _by_noise(output: ByOutputErrors, found: _Found, bases: Sequence[Fit]) -> _Found:
    """What was found or, where it leaves more than noise, what grows from a model with one effect that leaves noise.

    Slow errors of a linear model are so few independent samples that no effect is worth its cost beside two masses.
    The errors of a model that leaves noise are as many as noise has, and these count then.
    Of a torque that was measured, whose noise is known; else the search under innovations counts all samples.
    """
    space = found.space
    if not space.data.torque_measured or space.is_noise(found.final):
        return found
    grown = [f for b in bases for f in space.add(b) if space.is_noise(f)]
    if not grown:
        return found
    least = min(grown, key=lambda f: f.cost)
    space = output.informed(effective_samples(space.objective.unwhitened_errors(least))).space()
    best, other = (space.objective.rescored(f) for f in (found.final, least))
    final = _improved(space, other, best)
    return found if final is best else _Found(space, space.bare(final), final)


def _informed(output: ByOutputErrors, linear: Fit, axis: Fit | None) -> Task:
    """The task under output errors, with as many independent samples as the errors of the linear model contain.

    Those of the regressed axis count if they are more: the errors of a better model are more independent.
    They do not count where a rigid axis fits worse than a shaft that swings: its errors are the ringing of the shaft.
    """
    fits = [linear]
    if axis is not None and (axis.cost <= linear.cost or linear.parameters.masses == 1 or not swings(linear)):
        fits.append(axis)
    return output.informed(max(effective_samples(output.objective.unwhitened_errors(f)) for f in fits))


def _explored(task: Task, space: Moves, bases: Sequence[Fit]) -> tuple[Fit, Fit]:
    """(linear fit, selected model), from one mass or two, whichever ends better."""
    ends: list[tuple[Fit, Fit]] = []
    for base in bases:
        end = _searched(space, base)
        if space.swings(base) and not space.swings(end):
            end = base  # the search replaced the shaft by effects: the model with the shaft stays a candidate
        # On a coarse grid a resonance beyond what it shows stands for another fast effect: the fit to all samples decides.
        shown = task.scales.blocks == 1 or resonance(end) < POLICY.seen_band * np.pi / task.scales.dt
        if not ends or (space.swings(end) and shown):
            ends.append((base, end))
        if space.quiet(end) and space.small_unwhitened(end) and not on_no_shaft(end):
            break
    return min(ends, key=lambda e: space.rank(e[1]))


def _searched(space: Moves, base: Fit) -> Fit:
    """The beam search from one linear model."""
    best = _beam(space).run([base])
    if space.quiet(best) or space.data.fits_in_loop or not space.whitens:
        return best
    for other in space.valleys(base):
        best = _improved(space, other, best)
    return best


def _beam(space: Moves) -> Beam[Fit]:
    policy = space.policy
    return Beam(
        score=space.score,
        key=space.key,
        grow=space.add,
        worth=space.worth,
        reduce=_reductions(space),
        prefers=space.prefers,
        search=space.search,
        leaves_noise=space.is_noise,
        size=lambda f: len(f.effects),
        most=policy.most_effects,
        width=policy.beam_width,
        reach=policy.beam_reach * space.penalty,
        margin=policy.swap,
    )


def _reductions(space: Moves) -> tuple[Callable[[Fit], list[Fit]], ...]:
    return space.close, space.exchange, space.other_wave, space.other_side, space.drop, space.simplify, space.demote


def grown(space: Moves, fit: Fit) -> Fit:
    """What the beam search makes of a model, reduced first."""
    return _beam(space).run([reduced_by(fit, _reductions(space), space.prefers, space.score)])


def _improved(space: Moves, other: Fit, best: Fit) -> Fit:
    """Another model, reduced and grown, in the place of the best one where it scores better."""
    worse = space.rank(best)[:2] <= space.rank(other)[:2] and space.score(other) > space.score(best) + space.penalty
    if worse or space.leaves_the_shaft(other, best):
        return best
    other = grown(space, other)
    if space.rank(other)[:2] != space.rank(best)[:2]:
        return min(other, best, key=space.rank)
    return other if space.score(best) - space.score(other) > space.policy.swap else best


def _as_innovations(space: Moves, fit: Fit) -> Fit:
    """A model selected by output errors under a noise model of its own, under the predictors that may say more.

    A prefilter shows no fast resonance, nor a lag beside it: whitened errors do, and they are looked for again.
    """
    found = space.with_best_resonance(space.finished(ls.reestimated(space.objective, ls.scored(space.objective, fit))))
    return space.behind_a_lag(found)


def _on_all_samples(task: Task, outline: _Found, note: Callable[[str], None]) -> _Found:
    """The model found on the coarse grid, fitted to all samples, reduced, and grown by what the grid could not show.

    Output errors get a new prefilter: the low-pass of the coarse one removes what that grid could not show.
    """
    data, family, found = task.data, task.objective.family, outline.space.objective.family
    if outline.final.parameters.masses == 1:  # no stiff shaft, no fine substeps
        coarse = 0.5 * data.dt  # no decision: of a solver: the step of a simulation
        data = replace(data, finest=max(data.finest, coarse))
    if isinstance(found, Innovations) and found.shaft is not None:
        shaft = ShaftNoise(outline.base.parameters.linear(outline.base.x), data.dt, data.pi)
        family = Innovations(shaft, found.floor)
    task = replace(
        task, objective=Objective(data, task.objective.weight, family, task.objective.measured, task.objective.counter)
    )
    selecting = task
    if not outline.space.whitens:
        linear = _moved(task.by_output_errors.task.space(), task.scales, outline.base)
        selecting = _informed(task.by_output_errors, linear, task.by_output_errors.regressed(linear.predictor))
    space = selecting.space()
    base, final = (_moved(space, task.scales, f) for f in (outline.base, outline.final))
    final = reduced_by(final, _reductions(space), space.prefers, space.score)
    note(f"looking beyond {words(final.effects) or 'the linear model'}, at all samples")
    # An effect faster than a step of the coarse grid shows there as a resonance: the search also starts without that resonance.
    ways = [final, *(space.without(final, t.name) for t in final.parameters.terms if t.resonates)]
    if resonance(final) * outline.space.data.dt > 1.0:  # no decision: a time constant 1/w that is shorter than a step
        ways += space.demoted(final)
    final = min((_beam(space).run([f]) for f in ways), key=space.rank)
    test = specification(space, task, final) if space.whitens else outline.specification
    return _Found(space, base, base, test).of(final)


def _or(found: _Found, model: Fit | None) -> _Found:
    """What a search came to, or another model, fitted to the same data, reduced and grown, where that scores better."""
    if model is None:
        return found
    other = found.space.refitted(model.hypothesis.over(found.space.data), model.x)
    better = _improved(found.space, other, found.final)
    return found if better is found.final else found.of(better)


def _moved(space: Moves, scales: Scales, fit: Fit) -> Fit:
    start = moved(space.data, scales, fit)
    return space.refitted(start.hypothesis, start.x)


def _compared(found: _Found, classes: Classes, note: Callable[[str], None]) -> Selection:
    """The model of least cost near by, with the rivals of its effects; a better rival replaces it and is compared in turn."""
    space, final = found.space, found.space.deepened(found.final)
    swaps_left, kept = POLICY.swaps, frozenset[str]()
    while True:
        rivals, better = of_each_effect(space, final, swaps_left > 0, classes, note, kept)
        if better is None:
            break
        other = reduced_by(space.canonical(better), _reductions(space), space.prefers, space.score)
        lost = len(other.effects) < len(final.effects) and space.score(other) > space.score(final)
        if lost or space.leaves_the_shaft(other, final) or space.hidden(better, final):  # it is a rival only
            kept |= frozenset(final.effects) - {*better.effects} or frozenset(final.effects)
            continue
        final, swaps_left, kept = other, swaps_left - 1, frozenset()
    base = found.base if found.base.parameters.kind == final.parameters.kind else space.bare(final)
    return Selection(space, base, final, rivals, found.specification, found.whitened)


def by_whitened_errors(selection: Selection, classes: Classes, note: Callable[[str], None]) -> Selection | None:
    """What whitened errors had selected, with its rivals; None where that model decided, or none was searched."""
    return None if selection.whitened is None else _compared(selection.whitened, classes, note)


def with_rivals(space: Moves, like: Selection, final: Fit, classes: Classes, note: Callable[[str], None]) -> Selection:
    """The selection of another space and model in the place of one, compared with its rivals as any is."""
    return _compared(_Found(space, like.base, final, like.specification), classes, note)


def compared(selection: Selection, final: Fit, classes: Classes, note: Callable[[str], None]) -> Selection:
    """The selection with another model in the place of its own."""
    rivals, _ = of_each_effect(selection.space, final, False, classes, note)
    return replace(selection, final=final, rivals=rivals)
