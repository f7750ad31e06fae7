"""How old the measured velocity is: half a sample where it is the difference of an encoder's angle.

    w_m(n) = (theta(n) - theta(n-1))/T = 1/T int w dt over the last sample of the controller

is the mean over that sample, to second order in T the velocity in its middle. That is no cause: every drive that differences its
encoder has it. Left out, it is fitted as a delay or, beside a current loop, as a resonance.

The lattice of the velocities says how many lines the encoder had. Not every velocity on such a lattice is a difference: one that
an observer or the drive's firmware rounds to the lattice is not. So both ages are fitted, with the linear mechanism alone and
with the lag of a current loop, and the velocity is no difference where that scores better beyond the margin of two rivals.
"""

from __future__ import annotations

import numpy as np

from gaident.axis import TURN, Text, say
from gaident.data.signals.lattice import encoder_lines
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.mechanisms import one_mass, reduced
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Innovations, Objective
from gaident.estimation.term import Scales
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["as_old_as_shown"]

HALF = 0.5  # no decision: of a sample, the age of a mean over it


def as_old_as_shown(objective: Objective, scales: Scales, model: Model) -> tuple[Objective, list[Text]]:
    """The objective over records whose velocity is half a sample of the controller old where it is, with a note on that."""
    data = objective.data
    controller = data.controller
    every = 1 if controller is None else controller.log_every(data.dt)
    if controller is not None and (controller.loop == "continuous" or (data.loop is not None and any(data.moving))):
        return objective, []
    turn = TURN if data.axis == "rotary" else 1.0
    lines = encoder_lines(data.velocity, data.dt / every, turn)
    if not lines:
        return objective, []
    older = Objective(data.aged(HALF / every), objective.weight, counter=objective.counter)
    if _score(objective, scales, model) < _score(older, scales, model) - POLICY.rival_margin:
        return objective, []
    each = Text("a turn", "a metre")
    text = (
        "The velocities lie on the lattice of an encoder's {angle} ({} lines {}), differenced over one sample, and "
        "nothing speaks against it: they are taken for half a sample old ({:.3g} ms). The simulation has it; it is no finding."
    )
    return older, [say(text, lines, each, 1e3 * HALF * data.dt / every)]


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
