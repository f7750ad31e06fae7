"""The pictures of a result: what they draw is worked out here, how it is drawn stands in `gaident.show`.

The missing torque is that of the linear part of the diagnosed model, its parameters as refitted together with the effects: a
linear model fitted alone has bent its damping and inertia to swallow part of them, and would show the rest distorted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.controller.replay import replay
from gaident.diagnosis.experiments.excitation import position_of
from gaident.diagnosis.explain.evidence import velocity_curve
from gaident.diagnosis.explain.missing_torque import missing_torque
from gaident.diagnosis.gains import free_run_errors
from gaident.identification.frequency import response_of
from gaident.models.model import Model
from gaident.results.diagnosis import Diagnosis
from gaident.show import plots, response_plots
from gaident.show.diagnosis_plots import plot_evidence
from gaident.show.wording import unit

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_bode", "plot_diagnosis"]


def plot_diagnosis(dia: Diagnosis, records: Sequence[Record], axis: str = "rotary") -> Figure:
    """Six panels of the longest record; axis="linear" for m and N. Raises SettingsError for another axis."""
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


def _title(dia: Diagnosis, rec: Record, records: Sequence[Record]) -> str:
    found = ", ".join(" or ".join((f.effect, *f.alternatives)).replace("_", " ") for f in dia.causes)
    of = f"{rec.name}: " if rec.name else ""
    if len(records) > 1:
        alone = sum(len(r) == len(rec) for r in records) == 1
        of = f"{rec.name or 'record'}, {'the longest' if alone else 'the first of the longest'} of {len(records)}: "
    return f"{of}{dia.verdict}{f' - {found}' if found else ''}"


def plot_bode(model: Model, controller: PI | None, records: Sequence[Record], hz: bool, axis: str) -> Figure:
    """A model against the frequency response of the longest record, or alone; see `Identification.plot_bode`."""
    if not records:
        return plots.plot_bode(model, axis=axis, hz=hz)
    return response_plots.plot_response(response_of(max(records, key=len), model, controller), hz, axis)
