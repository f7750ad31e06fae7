"""How old the measured velocity is against the torque: half a sample where it is the difference of an encoder's angle.

    w_m(n) = (theta(n) - theta(n-1))/T = 1/T int w dt over the last sample of the controller

is the mean over that sample, to second order in T the velocity in its middle.
That is no cause: every drive that differences its encoder has this age.
A search without it fits it as a delay or, beside a current loop, as a resonance.

- Where the angle is logged and the velocity is its difference, the age is known.
- The lattice of the velocities says how many lines the encoder had, to a turn, to a metre or to a screw's lead.
  Where they are a whole number, or a power of two as far as the decimals of a log show, the velocity may be a difference.
  Not every velocity on such a lattice is one: an observer or the drive's firmware may round to it.
  So both ages are fitted, with the linear mechanism alone and with the lag of a current loop.
  The velocity is no difference where the age of 0 scores better by more than the margin of two rivals, and so does the model that
  the search finds with it.
  Nor is it one where the model found with half a sample scores better with the age of 0 by that margin, or without one of its
  delays, lags or resonances in series at all: the linear mechanism shows the age less where an effect is hidden.
- On another lattice (a gear, a scale, a unit between) the velocity may be a difference.
  Where the search finds a delay, a lag or a resonance in series with the mechanism, it is made again with the age of half
  a sample, which is no effect and costs nothing.
  The age is accepted where fewer effects score better with it, or as many effects by the margin of two rivals,
  both under the errors of the first search.

A torque that drives the model is held over each line of the log.
The torque of a controller which is faster than the log changes between the lines, and the age is below 0 (`torque_ahead.py`).
A delay of less than half a line does not show in such a log.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import TURN, Text, say
from gaident.data.signals.difference import is_difference_at_clock
from gaident.data.signals.lattice import encoder_lines, encoder_step
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.mechanisms import is_mechanism, on_a_shaft, one_mass, reduced, resonance, swings
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.select import Selection
from gaident.diagnosis.selection.torque_ahead import ahead_of_line, closer
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.found_numbers import worth
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Innovations, Objective
from gaident.estimation.regression.torque_lag import TorqueLag
from gaident.estimation.term import Scales, Term
from gaident.models.drive_torque import HALF
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["searched"]

LEADS = (1e-3, 3e-3, 5e-3, 25e-3)  # no decision: m; those of ISO 3408-2, 1 to 40 mm, are these but for powers of two

AHEAD = (
    "The motion comes {:.2g} ms before a {torque} that is held over each line of the log, which no axis does: between the lines "
    "the {torque} goes on, as that of a controller does that is faster than the log. The simulation has it; what is late by less "
    "than half a line ({:.2g} ms) is not seen in this log. {}"
)
MEASURED_AHEAD = (
    "The motion comes {:.2g} ms before a measured {torque} that is held over each line of the log: between the lines it goes on, "
    "or it was filtered or written late on its way into the log. The simulation has it; what is late by less than half a line "
    "({:.2g} ms) is not seen in this log. {}"
)

NO_DIFFERENCE = (
    "The velocities lie on the lattice of an encoder's {angle} ({} lines {}), but are no difference over one sample, which would "
    "be {:.3g} ms old: with that age the model leaves more, or needs a delay, a lag or a resonance beside it."
)

Vector = NDArray[np.float64]


def searched(
    objective: Objective,
    scales: Scales,
    model: Model,
    allowed: Sequence[Term],
    search: Callable[[Objective, int, Fit | None], Selection],
    ticks: int = 0,
    joint: Callable[[Selection], Selection | None] = lambda found: None,
) -> tuple[Selection, list[Text]]:
    """What a search selects over records whose velocity is as old as they show, with a note on that.

    allowed: the effects that are searched for.
    search: of these records, with at most so many effects; what it ends with is compared with a model that is given.
    ticks: samples to a line of a controller that is not simulated, while the torque that was measured on the lines drives the
    model: the mean over a line of what is measured at its begin comes half a line late, a differenced velocity half a sample.
    joint: a selection with the numbers of the controller, which its torque showed, where the model has them; None: as they are.
    """
    most = POLICY.most_effects
    data = objective.data
    controller = data.controller
    if controller is not None and (controller.loop == "continuous" or (any(data.moving) and not data.told_by_torque)):
        return search(objective, most, None), []
    every = 1 if controller is None else controller.log_every(data.dt)
    task = Task(objective, scales, model, tuple(allowed), lambda message: None)
    ahead = ahead_of_line(task) if every == 1 else None
    if ahead is None and ticks > 1:
        ahead = TorqueLag(HALF - HALF / ticks, HALF / ticks, 0.0)
    if ahead is not None:
        lag = ahead

        def under(lines: float) -> Selection:
            near = (-lines - lag.std, lag.std - lines)
            return search(Objective(data.aged(-lines, near), objective.weight, counter=objective.counter), most, None)

        found = under(lag.lag)
        lines = closer(found, lag)
        found = found if lines is None else under(lines)
        used = lag.lag if lines is None else lines
        asked = "Log every sample." if controller is None else "Give the controller's period, or log every sample."
        return found, [say(MEASURED_AHEAD if data.torque_measured else AHEAD, 1e3 * used * data.dt, 1e3 * HALF * data.dt, asked)]
    age = 1e3 * HALF * data.dt / every
    read = np.split(objective.weight > 0.0, np.cumsum(data.lengths)[:-1])
    if all(is_difference_at_clock(r.velocity, r.position, data.dt, every, at) for r, at in zip(data.records, read, strict=True)):
        text = (
            "The velocity is the difference of the last two {angles}: half a sample{} old ({:.3g} ms). The simulation has it; "
            "it is no finding."
        )
        older = Objective(data.aged(HALF / every), objective.weight, counter=objective.counter)
        return search(older, most, None), [say(text, " of the controller" if every > 1 else "", age)]
    # Between the lines of a log whose torque does not follow from its controller, the torque may go on; not where
    # that was given a sample time, and the log has a line for each of its samples.
    going_on = (-HALF,) if every == 1 and controller is not None and data.torque_logged and not data.known_between else ()
    if going_on:
        objective = Objective(data.aged(0.0, going_on), objective.weight, counter=objective.counter)
    shown = data.velocity[objective.weight > 0.0]  # what stands in an outlier's place is on no lattice
    lines, each = _encoder(data, shown, data.dt / every)
    older = Objective(data.aged(HALF / every, (0.0, *going_on)), objective.weight, counter=objective.counter)
    if lines and not _score(objective, scales, model) < _score(older, scales, model) - POLICY.rival_margin:
        text = (
            "The velocities lie on the lattice of an encoder's {angle} ({} lines {}), differenced over one sample, "
            "and nothing speaks against it: they are taken for half a sample old ({:.3g} ms). The simulation has it; it is no "
            "finding."
        )
        found = search(older, most, None)
        younger = _no_difference(found, objective, lambda start: search(objective, most, start), joint)
        if younger is not None:
            return younger, [say(NO_DIFFERENCE, lines, each, age)]
        return found, [say(text, lines, each, age)]
    found = search(objective, most, None)
    in_series = any(t.in_series for t in found.final.parameters.terms)
    step = encoder_step(shown, data.axis == "linear") if in_series else 0.0
    if not step > 0.0:
        return found, []
    # First whether fewer effects may do, unless the model itself is better so; then what the whole search ends with.
    # Velocities of an encoder's whole lines are a difference unless the model speaks against it, others if it speaks for it.
    margin = -POLICY.rival_margin if lines else POLICY.rival_margin
    closest, better = _over_older(found, older, margin)
    limits = (most,) if better else (len(found.final.effects) - 1, most)
    for number in limits:
        again = search(older, number, closest if len(closest.effects) <= number else None)
        if not _better(again, found, margin):
            return found, []
    return again, [_on_a_lattice(step, age)]


def _encoder(data: DataSet, velocity: Vector, sample: float) -> tuple[int, Text]:
    """(lines of the encoder whose angle, differenced over `sample` [s], gives these velocities, or 0, in words to what).

    On a linear axis they are counted on a metre of a scale, on a pitch that was given, and on the leads of screws: encoders of
    their motors have a power of two of lines.
    """
    if data.axis == "rotary":
        return encoder_lines(velocity, sample, TURN), Text("a turn")
    if lines := encoder_lines(velocity, sample, 1.0):
        return lines, Text("a metre")
    given = () if data.period is None or data.period_seen else (data.period,)
    for lead in (*given, *LEADS):
        lines = encoder_lines(velocity, sample, lead)
        if lines.bit_count() == 1 or (lines and lead in given):
            return lines, say("in {:.4g} mm", 1e3 * lead)  # no decision: a unit: in a metre
    return 0, Text("")


def _on_a_lattice(step: float, age: float) -> Text:
    text = (
        "The velocities lie on a lattice of {:.4g} {rad/s} and are half a sample old ({:.3g} ms), as those are that are the "
        "difference of an encoder's {angle} over one sample. The simulation has it; it is no finding."
    )
    return say(text, step, age)


def _better(again: Selection, found: Selection, margin: float) -> bool:
    """Whether the model of a search under older velocities takes the place: with fewer effects, or with as many by the margin."""
    more = len(again.final.effects) - len(found.final.effects)
    margin = margin if more == 0 else min(margin, 0.0)
    return more <= 0 and _score_beside(again, found) < found.space.score(found.final) - margin


def _no_difference(
    found: Selection, younger: Objective, search: Callable[[Fit], Selection], joint: Callable[[Selection], Selection | None]
) -> Selection | None:
    """What a search with the age of 0 ends with, where the model that was found speaks for that age; else None.

    Numbers of the controller that the torque showed are a little off, which an age may make up for: they are moved first.
    """
    moved = joint(found) or found
    data = moved.space.data.aged(younger.data.age, younger.data.other_ages)
    closest, gain = _of_other_age(moved, replace(younger, data=data), ())
    if gain < (POLICY.rival_margin if len(closest.effects) == len(moved.final.effects) else 0.0):
        return None
    again = search(closest)
    other = joint(again) or again
    more = _in_series(other.final) - _in_series(closest)
    price = worth(other.space.objective, other.final) - worth(moved.space.objective, moved.final)
    return again if more <= 0 and _better(other, moved, POLICY.rival_margin + price) else None


def _in_series(fit: Fit) -> int:
    return sum(t.in_series for t in fit.parameters.terms)


def _over_older(found: Selection, older: Objective, margin: float) -> tuple[Fit, bool]:
    """(the model that was found, fitted to the older velocities; whether it is better there by this margin [BIC units])."""
    closest, gain = _of_other_age(found, older, found.space.in_other_series(found.final.hypothesis, found.final.x))
    return closest, gain > margin


def _of_other_age(found: Selection, other: Objective, exchanged: Sequence[tuple[Hypothesis, Vector]]) -> tuple[Fit, float]:
    """(the model that was found, fitted to velocities of another age; by how much it scores better there [BIC units]).

    As it is, without one of its lags and delays, or as one of those with another one in the place of that, whichever scores best.
    A velocity that is a difference over several samples has an age of its own.
    """
    space, final = found.space, found.final
    tries = [final, *(replace(final, hypothesis=h, x=x) for h, x in exchanged)]
    for term in final.parameters.terms:
        if term.in_series:
            x = final.parameters.removed(final.x, term.name)
            tries.append(replace(final, hypothesis=final.hypothesis.without(term.name), x=x))
    space = replace(space, objective=replace(space.objective, data=other.data))
    closest = min((_fitted_to(other.data, f, space) for f in tries), key=space.score)
    return closest, found.space.score(final) - space.score(closest)


def _score_beside(again: Selection, found: Selection) -> float:
    """Score of the model of one search under the errors of another one.

    How many of the output errors are independent is of each search its own: two scores tell nothing of each other.
    """
    return _score_under(again.space.data, again.final, found.space)


def _score_under(data: DataSet, final: Fit, space: Moves) -> float:
    """Score of a model over these data, fitted again, under the errors of a search."""
    space = replace(space, objective=replace(space.objective, data=data))
    return space.score(_fitted_to(data, final, space))


def _fitted_to(data: DataSet, final: Fit, space: Moves) -> Fit:
    """A model fitted again to these data, which are those of the space."""
    return space.refitted(final.hypothesis.over(data), final.x)


def _score(objective: Objective, scales: Scales, model: Model) -> float:
    """Score of the best linear mechanism with and without a lag of the torque, each under a noise filter of its own.

    A mechanism fitted without the lag has a wrong resonance in its place, and a fit from there does not find the lag.
    So the lag is also fitted to one mass, and the resonance beside it.
    A resonance faster than the records show would replace the age: it is allowed only where the mechanism without the lag has
    one, too.
    Each is scored: one that leaves least without a noise filter need not do so with one.
    """
    task = Task(objective, scales, model, (), lambda message: None).under(Innovations())
    space, lag = task.space(), next(t for t in LIBRARY.values() if t.late)  # the same as a lag of the torque, see `EQUIVALENT`
    one, *two = (task.start(m, POLICY.short) for m in (one_mass(task.data, model), *reduced(model)))
    base, late = min((one, *two), key=lambda f: f.cost), _with_lag(task, lag, one)
    shafts = [ls.fit(objective, hypothesis, x, WHITE, POLICY.short) for hypothesis, x in on_a_shaft(objective, late)]
    seen = POLICY.seen_band * np.pi / task.data.dt
    shafts = [
        f for f in shafts if swings(f) and is_mechanism(f.parameters, f.x) and (resonance(f) < seen or resonance(base) > seen)
    ]
    lagging = (late, _with_lag(task, lag, base), *shafts)
    return min(space.score(space.refitted(f.hypothesis, f.x)) for f in (base, *lagging))


def _with_lag(task: Task, lag: Term, fit: Fit) -> Fit:
    """The lag beside a mechanism, from the best of its starts."""
    longer = fit.hypothesis.extended(lag)
    X = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in lag.starts(longer.parameters.scales)])
    start = X[int(np.argmin(task.objective.costs(longer, X, WHITE)))]
    return ls.fit(task.objective, longer, start, WHITE, POLICY.usual)
