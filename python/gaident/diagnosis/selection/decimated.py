"""Long records, searched on a coarser grid of time first.

Every k-th velocity is kept, and the torque is the mean of what was held in between:

    W(m) = w(m k),   U(m) = 1/k sum_i u(m k + i),   i = 0 .. k-1
    W(m+1) - W(m) = k dt/J U(m)   for w(n+1) - w(n) = dt/J u(n)

The velocity is not smoothed: a reversal would look like an elastic one, and no friction jumps there any more.
What is found on the coarse grid is a start: every figure of the result comes from all samples,
and so does the search for what the grid cannot show.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.data.torque_kind import HELD
from gaident.estimation.dataset import FINEST, DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation, parameter_names
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.projection import WORST
from gaident.estimation.term import Scales
from gaident.models.held_torque import held_torque, kind_of_held
from gaident.policy.table import POLICY

__all__ = ["blocks_of", "decimated", "decimated_record", "moved"]

Vector = NDArray[np.float64]


def decimated(data: DataSet, blocks: int) -> DataSet:
    """The records on the coarser grid, open loop: driven by the torque that the controller issued."""
    records = [decimated_record(data.as_old(r) if data.age else r, blocks) for r in data.driven]
    finest = max(FINEST, 2.0 * data.dt)  # no decision: of a solver: the step of a simulation
    found = replace(DataSet.of(records, None), finest=finest, known_noise=data.noise)
    found = replace(found, torque_measured=data.torque_measured, axis=data.axis, period=data.period)
    return replace(found, moving=data.moving, places=data.places, whole=data.whole) if data.whole is not None else found


def decimated_objective(objective: Objective, blocks: int) -> Objective:
    """The objective over the records on the coarser grid; no sample is left out there."""
    data = decimated(objective.data, blocks)
    return Objective(data, np.ones(sum(data.lengths)), objective.family, counter=objective.counter)


def blocks_of(data: DataSet, error: Vector) -> int:
    """Samples of the log in one of the coarse grid: as many as leave enough samples and keep what the error shows; 1 for none.

    error: of a linear model, records one after the other.
    A controller that is simulated cannot be coarsened: it samples as it does.
    """
    if data.slower or (data.pi is not None and not data.torque_logged):
        return 1
    if not np.all(np.isfinite(error)):
        return 1
    most = min(sum(data.lengths) // POLICY.enough_samples, min(data.lengths) // POLICY.short_record)
    for k in range(most, 1, -1):
        parts = np.split(error, np.cumsum(data.lengths)[:-1])
        rows = np.vstack([e[: len(e) // k * k].reshape(-1, k) for e in parts])
        within = float(np.mean((rows - rows.mean(axis=1, keepdims=True)) ** 2)) - data.noise**2 * (1.0 - 1.0 / k)
        if within < POLICY.grid_loss * (float(np.mean(rows**2)) - data.noise**2):
            return k
    return 1


def decimated_record(rec: Record, blocks: int) -> Record:
    """The record on the coarse grid, its torque as it is held there; what is left over at its end is not used."""
    k, count = blocks, len(rec) // blocks
    torque = held_torque(rec)[: count * k].reshape(count, k).mean(axis=1)
    kept = {name: x[: count * k : k] for name, x in rec.channels()} | {"torque": torque}
    return rec.with_channels(dt=rec.dt * k, torque_is=kind_of_held(rec, rec.dt * k), torque_log=HELD, **kept)


def moved(data: DataSet, scales: Scales, fit: Fit) -> Fit:
    """The same model, effects in their order, as a start on another grid of time; start states are zero and nothing is fitted."""
    old = fit.parameters
    linear = old.linear(fit.x)
    new = Parameterisation.of(linear, scales, data.moving, data.begun)
    new = replace(new, scales=replace(new.scales, friction=old.scales.friction))
    x = new.base_vector(linear)
    for t in old.terms:
        natural = dict(zip(parameter_names(t), old.effect_values(fit.x[None, :], t.name)[0].tolist(), strict=True))
        new = new.extended(t)
        low, high = np.array(t.limits(new.scales)).T
        x = np.concatenate([x, np.clip(t.coordinates(natural), low, high)])
    x = np.concatenate([x, np.zeros(sum(new.starts))])
    return Fit(Hypothesis(new, OpenLoop(data, fit.predictor.own_angle)), x, WHITE, WORST, np.inf)
