"""The torque of a log that contains the motor's voltage or current instead."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.data.formats.table import LogTable
from gaident.data.torque_kind import COMMANDED, MEAN, MEASURED
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


class WindingTorque(NamedTuple):
    """values: [N m] (n,); kind and line: as `torque_is` and `torque_log` of a record; note: "" where nothing was estimated."""

    values: Vector
    kind: str
    line: str
    note: str


def torque_of_winding(table: LogTable, wanted: Wanted, values: Mapping[str, Vector], dt: float) -> WindingTorque:
    """The torque from voltage [V], current [A] and velocity [rad/s]. Raises ReadError.

    A winding gives the mean torque between two lines, which the second of them contains then.
    """
    known, current, voltage = wanted.constants, values.get("current"), values.get("voltage")
    kind = wanted.torque_is or MEASURED
    if "torque" in values:
        extra = next(name for name in ("voltage", "current") if name in values)
        raise ReadError(f"{table.path}: a torque is read, and a {extra} that would make one: leave one of the columns out")
    if current is not None and known.torque_constant is not None:
        return WindingTorque(known.torque_constant * current, kind, wanted.torque_log, "")
    if current is not None and voltage is not None:
        fit = provided("estimate_winding")(voltage, current, values["velocity"], dt)
        found: Winding = fit.winding
        R, ke = (fit.parameters[name] for name in ("resistance", "back_emf_constant"))
        note = (
            f"The winding was estimated from voltage, current and velocity: R = {R.value:.4g} +- {R.std:.2g} Ohm, back-EMF "
            f"constant {ke.value:.4g} +- {ke.std:.2g} V s/rad, taken as the torque constant; {_inductance(fit)}."
        )
        kt = found.torque_constant
        if not fit.held:  # each line is a sample of a current that goes on between the lines
            return WindingTorque(kt * current, kind, wanted.torque_log, note)
        mean = kt * fit.mean_current(current, values["velocity"], dt)
        return WindingTorque(_since_the_line_before(mean, kt * current[0]), kind, MEAN, note)
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
    first = winding.torque_constant * winding.current(voltage, values["velocity"], dt)[0]
    torque = _since_the_line_before(winding.torque(voltage, values["velocity"], dt), first)
    if known.inductance is not None:
        return WindingTorque(torque, kind, MEAN, "")
    return WindingTorque(torque, wanted.torque_is or COMMANDED, MEAN, LAGS)


def _inductance(fit: Any) -> str:
    """What the fit says of the inductance, in words."""
    told = fit.parameters["inductance"]
    if fit.winding.inductance > 0.0:
        return f"L = {told.value:.4g} +- {told.std:.2g} H"
    return "its inductance does not show at this sample time"


def _since_the_line_before(following: Vector, first: float) -> Vector:
    """The means over the time since the line before, of those over the time after each line; first: what stands for the first."""
    return np.concatenate([[first], following[:-1]])
