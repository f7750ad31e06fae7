"""The sample time of a controller, where none was given: by the logged torque, and by how old the velocity is.

A controller that is faster than the log makes another torque of the same lines than one at the log's rate: by its filters,
by what its integrator adds up between the lines, by what an anti-windup keeps at a limit.
Each of r = 2, 4, 8, 16 samples to a line is tried, and one that lies between is taken for its neighbour, with the plateau
of the torque as a limit where it shows one.
Such a controller is the drive's where it leaves less than the share `each_number` of what one at the log's rate leaves.
What the velocity did between the lines is lost and adds up in the integral, so that two are compared by how much of what they
leave changes from line to line, where no limit acts; two that are alike in it, up to the share `same_clock`, are told apart by
the motion.
A velocity is not old, or T/2 old where it is the difference of an encoder's angle:

    lag = 0,   or, on the lattice of an encoder,   lag = -1/(2 r) lines

with the lag of the inverse-dynamics regression (`estimation/regression/torque_lag.py`) under the torque that each controller
makes between the lines.
The r whose lag is nearest is taken, on one of these conditions:

- The lag differs by less than `near_age` of the controller's samples.
  Where the torque leaves one r alone, the lag may be either of the two.
- The torque leaves one r alone and follows from that controller.

With r = 2 a torque that is held over each line has the second lag too, so that this lag shows nothing.
The first condition then also asks that the torque follows, or that the controller leaves less than the share `replay_noise`
of what one at the log's rate leaves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gaident.axis import Text, say
from gaident.control.cascade import Cascade, cascade_of
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.signals.lattice import encoder_step
from gaident.diagnosis.controller.slow_forms import limited, run_error
from gaident.estimation.regression.torque_lag import torque_lag
from gaident.identification.logged_stretches import log_of
from gaident.identification.logged_torque import comparable, not_followed
from gaident.identification.replay.replay import replay
from gaident.models.drive_torque import HALF, driven_by
from gaident.policy.table import POLICY

__all__ = ["FASTER", "Period", "period_shown"]

FASTER = (2, 4, 8, 16)  # no decision: a grid of octaves; what is taken is said to be about so many
UNLIKE = ("", "torque_limit", "anti_windup")  # what a replay at the log's rate may say: any other reason explains the torque


@dataclass(frozen=True)
class Period:
    """The given controller, with the sample time that the log shows where that is sure, and a sentence on it."""

    controller: Controller
    note: Text


def period_shown(records: Sequence[Record], given: Controller | None) -> Period | None:
    """None where a sample time was given, numbers are not known, or the torque follows no better from a faster controller."""
    if given is None or given.unknown or given.loop != "sampled" or cascade_of(given).period is not None:
        return None
    own, dt = cascade_of(given), records[0].dt
    faster = {every: replace(own, period=dt / every) for every in FASTER}
    if any(r.dt != dt or not comparable(r, faster[FASTER[0]]) for r in records):
        return None
    if given.one_equation:
        said = [replay(r, given) for r in records]
        if all(r.follows for r in said) or any(r.cause not in UNLIKE for r in said if r.follows is False):
            return None
    before = _left(records, replace(own, period=dt))[1]
    found = {every: _left(records, one) for every, one in faster.items()}
    least = min(left for _, left in found.values())
    if not least < POLICY.each_number * before:
        return None
    steps = {every: _step_error(records, one) for every, (one, _) in found.items()}
    alike = [n for n, step in steps.items() if step <= (1.0 + POLICY.same_clock) * min(steps.values())]
    lags = {n: _lag(records, found[n][0]) for n in alike}
    old = HALF if encoder_step(np.concatenate([r.velocity for r in records])) > 0.0 else 0.0
    every = min(alike, key=lambda n: abs(lags[n] + old / n))
    alone = len(alike) == 1
    near = min(abs(lags[every] + age / every) for age in ((0.0, old) if alone else (old,)))
    # Two samples to a line, and a velocity half a sample old: the lag is that of a torque held over each line, and shows nothing.
    follows = not not_followed(records, found[every][0])
    told = every > 2 or not old or follows or found[every][1] < POLICY.replay_noise * before
    sure = (told and near < POLICY.near_age / every) or (alone and follows)
    text = (
        "The logged {torque} does not follow from this controller at the log's rate (rms {:.2g} {N m}). It follows better where "
        "it samples about {} times for each line (rms {:.2g} {N m}){}"
    )
    used = say(": {:.4g} ms is taken for its sample time. Where that is not it, give period (s).", 1e3 * dt / every)
    asked = say("; if it does, give its sample time, period = {:.4g} (s).", dt / every)
    note = say(text, before, every, found[every][1], used if sure else asked)
    return Period(faster[every] if sure else given, note)


def _left(records: Sequence[Record], controller: Cascade) -> tuple[Cascade, float]:
    """(the controller with the limit that the logs show, root mean square of logged minus made torque [N m])."""
    one = limited(records, controller).controller
    return one, run_error(records, one)


def _step_error(records: Sequence[Record], controller: Cascade) -> float:
    """Root mean square of the change of logged minus made torque from line to line [N m], where no limit acts.

    What the velocity did between the lines adds up in the integral, so that the difference itself says little.
    Infinite where a limit acts nearly everywhere: nothing is compared then.
    """
    changes = []
    for rec in records:
        log = log_of(rec, len(rec), controller, True)
        made = log.made(controller)
        free = np.maximum(np.abs(log.torque), np.abs(made)) < POLICY.at_limit * controller.velocity.limits[0]
        changes.append(np.diff(log.torque - made)[free[1:] & free[:-1]])
    together = np.concatenate(changes)
    return float(np.sqrt(np.mean(together**2))) if len(together) else np.inf


def _lag(records: Sequence[Record], controller: Cascade) -> float:
    """Of the torque that the controller makes against the velocity, mean of the records [lines]; infinite where none tells.

    A logged position is left out: it is not as old as a velocity that was differenced from it.
    """
    driven = [driven_by(r, controller).with_channels(position=None) for r in records]
    lags = [lag.lag for r in driven if (lag := torque_lag(r)) is not None]
    return float(np.mean(lags)) if lags else np.inf
