"""What is late inside a controller and was not given: the simulated loop needs more behind its torque than the logged one does.

A log slower than its controller shows few of its torques, and noise of the velocity hides in them a filter that was not given.
A loop without that filter makes up for it behind the torque; the logged torque stands behind the filter already:

    d = late(model, under the torque of a record that it makes itself in the loop) - late(model, under the logged torque)

with late() the sum over what is linear and late in series, by which a slow motion follows its torque.
Both torques are those of lines, between which the controller makes them of a velocity that is drawn straight.
What that is off by, where an axis swings faster than the log has lines, is in both.
d is that filter's part where it is beyond `contradiction` deviations of both, and `lag_seen` samples of the controller.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaident.axis import Text, say
from gaident.control.controller import Controller
from gaident.data.torque_kind import SAMPLE
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Term
from gaident.estimation.uncertainty import covariance_of
from gaident.models.drive_torque import driven_by
from gaident.models.effects_linear import LINEAR
from gaident.models.simulate import run
from gaident.policy.table import POLICY

__all__ = ["is_late", "late_inside"]


def late_inside(objective: Objective, fit: Fit) -> list[Text]:
    """Note on what a controller lacks that makes its torque late; objective: under which the model was estimated."""
    data = objective.data
    closed = fit.predictor.closed and data.slower and data.torque_logged and data.left_in_loop
    if not closed or fit.impacts or not any(map(is_late, fit.parameters.terms)):
        return []
    assert data.controller is not None
    _, one = _late(objective, fit)
    outside, other = _late(objective, _under_the_torque(objective, fit))
    own = _of_itself(objective, fit, data.controller)
    inside, _ = _late(own, _under_the_torque(own, fit))
    sample = data.dt / data.controller.log_every(data.dt)
    if abs(inside - outside) <= max(POLICY.contradiction * float(np.hypot(one, other)), POLICY.lag_seen * sample):
        return []
    text = (
        "In the loop of this controller the motion follows the {torque} by {:.3g} +- {:.2g} ms, behind the logged {torque} by "
        "{:.3g} +- {:.2g} ms, both as a log of these lines shows it. So about {:.2g} ms of it are in the controller, before its "
        "{torque} is logged: a filter that was not given, or another delay. What is called late below contains it."
    )
    return [say(text, 1e3 * inside, 1e3 * one, 1e3 * outside, 1e3 * other, 1e3 * (inside - outside))]


def _under_the_torque(objective: Objective, fit: Fit) -> Fit:
    """The model fitted where the torque of the records drives it."""
    driven = replace(fit.hypothesis, predictor=OpenLoop(objective.data, fit.predictor.own_angle))
    return ls.reestimated(objective, ls.fit(objective, driven, fit.x, fit.noise, POLICY.usual))


def _of_itself(objective: Objective, fit: Fit, controller: Controller) -> Objective:
    """Of the records that the model makes of the commands in its loop, on the same lines, without noise."""
    data, model = objective.data, fit.parameters.model(fit.x)
    runs = [(r, run(model, r, controller)) for r in data.read or data.records]
    made = [r.with_channels(velocity=done.velocity, torque=done.torque, torque_log=SAMPLE) for r, done in runs]
    own = DataSet.of([driven_by(r, controller) for r in made], controller, read=made, axis=data.axis)
    return Objective(replace(own, period=data.period), objective.weight, objective.family, counter=objective.counter)


def is_late(term: Term) -> bool:
    """Linear and late in series; a resonance may be another mass."""
    return term.name in LINEAR and not term.resonates


def _late(objective: Objective, fit: Fit) -> tuple[float, float]:
    """(by how much a slow motion follows the torque of a model, its standard deviation) [s]."""
    value, slopes = 0.0, np.zeros(len(fit.x))
    for term in filter(is_late, fit.parameters.terms):
        slot = fit.parameters.slot(term.name)
        z = fit.x[slot]
        h = 1e-6 * np.maximum(np.abs(z), 1.0)  # no decision: the step of a difference
        here, *near = (LINEAR[term.name](row).late for row in term.natural(np.vstack([z, z + np.diag(h)])))
        value += here
        slopes[slot] = (np.array(near) - here) / h
    variance = float(slopes @ np.nan_to_num(covariance_of(objective, fit), posinf=0.0) @ slopes)
    return value, float(np.sqrt(max(variance, 0.0)))
