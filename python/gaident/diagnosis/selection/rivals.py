"""Other effects in a finding's place: what the record cannot tell from it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.model_space import representative, words
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.criterion import chi_square_bound, cost_of
from gaident.estimation.objective import Fit
from gaident.estimation.term import Term

__all__ = ["Classes", "Replacement", "of_each_effect", "rivals_of"]

Classes = Callable[[str], Collection[str]]


@dataclass(frozen=True)
class Replacement:
    """Another effect in the place of one: how much worse (BIC units) the whole model is with it."""

    effect: str
    behind: float
    fit: Fit

    @property
    def term(self) -> Term:
        """The other effect."""
        return self.fit.parameters.term(self.effect)


def of_each_effect(
    space: Moves,
    final: Fit,
    may_swap: bool,
    classes: Classes,
    note: Callable[[str], None],
    kept: Collection[str] = (),
) -> tuple[dict[str, tuple[float, list[Replacement]]], Fit | None]:
    """(rivals of each effect, a better model where there is one and a swap is allowed; not for the effects that are `kept`).

    Where a record cannot tell a load or a dead band from dry friction, friction has the name: every axis has it.
    """
    found: dict[str, tuple[float, list[Replacement]]] = {}
    # The effect that gains least comes first: it is the likeliest to be replaced, and then all are compared again.
    for term in sorted(final.parameters.terms, key=lambda t: space.without(final, t.name).bic):
        note(f"rivals of {words([term.name])}")
        here = classes(term.name)
        gain, rivals = rivals_of(space, final, term.name, here)
        found[term.name] = (gain, rivals)
        if not rivals or not may_swap or term.name in kept:
            continue
        first = rivals[0]
        contained = term.name in first.fit.parameters.term(first.effect).nested
        named = first.effect in here or _has_the_name(term, first.term)
        needed = space.penalty if contained else space.margin if named else space.policy.swap
        better = first if first.behind < -needed else None
        if better is None:
            # Of effects that these records cannot tell apart, the simplest of a family is preferred to those outside of it, and
            # dry friction to what has no level.
            others = [r for r in rivals if r.term.simplest and r.behind < space.margin]
            better = next((r for r in others if r.effect in here and r.term.family != term.family), None)
            better = better or next((r for r in others if _has_the_name(r.term, term)), None)
        if better is None and (first_of := representative(term)) != term.name:
            # Rounding decides between effects that are the same to every record: the first of them has the name.
            better = next((r for r in rivals if r.effect == first_of and r.behind < space.policy.swap), None)
        if better is not None:
            return found, better.fit
    return found, None


def _has_the_name(one: Term, other: Term) -> bool:
    """Whether an effect has the name before another of its family that the records do not tell from it: dry friction."""
    return one.simplest and one.family == other.family and bool(one.levels) and not other.levels


def rivals_of(space: Moves, final: Fit, effect: str, equivalent: Collection[str] = ()) -> tuple[float, list[Replacement]]:
    """(gain of `effect` in the final model, other effects in its place that come within reach, or are equivalent here)."""
    less = space.known(space.without(final, effect))
    gain = space.under_predictor_of(less, final).bic - final.bic
    term = final.parameters.term(effect)
    found = []
    turned = space.at_other_side(final, term)
    elsewhere = "" if turned is None else turned.parameters.terms[-1].name
    others = [f for f in space.extended(less) if _only_new(f, final) not in ("", elsewhere)]
    grown = {_only_new(f, final) for f in others}
    others += [f for f in space.as_other_wave(final, term) if _only_new(f, final) not in grown]
    others = _least_of_each(final, [*others, *_as_dry_friction(space, final, term, equivalent)])
    missed = term.impacts and _missed(space, final, less)
    if missed:  # a candidate may be the model with another mechanism and no effect
        others = [f for f in others if not f.parameters.term(_only_new(f, final)).impacts]
        others += [f for f in space.instead(final, term) if _only_new(f, final) not in ("", elsewhere)]
    if final.impacts and not space.quiet(final):
        reach = space.policy.rival_reach * gain
        others = [space.in_its_place(final, term, f, reach) for f in others]
        others = [f for f in others if _only_new(f, final)]  # a search may have made another model of it
    for f in sorted(others, key=space.score):
        other = f.parameters.term(_only_new(f, final))
        behind = f.bic - final.bic
        if other.name in equivalent:
            found.append(Replacement(other.name, behind, f))
            continue
        if effect in other.nested:
            if not space.whitens:  # of a misfit any detail explains a part
                continue
            # A generalisation is never worse by more than its parameters: only a hint of what it adds counts.
            more = other.size - term.size
            gained = cost_of(more, space.objective.information) - behind  # likelihood ratio, 2 ln
            if gained < chi_square_bound(more, space.policy.detail_level):
                continue
            if not space.beyond_simulation(final, f) or (behind < -space.penalty and not space.in_both_loops(final, f)):
                continue
        if behind < space.margin or (missed and other.impacts):
            found.append(Replacement(other.name, behind, f))
    found += _beside_simpler(space, final, term)
    if turned is not None and turned.bic - final.bic < space.margin:
        there = Replacement(elsewhere, turned.bic - final.bic, turned)
        found.insert(0 if not found or there.behind < found[0].behind else len(found), there)
    return float(gain), found


def _as_dry_friction(space: Moves, final: Fit, term: Term, equivalent: Collection[str]) -> list[Fit]:
    """The model with dry friction of the size of a constant torque in its place, where these records cannot tell them apart.

    In one direction both are the same torque.
    A fit of dry friction from other levels may end with an axis that sticks where the measured one moves.
    """
    dry = [LIBRARY[name] for name in sorted(equivalent) if LIBRARY[name].levels and LIBRARY[name].simplest]
    if not dry or not LIBRARY[term.name].constant:
        return []
    size = np.abs(final.x[final.parameters.slot(term.name)])
    short, x = final.hypothesis.without(term.name), final.parameters.removed(final.x, term.name)
    may = [other for other in dry if other in space.allowed and other.name not in final.effects]
    return [space.continued(short.extended(other), final, short.parameters.inserted(x, size)) for other in may]


def _least_of_each(final: Fit, others: Sequence[Fit]) -> list[Fit]:
    """Of the fits with the same new effect the one of least BIC."""
    least: dict[str, Fit] = {}
    for f in others:
        name = _only_new(f, final)
        if name not in least or f.bic < least[name].bic:
            least[name] = f
    return list(least.values())


def _beside_simpler(space: Moves, final: Fit, term: Term) -> list[Replacement]:
    """Effects that come as close beside a simpler friction as a generalisation of it does alone.

    A small drag bends the curve of a friction over the speed as a shallow Stribeck hump does.
    """
    found = []
    for simple in (LIBRARY[name] for name in term.nested if term.family and space.may(LIBRARY[name])):
        simpler = space.known(space.as_nested(final, term, simple))
        for f in space.extended(simpler):
            new = [e for e in f.effects if e not in simpler.effects]
            if len(new) == 1 and simple.name in f.effects and f.bic - final.bic < space.margin:
                found.append(Replacement(new[0], f.bic - final.bic, f))
    return sorted(found, key=lambda r: r.behind)


def _only_new(fit: Fit, final: Fit) -> str:
    """The one effect that another model has in the place of one of the final model's; "" where more is different."""
    new = [e for e in fit.effects if e not in final.effects]
    return new[0] if len(new) == 1 and len(fit.effects) == len(final.effects) else ""


def _missed(space: Moves, final: Fit, less: Fit) -> bool:
    """Whether an effect with impacts leaves so much that its minimum was missed, or that of another effect with impacts.

    More than noise, and more than the share `overrules` of the squared error before whitening that the model without it leaves.
    """
    if space.is_noise(final) and space.small_unwhitened(final):
        return False
    return space.unwhitened_cost(final) > space.policy.overrules * space.unwhitened_cost(less)
