"""A drive against a record: command -> PI -> torque -> model -> velocity, or torque -> velocity."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident import _core
from gaident.arguments import A_CONTROLLER, COMMAND, NO_CONTROLLER, TORQUE
from gaident.checks import one_of
from gaident.control import core
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.errors import GaidentError, ModelError, RecordError
from gaident.models.effects import table as effect_table
from gaident.models.factors import Structure
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Model, require_strictly_proper
from gaident.models.own_effects import OWN

Signal = NDArray[np.float64]
AnyModel = Model | OneMass | TwoMass
ARITHMETICS = ("double", "float", "drive_double", "drive_float", "c30", "fixed", "fixed_tight", "fixed_wide")
MAX_SUBSTEPS = 64


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated run, arrays of the record's length."""

    velocity: Signal  # rad/s, as the sensor shows it
    torque: Signal  # N m, as the controller issues it; the record's torque in the open loop
    position: Signal  # rad, the motor's true angle from the record's first position or 0


def simulate(
    model: AnyModel,
    rec: Record,
    controller: PI | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
    substeps: int | None = None,
) -> Signal:
    """The model's velocity [rad/s] for the record, an array like `rec.velocity`; see `run`."""
    return _simulated(model, rec, controller, initial_state, arithmetic, substeps)[0]


def run(
    model: AnyModel,
    rec: Record,
    controller: PI | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
    substeps: int | None = None,
) -> Run:
    """The model's answer to the record: its velocity, torque and position.

    model          Model, OneMass or TwoMass
    rec            with a controller its command drives the loop, without one its torque drives the model
    initial_state  None: at rest; otherwise what `gaident.models.initial_state` gives: p + q numbers of the
                   plant, the first of them the velocity [rad/s] before the first input acts; with a
                   controller one more, its stored torque [N m]
    arithmetic     "double", or "float" for 32-bit arithmetic (within 1e-4 of the response; models without effects); or a
                   drive's (docs/dsp.md): from rest, in the continuous loop without limits; NaN once it has left its range
    substeps       steps per sample of a model with effects, 1..64; None: as many as it needs

    A model that diverges gives infinite or undefined values, no error. Raises RecordError where the record
    lacks the input, ModelError for p = 0 outside the continuous loop and for an initial state of the wrong
    length.
    """
    velocity, torque, angle = _simulated(model, rec, controller, initial_state, arithmetic, substeps)
    if angle is not None:
        return Run(velocity, torque, angle)
    start = 0.0 if rec.position is None else float(rec.position[0])
    with np.errstate(invalid="ignore", over="ignore"):
        steps = 0.5 * rec.dt * (velocity[1:] + velocity[:-1])
        position = start + np.concatenate([[0.0], np.cumsum(steps)])
    return Run(velocity, torque, position)


def initial_state(model: AnyModel, rec: Record, controller: PI | None = None) -> Signal:
    """The initial state with which the model follows the record's velocity best (linear least squares).

    The response is the one from rest plus the state's own, which is linear in it. Returns p + q numbers, with
    a controller one more, for the argument `initial_state` of `simulate` and `run`; states that the record
    does not show are kept smallest. Of a model with effects the linear part is taken. Raises ModelError for a
    controller with limits (the loop is then not linear) and where the model diverges, RecordError where the
    record lacks the input.
    """
    plant = _as_model(model).linear
    if controller is not None and controller.limited:
        raise ModelError(
            "the controller has a torque_limit or integrator_limit: with limits the response is "
            "not linear in the initial state; estimate it with PI(kp, ki) without limits, or "
            "start at rest"
        )
    source, _ = _input(plant, rec, controller)
    size = plant.order + (controller is not None)
    if size == 0:
        return np.zeros(0)
    silence = np.zeros_like(source)
    missing = rec.velocity - _core_simulate(plant, rec.dt, source, controller, np.zeros(size), "double")[0]
    columns = np.column_stack([_core_simulate(plant, rec.dt, silence, controller, unit, "double")[0] for unit in np.eye(size)])
    if not (np.all(np.isfinite(columns)) and np.all(np.isfinite(missing))):
        raise ModelError(
            f"{plant!r} diverges within the record: its initial state cannot be found; use a "
            "shorter part of the record or a stable model"
        )
    lengths = np.linalg.norm(columns, axis=0)
    lengths[lengths == 0.0] = 1.0
    solution = np.linalg.lstsq(columns / lengths, missing, rcond=1e-12)[0]
    state: Signal = solution / lengths
    return state


def simulate_many(
    models: Sequence[AnyModel],
    rec: Record,
    controller: PI | None = None,
    *,
    initial_states: ArrayLike | None = None,
    substeps: int | None = None,
    workers: int = 1,
) -> Signal:
    """Velocities [rad/s] of many models for one record, shape (len(models), len(rec)).

    Each row is what `simulate` gives for its model; models of one structure with the same effects run side by
    side. initial_states: (len(models), states), see `run`; then all models have the same number of states.
    Raises as `run` does.
    """
    plants = [_as_model(model) for model in models]
    source, starts = None, np.zeros((0, 0))
    for structure in {(plant.p, plant.q): plant for plant in plants}.values():
        source, _ = _input(structure, rec, controller)
    if source is None:
        return np.zeros((0, len(rec)))
    if initial_states is not None:
        starts = np.array(initial_states, dtype=np.float64)
        if starts.ndim != 2 or len(starts) != len(plants):
            raise ModelError(f"initial_states has the shape {starts.shape}: give one row per model, {len(plants)}")
        for i, plant in enumerate(plants):
            _check_start(plant, controller, starts[i], "command" if controller is not None else "torque")
    record = _core_record(rec, source, controller)
    return _simulate(record, plants, starts, checked_substeps(substeps), workers, False)[0]


def simulate_values(
    structure: Structure,
    effects: Sequence[str],
    values: ArrayLike,
    rec: Record,
    controller: PI | None = None,
    *,
    initial_states: ArrayLike | None = None,
    substeps: int | None = None,
    workers: int = 1,
) -> Signal:
    """`simulate_many` for models given as numbers, shape (len(values), len(rec)): the inner loop of a fit.

    A row of `values` holds the natural parameters of the linear part in the order of `factor_parameters`, then
    those of each effect named, in the order of `gaident.effects.table()`. Values are not checked against their
    bounds: what makes no drive gives undefined numbers. Raises ModelError for a wrong shape or unknown names.
    """
    table = np.ascontiguousarray(values, dtype=np.float64)
    source, _ = _input_for(structure.p, rec, controller)
    starts = np.zeros((0, 0)) if initial_states is None else np.ascontiguousarray(initial_states, dtype=np.float64)
    record = _core_record(rec, source, controller)
    built_in, own = _parted(structure, effects, table)
    try:
        with np.errstate(all="ignore"):
            return record.simulate_values(
                built_in, tuple(structure), [e for e in effects if e not in OWN], starts, checked_substeps(substeps), workers, own
            )
    except GaidentError:
        raise
    except ValueError as reason:
        raise ModelError(str(reason)) from None


def _simulated(
    model: AnyModel, rec: Record, controller: PI | None, state: ArrayLike | None, arithmetic: str, substeps: int | None
) -> tuple[Signal, Signal, Signal | None]:
    """(velocity, torque, angle); a model without effects has no angle of its own."""
    plant = _as_model(model)
    one_of(arithmetic, "arithmetic", ARITHMETICS, ModelError)
    source, what = _input(plant, rec, controller)
    start = np.zeros(0) if state is None else np.array(state, dtype=np.float64)
    if state is not None:
        _check_start(plant, controller, start, what)
    steps = checked_substeps(substeps)
    if arithmetic not in ("double", "float") and not plant.effects:
        _check_drive(controller, state, arithmetic)
    if not plant.effects:
        return *_core_simulate(plant, rec.dt, source, controller, start, arithmetic), None
    if arithmetic != "double":
        raise ModelError(f'arithmetic is {arithmetic!r}: a model with effects is simulated in "double" only')
    starts = start.reshape(1, -1) if state is not None else np.zeros((0, 0))
    found = _simulate(_core_record(rec, source, controller), [plant], starts, steps, 1, True)
    velocity, torque, angle = (signal[0] for signal in found)
    return velocity, torque, angle


def _check_drive(controller: PI | None, state: ArrayLike | None, arithmetic: str) -> None:
    limits = (0.0,) if controller is None else controller.limits
    if controller is None or controller.loop != "continuous" or any(map(math.isfinite, limits)):
        raise ModelError(f'arithmetic is {arithmetic!r}: it is that of the continuous loop without limits; use "double" here')
    if state is not None:
        raise ModelError(f"initial_state is {state!r}: in the arithmetic {arithmetic!r} a model starts at rest; leave it out")


OwnList = list[tuple[str, Callable[..., Any], Signal]]


def _simulate(
    record: _core.EffectRecord, plants: Sequence[Model], starts: Signal, steps: int, workers: int, every: bool
) -> tuple[Signal, Signal, Signal]:
    """The core's simulation of models, those with the same effects of one's own at once."""
    acting = [tuple(e.name for e in plant.own_effects()) for plant in plants]
    if not any(acting):
        return record.simulate([plant.core() for plant in plants], starts, steps, workers, every)
    found: list[Signal] | None = None
    for names in dict.fromkeys(acting):
        index = [i for i, mine in enumerate(acting) if mine == names]
        own: OwnList = []
        for name in names:
            rows = [next(e.values for e in plants[i].effects if e.name == name) for i in index]
            own.append((OWN[name].acts, OWN[name].ask, np.array(rows, dtype=np.float64)))
        some = starts[index] if starts.size else starts
        with np.errstate(all="ignore"):
            parts = record.simulate([plants[i].core() for i in index], some, steps, workers, every, own=own)
        if found is None:
            found = [np.empty((len(plants) if part.size else 0, part.shape[1])) for part in parts]
        for whole, part in zip(found, parts, strict=True):
            if part.size:
                whole[index] = part
    assert found is not None
    return found[0], found[1], found[2]


def _parted(structure: Structure, effects: Sequence[str], values: Signal) -> tuple[Signal, OwnList]:
    """Rows of values of `simulate_values` without the columns of effects of one's own, and these."""
    if not any(e in OWN for e in effects):
        return values, []
    sizes = {row.name: len(row.parameters) for row in effect_table()}
    at = 1 + structure.real_poles + 2 * structure.pole_pairs + structure.real_zeros + 2 * structure.zero_pairs
    kept, own = [values[:, :at]], []
    for e in effects:
        columns = values[:, at : at + sizes.get(e, 0)]
        at += sizes.get(e, 0)
        if e in OWN:
            own.append((OWN[e].acts, OWN[e].ask, np.ascontiguousarray(columns)))
        else:
            kept.append(columns)
    if values.shape[1] != at:
        raise ModelError(f"values has {values.shape[1]} columns: {at} are needed for {structure} with {', '.join(effects)}")
    return np.ascontiguousarray(np.hstack(kept)), own


def checked_substeps(substeps: int | None) -> int:
    """Substeps per sample as the core takes them, 0 for as many as needed; raises ModelError."""
    if substeps is None:
        return 0
    if isinstance(substeps, bool) or not isinstance(substeps, int) or not 1 <= substeps <= MAX_SUBSTEPS:
        raise ModelError(f"substeps is {substeps!r}: give a whole number from 1 to {MAX_SUBSTEPS}, or None for as many as needed")
    return substeps


def _core_record(rec: Record, source: Signal, controller: PI | None) -> _core.EffectRecord:
    position = np.zeros(0) if rec.position is None else rec.position
    start = 0.0 if rec.position is None else float(rec.position[0])
    return core.effect_record(rec.dt, source, position, rec.velocity, start, controller)


def _check_start(plant: Model, controller: PI | None, start: Signal, what: str) -> None:
    extra = 2 * any(effect.name == "extra_resonance" for effect in plant.effects)
    size = plant.order + extra + (controller is not None)
    if start.shape != (size,):
        raise ModelError(
            f"initial_state has the shape {start.shape}: this model driven by the {what} has "
            f"{size} states; use gaident.models.initial_state(model, rec, controller)"
        )
    if not np.all(np.isfinite(start)):
        raise ModelError(f"initial_state is {start}: every number must be finite")


def _core_simulate(
    plant: Model, dt: float, source: Signal, controller: PI | None, start: Signal, arithmetic: str
) -> tuple[Signal, Signal]:
    return core.simulate(plant.gain, _roots(plant.poles), _roots(plant.zeros), dt, source, controller, start, arithmetic)


def _roots(roots: tuple[complex, ...]) -> NDArray[np.complex128]:
    return np.array(roots, dtype=np.complex128)


def _input(plant: Model, rec: Record, controller: PI | None) -> tuple[Signal, str]:
    """What drives the simulation, and its name; raises where record, model and loop do not fit together."""
    return _input_for(plant.p, rec, controller)


def _input_for(p: int, rec: Record, controller: PI | None) -> tuple[Signal, str]:
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    require_strictly_proper(p, controller)
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
    return np.ascontiguousarray(rec.torque, dtype=np.float64), "torque"


def _as_model(model: AnyModel) -> Model:
    if isinstance(model, (OneMass, TwoMass)):
        return model.model()
    if not isinstance(model, Model):
        raise ModelError(f"model is a {type(model).__name__}: give a Model, OneMass or TwoMass")
    return model
