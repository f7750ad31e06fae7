"""What to do with a diagnosis, worked out for its page: other gains, feedforward, and what mending each cause would bring.

    following error = command - velocity, or under a position controller position command - position;  rms over a record

Each part is there where the diagnosis carries what it needs; else its reason is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gaident.axis import message_of, say
from gaident.control.cascade import Cascade
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.estimation.mean_velocity import run_as_seen
from gaident.identification.replay.command_timing import timed_record
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.remedies.doubts import doubts_of
from gaident.remedies.feedforward import feedforward
from gaident.remedies.following.simulated import NO_COMMAND, NO_CONTROLLER, NOT_THE_LOOP, RUNS_AWAY
from gaident.remedies.nonlinear import mendable
from gaident.remedies.pictures import loop_curves
from gaident.remedies.retune import retune
from gaident.results.diagnosis import Diagnosis
from gaident.results.retuning import Retuning
from gaident.show.report.views import Mended, Remedies

__all__ = ["remedies_of"]

NO_LOOP = say("no controller is simulated in this result, so that there is no loop")
NOT_ON_THIS = say("what is said above stands against this model")
NOTHING = say("the model has no effect that a repair could take out")


def remedies_of(result: Diagnosis, records: Sequence[Record]) -> Remedies | None:
    """What the page shows of a diagnosis on these records, which it was made of; None without any."""
    if not records:
        return None
    dia = replace(result, records=tuple(records))
    found = Remedies(doubts=doubts_of(dia))
    try:
        if found.doubts:
            raise GaidentError(NOT_ON_THIS)
        if dia.controller is None:
            raise GaidentError(NO_CONTROLLER)
        tuned = retune(dia, filters=isinstance(dia.controller, Cascade), most_times=POLICY.raised)
        found = replace(found, retuning=tuned, loops=loop_curves(tuned))
    except GaidentError as error:
        found = replace(found, no_gains=message_of(error))
    try:
        found = replace(found, tables=feedforward(dia))
    except GaidentError as error:
        found = replace(found, no_tables=message_of(error))
    try:
        return replace(found, mended=_mended(dia, max(records, key=len), found.retuning))
    except GaidentError as error:
        return replace(found, no_mended=message_of(error))


def _mended(dia: Diagnosis, rec: Record, tuned: Retuning | None) -> Mended:
    """Raises GaidentError with the reason where there is no such table."""
    controller, rec = dia.controller, timed_record(rec, dia.controller)
    if controller is None:
        raise GaidentError(NO_LOOP)
    if not dia.loop_follows:
        raise GaidentError(NOT_THE_LOOP)
    causes = [effect for effect in dia.model.effects if mendable(effect)]
    if not causes:
        raise GaidentError(NOTHING)

    def error(model: Model, loop: Controller = controller) -> float:
        return _following_error(model, rec, loop, dia.velocity_age)

    now = error(dia.model)
    if not np.isfinite(now):
        raise GaidentError(RUNS_AWAY)
    without = {(e.name, e.side): error(dia.model.without_effect(e.name, side=e.side or None)) for e in causes}
    placed = controller.driven_by != "command"
    new = None if tuned is None else error(dia.model, tuned.controller)
    return Mended(rec.name or "the record", "rad" if placed else "rad/s", now, new, without)


def _following_error(model: Model, rec: Record, controller: Controller, age: float) -> float:
    command, placed = (rec.position_command, True) if controller.driven_by == "position_command" else (rec.command, False)
    if command is None:
        raise GaidentError(NO_COMMAND)
    with np.errstate(over="ignore", invalid="ignore"):
        run = run_as_seen(model, rec, controller, age)
        error = float(np.sqrt(np.mean((command - (run.position if placed else run.velocity)) ** 2)))
    return error if np.isfinite(error) else float("inf")
