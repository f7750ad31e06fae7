"""The velocity of an encoder whose angle is differenced: the mean over the last sample.

    w_m(n) = 1/T int w dt = (w(n-1) + 4 w(n-1/2) + w(n))/6 + O(T^4)        Simpson's rule

The torque is held over the sample, so that w is smooth inside it; simulated with twice the samples, it is known in the middle.
The mean of the ends alone would be off by T/12 of the change of the acceleration, which behind a current loop of a sample is as
large as the steps of a fine encoder.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.differencing import older
from gaident.data.record import Record
from gaident.data.torque_kind import HELD, MEAN
from gaident.models.drive_torque import HALF, as_late
from gaident.models.held_torque import kind_of_held, sampled_between
from gaident.models.simulate import Run, run, simulate
from gaident.models.simulation_input import AnyModel

__all__ = ["halved", "means", "run_as_seen", "with_middles"]

Matrix = NDArray[np.float64]


def halved(x: NDArray[np.float64], later: float = 0.0) -> NDArray[np.float64]:
    """A signal (n,) with twice the samples, half way between; later: than these, in lines. The last one is held."""
    at = 0.5 * np.arange(2 * len(x)) + later  # no decision: a formula: the middle
    return np.asarray(np.interp(at, np.arange(len(x)), x))


@lru_cache(maxsize=16)
def with_middles(rec: Record) -> Record:
    """The record with twice the samples: its torque as it is held, everything else half way between."""

    def between(name: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
        if name != "torque":
            return halved(x)
        # no decision: a quarter of the line is the middle of its half
        return halved(x, 0.25) if sampled_between(rec) else np.repeat(x, 2)

    channels: dict[str, Any] = {name: between(name, x) for name, x in rec.channels()}
    half = 0.5 * rec.dt  # no decision: a formula: half the sample
    line = HELD if rec.torque is not None and rec.torque_log != MEAN else None
    return rec.with_channels(dt=half, torque_is=kind_of_held(rec, half), torque_log=line, **channels)


def means(W: Matrix) -> Matrix:
    """Rows of means over each sample (m, n) of velocities with the middle of each sample (m, 2 n); the first as it is."""
    ends, middles = W[:, ::2], W[:, 1::2]
    seen = ends.copy()
    seen[:, 1:] = (ends[:, :-1] + 4.0 * middles[:, :-1] + ends[:, 1:]) / 6.0  # no decision: a formula: Simpson's rule
    return seen


def run_as_seen(model: AnyModel, rec: Record, controller: Controller | None, lines: float) -> Run:
    """A model's run from rest, its velocity so many lines of the log old, as that of the record is against its torque.

    In a loop the controller reads that velocity; else it is the one that the sensor shows of a motion which it does not change.
    """
    if controller is not None:
        return run(model, rec, older(controller, lines))
    velocity = means(simulate(model, with_middles(rec))[None])[0] if lines == HALF else simulate(model, as_late(rec, lines))
    return replace(run(model, rec), velocity=velocity)
