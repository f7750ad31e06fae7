"""The torque that a fitted regression needs for a motion, and its error; `InverseDynamics.torque` and `.error` call these."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError
from gaident.estimation.regression.motion import motion_of
from gaident.estimation.regression.rows import rows_of
from gaident.estimation.regression.torque_terms import columns_of
from gaident.results.inverse_dynamics import InverseDynamics

__all__ = ["regression_error", "regression_torque"]


def regression_torque(found: InverseDynamics, record: Record) -> NDArray[np.float64]:
    """See `InverseDynamics.torque`."""
    _fits(found, record)
    motion = motion_of(record, found.cutoff_hz, found.order, found.standstill)
    return np.asarray(columns_of(found.terms, motion) @ np.array(found.coefficients))


def regression_error(found: InverseDynamics, records: Sequence[Record]) -> float:
    """See `InverseDynamics.error`."""
    if not isinstance(records, Sequence) or not records or not all(isinstance(r, Record) for r in records):
        raise RecordError(f"records is {type(records).__name__}: give a gaident.Record or a list of them, at least one")
    squares = whole = 0.0
    for record in records:
        _fits(found, record)
        if record.torque is None:
            raise RecordError(f"record {record.name!r} has no torque to compare with; log it")
        step = max(1, round(found.decimation * found.dt / record.dt))
        rows = rows_of(record, found.terms, found.cutoff_hz, found.order, step, found.standstill)
        left = rows.torque - rows.of(found.terms) @ np.array(found.coefficients)
        squares, whole = squares + float(left @ left), whole + float(rows.torque @ rows.torque)
    if not whole > 0.0:
        raise RecordError("the records have no motion with a torque: no relative force error; give records that move")
    return float(np.sqrt(squares / whole))


def _fits(found: InverseDynamics, record: Record) -> None:
    if not isinstance(record, Record):
        raise RecordError(f"record is {type(record).__name__}: give a gaident.Record")
    if not found.cutoff_hz < 0.5 / record.dt:  # no decision: a formula: the Nyquist frequency
        raise SettingsError(
            f"the record has dt={record.dt:g} s, too slow for the filter of {found.cutoff_hz:g} Hz that was used; "
            f"fit with cutoff_hz below {0.5 / record.dt:g}"
        )
