"""How far numbers may be off by what every axis has, a model lacks, and the records do not exclude.

**Friction.** Every axis has dry friction, and many have drag.
A record of few speeds shows their sum with viscous friction far better than the parts.
So each friction of one number that the inverse-dynamics regression knows, dry friction and quadratic drag, is added to a model
that has none, all is fitted again, and x gets the covariance

    larger(C, C_beside) - C + d d',   d = x beside that friction - x,   C, C_beside: of x in the one fit and in the other

of the friction with which the viscous friction is known least (`larger`: see `regression.larger_of`).
A friction whose size comes out as 0 moves nothing, but its slopes widen what is known of the rest.

**Delay and lag.** Every drive has some of either, and a log shows their sum far better than the parts.
Where a model has one of them alone, the other one is added, and all is fitted again:

    std^2 = std_alone^2 + (value - value beside the other)^2

Where the records exclude what is added, these parts are small.
The name is another matter: the criterion decides it, and what no record tells apart is among the alternatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, called, say
from gaident.diagnosis.explain.late_inside import is_late
from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.mechanics import mechanics_of, of_no_axis
from gaident.estimation import least_squares as ls
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.regression.regression import larger_of
from gaident.estimation.term import Term
from gaident.estimation.uncertainty import local_covariance
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["friction_beside", "late_together"]

Matrix = NDArray[np.float64]
NAME = "viscous_friction"


def friction_beside(objective: Objective, fit: Fit) -> tuple[Matrix, list[Text]]:
    """(covariance to be added to that of x, notes).

    0 for a model with friction, with impacts, whose minima differ by more than this, and for what no axis is.
    """
    part = np.zeros((len(fit.x), len(fit.x)))
    alone = mechanics_of(objective, fit)
    viscous = alone.get(NAME)
    if viscous is None or not np.isfinite(viscous.std) or of_no_axis(alone) is not None:
        return part, []
    if fit.impacts or any(_is_friction(fit, t) for t in fit.parameters.terms):
        return part, []
    widest, of = viscous.std, None
    for term in LIBRARY.values():
        if _is_friction(fit, term) and term.size == 1 and term.regressed is not None and not term.at_load:
            more = _part(objective, fit, term)
            std = mechanics_of(objective, fit, more)[NAME].std
            if std > widest:
                part, widest, of = more, std, term
    if of is None or not widest > max(POLICY.contradiction * viscous.std, POLICY.check_share * abs(viscous.value)):
        return part, []
    text = "These data do not tell viscous friction from {}: the deviations of the mechanics contain what that would change."
    return part, [say(text, called(of.name))]


def _is_friction(fit: Fit, term: Term) -> bool:
    """Whether its torque is a function of the velocity that brakes, whatever the size."""
    return term.levels or (term.curve is not None and term.limits(fit.parameters.scales)[0][0] >= 0.0)


def _part(objective: Objective, fit: Fit, term: Term) -> Matrix:
    """The covariance for one friction; 0 for what either fit does not determine."""
    lowest = tuple(low for low, _ in term.limits(fit.parameters.scales))
    other = _beside(objective, fit, term, [lowest])
    kept = np.delete(np.arange(len(other.x)), other.parameters.slot(term.name))
    C, move = local_covariance(objective, fit), other.x[kept] - fit.x
    beside = local_covariance(objective, other)[np.ix_(kept, kept)]
    known = np.isfinite(np.diag(C)) & np.isfinite(np.diag(beside))
    part, at = np.zeros_like(C), np.ix_(known, known)
    part[at] = larger_of(C[at], beside[at]) - C[at] + np.outer(move[known], move[known])
    return part


def late_together(
    objective: Objective, fit: Fit, allowed: Sequence[Term], found: Mapping[str, dict[str, Estimate]]
) -> tuple[dict[str, dict[str, Estimate]], list[Text]]:
    """(estimates of effects with what another late one would change, notes); found: those of the model alone."""
    late = [t for t in fit.parameters.terms if is_late(t) and t.name in found]
    if len(late) != 1 or fit.impacts or late[0].size != 1:
        return dict(found), []
    alone = late[0]
    other = next((t for t in allowed if is_late(t) and t.place == "actuator" and t.name not in _same(alone.name)), None)
    beside = None if other is None else _beside(objective, fit, other)
    if other is None or beside is None or not beside.cost < fit.cost:  # no better: the data exclude it
        return dict(found), []
    ((name, value),) = found[alone.name].items()
    moved = float(alone.natural(beside.x[beside.parameters.slot(alone.name)][None, :])[0, 0])
    wider = replace(value, std=float(np.hypot(value.std, moved - value.value)))
    estimates = {**found, alone.name: {name: wider}}
    if abs(moved - value.value) <= POLICY.contradiction * value.std or value.unit != "s":
        return estimates, []
    text = (
        "What is late here is one number, {:.3g} ms: beside a {} the {} would be {:.3g} ms, and these data do not tell how much "
        "each of them is. Its deviation contains that."
    )
    return estimates, [say(text, 1e3 * value.value, called(other.name), called(alone.name), 1e3 * moved)]


def _same(effect: str) -> set[str]:
    return {effect, *equivalents(effect)}


def _beside(objective: Objective, fit: Fit, term: Term, more: Sequence[tuple[float, ...]] = ()) -> Fit:
    """The model with one effect more, fitted again from the best of its starts and of more of them."""
    longer = fit.hypothesis.extended(term)
    rows = [*more, *term.starts(longer.parameters.scales)]
    X = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in rows])
    start = X[int(np.argmin(objective.costs(longer, X, fit.noise)))]
    return ls.fit(objective, longer, start, fit.noise, POLICY.usual)
