"""Models of the library against a measured record: free run and force error. Only the public interface is used."""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import NDArray
from real_fits import smooth, start_velocity

import gaident as ga

Vector = NDArray[np.float64]

FINER = 8
LOOP = 0.4  # the gain of the loop, of the one at which an integrator is reached in a single step


def open_loop(rec: ga.Record) -> ga.Record:
    """The record as a model sees it that is driven by the torque."""
    return ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque, position=rec.position, name=rec.name)


def free_run(model: ga.Model, rec: ga.Record) -> Vector:
    """The velocity under the logged torque, from the velocity that the record starts with.

    A linear model with more states than that has those with which it follows this record best: to its advantage, or the
    slow states of a wrong model would be all that is seen. Other states of a model with effects start at rest.
    """
    state = np.zeros(model.p + model.q)
    state[:1] = start_velocity(rec)
    with np.errstate(all="ignore"):
        if len(state) > 1 and not model.effects:
            with contextlib.suppress(ga.errors.ModelError):  # it diverges within the record
                state = ga.initial_state(model, open_loop(rec))
        return ga.simulate(model, open_loop(rec), None, state)


def needed_torque(model: ga.Model, rec: ga.Record) -> Vector:
    """The torque that the model needs for the record's motion: a stiff loop, eight times faster, makes it follow.

    The velocity in the band in which torques are compared is the command; kp = 0.4/(K dt'), dt' = dt/8, so the loop follows
    up to 0.4/(2 pi dt') Hz, half of the sample rate. A gain that is not positive cannot be led like this: nan.
    """
    n, dt = len(rec), rec.dt / FINER
    if not model.gain > 0.0:
        return np.full(n, np.nan)
    fine = np.arange((n - 1) * FINER + 1) / FINER
    command = np.interp(fine, np.arange(n), smooth(rec, rec.velocity))
    position = None if rec.position is None else np.interp(fine, np.arange(n), rec.position)
    kp = LOOP / (model.gain * dt)
    state = np.zeros(model.p + model.q + 1)
    state[0] = command[0]
    fast = ga.Record(dt, command=command, velocity=command, position=position)
    with np.errstate(all="ignore"):
        torque = ga.run(model, fast, ga.PI(kp, 0.02 * kp / dt), state).torque
    return np.asarray(torque[::FINER])
