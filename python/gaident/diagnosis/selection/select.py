"""The selection of a model: mechanism, effects, and what could stand in their place.

    1. The search under innovations, each hypothesis whitened by a noise model of its own.
    2. Where more than noise is left, or the free run of the loop is missed: the same search under output errors. What it finds
       is fitted under innovations as well, and counts there if it is better.
       Only this search where the torque itself was measured: noise on the input, which no noise model of the output describes.
    3. The specification test: where whitened and plain estimates of the selected model contradict each other, its errors are no
       stationary noise, and the model that output errors select is the result, with the information of its independent samples.
    4. The rivals of every effect.

Long records are searched on a coarser grid of time first.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.terms import EVEN_FRICTION
from gaident.diagnosis.selection.bases import Task, linear_bases, noise_floor, plain_bases, regressed
from gaident.diagnosis.selection.beam import Beam
from gaident.diagnosis.selection.beam import reduced as reduced_by
from gaident.diagnosis.selection.decimated import blocks_of, decimated_objective, moved
from gaident.diagnosis.selection.mechanisms import resonance, swings
from gaident.diagnosis.selection.model_space import words
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.rivals import Rival, rivals_of
from gaident.estimation import least_squares as ls
from gaident.estimation.criterion import chi_square_bound, effective_samples, specification_statistic
from gaident.estimation.noise_model import WHITE, ShaftNoise
from gaident.estimation.objective import Fit, Innovations, Objective, OutputErrors
from gaident.estimation.projection import WORST
from gaident.estimation.term import Scales, Term
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["Selection", "by_whitened_errors", "compared", "selected"]

Vector = NDArray[np.float64]
Classes = Callable[[str], Collection[str]]


@dataclass(frozen=True, eq=False)
class Selection:
    """The selected model.

    space: of the noise family that decided; base: its linear part, fitted alone; final: the model; rivals: effect -> (gain in BIC
    units, explanations in its place); statistic, bound: of the specification test. whitened: what whitened errors had selected,
    where output errors decided and both searches ran.
    """

    space: Moves
    base: Fit
    final: Fit
    rivals: dict[str, tuple[float, list[Rival]]]
    statistic: float
    bound: float
    whitened: _Found | None = None

    @property
    def stationary(self) -> bool:
        """Whether whitened errors decided."""
        return self.space.whitens


def selected(
    objective: Objective,
    scales: Scales,
    model: Model,
    allowed: Sequence[Term],
    classes: Classes,
    note: Callable[[str], None],
) -> Selection:
    """The model of the records, with the rivals of its effects.

    objective: over all samples; model: the identified linear one; classes: effect -> what these records cannot tell from it.
    """
    task = Task(objective, scales, model, tuple(allowed), note)
    one = task.one_mass()
    error = objective.error(one)
    task = task.under(Innovations(floor=noise_floor(task, one)))
    blocks = blocks_of(task.data, error)
    if blocks == 1:
        found = _decided(task, note)
        return _compared(found, classes, note)
    grid = decimated_objective(task.objective, blocks)
    coarse_scales = replace(scales, dt=task.data.dt * blocks, blocks=blocks)
    outside = tuple(t for t in task.allowed if not t.in_controller)
    outline = _decided(Task(grid, coarse_scales, model, outside, note), note)
    return _compared(_on_all_samples(task, outline, note), classes, note)


@dataclass(frozen=True, eq=False)
class _Found:
    """What a search came to."""

    space: Moves
    base: Fit
    final: Fit
    statistic: float
    bound: float
    whitened: _Found | None = None


def _decided(task: Task, note: Callable[[str], None]) -> _Found:
    """Steps 1 to 3; where the linear model leaves a large misfit, step 2 first: step 1 may then be needless."""
    task, bases = linear_bases(task)
    space = task.space()
    if task.data.torque_measured:
        # Noise on the input makes a whitened inertia too large, whatever the noise model; at the slow end there is little of it.
        return _Found(*_plainly(task, bases, note), np.inf, 0.0)
    plainly: tuple[Moves, Fit, Fit] | None = None
    if min(space.ratio(b) for b in bases) > POLICY.misfit_ratio:
        plainly = _plainly(task, bases, note)
        as_whitened = _as_innovations(space, plainly[2])
        statistic, bound = _specification(space, as_whitened, plainly[2])
        if statistic > bound:
            return _Found(*plainly, statistic, bound)
    base, final = _explored(task, space, bases)
    statistic, bound = _specification(space, final)
    if plainly is None and (statistic > bound or not space.runs_free(final)):
        plainly = _plainly(task, bases, note)
    if plainly is not None:
        again = _improved(space, _as_innovations(space, plainly[2]), final)
        if again is not final:
            base, final = _bare(space, again), again
        statistic, bound = _specification(space, final, plainly[2])
    whitened = _Found(space, base, final, statistic, bound)
    if plainly is not None and statistic > bound:
        return _Found(*plainly, statistic, bound, whitened)
    return whitened


def _plainly(task: Task, bases: Sequence[Fit], note: Callable[[str], None]) -> tuple[Moves, Fit, Fit]:
    """Step 2: (the space of output errors, linear fit, selected model).

    The information is that of the linear model's plain errors: those of a better model are more.
    """
    note("looking at the plain errors")
    starts = plain_bases(task.under(OutputErrors(1.0)), bases)
    least = min(starts, key=lambda f: f.cost)
    information = effective_samples(task.objective.error(least) * task.objective.counted)
    plain = task.under(OutputErrors(information))
    space = plain.space()
    fitted = [plain.objective.fitted(f.hypothesis, f.x, f.noise, f.cost, f.converged) for f in starts]
    base, final = _explored(plain, space, fitted)
    start = regressed(plain, least.predictor)
    if start is not None and start.cost < WORST:
        final = _improved(space, start, final)
        base = base if base.parameters.masses == final.parameters.masses else _bare(space, final)
    return space, base, final


def _explored(task: Task, space: Moves, bases: Sequence[Fit]) -> tuple[Fit, Fit]:
    """(linear fit, selected model), from one mass or two, whichever ends better."""
    ends: list[tuple[Fit, Fit]] = []
    for base in bases:
        end = _searched(space, base)
        # On a coarse grid a resonance beyond what it shows is some other thing of short times: all samples will tell.
        # Two masses that do not swing describe something else, which one mass leaves for all to see.
        seen = task.scales.blocks == 1 or resonance(end) < POLICY.seen_band * np.pi / task.scales.dt
        if not ends or (swings(end) and seen):
            ends.append((base, end))
        if space.quiet(end) and space.runs_free(end):
            break
    return min(ends, key=lambda e: space.score(e[1]))


def _searched(space: Moves, base: Fit) -> Fit:
    """The beam search from one linear model."""
    best = _beam(space).run([base])
    if space.quiet(best) or space.data.loopable or not space.whitens:
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
        settled=space.is_noise,
        size=lambda f: len(f.effects),
        most=policy.most_effects,
        width=policy.beam_width,
        reach=policy.beam_reach * space.penalty,
        margin=policy.swap,
    )


def _reductions(space: Moves) -> tuple[Callable[[Fit], list[Fit]], ...]:
    return space.close, space.exchange, space.drop, space.simplify, space.demote


def _improved(space: Moves, other: Fit, best: Fit) -> Fit:
    """Another model, reduced and grown, in the place of the best one where it scores better."""
    if space.score(other) > space.score(best) + space.penalty:
        return best
    other = reduced_by(other, _reductions(space), space.prefers, space.score)
    other = _beam(space).run([other])
    return other if space.score(best) - space.score(other) > space.policy.swap else best


def _as_innovations(space: Moves, fit: Fit) -> Fit:
    """A model selected by output errors under a noise model of its own, in the views that may say more."""
    return space.finished(ls.reestimated(space.objective, ls.scored(space.objective, fit)))


def _specification(space: Moves, fit: Fit, other: Fit | None = None) -> tuple[float, float]:
    """(H of the specification test, its bound): the plain errors of the whitened and of the plain estimate.

    The plain estimate is that of the same model, and of the one that output errors selected where that holds another cause: what
    whitened errors have selected may be no model that a plain estimate could start from.
    """
    objective = space.objective
    found = 0.0
    bound = chi_square_bound(fit.parameters.size, space.policy.noise_level)
    views = [ls.fit(objective, fit.hypothesis, fit.x, WHITE, space.policy.usual)]
    pairs = [(fit, views[0])]
    if other is not None and set(other.effects) - set(fit.effects):  # a cause that whitening hid
        seen = space.seen_plainly(fit, other.predictor)
        if other.cost < space.policy.overrules * seen.cost:
            pairs.append((seen, other))
    for whitened, plain in pairs:
        errors = [objective.error(f) * objective.counted for f in (whitened, plain)]
        information = min(effective_samples(errors[1]), objective.count)
        whole, least = (float(e @ e) for e in errors)
        found = max(found, specification_statistic(whole, least, information))
    return found, bound


def _on_all_samples(task: Task, outline: _Found, note: Callable[[str], None]) -> _Found:
    """What the coarse grid came to, fitted to all samples, reduced, and grown by what the grid could not show."""
    data, family = task.data, outline.space.objective.family
    if outline.final.parameters.masses == 1:  # no stiff shaft, no fine substeps
        coarse = 0.5 * data.dt
        data = replace(data, finest=max(data.finest, coarse))
    if isinstance(family, Innovations) and family.shaft is not None:
        shaft = ShaftNoise(outline.base.parameters.linear(outline.base.x), data.dt, data.controller)
        family = Innovations(shaft, family.floor)
    objective = Objective(data, task.objective.weight, family, task.objective.measured, task.objective.counter)
    task = replace(task, objective=objective)
    space = task.space()
    base, final = (_moved(space, task.scales, f) for f in (outline.base, outline.final))
    final = reduced_by(final, _reductions(space), space.prefers, space.score)
    note(f"looking beyond {words(final.effects) or 'the linear model'}, at all samples")
    final = _beam(space).run([final])
    if base.parameters.masses != final.parameters.masses:
        base = _bare(space, final)
    statistic, bound = _specification(space, final) if space.whitens else (outline.statistic, outline.bound)
    return _Found(space, base, final, statistic, bound)


def _moved(space: Moves, scales: Scales, fit: Fit) -> Fit:
    start = moved(space.data, scales, fit)
    return space.refitted(start.hypothesis, start.x)


def _bare(space: Moves, final: Fit) -> Fit:
    """The linear part of a model, fitted without its effects."""
    hypothesis, x = final.hypothesis, final.x
    for e in final.effects:
        x, hypothesis = hypothesis.parameters.removed(x, e), hypothesis.without(e)
    return space.refitted(hypothesis, x)


def _compared(found: _Found, classes: Classes, note: Callable[[str], None]) -> Selection:
    """With the rivals of every effect; a better one takes the place, and all are compared again."""
    space, final = found.space, found.final
    for swaps_left in range(POLICY.swaps, -1, -1):
        rivals, better = _rivals(space, final, swaps_left > 0, classes, note)
        if better is None:
            break
        final = reduced_by(space.canonical(better), _reductions(space), space.prefers, space.score)
    base = found.base if found.base.parameters.masses == final.parameters.masses else _bare(space, final)
    return Selection(space, base, final, rivals, found.statistic, found.bound, found.whitened)


def by_whitened_errors(selection: Selection, classes: Classes, note: Callable[[str], None]) -> Selection | None:
    """What whitened errors had selected in the place of a plain result that names nothing; None where there is none."""
    return None if selection.whitened is None else _compared(selection.whitened, classes, note)


def compared(selection: Selection, final: Fit, classes: Classes, note: Callable[[str], None]) -> Selection:
    """The selection with another model in the place of its own."""
    rivals, _ = _rivals(selection.space, final, False, classes, note)
    return replace(selection, final=final, rivals=rivals)


def _rivals(
    space: Moves, final: Fit, may_swap: bool, classes: Classes, note: Callable[[str], None]
) -> tuple[dict[str, tuple[float, list[Rival]]], Fit | None]:
    """(rivals of each effect, a better model where there is one and a swap is allowed).

    Where a record cannot split a load or a dead band from dry friction, friction stands first: every axis has it.
    """
    found: dict[str, tuple[float, list[Rival]]] = {}
    for term in final.parameters.terms:
        note(f"rivals of {words([term.name])}")
        here = classes(term.name)
        gain, rivals = rivals_of(space, final, term.name, here)
        found[term.name] = (gain, rivals)
        if not rivals or not may_swap:
            continue
        first = rivals[0]
        contained = term.name in first.fit.parameters.term(first.effect).nested
        needed = space.penalty if contained else space.margin if first.effect in here else space.policy.swap
        better = first if first.behind < -needed else None
        if better is None and term.family != EVEN_FRICTION.family and EVEN_FRICTION.name in here:
            better = next((r for r in rivals if r.effect == EVEN_FRICTION.name and r.behind < space.margin), None)
        if better is not None:
            return found, better.fit
    return found, None
