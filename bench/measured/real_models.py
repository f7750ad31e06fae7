"""Models of the library against a measured record: their free run. Only the public interface is used."""

from __future__ import annotations

import contextlib

import numpy as np
from numpy.typing import NDArray
from real_fits import start_velocity

import gaident as ga

Vector = NDArray[np.float64]


def open_loop(rec: ga.Record) -> ga.Record:
    """The record as a model sees it that is driven by the torque."""
    return rec.with_channels(command=None, position_command=None)


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
