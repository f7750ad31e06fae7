"""The pictures of a result: what they draw is worked out here and in runs.py, how it is drawn stands in `gaident.show`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gaident.axis import checked_axis, said
from gaident.checks import yes_or_no
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.frequency.response import FrequencyResponse
from gaident.data.record import Record
from gaident.diagnosis.explain.evidence import velocity_curve
from gaident.errors import GaidentError, SettingsError
from gaident.identification.response.averaged import response_of, responses_of
from gaident.models.model import Model
from gaident.reporting.runs import run_of
from gaident.results.diagnosis import Diagnosis
from gaident.show import plots, response_plots
from gaident.show.diagnosis_plots import plot_evidence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["plot_bode", "plot_diagnosis", "plot_frequency_response"]


def plot_diagnosis(dia: Diagnosis, records: Sequence[Record], axis: str = "rotary") -> Figure:
    """Six panels of the longest record; axis="linear" for m and N. Raises SettingsError for another axis."""
    checked_axis(axis)
    rec = max(records, key=len)
    run = run_of(dia, rec)
    if run.dhat is None or run.torque is None:
        raise GaidentError(f"there is no picture of {rec.name or 'the record'}: {' '.join(said(n, axis) for n in run.notes)}")
    return plot_evidence(
        run.time,
        run.measured,
        run.linear,
        run.dhat,
        run.position,
        run.torque,
        dia.after.noise_floor,
        std=run.std,
        extended=run.extended,
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


def plot_bode(model: Model, controller: Controller | None, records: Sequence[Record], hz: bool, axis: str) -> Figure:
    """A model against the frequency response of the longest record, or alone; see `Identification.plot_bode`."""
    yes_or_no(hz, "hz", SettingsError)
    if not records:
        return plots.plot_bode(model, axis=axis, hz=hz)
    return response_plots.plot_response(response_of(max(records, key=len), model, bare_pi(controller)), hz, axis)


def plot_frequency_response(
    given: Sequence[FrequencyResponse],
    model: Model | None = None,
    hz: bool = True,
    axis: str = "rotary",
) -> Figure:
    """Measured frequency responses, all in one diagram, and the model that was found from them."""
    checked_axis(axis)
    yes_or_no(hz, "hz", SettingsError)
    name = given[0].name if len(given) == 1 else ""
    return response_plots.plot_response(responses_of(given, model), hz, axis, name)
