"""The whole extension of a linear model: mechanism, effects, rivals. Long records are searched on a coarse grid of time first."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.bases import base_fit, linear_bases, loop_starts, one_mass, two_mass_fits, without_second_mass
from gaident.diagnosis.candidates import CANDIDATES, FRICTION, Scales
from gaident.diagnosis.coarse import Coarse, blocks_of, moved_to
from gaident.diagnosis.driven import AT_CONTROLLER, Driven
from gaident.diagnosis.layout import swings
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import Fit, Problem
from gaident.diagnosis.rivals import Rival, rivals_of
from gaident.diagnosis.stepwise import MOST, Search, with_second_mass
from gaident.models.model import Model
from gaident.models.simulate import simulate

__all__ = ["Extension", "extended", "numbered"]

IMMATERIAL = 0.02
"""Part of the rms error of the linear mechanism that counts as noise, however little noise there is."""

MATERIAL = 0.01
"""BIC units per sample of a long record: less, half a per cent of the whitened rms error, is significant there and no cause."""

ASTRAY = 1.5  # times the noise of the velocity: what a model may leave, whitened, before the free run is asked for a better one
SWAP = 2.0  # BIC units by which a rival has to be better to take a finding's seat
SEEN = 0.8  # of half the sampling frequency: how far up a coarse grid shows a resonance
ROUNDS = 4  # of fits and filters, at most, until the final numbers stand
CLOSE = 4  # rivals on the coarse grid that are fitted to all samples

Vector = NDArray[np.float64]
Twins = Callable[[str], Collection[str]]


@dataclass
class Extension:
    """The linear fit, the extended one, and per effect (gain in BIC units, rivals); the search that knows their kin.

    decided: the extended model as the rivals were compared with it; final: with the numbers that are reported.
    """

    search: Search
    base: Fit
    decided: Fit
    rivals: dict[str, tuple[float, list[Rival]]]
    final: Fit
    known: Callable[[Fit], None] | None = None

    def instead(self, simpler: Fit, twins: Twins, note: Callable[[str], None]) -> Extension:
        """With a simpler model in the place of the decided one."""
        decided, rivals, _ = _rivals(self.search, simpler, False, twins, note, self.known)
        numbers = decided if self.known is None else numbered(self.search.problem, decided)
        return Extension(self.search, self.base, decided, rivals, numbers, self.known)


def extended(
    problem: Problem, driven: Driven, scales: Scales, model: Model, allowed: list[str], twins: Twins, note: Callable[[str], None]
) -> Extension:
    """The search over all samples, or on the coarse grid and then over all samples."""
    one = base_fit(problem, driven, scales, one_mass(driven, model))
    error = problem.errors(one.layout, one.x[None, :])[0]
    problem.floor = _floor(problem, driven, scales, model, one, error)
    blocks = blocks_of(driven, error)
    if blocks == 1:
        search = Search(problem, driven, allowed, note)
        base, final = _found(search, scales, model)
        return _compared(search, base, final, twins, note)
    coarse = Coarse.of(driven, problem, scales, blocks)
    outline = Search(coarse.problem, coarse.driven, [e for e in allowed if e not in AT_CONTROLLER], note)
    outline.threshold = max(outline.threshold, MATERIAL * coarse.problem.count)
    base_c, final_c = _found(outline, coarse.scales, model)
    if final_c.layout.masses == 1:  # no stiff shaft, no fine substeps
        driven = replace(driven, finest=max(driven.finest, 0.5 * driven.records[0].dt))
        problem = replace(problem, predict=driven.predict)
    search = Search(problem, driven, allowed, note)
    search.threshold = max(search.threshold, MATERIAL * problem.count)
    base, final = (_on(search, scales, f) for f in (base_c, final_c))
    if final.effects and base.layout.masses != final.layout.masses:
        base = _bare(search, final)
    final = search.thinned(without_second_mass(search, final), every=True)
    final = _completed(search, without_second_mass(search, final), note)

    def known(fit: Fit) -> None:
        """What the coarse grid says about the seat of each effect, fitted to all samples."""
        on_grid = coarse.problem.settled(_moved(outline, coarse.scales, fit))
        for effect in fit.effects:
            less = search.without(fit, effect)
            key = (less.layout.masses, frozenset(less.effects))
            if key in search.known:
                continue
            note(f"what else could be {effect.replace('_', ' ')}")
            near = [r.fit for r in rivals_of(outline, on_grid, effect, twins(effect))[1]][:CLOSE]
            if effect in FRICTION:  # what reversals look like in detail tells the family apart: all of it, at all samples
                others = outline.extensions(outline.without(on_grid, effect))
                near += [f for f in others if f.effects[-1] in FRICTION and f not in near]
            search.known[key] = sorted((_on(search, scales, f) for f in near), key=lambda f: f.bic)

    done = _compared(search, base, final, twins, note, known)
    done.final = numbered(problem, done.decided)
    search.problem.simulations += coarse.problem.simulations
    return done


def _floor(problem: Problem, driven: Driven, scales: Scales, model: Model, one: Fit, error: Vector) -> float:
    """Variance of what counts as noise beside the noise that the velocity shows [(rad/s)^2]."""

    def beyond(power: float) -> float:
        return max(IMMATERIAL**2 * power - driven.noise**2, 0.0)

    floor = beyond(float(np.mean(error[problem.weight > 0.0] ** 2)))
    if not np.isfinite(floor):
        return 0.0
    if floor > 0.0 and driven.loopable:  # what the loop does not let through is none either, as a load that adds up without it
        inside = np.concatenate([r.velocity - simulate(model, r, driven.controller) for r in driven.records])
        floor = min(floor, beyond(float(np.mean(inside[problem.weight > 0.0] ** 2))))
    if floor > 0.0:  # a shaft that resonates is no misfit
        floor = min([floor, *(beyond(f.cost / problem.count) for f in two_mass_fits(problem, driven, scales, model, one))])
    return floor


def numbered(problem: Problem, fit: Fit) -> Fit:
    """The numbers of a model that leaves more than noise.

    A misfit is no stationary noise: a filter of what it leaves would trust the frequencies where it happens to be small, and
    the instants of reversals above all. The filter is made as if as much again of white noise had been on the velocity, which
    lies between inverse identification (all weight on short times) and a plain free run (all on the slowest misfit).
    """
    for _ in range(ROUNDS):
        error = problem.errors(fit.layout, fit.x[None, :])[0]
        loud = replace(problem, floor=float(np.mean(error[problem.weight > 0.0] ** 2)), simulations=0)
        before = loud.judged(fit)
        fit = loud.settled(before)
        problem.simulations += loud.simulations
        if before.bic - fit.bic < 1.0:
            break
    return fit


def _found(search: Search, scales: Scales, model: Model) -> tuple[Fit, Fit]:
    """(linear fit, extended fit), from one mass or two, whichever ends better."""
    ends: list[tuple[Fit, Fit]] = []
    bases = linear_bases(search, scales, model)
    if scales.blocks > 1 and bases[0].layout.masses == 2:
        # A misfit looks like a resonance on a coarse grid: one mass has its turn in any case.
        one = base_fit(search.problem, search.driven, scales, one_mass(search.driven, model))
        bases.insert(0, search.problem.settled(one))
    for base in bases:
        end = without_second_mass(search, search.run(base))
        # On a coarse grid a resonance beyond what it shows is some other thing of short times: all samples will tell.
        # Two masses that do not swing describe something else, which one mass leaves for all to see.
        if not ends or (swings(end.layout, end.x) and (scales.blocks == 1 or _resonance(end) < SEEN * np.pi / scales.dt)):
            ends.append((base, end))
        if search.fitter.runs_free(end):
            break
    base, end = min(ends, key=lambda e: e[1].bic)
    if search.driven.loopable and not search.fitter.runs_free(end, ASTRAY):
        other = search.freed(end, loop_starts(search, scales, model, bases))
        if other is not end:
            end = without_second_mass(search, other)
            base = base if base.layout.masses == end.layout.masses else _bare(search, end)
    return base, search.leanest(end)


def _resonance(fit: Fit) -> float:
    """Of a fit of two masses [rad/s]; 0 for one."""
    return float(np.sqrt(abs(fit.layout.base_values(fit.x[None, :])[0][3]))) if fit.layout.masses == 2 else 0.0


def _completed(search: Search, final: Fit, note: Callable[[str], None]) -> Fit:
    """What the coarse grid could not show: more effects, from all samples."""
    while len(final.effects) < MOST:
        note(f"looking beyond {', '.join(e.replace('_', ' ') for e in final.effects) or 'the linear model'}, at all samples")
        found = search.best_extension(final)
        if found is None:
            break
        needed = search.needed(found, found.effects[-1])
        if final.bic - found.bic < needed or not search.material(final, found):
            break
        final = search.thinned(with_second_mass(search.problem, found))
    return search.leanest(final)


def _compared(
    search: Search, base: Fit, final: Fit, twins: Twins, note: Callable[[str], None], known: Callable[[Fit], None] | None = None
) -> Extension:
    """With the rivals of every finding; a better one takes the seat, and all are compared again."""
    for swaps_left in (2, 1, 0):
        final, rivals, again = _rivals(search, final, swaps_left > 0, twins, note, known)
        if not again:
            break
    thinned = search.thinned(final, every=True)
    if thinned is not final:  # gains and rivals are those of the model that is reported
        final, rivals, _ = _rivals(search, thinned, False, twins, note, known)
    return Extension(search, base, final, rivals, final, known)


def _rivals(
    search: Search, final: Fit, may_swap: bool, twins: Twins, note: Callable[[str], None], known: Callable[[Fit], None] | None
) -> tuple[Fit, dict[str, tuple[float, list[Rival]]], bool]:
    """(model, rivals, whether a better one has taken a seat and the round has to be run again).

    Where a record cannot split a load or a dead band from dry friction, friction stands first: every axis has it.
    """
    found: dict[str, tuple[float, list[Rival]]] = {}
    if known is not None:
        known(final)
    for effect in final.effects:
        note(f"rivals of {effect.replace('_', ' ')}")
        gain, rivals = rivals_of(search, final, effect, twins(effect))
        found[effect] = (gain, rivals)
        if not rivals:
            continue
        contained = effect in CANDIDATES[rivals[0].effect].parents
        here = twins(effect)
        needed = (
            search.needed(rivals[0].fit, rivals[0].effect) if contained else search.margin if rivals[0].effect in here else SWAP
        )
        better = rivals[0] if rivals[0].behind < -needed else None
        if better is None and effect not in FRICTION and "coulomb_friction" in here:
            better = next((r for r in rivals if r.effect == "coulomb_friction" and r.behind < search.margin), None)
        if may_swap and better is not None:
            return search.thinned(with_second_mass(search.problem, better.fit)), found, True
    return final, found, False


def _moved(search: Search, scales: Scales, fit: Fit) -> Fit:
    """The model on the grid of a search, start states and bounds its own."""
    start = moved_to(search.driven, scales, fit)
    return search.problem.fit(start.layout, start.x, WHITE, 8)


def _on(search: Search, scales: Scales, fit: Fit) -> Fit:
    """The model fitted to all that the grid of a search holds."""
    return search.problem.settled(_moved(search, scales, fit))


def _bare(search: Search, final: Fit) -> Fit:
    """The linear part of a model, fitted without its effects."""
    layout, x = final.layout, final.x
    for e in final.effects:
        x, layout = layout.removed(x, e), layout.without(e)
    return search.problem.settled(search.problem.fit(layout, x, WHITE, 12))
