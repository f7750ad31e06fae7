"""The rows of the regression: columns and torque of a record, low-passed alike, decimated, without the samples at standstill."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.checks import is_whole
from gaident.data.record import Record
from gaident.data.signals.decimation import decimated
from gaident.errors import SettingsError
from gaident.estimation.regression.motion import motion_of
from gaident.estimation.regression.torque_terms import COLUMNS, columns_of

__all__ = ["Rows", "decimation_of", "rows_of"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rows:
    """n rows of one record."""

    terms: tuple[str, ...]
    columns: Matrix  # (n, k)
    torque: Vector  # (n,) N m
    position: Vector  # (n,) rad
    time: Vector  # (n,) s
    threshold: float  # rad/s, the velocity of standstill
    travel: float  # rad, over the whole record

    def of(self, terms: tuple[str, ...]) -> Matrix:
        """The columns of some of the terms, in the order of these."""
        starts = dict(zip(self.terms, np.cumsum([0, *(len(COLUMNS[t].parameters) for t in self.terms)]), strict=False))
        index = [starts[t] + i for t in terms for i in range(len(COLUMNS[t].parameters))]
        return self.columns[:, index]

    def split(self, share: float) -> tuple[Rows, Rows]:
        """The first `share` of the rows, and the rest."""
        at = round(share * len(self.torque))
        return self._cut(slice(0, at)), self._cut(slice(at, None))

    def _cut(self, part: slice) -> Rows:
        kept = {name: getattr(self, name)[part] for name in ("columns", "torque", "position", "time")}
        return replace(self, **kept)


MOST = 100_000  # no decision: what an argument may be: samples that become one row


def decimation_of(decimation: object, cutoff_hz: float, dt: float) -> int:
    """Samples that become one row: as asked, else 1/(cutoff_hz dt) of them, at least one. Raises SettingsError."""
    if decimation is None:
        factor = max(1, int(1.0 / (cutoff_hz * dt) + 1e-6))  # no decision: rounding
        if factor > MOST:
            lowest = f"{1.0 / (MOST * dt):g} Hz or more"
            raise SettingsError(f"cutoff_hz is {cutoff_hz:g} Hz: more than {MOST} samples become one row; give {lowest}")
        return factor
    if not is_whole(decimation) or not 1 <= decimation <= MOST:
        raise SettingsError(f"decimation={decimation!r}: give a whole number of samples from 1 to {MOST}, or None")
    return int(decimation)


def rows_of(rec: Record, terms: tuple[str, ...], cutoff_hz: float, order: int, decimation: int, standstill: float | None) -> Rows:
    """The rows of a record that has a torque; none where it is too short.

    The low-pass of the decimation acts on columns and torque alike ("parallel filtering"): where the sign of the velocity
    jumps, column and torque are smoothed the same way. The first and last two rows are left out: filters start there.
    """
    motion = motion_of(rec, cutoff_hz, order, standstill)
    torque = motion.torque
    assert torque is not None  # checked by the caller
    columns = columns_of(terms, motion)
    regressor = np.column_stack([decimated(np.ascontiguousarray(c), decimation) for c in columns.T])
    kept = ~motion.still[::decimation]
    kept[:2] = kept[-2:] = False
    travel = float(np.ptp(motion.position))
    position = motion.position[::decimation][kept]
    time = (rec.dt * decimation * np.arange(len(kept), dtype=np.float64))[kept]
    return Rows(terms, regressor[kept], decimated(torque, decimation)[kept], position, time, motion.threshold, travel)
