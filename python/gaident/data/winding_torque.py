"""The torque of a log that contains the motor's voltage or current instead."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.data.formats.table import LogTable
from gaident.data.torque_kind import COMMANDED, MEASURED
from gaident.data.wanted import Wanted
from gaident.data.winding import Winding
from gaident.errors import ReadError
from gaident.providers import provided

__all__ = ["ELECTRICAL", "torque_of_winding"]

Vector = NDArray[np.float64]

ELECTRICAL = frozenset({"voltage", "current"})
"""Columns that are no channel of a record, but make its torque."""
LAGS = (
    "The inductance L of the winding is not given, so its torque is made as if the current followed the voltage at once. The lag "
    "L/R that it has in the motor looks like a filter of the velocity, or like a lag of the torque. Give the inductance [H]. "
    "Until then the torque counts as commanded: the winding stands between it and the shaft, as an actuator does."
)


def torque_of_winding(table: LogTable, wanted: Wanted, values: Mapping[str, Vector], dt: float) -> tuple[Vector, str, str]:
    """(torque [N m], what it is, note) from voltage [V], current [A] and velocity [rad/s]; the note is "" where nothing was
    estimated. Raises ReadError."""
    known, current, voltage = wanted.constants, values.get("current"), values.get("voltage")
    kind = wanted.torque_is or MEASURED
    if "torque" in values:
        extra = next(name for name in ("voltage", "current") if name in values)
        raise ReadError(f"{table.path}: a torque is read, and a {extra} that would make one: leave one of the columns out")
    if current is not None and known.torque_constant is not None:
        return known.torque_constant * current, kind, ""
    if current is not None and voltage is not None:
        fit = provided("estimate_winding")(voltage, current, values["velocity"], dt)
        found: Winding = fit.winding
        R, ke = (fit.parameters[name] for name in ("resistance", "back_emf_constant"))
        note = (
            f"The winding was estimated from voltage, current and velocity: R = {R.value:.4g} +- {R.std:.2g} Ohm, back-EMF "
            f"constant {ke.value:.4g} +- {ke.std:.2g} V s/rad, taken as the torque constant."
        )
        return found.torque_constant * found.mean_current(current, dt), kind, note
    if current is not None:
        raise ReadError(
            f"{table.path}: a current makes a torque with {arg('torque_constant', '...')} [N m/A], or with the voltage, from "
            "which it is estimated; give one of them"
        )
    assert voltage is not None
    if known.resistance is None or known.torque_constant is None:
        raise ReadError(
            f"{table.path}: voltage and velocity alone do not tell the motor's back-EMF from viscous friction; give "
            f"{arg('resistance', '...')} [Ohm] and {arg('torque_constant', '...')} [N m/A], or name the current's column"
        )
    winding = Winding(known.resistance, known.torque_constant, known.inductance or 0.0, known.back_emf_constant)
    torque = winding.torque(voltage, values["velocity"], dt)
    return (torque, kind, "") if known.inductance is not None else (torque, wanted.torque_is or COMMANDED, LAGS)
