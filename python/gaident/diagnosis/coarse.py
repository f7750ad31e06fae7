"""Long records, searched on a coarser grid of time first.

Every k-th velocity is kept, and the torque is the mean of what was held in between:

    W(m) = w(m k),   U(m) = 1/k sum_i u(m k + i),   i = 0 .. k-1
    W(m+1) - W(m) = k dt/J U(m)   for w(n+1) - w(n) = dt/J u(n)

The velocity is not smoothed: a reversal would look like an elastic one, and no friction jumps there any more. What is found on
the coarse grid is a start: every figure of the result comes from all samples, and so does the search for what the grid cannot
show.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.diagnosis.candidates import CANDIDATES, Scales
from gaident.diagnosis.driven import FINEST, Driven
from gaident.diagnosis.layout import Layout, described
from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import WORST, Fit, Problem
from gaident.models.effects import table
from gaident.models.model import Model

__all__ = ["Coarse", "blocks_of", "coarsened", "moved_to"]

Vector = NDArray[np.float64]

ENOUGH = 3500
"""Samples of a coarse search: as many as say what a record of this length can say about the structure."""

LOST_SHARE = 0.02
"""Share of the linear model's squared error, noise left out, that the coarse grid may lose: what it is too coarse to show."""


@dataclass(frozen=True)
class Coarse:
    """Records on a coarse grid: as the fit sees them, `blocks` samples of the log in each of theirs."""

    driven: Driven
    problem: Problem
    scales: Scales
    blocks: int

    @classmethod
    def of(cls, driven: Driven, problem: Problem, scales: Scales, blocks: int) -> Coarse:
        """The records of `driven`, open loop: driven by the torque that the controller issued."""
        records = [coarsened(r, blocks) for r in driven.driven]
        log_dt = driven.records[0].dt
        coarse = replace(Driven.of(records, None), finest=max(FINEST, 2.0 * log_dt), known_noise=driven.noise)
        weight = np.ones(sum(coarse.lengths))
        scales = replace(scales, dt=log_dt * blocks, blocks=blocks)
        return cls(coarse, Problem(coarse.predict, coarse.measured, coarse.lengths, weight, floor=problem.floor), scales, blocks)


def blocks_of(driven: Driven, error: Vector) -> int:
    """Samples of the log in one of the coarse grid: as many as leave enough samples and keep what the error shows; 1 for none.

    error: of a linear model, records one after the other. A controller that is simulated cannot be coarsened: it samples as it
    does.
    """
    if driven.controller is not None and not driven.torque_logged:
        return 1
    if not np.all(np.isfinite(error)):
        return 1
    most = min(sum(driven.lengths) // ENOUGH, min(driven.lengths) // 200)
    for k in range(most, 1, -1):
        parts = np.split(error, np.cumsum(driven.lengths)[:-1])
        rows = np.vstack([e[: len(e) // k * k].reshape(-1, k) for e in parts])
        within = float(np.mean((rows - rows.mean(axis=1, keepdims=True)) ** 2)) - driven.noise**2 * (1.0 - 1.0 / k)
        if within < LOST_SHARE * (float(np.mean(rows**2)) - driven.noise**2):
            return k
    return 1


def coarsened(rec: Record, blocks: int) -> Record:
    """The record on the coarse grid; what is left over at its end is not used."""
    assert rec.torque is not None
    k, count = blocks, len(rec) // blocks
    torque = rec.torque[: count * k].reshape(count, k).mean(axis=1)
    kept = [None if x is None else x[: count * k : k] for x in (rec.command, rec.velocity, rec.position)]
    assert kept[1] is not None
    return Record(rec.dt * k, kept[0], kept[1], torque, kept[2], rec.name)


def moved_to(driven: Driven, scales: Scales, fit: Fit) -> Fit:
    """The same model, effects in their order, as a start on another grid of time; start states are zero and nothing is fitted."""
    model = fit.layout.model(fit.x)
    linear = Model(model.gain, model.poles, model.zeros)
    layout = Layout.of(linear, described(scales, linear), driven.moving, False)
    layout = replace(layout, scales=replace(layout.scales, friction=fit.layout.scales.friction), own_angle=fit.layout.own_angle)
    x = layout.base_vector(linear)
    for e in fit.effects:
        names = [p.name for row in table() if row.name == e for p in row.parameters]
        natural = dict(zip(names, fit.layout.effect_values(fit.x[None, :], e)[0].tolist(), strict=True))
        layout = layout.extended(e)
        low, high = np.array(CANDIDATES[e].limits(layout.scales)).T
        x = np.concatenate([x, np.clip(CANDIDATES[e].coordinates(natural), low, high)])
    x = np.concatenate([x, np.zeros(sum(layout.starts))])
    return Fit(layout, x, WHITE, WORST, np.inf)
