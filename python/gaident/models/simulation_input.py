"""What a simulation takes, checked: the model, what drives it, its start and its substeps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.arguments import A_CONTROLLER, COMMAND, NO_CONTROLLER, TORQUE
from gaident.control import core
from gaident.control.controller import Controller, checked_controller
from gaident.control.filtering import rate_limited
from gaident.data.record import Record
from gaident.data.signals.arrays import floats
from gaident.data.windows.window import Window, angle_before
from gaident.errors import ModelError, RecordError
from gaident.models.discrete import require_strictly_proper
from gaident.models.held_torque import held_torque
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model

Signal = NDArray[np.float64]
AnyModel = Model | OneMass | TwoMass
MAX_SUBSTEPS = 64  # no decision: what an argument may be


def followed(rec: Record, slope: float) -> Record:
    """The record with the command as a controller follows it, with at most this slope [rad/s^2]."""
    if rec.command is None or not np.isfinite(slope):
        return rec
    return rec.with_channels(command=rate_limited(rec.command, slope, rec.dt, 0.0))


def as_model(model: AnyModel) -> Model:
    if isinstance(model, (OneMass, TwoMass)):
        return model.model()
    if not isinstance(model, Model):
        raise ModelError(f"model is a {type(model).__name__}: give a Model, OneMass or TwoMass")
    return model


def input_of(plant: Model, rec: Record, controller: Controller | None) -> tuple[Signal, str]:
    """What drives the simulation, and its name; raises where record, model and loop do not fit together."""
    return input_for(plant.p, rec, controller)


def input_for(p: int, rec: Record, controller: Controller | None) -> tuple[Signal, str]:
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    checked_controller(controller)
    require_strictly_proper(p, controller)
    if controller is not None and controller.driven_by == "position_command":
        if rec.position_command is None:
            raise RecordError(
                "the record has no position_command, which drives the loop with a position controller: give position_command=, "
                "or leave position= out of the cascade to drive its velocity controller with the command"
            )
        return np.ascontiguousarray(rec.position_command, dtype=np.float64), "position_command"
    if controller is not None:
        if rec.command is None:
            raise RecordError(
                "the record has no command, which drives the loop with a controller: give "
                f"{COMMAND}, or {NO_CONTROLLER} to drive the model with the torque"
            )
        return np.ascontiguousarray(rec.command, dtype=np.float64), "command"
    if rec.torque is None:
        raise RecordError(
            "the record has no torque, which drives the model without a controller: give "
            f"{TORQUE}, or {A_CONTROLLER} to drive the loop with the command"
        )
    return held_torque(rec), "torque"


MOST_WORKERS = 1024  # no decision: what an argument may be: threads


def states_of(value: object, name: str) -> Signal:
    """States of a start as an array of its own; raises ModelError for what is no array of numbers."""
    try:
        return floats(value)
    except TypeError:
        raise ModelError(f"{name} is {value!r:.80}: give numbers, as gaident.initial_state does") from None


def models_of(models: object) -> list[Model]:
    """What is given as several models, as a list; raises ModelError for what is none."""
    if not isinstance(models, Iterable) or isinstance(models, str | bytes | Mapping):
        raise ModelError(f"models is {models!r:.80}: give a list of models")
    return [as_model(model) for model in models]


def check_workers(workers: object) -> None:
    """Raises ModelError for what is no number of threads."""
    if isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= MOST_WORKERS:
        raise ModelError(f"workers is {workers!r:.80}: give a number of threads, from 1 to {MOST_WORKERS}")


def check_start(plant: Model, controller: Controller | None, start: Signal, what: str, before: bool = False) -> None:
    """ModelError where a start state has another size; before: it may have the torque before the record, too."""
    size = plant.mechanism.order + (controller is not None)
    sizes = (size, size + 1) if before and controller is None else (size,)
    if start.ndim != 1 or len(start) not in sizes:
        raise ModelError(
            f"initial_state has the shape {start.shape}: this model driven by the {what} has "
            f"{size} states; use gaident.models.initial_state(model, rec, controller)"
        )
    if not np.all(np.isfinite(start)):
        raise ModelError(f"initial_state is {start}: every number must be finite")


def checked_substeps(substeps: int | None) -> int:
    """Substeps per sample as the core takes them, 0 for as many as needed; raises ModelError."""
    if substeps is None:
        return 0
    if isinstance(substeps, bool) or not isinstance(substeps, int) or not 1 <= substeps <= MAX_SUBSTEPS:
        raise ModelError(f"substeps is {substeps!r}: give a whole number from 1 to {MAX_SUBSTEPS}, or None for as many as needed")
    return substeps


def core_record(
    rec: Record, source: Signal, controller: Controller | None, before: float = 0.0, angle: Signal | None = None
) -> _core.EffectRecord:
    """A record as the core takes it; before: the torque that acted before it, of an open loop [N m].

    angle: in the place of the record's own [rad] (n,).
    """
    start = 0.0 if controller is None else controller.start_angle(source)
    angle = rec.position if angle is None else angle
    if angle is not None:
        start = float(angle[0])
    elif isinstance(rec, Window):
        start = angle_before(rec)
    between = None if controller is None else controller.source_of(rec)
    source = source if between is None else between
    return core.effect_record(rec.dt, source, angle, rec.velocity, start, controller, before)
