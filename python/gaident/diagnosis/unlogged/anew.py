"""Mechanisms found anew in records that a controller with other numbers drives, without a model to start from.

The linear model that is identified there contains the mechanism, with roots of its own for what is not modelled yet.
The resonance of a shaft is also searched beside one mass, with and without what nearly every drive has.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from gaident.diagnosis.selection.mechanisms import balanced, is_mechanism, on_a_shaft, reduced, rigid
from gaident.diagnosis.selection.model_space import ModelSpace
from gaident.diagnosis.selection.screening.score_test import ScoreTest
from gaident.errors import GaidentError
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import WORST
from gaident.estimation.term import Scales, Term
from gaident.identification.closed_loop import space_of
from gaident.identification.identify import identify
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["dry_friction", "mechanisms_under", "with_term", "with_usual_effects", "with_wave"]

POLES = (1, 1)  # no decision: a formula: of two masses, p
ZEROS = (2, 3)  # no decision: a formula: of two masses, q, and one pole and zero more


def mechanisms_under(space: ModelSpace, scales: Scales, objective: Objective, data: DataSet) -> list[Fit]:
    """One mass and two, fitted to the raw errors of data; [] where none fits.

    One mass has the usual effects where they are worth it, and its shaft has them then.
    """
    one = _short(scales, objective, data, balanced(data))
    if not one.cost < WORST:
        return []
    usual = with_usual_effects(space, objective, one)
    bases = [one, usual] if usual.effects else [one]
    shafts = [fit for base in bases for fit in _on_a_shaft(objective, base)]
    return [usual, *(ls.scored(objective, fit) for fit in shafts + _identified(scales, objective, data))]


def _identified(scales: Scales, objective: Objective, data: DataSet) -> list[Fit]:
    """[the best two masses, and one, that the linear model of the data contains]; [] where there is no such model."""
    records, controller = list(data.records), data.controller
    try:
        few = replace(space_of(records, controller), p=POLES, q=ZEROS)
        found = identify(records, controller, few, workers=1).model
    except GaidentError:  # such as a velocity that falls when the torque of that controller rises
        return []
    parts = ([_short(scales, objective, data, model) for model in models] for models in (rigid(found), reduced(found)))
    return [fit for part in parts for fit in _mechanisms(part)]


def _short(scales: Scales, objective: Objective, data: DataSet, model: Model) -> Fit:
    parameters = Parameterisation.of(model, scales, data.moving)
    return ls.fit(objective, Hypothesis(parameters, OpenLoop(data)), parameters.start(model), WHITE, POLICY.short)


def _mechanisms(fits: Iterable[Fit]) -> list[Fit]:
    """[the best of fits that are mechanisms], [] without one."""
    known = [f for f in fits if f.cost < WORST and is_mechanism(f.parameters, f.x)]
    return [min(known, key=lambda f: f.cost)] if known else []


def _on_a_shaft(objective: Objective, one: Fit) -> list[Fit]:
    """[one mass with its effects as two], [] where that is no mechanism."""
    return _mechanisms(ls.fit(objective, h, x, WHITE, POLICY.short) for h, x in on_a_shaft(objective, one))


def dry_friction(space: ModelSpace, fit: Fit) -> list[Term]:
    """[its simplest form], [] where it is not testable, or in the fit."""
    if any(t.levels for t in fit.parameters.terms):
        return []
    return [t for t in space.allowed if t.levels and t.simplest][:1]


def with_usual_effects(space: ModelSpace, objective: Objective, fit: Fit) -> Fit:
    """The fit with what nearly every drive has, dry friction and a current loop that is late, where it is worth its numbers.

    A torque that lacks a filter may hide them.
    """
    fit = ls.scored(objective, fit)
    late = [t for t in space.allowed if t.in_series and t.place == "actuator" and t.name not in fit.effects]
    for terms in (dry_friction(space, fit), late):
        fit = min((fit, *(with_term(objective, fit, term) for term in terms)), key=space.score)
    return fit


def with_wave(space: ModelSpace, objective: Objective, fit: Fit) -> list[Fit]:
    """[the fit with the torque over the angle that promises most, cogging or an unbalance]; [] where none promises anything."""
    there = {*fit.effects}.union(*(t.excludes for t in fit.parameters.terms))
    waves = [t for t in space.allowed if t.harmonic == "torque" and not t.at_load and t.name not in there]
    test = ScoreTest(objective)
    test.add(fit.hypothesis, fit.x, waves)
    best = [s for s in test.ranked(WHITE) if s.fall > 0.0][:1]
    return [ls.scored(objective, ls.fit(objective, s.hypothesis, s.starts[0], WHITE, POLICY.short)) for s in best]


def with_term(objective: Objective, fit: Fit, term: Term) -> Fit:
    """The fit with one term more, from its best start."""
    longer = fit.hypothesis.extended(term)
    starts = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in term.starts(longer.parameters.scales)])
    start = starts[int(np.argmin(objective.costs(longer, starts, WHITE)))]
    return ls.scored(objective, ls.fit(objective, longer, start, WHITE, POLICY.short))
