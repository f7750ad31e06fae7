"""Section III-C on the simulated rig: least squares against the genetic identification, M-sequence command, many noise seeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.identification.identify import identify
from gaident.identification.least_squares import least_squares
from gaident.identification.m_sequence import m_sequence
from gaident.models.discrete import Discrete
from gaident.models.mechanics import Mechanics, mechanics_from_model
from gaident.paper.experiment import rig_of
from gaident.paper.facts import STEP, Mechanism
from gaident.paper.rig import NO_FRICTION, Friction, Rig, RigRun, side_by_side
from gaident.results.settings import Settings

__all__ = ["METHODS", "MethodComparison", "Method", "compare"]

Vector = NDArray[np.float64]

REGISTER, HOLD = 7, 8  # 1016 samples, 0.45 s; flat up to about 110 Hz, the resonance lies at 27 Hz
AMPLITUDE = 0.5 * STEP  # rad/s
METHODS = {
    "plain": "least squares, as in the paper",
    "refined": "least squares with instruments and whitening",
    "genetic": "genetic identification, Settings()",
}


@dataclass(frozen=True)
class Method:
    """What one method made of all noise seeds: arrays of seeds x coefficients and seeds x mechanical parameters, nan for none.

    right: runs that end in the true structure: for the regression, whose order is given, in a physical mechanism of that kind.
    """

    key: str
    coefficients: Vector
    mechanics: Vector
    right: int

    def bias(self, truth: Vector) -> Vector:
        """Mean deviation of the coefficients from the truth, over the seeds that have some."""
        return self._known.mean(axis=0) - truth if len(self._known) else np.full(len(truth), np.nan)

    @property
    def spread(self) -> Vector:
        """Standard deviation of the coefficients over the seeds."""
        return self._known.std(axis=0) if len(self._known) else np.full(self.coefficients.shape[1], np.nan)

    @property
    def _known(self) -> Vector:
        known: Vector = self.coefficients[np.all(np.isfinite(self.coefficients), axis=1)]
        return known


@dataclass(frozen=True)
class MethodComparison:
    """One mechanism, with or without friction in the rig. truth: alpha, beta of the rig's linear part; mechanics likewise."""

    mechanism: Mechanism
    friction: Friction
    truth: Vector
    mechanics: Vector
    methods: tuple[Method, ...]
    seeds: int

    def method(self, key: str) -> Method:
        return next(m for m in self.methods if m.key == key)


def compare(
    mechanism: Mechanism, frictions: Sequence[Friction], seeds: int, seed: int, workers: int | None
) -> list[MethodComparison]:
    """The methods with each friction in the rig. Every rig runs with the same noise seeds, all side by side."""
    command, title = m_sequence(REGISTER, AMPLITUDE, HOLD), f"M-sequence, {mechanism.title}"
    rigs = [rig_of(mechanism, friction) for friction in frictions]
    records = side_by_side([RigRun(rig, command, seed + k, title) for rig in rigs for k in range(seeds)])
    return [_compared(mechanism, rig, records[i * seeds : (i + 1) * seeds], seed, workers) for i, rig in enumerate(rigs)]


def _compared(mechanism: Mechanism, rig: Rig, records: Sequence[Record], seed: int, workers: int | None) -> MethodComparison:
    """All methods on the same records of the rig."""
    controller, model = rig.controller, mechanism.sheet.model()
    settings = Settings(initial_state="rest")

    def plain(rec: Record) -> tuple[Discrete | None, Mechanics | None]:
        found = least_squares(rec, mechanism.order, controller)
        return found.discrete, found.mechanics

    def refined(rec: Record) -> tuple[Discrete | None, Mechanics | None]:
        found = least_squares(rec, mechanism.order, controller, instruments=True, whitening=True)
        return found.discrete, found.mechanics

    def genetic(rec: Record) -> tuple[Discrete | None, Mechanics | None]:
        found = identify(rec, controller, settings=settings, seed=seed, workers=1).model
        same = (found.p, found.q) == (model.p, model.q)
        return found.discrete(rec.dt, controller) if same else None, mechanics_from_model(found) if same else None

    def run(key: str, method: Callable[[Record], tuple[Discrete | None, Mechanics | None]]) -> Method:
        pool = ThreadPoolExecutor(workers)
        try:
            found = list(pool.map(method, records))
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C those that wait are not begun
        size = 2 * mechanism.order + 1
        rows = [np.full(size, np.nan) if d is None else np.r_[d.alpha, d.beta] for d, _ in found]
        kind = type(mechanism.sheet)
        known = [m if isinstance(m, kind) else None for _, m in found]
        values = [[getattr(m, name) if m else np.nan for name in mechanism.names] for m in known]
        return Method(key, np.array(rows), np.array(values), sum(m is not None and m.physical for m in known))

    truth = model.discrete(rig.dt, controller)
    return MethodComparison(
        mechanism,
        rig.friction,
        np.r_[truth.alpha, truth.beta],
        np.array([getattr(mechanism.sheet, name) for name in mechanism.names]),
        (run("plain", plain), run("refined", refined), run("genetic", genetic)),
        len(records),
    )


def both(
    mechanism: Mechanism, friction: Friction, seeds: int, seed: int, workers: int | None
) -> tuple[MethodComparison, MethodComparison]:
    """(without friction: what noise alone does, with friction: what the linear form does)."""
    without, with_ = compare(mechanism, (NO_FRICTION, friction), seeds, seed, workers)
    return without, with_
