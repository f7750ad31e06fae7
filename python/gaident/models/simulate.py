"""A drive against a record: command -> PI -> torque -> model -> velocity, or torque -> velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident import _core
from gaident.data.record import Record
from gaident.errors import ModelError, RecordError
from gaident.models._checks import one_of, real_number
from gaident.models.controller import PI
from gaident.models.mechanics import OneMass, TwoMass
from gaident.models.model import Discrete, Model

Signal = NDArray[np.float64]
AnyModel = Model | OneMass | TwoMass
ARITHMETICS = ("double", "float")


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated run, arrays of the record's length."""

    velocity: Signal  # rad/s
    torque: Signal  # N m, as the controller issues it; the record's torque in the open loop
    position: Signal  # rad, integral of velocity from the record's first position or 0


def simulate(
    model: AnyModel,
    rec: Record,
    controller: PI | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
) -> Signal:
    """The model's velocity [rad/s] for the record, an array like `rec.velocity`; see `run`."""
    return _simulated(model, rec, controller, initial_state, arithmetic)[0]


def run(
    model: AnyModel,
    rec: Record,
    controller: PI | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
) -> Run:
    """The model's answer to the record: its velocity, torque and position.

    model          Model, OneMass or TwoMass
    rec            with a controller its command drives the loop, without one its torque drives the model
    initial_state  None: at rest; otherwise what `gaident.models.initial_state` gives: p + q numbers of the
                   plant, the first of them the velocity [rad/s] before the first input acts; with a
                   controller one more, its stored torque [N m]
    arithmetic     "double", or "float" for 32-bit arithmetic (within 1e-4 of the response)

    A model that diverges gives infinite or undefined values, no error. Raises RecordError where the record
    lacks the input, ModelError for p = 0 outside the continuous loop and for an initial state of the wrong
    length.
    """
    velocity, torque = _simulated(model, rec, controller, initial_state, arithmetic)
    start = 0.0 if rec.position is None else float(rec.position[0])
    with np.errstate(invalid="ignore", over="ignore"):
        steps = 0.5 * rec.dt * (velocity[1:] + velocity[:-1])
        position = start + np.concatenate([[0.0], np.cumsum(steps)])
    return Run(velocity, torque, position)


def initial_state(model: AnyModel, rec: Record, controller: PI | None = None) -> Signal:
    """The initial state with which the model follows the record's velocity best (linear least squares).

    The response is the one from rest plus the state's own, which is linear in it. Returns p + q numbers, with
    a controller one more, for the argument `initial_state` of `simulate` and `run`; states that the record
    does not show are kept smallest. Raises ModelError for a controller with limits (the loop is then not
    linear) and where the model diverges, RecordError where the record lacks the input.
    """
    plant = _as_model(model)
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


def discrete(model: AnyModel, dt: float, controller: PI | None = None) -> Discrete:
    """Equation (7) of the model in the controller's loop, or torque to velocity; see `Model.discrete`."""
    plant = _as_model(model)
    sample_time = real_number(dt, "dt", ModelError, "give the sample time in s, > 0")
    if sample_time <= 0.0:
        raise ModelError(f"dt is {sample_time:g}: give the sample time in s, > 0")
    _require_strictly_proper(plant, controller)
    loop, kp, ki = "open", 0.0, 0.0
    if controller is not None:
        loop, kp, ki = controller.loop, controller.kp, controller.ki
    alpha, beta = _core.discrete(plant.gain, _roots(plant.poles), _roots(plant.zeros), sample_time, loop, kp, ki)
    return Discrete(alpha, beta)


def _simulated(
    model: AnyModel, rec: Record, controller: PI | None, state: ArrayLike | None, arithmetic: str
) -> tuple[Signal, Signal]:
    plant = _as_model(model)
    one_of(arithmetic, "arithmetic", ARITHMETICS, ModelError)
    source, what = _input(plant, rec, controller)
    size = plant.order + (controller is not None)
    start = np.zeros(0) if state is None else np.array(state, dtype=np.float64)
    if state is not None and start.shape != (size,):
        raise ModelError(
            f"initial_state has the shape {start.shape}: this model driven by the {what} has "
            f"{size} states; use gaident.models.initial_state(model, rec, controller)"
        )
    if not np.all(np.isfinite(start)):
        raise ModelError(f"initial_state is {start}: every number must be finite")
    return _core_simulate(plant, rec.dt, source, controller, start, arithmetic)


def _core_simulate(
    plant: Model, dt: float, source: Signal, controller: PI | None, start: Signal, arithmetic: str
) -> tuple[Signal, Signal]:
    if controller is None:
        loop, kp, ki, torque_limit, integrator_limit = "open", 0.0, 0.0, math.inf, math.inf
    else:
        loop, kp, ki = controller.loop, controller.kp, controller.ki
        torque_limit, integrator_limit = controller.limits
    return _core.simulate(
        plant.gain,
        _roots(plant.poles),
        _roots(plant.zeros),
        dt,
        source,
        loop,
        kp,
        ki,
        torque_limit,
        integrator_limit,
        start,
        arithmetic,
    )


def _roots(roots: tuple[complex, ...]) -> NDArray[np.complex128]:
    return np.array(roots, dtype=np.complex128)


def _input(plant: Model, rec: Record, controller: PI | None) -> tuple[Signal, str]:
    """What drives the simulation, and its name; raises where record, model and loop do not fit together."""
    if not isinstance(rec, Record):
        raise RecordError(f"rec is {type(rec).__name__}: give a gaident.Record")
    _require_strictly_proper(plant, controller)
    if controller is not None:
        if rec.command is None:
            raise RecordError(
                "the record has no command, which drives the loop with a controller: give "
                "Record(command=...), or controller=None to drive the model with the torque"
            )
        return np.ascontiguousarray(rec.command, dtype=np.float64), "command"
    if rec.torque is None:
        raise RecordError(
            "the record has no torque, which drives the model without a controller: give "
            "Record(torque=...), or controller=PI(...) to drive the loop with the command"
        )
    return np.ascontiguousarray(rec.torque, dtype=np.float64), "torque"


def _require_strictly_proper(plant: Model, controller: PI | None) -> None:
    if plant.p == 0 and (controller is None or controller.loop != "continuous"):
        where = "the sampled loop" if controller is not None else "an open loop"
        raise ModelError(
            f"the model has p = 0 (as many zeros as poles), which does not exist in {where}: "
            'use a model with more poles than zeros, or PI(..., loop="continuous")'
        )


def _as_model(model: AnyModel) -> Model:
    if isinstance(model, (OneMass, TwoMass)):
        return model.model()
    if not isinstance(model, Model):
        raise ModelError(f"model is a {type(model).__name__}: give a Model, OneMass or TwoMass")
    return model
