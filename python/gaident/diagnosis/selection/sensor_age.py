"""How old the measured velocity is: half a sample where it is the difference of an encoder's angle.

    w_m(n) = (theta(n) - theta(n-1))/T = 1/T int w dt over the last sample of the controller

is the mean over that sample, to second order in T the velocity in its middle. That is no cause: every drive that differences its
encoder has it. Left out, it is fitted as a delay or, beside a current loop, as a resonance.

- The lattice of the velocities says how many lines the encoder had. Where they are a whole number, the velocity is taken for a
  difference. Not every velocity on such a lattice is one: an observer or the drive's firmware may round to it. So both ages are
  fitted, with the linear mechanism alone and with the lag of a current loop, and it is none where the age of 0 scores better
  beyond the margin of two rivals.
- On another lattice (a gear, a scale, a unit between) the velocity may be a difference. Where the search finds something linear
  in series with the mechanism, a delay, a lag or a resonance, it is made again with the age of half a sample, which is no effect
  and costs nothing; the better score decides.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaident.axis import TURN, Text, say
from gaident.data.signals.lattice import encoder_lines
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.mechanisms import one_mass, reduced
from gaident.diagnosis.selection.select import Selection
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Innovations, Objective
from gaident.estimation.term import Scales, Term
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["searched"]

HALF = 0.5  # no decision: of a sample, the age of a mean over it


def searched(
    objective: Objective, scales: Scales, model: Model, search: Callable[[Objective], Selection]
) -> tuple[Selection, list[Text]]:
    """What a search selects over records whose velocity is as old as they show, with a note on that."""
    data = objective.data
    controller = data.controller
    if controller is not None and (controller.loop == "continuous" or (data.loop is not None and any(data.moving))):
        return search(objective), []
    every = 1 if controller is None else controller.log_every(data.dt)
    lines = encoder_lines(data.velocity, data.dt / every, TURN if data.axis == "rotary" else 1.0)
    older = Objective(data.aged(HALF / every), objective.weight, counter=objective.counter)
    age = 1e3 * HALF * data.dt / every
    if lines and not _score(objective, scales, model) < _score(older, scales, model) - POLICY.rival_margin:
        each = Text("a turn", "a metre")
        text = (
            "The velocities lie on the lattice of an encoder's {angle} ({} lines {}), differenced over one sample, "
            "and nothing speaks against it: they are taken for half a sample old ({:.3g} ms). The simulation has it; it is no "
            "finding."
        )
        return search(older), [say(text, lines, each, age)]
    found = search(objective)
    if not data.resolution > 0.0 or not any(_in_series(t) for t in found.final.parameters.terms):
        return found, []
    again = search(older)
    if again.space.whitens != found.space.whitens or not again.space.score(again.final) < found.space.score(found.final):
        return found, []
    text = (
        "The velocities lie on a lattice of {:.4g} {rad/s} and are half a sample old ({:.3g} ms), as those are that are the "
        "difference of an encoder's {angle} over one sample. The simulation has it; it is no finding."
    )
    return again, [say(text, data.resolution, age)]


def _in_series(term: Term) -> bool:
    """Whether an effect is linear: a delay, a lag, a filter or a resonance between the torque and the measured velocity."""
    return not (term.domains or term.harmonic or term.in_controller)


def _score(objective: Objective, scales: Scales, model: Model) -> float:
    """BIC of the best linear mechanism with and without a lag of the torque, each under a noise filter of its own."""
    task = Task(objective, scales, model, (), lambda message: None).under(Innovations())
    space, lag = task.space(), next(t for t in LIBRARY.values() if t.late)  # the same as a lag of the torque, see `EQUIVALENT`
    starts = [task.start(m, POLICY.short) for m in (one_mass(task.data, model), *reduced(model))]
    base = min(starts, key=lambda f: f.cost)
    longer = base.hypothesis.extended(lag)
    X = np.array([base.parameters.inserted(base.x, np.array(row)) for row in lag.starts(longer.parameters.scales)])
    x = X[int(np.argmin(task.objective.costs(longer, X, WHITE)))]
    return min(space.refitted(base.hypothesis, base.x).bic, space.refitted(longer, x).bic)
