"""One record and what the models of a result make of it: worked out once for the pictures and for the page.

The missing torque is that of the linear part of a diagnosed model, its parameters as refitted together with the effects: a
linear model fitted alone has a part of them in its damping and inertia, and would show the rest distorted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.axis import message_of, say
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.diagnosis.experiments.excitation import position_of
from gaident.diagnosis.explain.missing_torque import missing_torque
from gaident.diagnosis.gains import closed_over, free_run_errors
from gaident.diagnosis.held_parts import VALIDATION, held_out_from
from gaident.diagnosis.records.hygiene import cleaned, outliers
from gaident.errors import GaidentError
from gaident.estimation.dataset import DataSet
from gaident.models.drive_torque import on_lines, torque_of
from gaident.models.model import Model
from gaident.models.simulate import run
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification
from gaident.show.report.views import RecordView

__all__ = ["run_of"]

Vector = NDArray[np.float64]


def run_of(result: Diagnosis | Identification, rec: Record) -> RecordView:
    """One record and what the models make of it."""
    loop = bare_pi(result.controller)
    linear: Model = result.model.mechanism if isinstance(result, Diagnosis) else result.model
    rec = rec if isinstance(result, Diagnosis) else result.as_used(rec)
    digest = rec.digest
    used = "fitted" if digest in result.digests else "new"
    notes: list[str] = []
    extended = first_held_out = None
    if isinstance(result, Diagnosis):
        rec = result.as_used(rec)
        if digest in result.validation_digests:
            used, first_held_out = "held out", 0
        elif used == "fitted" and not result.in_sample and result.held_out != VALIDATION:
            first_held_out = held_out_from(rec)
        # Where the logged torque does not follow from the controller, the figures are of models that this torque drives.
        of_loop = result.loop_follows or rec.torque is None
        closed = closed_over(result.controller, (rec,), [e.name for e in result.model.effects]) if of_loop else None
        aged = DataSet.of([rec], result.controller).aged(result.velocity_age)
        driven = rec if closed is not None else aged.as_old(rec)

        def free_run(model: Model, what: str) -> Vector:
            (error,) = free_run_errors(model, [(driven, 0)], aged.older(closed), closed)
            return _finite(rec.velocity - error, rec, what, notes)

        before = free_run(result.linear_model or result.identification.model, "linear")
        if result.model.effects:
            extended = free_run(result.model, "extended")
    else:
        before = _finite(result.simulate(rec), rec, "linear", notes)
    rec = on_lines(rec, result.controller)
    simulated = rec.torque is None and result.controller is not None and loop is None
    torque = run(linear, rec, result.controller).torque if simulated else torque_of(rec, loop)
    dhat, std = None, 0.0
    try:
        hit = outliers(rec.velocity, rec.velocity - before if np.all(np.isfinite(before)) else None)
        missing = missing_torque(linear, cleaned(rec, hit), loop, torque)
        dhat, std = missing.dhat, float(np.median(missing.std))
    except GaidentError as error:
        notes.append(say("The missing {torque} cannot be worked out: {}", message_of(error)))
    return RecordView(
        name=rec.name,
        digest=digest,
        used=used,
        time=rec.time,
        measured=rec.velocity,
        position=position_of(rec),
        linear=before,
        command=rec.command,
        torque=torque,
        torque_logged=rec.torque is not None,
        extended=extended,
        dhat=dhat,
        std=std,
        held_out_from=first_held_out,
        notes=tuple(notes),
    )


def _finite(velocity: Vector, rec: Record, what: str, notes: list[str]) -> Vector:
    """Values beyond what a picture can show are left out: a diverging simulation ends in a gap."""
    limit = POLICY.diverged * float(np.abs(rec.velocity).max() or 1.0)
    with np.errstate(invalid="ignore"):
        away = ~(np.abs(velocity) <= limit)
    if not np.any(away):
        return velocity
    first = int(np.argmax(away))
    notes.append(f"The free run of the {what} model runs away at {first * rec.dt:.4g} s; it is drawn up to there.")
    out = velocity.copy()
    out[first:] = np.nan
    return out
