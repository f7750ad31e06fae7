"""The picture of a diagnosis: what it draws is worked out here, how it is drawn stands in `gaident.show`.

The missing torque is that of the linear part of the diagnosed model, its parameters as refitted together with the effects: a
linear model fitted alone has bent its damping and inertia to swallow part of them, and would show the rest distorted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.diagnosis.excitation import position_of
from gaident.diagnosis.gains import free_run_errors
from gaident.diagnosis.missing_torque import missing_torque
from gaident.diagnosis.replay import replay
from gaident.diagnosis.result import Diagnosis

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["overview"]

Vector = NDArray[np.float64]
Curve = tuple[Vector, Vector, str]


def overview(dia: Diagnosis, records: Sequence[Record], axis: str = "rotary") -> Figure:
    """Six panels of the longest record; axis="linear" for m and N. Raises SettingsError for another axis."""
    from gaident.show.diagnosis_plots import plot_evidence
    from gaident.show.wording import unit

    unit("N m", axis)
    rec = max(records, key=len)
    torque = replay(rec, dia.controller).torque
    missing = missing_torque(dia.model.linear, rec, dia.controller, torque)
    (before,) = free_run_errors(dia.identification.model, [(rec, 0)], dia.controller)
    extended = None
    if dia.model.effects:
        (after,) = free_run_errors(dia.model, [(rec, 0)], dia.controller)
        extended = rec.velocity - after
    return plot_evidence(
        rec.time,
        rec.velocity,
        rec.velocity - before,
        missing.dhat,
        position_of(rec),
        torque,
        dia.after.noise_floor,
        std=float(np.median(missing.std)),
        extended=extended,
        curve=velocity_curve(dia, float(rec.velocity.min()), float(rec.velocity.max())),
        title=_title(dia, rec, records),
        axis=axis,
    )


def velocity_curve(dia: Diagnosis, low: float, high: float) -> Curve | None:
    """(velocity, torque, label) of the effects that are functions of the velocity, from low to high [rad/s]; None without one."""
    w = np.linspace(low, high, 401)
    size, sign = np.abs(w), np.sign(w)
    torque, names = np.zeros_like(w), []
    for effect in dia.model.effects:
        p = dict(effect.parameters)
        if effect.name in ("coulomb_friction", "presliding_friction", "friction_drift"):
            torque -= p["torque"] * sign
        elif effect.name == "stribeck_friction":
            hump = (p["static_torque"] - p["torque"]) * np.exp(-((w / p["stribeck_velocity"]) ** 2))
            torque -= (p["torque"] + hump) * sign
        elif effect.name == "asymmetric_friction":
            forwards = p["torque_positive"] + p["viscous_positive"] * size
            torque += np.where(w > 0.0, -forwards, np.where(w < 0.0, p["torque_negative"] + p["viscous_negative"] * size, 0.0))
        elif effect.name == "quadratic_drag":
            torque -= p["coefficient"] * w * size
        elif effect.name == "load_torque":
            torque -= p["torque"]
        else:
            continue
        names.append(effect.name.replace("_", " "))
    return (w, torque, " + ".join(names)) if names else None


def _title(dia: Diagnosis, rec: Record, records: Sequence[Record]) -> str:
    found = ", ".join(" or ".join((f.effect, *f.alternatives)).replace("_", " ") for f in dia.causes)
    of = f"{rec.name}: " if rec.name else ""
    if len(records) > 1:
        alone = sum(len(r) == len(rec) for r in records) == 1
        of = f"{rec.name or 'record'}, {'the longest' if alone else 'the first of the longest'} of {len(records)}: "
    return f"{of}{dia.verdict}{f' - {found}' if found else ''}"
