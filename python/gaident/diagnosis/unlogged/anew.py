"""Mechanisms found anew in records that a controller with other numbers drives, without a model to start from.

The linear model that is identified there contains the mechanism, with roots of its own for what is not modelled yet.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gaident.diagnosis.selection.mechanisms import balanced, is_mechanism, on_a_shaft, reduced, rigid
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.errors import GaidentError
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import WORST
from gaident.estimation.term import Scales, Term
from gaident.identification.identify import identify
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["best_on_a_shaft", "dry_friction", "linear_mechanisms", "with_term", "with_usual_effects"]


def linear_mechanisms(scales: Scales, objective: Objective, data: DataSet) -> list[Fit]:
    """One mass and two, fitted to the raw errors of data from what their linear model contains; [] where there is none."""
    try:
        identified = identify(list(data.records), data.controller, workers=1).model
    except GaidentError:  # such as a velocity that falls when the torque of that controller rises
        return []
    starts = ([balanced(data), *rigid(identified)], reduced(identified))
    parts = [_mechanisms([_short(scales, objective, data, model) for model in models]) for models in starts]
    return [fit for part in parts for fit in part]


def _short(scales: Scales, objective: Objective, data: DataSet, model: Model) -> Fit:
    parameters = Parameterisation.of(model, scales, data.moving)
    return ls.fit(objective, Hypothesis(parameters, OpenLoop(data)), parameters.start(model), WHITE, POLICY.short)


def _mechanisms(fits: Iterable[Fit]) -> list[Fit]:
    """[the best of fits that are mechanisms], [] without one."""
    known = [f for f in fits if f.cost < WORST and is_mechanism(f.parameters, f.x)]
    return [min(known, key=lambda f: f.cost)] if known else []


def best_on_a_shaft(objective: Objective, one: Fit) -> list[Fit]:
    """[one mass with its effects as two], [] where that is no mechanism, or where it has two already."""
    if one.parameters.masses > 1:
        return []
    return _mechanisms(ls.fit(objective, h, x, WHITE, POLICY.short) for h, x in on_a_shaft(objective, one))


def dry_friction(space: ModelSpace) -> list[Term]:
    """[its simplest form], [] where it is not testable."""
    return [t for t in space.allowed if t.levels and t.simplest][:1]


def with_usual_effects(space: ModelSpace, objective: Objective, fit: Fit) -> Fit:
    """The fit with what nearly every drive has, dry friction and a current loop that is late, where it is worth its numbers.

    A torque that lacks a filter may hide them.
    """
    late = [t for t in space.allowed if t.in_series and t.place == "actuator"]
    fit = ls.scored(objective, fit)
    for terms in (dry_friction(space), late):
        fit = min((fit, *(with_term(objective, fit, term) for term in terms)), key=space.score)
    return fit


def with_term(objective: Objective, fit: Fit, term: Term) -> Fit:
    """The fit with one term more, from its best start."""
    longer = fit.hypothesis.extended(term)
    starts = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in term.starts(longer.parameters.scales)])
    start = starts[int(np.argmin(objective.costs(longer, starts, WHITE)))]
    return ls.scored(objective, ls.fit(objective, longer, start, WHITE, POLICY.short))
