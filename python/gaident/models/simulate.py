"""A drive against a record: command -> PI -> torque -> model -> velocity, or torque -> velocity."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.checks import one_of
from gaident.control import core
from gaident.control.controller import Controller, checked_controller
from gaident.data.record import Record
from gaident.errors import GaidentError, ModelError
from gaident.models.model import Model
from gaident.models.simulate_many import simulated_with_effects
from gaident.models.simulation_input import (
    AnyModel,
    Signal,
    as_model,
    check_start,
    checked_substeps,
    core_record,
    input_of,
    states_of,
)

BLOCK = 1 << 18  # no decision: memory; rows of a regression, some 0.1 s
ARITHMETICS = ("double", "float", "drive_double", "drive_float", "c30", "fixed", "fixed_tight", "fixed_wide")


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated run, arrays of the record's length n.

    Attributes
    ----------
    velocity : ndarray, shape (n,)
        Velocity as the sensor shows it [rad/s].
    torque : ndarray, shape (n,)
        Torque as the controller issues it [N m]; the record's torque in open loop.
    position : ndarray, shape (n,)
        The motor's true angle [rad], from the record's first position or 0.
    load_velocity : ndarray, shape (n,), or None
        The load's true velocity [rad/s]; None where it was not asked for.
    load_position : ndarray, shape (n,), or None
        The load's true angle [rad], which starts where the motor's does; None where it was not asked for.

    See Also
    --------
    run : Makes it, with an example.
    """

    velocity: Signal  # rad/s, as the sensor shows it
    torque: Signal  # N m, as the controller issues it; the record's torque in the open loop
    position: Signal  # rad, the motor's true angle from the record's first position or 0
    load_velocity: Signal | None = None  # rad/s
    load_position: Signal | None = None  # rad


def simulate(
    model: AnyModel,
    rec: Record,
    controller: Controller | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
    substeps: int | None = None,
) -> Signal:
    """Return the model's velocity for a record, from its command or its torque.

    Parameters
    ----------
    model : Model, OneMass or TwoMass
        The drive.
    rec : Record
        With a controller its command drives the loop, without one its torque drives the model.
    controller : PI or Cascade, optional
        The velocity loop; None: open loop.
    initial_state : array_like, optional
        See `run`; None: at rest.
    arithmetic, substeps : optional
        See `run`.

    Returns
    -------
    ndarray, shape (n,)
        Velocity [rad/s], like `rec.velocity`.

    Raises
    ------
    RecordError, ModelError
        As `run`.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> rec = ga.Record(1e-3, torque=np.full(100, 0.2), velocity=np.zeros(100))
    >>> w = ga.simulate(ga.OneMass(J=1e-3, D=0.0), rec)
    >>> round(float(w[-1]), 6)  # 99 ms of 0.2 N m at 1e-3 kg m^2
    19.8
    """
    return _simulated(model, rec, controller, initial_state, arithmetic, substeps)[0]


def run(
    model: AnyModel,
    rec: Record,
    controller: Controller | None = None,
    initial_state: ArrayLike | None = None,
    *,
    arithmetic: str = "double",
    substeps: int | None = None,
    load: bool = False,
) -> Run:
    """Return the model's answer to a record: its velocity, torque and position.

    A model that diverges gives infinite or undefined values, no error.

    Parameters
    ----------
    model : Model, OneMass or TwoMass
        The drive.
    rec : Record
        With a controller its command drives the loop, without one its torque drives the model.
    controller : PI or Cascade, optional
        The velocity loop; None: open loop.
    initial_state : array_like, optional
        None: at rest.
        Otherwise what `gaident.initial_state` gives: p + q numbers of the plant, the first of them the velocity [rad/s] before
        the first input acts; with a controller one more, its stored torque [N m].
        In the open loop one more may be given, too: the torque that acted before the record [N m], which a delay and a lag of
        the torque contain where it begins. Without it that is the first torque, and 0 at rest.
    arithmetic : str
        "double", or "float" for 32-bit arithmetic (within 1e-4 of the response; models without effects).
        Or a drive's (docs/dsp.md): from rest, in the continuous loop without limits; NaN once it has left its range.
    substeps : int, optional
        Steps per sample of a model with effects, 1 to 64; None: as many as it needs.
    load : bool
        Whether the motion of the load is simulated, too: of two masses on a shaft, p = 1 and q = 2.

    Returns
    -------
    Run
        Velocity [rad/s], torque [N m] and position [rad], with `load` velocity and position of the load.

    Raises
    ------
    RecordError
        Where the record lacks the input.
    ModelError
        For p = 0 outside the continuous loop, an initial state of the wrong length, an unknown arithmetic, wrong substeps, or a
        load that the model does not have.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> rec = ga.Record(1e-3, command=np.full(400, 20.0), velocity=np.zeros(400))
    >>> answer = ga.run(ga.OneMass(J=1e-3, D=0.01), rec, ga.PI(kp=0.05, ki=0.5))
    >>> round(float(answer.torque[0]), 6), round(float(answer.velocity[-1]), 2)
    (1.005, 20.0)
    """
    if not isinstance(load, bool):
        raise ModelError(f"load is {load!r}: give True or False")
    velocity, torque, angle = _simulated(model, rec, controller, initial_state, arithmetic, substeps)
    if angle is None:
        angle = _integrated(rec, velocity)
    if not load:
        return Run(velocity, torque, angle)
    load_velocity, lag = _load_of(model, rec, controller, initial_state, substeps)
    return Run(velocity, torque, angle, load_velocity, angle + lag)


def _integrated(rec: Record, velocity: Signal) -> Signal:
    """The angle [rad] of a velocity, by the trapezoidal rule."""
    start = 0.0 if rec.position is None else float(rec.position[0])
    with np.errstate(invalid="ignore", over="ignore"):
        steps = 0.5 * rec.dt * (velocity[1:] + velocity[:-1])
        return np.asarray(start + np.concatenate([[0.0], np.cumsum(steps)]))


def initial_state(model: AnyModel, rec: Record, controller: Controller | None = None) -> Signal:
    """Return the initial state with which the model follows the record's velocity best (linear least squares).

    The response is the one from rest plus the state's own, which is linear in it.
    States that the record does not show are kept smallest.
    Of a model with effects the linear part is taken.

    Parameters
    ----------
    model : Model, OneMass or TwoMass
        The drive.
    rec : Record
        The record that starts in motion.
    controller : PI or Cascade, optional
        The velocity loop; None: open loop.

    Returns
    -------
    ndarray, shape (p + q,) or, with a controller, (p + q + 1,)
        For the argument `initial_state` of `simulate` and `run`, which names the units.

    Raises
    ------
    ModelError
        For a controller with limits (the loop is then not linear), and where the model diverges.
    RecordError
        Where the record lacks the input.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> rec = ga.Record(1e-3, torque=np.zeros(100), velocity=np.full(100, 20.0))
    >>> ga.initial_state(ga.OneMass(J=1e-3, D=0.0), rec).round(6).tolist()
    [20.0]
    """
    plant = as_model(model).mechanism
    checked_controller(controller)
    if controller is not None and controller.limited:
        raise ModelError(
            "the controller has a torque_limit or integrator_limit: with limits the response is "
            "not linear in the initial state; estimate it with PI(kp, ki) without limits, or "
            "start at rest"
        )
    source, _ = input_of(plant, rec, controller)
    if controller is not None and not controller.one_equation:
        raise ModelError(
            f"controller is {controller!r}: the start of a loop is found under a bare PI only; use controller=None where the "
            "torque is logged, or start at rest"
        )
    size = plant.order + (controller is not None)
    if size == 0:
        return np.zeros(0)
    silence = np.zeros_like(source)
    missing = rec.velocity - _core_simulate(plant, rec.dt, source, controller, np.zeros(size), "double")[0]
    answers = [_core_simulate(plant, rec.dt, silence, controller, unit, "double")[0] for unit in np.eye(size)]
    if not all(np.all(np.isfinite(answer)) for answer in (*answers, missing)):
        raise ModelError(
            f"{plant!r} diverges within the record: its initial state cannot be found; use a "
            "shorter part of the record or a stable model"
        )
    return _least_norm(answers, missing)


def _least_norm(answers: list[Signal], wanted: Signal) -> Signal:
    """x with the smallest sum of x_i answers_i - wanted, and of these the smallest; long ones block by block, so for Ctrl-C."""
    if len(wanted) <= BLOCK:
        columns = np.column_stack(answers)
        lengths = np.linalg.norm(columns, axis=0)
    else:
        lengths = np.array([np.linalg.norm(answer) for answer in answers])
        both = np.zeros((0, len(answers) + 1))
        for start in range(0, len(wanted), BLOCK):
            rows = np.column_stack([signal[start : start + BLOCK] for signal in (*answers, wanted)])
            both = np.asarray(np.linalg.qr(np.vstack([both, rows]), mode="r"))
        columns, wanted = both[:, :-1], both[:, -1]
    lengths[lengths == 0.0] = 1.0
    solution = np.linalg.lstsq(columns / lengths, wanted, rcond=1e-12)[0]
    state: Signal = solution / lengths
    return state


def _start_of(plant: Model, rec: Record, controller: Controller | None, state: ArrayLike | None) -> tuple[Signal, Signal, float]:
    """(what drives the model, its initial state, empty at rest, and the torque before the record [N m])."""
    source, what = input_of(plant, rec, controller)
    if state is None:
        return source, np.zeros(0), 0.0
    start = states_of(state, "initial_state")
    check_start(plant, controller, start, what, before=True)
    if controller is not None or not len(start):
        return source, start, 0.0
    order = plant.mechanism.order
    return source, start[:order], float(start[order] if len(start) > order else source[0])


def _load_of(
    model: AnyModel, rec: Record, controller: Controller | None, state: ArrayLike | None, substeps: int | None
) -> tuple[Signal, Signal]:
    """(velocity [rad/s], angle less the motor's [rad]) of the load."""
    plant = as_model(model)
    source, start, before = _start_of(plant, rec, controller, state)
    starts = start.reshape(1, -1) if state is not None else np.zeros((0, 0))
    record = core_record(rec, source, controller, before)
    try:
        found = simulated_with_effects(record, [plant], starts, checked_substeps(substeps), 1, False, load=True)
    except GaidentError:
        raise
    except ValueError:
        raise ModelError(
            f"load is True, but the model is {plant!r}: only two masses on a shaft, p = 1 and q = 2 without an extra resonance, "
            "have a load; leave it out"
        ) from None
    return found[3][0], found[4][0]  # no decision: places


def _simulated(
    model: AnyModel, rec: Record, controller: Controller | None, state: ArrayLike | None, arithmetic: str, substeps: int | None
) -> tuple[Signal, Signal, Signal | None]:
    """(velocity, torque, angle); a model without effects has no angle of its own."""
    plant = as_model(model)
    one_of(arithmetic, "arithmetic", ARITHMETICS, ModelError)
    source, start, before = _start_of(plant, rec, controller, state)
    steps = checked_substeps(substeps)
    if arithmetic not in ("double", "float") and not plant.effects:
        _check_drive(controller, state, arithmetic)
    if not plant.effects and (controller is None or controller.one_equation):
        return *_core_simulate(plant, rec.dt, source, controller, start, arithmetic), None
    if arithmetic != "double":
        raise ModelError(
            f"arithmetic is {arithmetic!r}: a model with effects, or under another controller than a bare PI, is "
            'simulated in "double" only'
        )
    starts = start.reshape(1, -1) if state is not None else np.zeros((0, 0))
    found = simulated_with_effects(core_record(rec, source, controller, before), [plant], starts, steps, 1, True)
    velocity, torque, angle = (signal[0] for signal in found[:3])  # no decision: how many signals are the motor's
    return velocity, torque, angle


def _check_drive(controller: Controller | None, state: ArrayLike | None, arithmetic: str) -> None:
    limits = (0.0,) if controller is None else controller.limits
    if controller is None or controller.loop != "continuous" or any(map(math.isfinite, limits)):
        raise ModelError(f'arithmetic is {arithmetic!r}: it is that of the continuous loop without limits; use "double" here')
    if state is not None:
        raise ModelError(f"initial_state is {state!r}: in the arithmetic {arithmetic!r} a model starts at rest; leave it out")


def _core_simulate(
    plant: Model, dt: float, source: Signal, controller: Controller | None, start: Signal, arithmetic: str
) -> tuple[Signal, Signal]:
    return core.simulate(plant.gain, _roots(plant.poles), _roots(plant.zeros), dt, source, controller, start, arithmetic)


def _roots(roots: tuple[complex, ...]) -> NDArray[np.complex128]:
    return np.array(roots, dtype=np.complex128)
