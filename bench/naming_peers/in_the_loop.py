"""Effects of the library fitted by the library's own code: a hold-out ladder and greedy BIC, both without whitening.

The fits are those of gaident's search (`Task`, `ScoreTest`, `least_squares`); what is another method is how an effect is chosen.
Both take the plain velocity error of a simulation that the logged torque drives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from case import Answer, Case, Values

import gaident as ga
from gaident.control.controller import checked_controller
from gaident.control.pi import bare_pi
from gaident.diagnosis.blas import one_thread
from gaident.diagnosis.controller.as_read import outliers_of_the_log
from gaident.diagnosis.controller.driving import driving_of
from gaident.diagnosis.controller.form_findings import loop_of
from gaident.diagnosis.experiments.candidates import candidates
from gaident.diagnosis.gains import with_effects
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.note import Note
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.screening.score_test import ScoreTest
from gaident.diagnosis.work import Work
from gaident.estimation import least_squares as ls
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit
from gaident.estimation.projection import WORST
from gaident.identification.replay.driven_records import torque_driven
from gaident.models.drive_torque import on_lines
from gaident.policy.table import POLICY

MOST = 3
"""Effects in one model at most."""
FITTED = 0.7
"""Share of the record that the ladder fits; it validates on the rest."""
LADDER = (0.01, 0.03, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
"""Thresholds: share by which an effect has to lower the validation error."""
UNITS = (10.0, 100.0, 500.0, 1000.0, 2000.0, 3000.0, 5000.0, 7000.0, 10000.0, 15000.0)
"""Thresholds: BIC units that an effect has to gain."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A record as gaident's search gets it, and what the replay of its controller shows: effect -> parameters."""

    task: Task
    replayed: Values


def prepared(case: Case) -> Prepared:
    """The task of a case: made once, and kept in its memory."""
    with one_thread(), np.errstate(all="ignore"):
        return case.shared("task", lambda: _prepared(case))


def _prepared(case: Case) -> Prepared:
    given, _ = outliers_of_the_log((case.record,), checked_controller(case.controller))
    asked = loop_of(given, checked_controller(case.controller))
    driven = torque_driven(given, asked.controller)
    records = tuple(on_lines(r, driven.controller) for r in driven.records)
    origin = {r.digest: whole for r, whole in zip(records, given, strict=True)}
    driving = driving_of(records, (), asked, driven, origin)
    here = driving.moved
    idn = ga.identify(list(here.records), bare_pi(driving.controller), workers=1)
    work = Work(here.records, here.validation, driving, idn, None, Note(None), "rotary", None)
    allowed, _ = candidates(work.records, work.clean, work.data, work.excited, work.at_controller)
    task = Task(work.objective, work.scales, idn.model, tuple(allowed), lambda message: None)
    return Prepared(task, {name: dict(values) for name, values in work.at_controller.effects.items()})


def linear(task: Task) -> Fit:
    """The linear model with the least plain error that is a mechanism: one mass, or two where they come closer by 1 %."""
    one = task.one_mass()
    known, others = task.two_masses(one)
    two = [f for f in (*known, *others) if f.cost < 0.99 * one.cost and f.cost < WORST]
    best = min((one, *two), key=lambda f: f.cost)
    return ls.fit(task.objective, best.hypothesis, best.x, WHITE, POLICY.usual)


def _linear(case: Case) -> Fit:
    """The linear mechanism of a case: made once."""
    return case.shared("linear", lambda: linear(prepared(case).task))


def mechanism(case: Case) -> ga.Model:
    """The linear model that other methods begin with: one mass or two."""
    with one_thread(), np.errstate(all="ignore"):
        fit = _linear(case)
        return fit.parameters.model(fit.x)


def extended(task: Task, now: Fit, most: int) -> list[Fit]:
    """The model with each effect of the library that may join it, fitted; `most`: candidates by the library's score test."""
    space = task.space()
    test = ScoreTest(task.objective)
    test.add(now.hypothesis, now.x, [t for t in space.candidates(now) if not t.at_load])
    found = []
    for screened in test.ranked(WHITE)[:most]:
        starts = screened.starts if screened.term.resonates else screened.starts[:2]
        hypothesis = screened.hypothesis.driven_by(now.predictor)
        fits = [ls.fit(task.objective, hypothesis, x, WHITE, POLICY.short) for x in starts]
        found.append(min(fits, key=lambda f: f.cost))
    return [f for f in found if f.cost < WORST]


def grown(task: Task, gain: Callable[[Fit, Fit], float], least: float, most: int) -> list[tuple[float, Fit]]:
    """Greedy steps, each with its gain, until one gains less than `least`."""
    steps: list[tuple[float, Fit]] = [(np.inf, linear(task))]
    while len(steps) <= MOST:
        now = steps[-1][1]
        fits = extended(task, now, most)
        if not fits:
            break
        best = max(fits, key=lambda f: gain(now, f))
        best = ls.fit(task.objective, best.hypothesis, best.x, WHITE, POLICY.usual)
        worth = gain(now, best)
        if not worth > least:
            break
        steps.append((worth, best))
    return steps


def answers_of(
    case: Case, steps: list[tuple[float, Fit]], refitted: Callable[[Fit], Fit], grid: tuple[float, ...]
) -> dict[float, Answer]:
    """The answer at each threshold: the steps up to the first that gains too little, and what the replay shows."""
    replayed = prepared(case).replayed
    of_count: dict[int, Answer] = {}
    found = {}
    for threshold in grid:
        count = next((i for i, (gain, _) in enumerate(steps) if not gain > threshold), len(steps)) - 1
        if count not in of_count:
            fit = refitted(steps[count][1])
            of_count[count] = answer_of(case, fit, replayed)
        found[threshold] = of_count[count]
    return found


def answer_of(case: Case, fit: Fit, replayed: Values) -> Answer:
    """The effects of a fit, and its free run."""
    made = fit.parameters.model(fit.x)
    effects = replayed | {name_of(e.name): {k: float(v) for k, v in e.parameters.items()} for e in made.effects}
    rmse = case.before if not effects else case.free_run(with_effects(made, replayed))
    return Answer(effects, rmse=None if case.cell.loop else rmse)


def ladder(case: Case) -> dict[float, Answer]:
    """The effect with the least error on the rest of the record, fitted to its first part, as long as it lowers it enough."""
    whole = prepared(case).task
    n = len(whole.objective.weight)
    mask = (np.arange(n) < FITTED * n).astype(np.float64)
    task = replace(whole, objective=whole.objective.weighted(whole.objective.weight * mask))
    rest = (mask == 0.0) & (whole.objective.weight > 0.0)

    def error(fit: Fit) -> float:
        return float(np.sqrt(np.mean(whole.objective.errors(fit.hypothesis, fit.x[None, :])[0][rest] ** 2)))

    def gain(now: Fit, more: Fit) -> float:
        return 1.0 - error(more) / error(now)

    def on_all_of_it(fit: Fit) -> Fit:
        return ls.fit(whole.objective, fit.hypothesis, fit.x, WHITE, POLICY.usual)

    with one_thread(), np.errstate(all="ignore"):
        steps = grown(task, gain, LADDER[0], 100)
        return answers_of(case, steps, on_all_of_it, LADDER)


def bic(case: Case) -> dict[float, Answer]:
    """The effect with the lowest BIC of the plain errors, all samples counted as independent, as long as it gains enough."""
    task = prepared(case).task

    def units(fit: Fit) -> float:
        n = task.objective.count
        return float(n * np.log(max(fit.cost, 1e-300) / n) + len(fit.x) * np.log(n))

    with one_thread(), np.errstate(all="ignore"):
        steps = grown(task, lambda now, more: units(now) - units(more), UNITS[0], 8)
        return answers_of(case, steps, lambda fit: fit, UNITS)


def refitted(case: Case, effects: list[str]) -> ga.Model | None:
    """The linear model with effects that another method named, fitted to the record; None where the fit cannot carry them."""
    ready = prepared(case)
    with one_thread(), np.errstate(all="ignore"):
        now = _linear(case)
        for name in [e for e in effects if e not in ready.replayed]:
            test = ScoreTest(ready.task.objective)
            terms: list[Any] = [t for t in ready.task.space().candidates(now) if t.name == name]
            test.add(now.hypothesis, now.x, terms)
            ranked = test.ranked(WHITE)
            if not ranked:
                continue
            starts = [s for screened in ranked for s in screened.starts[:2]]
            hypothesis = ranked[0].hypothesis.driven_by(now.predictor)
            now = min((ls.fit(ready.task.objective, hypothesis, x, WHITE, POLICY.usual) for x in starts), key=lambda f: f.cost)
        return with_effects(now.parameters.model(now.x), {k: v for k, v in ready.replayed.items() if k in effects})
