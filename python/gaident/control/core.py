"""The core's functions that take a controller: the only file that calls them.

controller: None for the open loop, where the torque drives the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.between import straight_part, with_means
from gaident.control.controller import Controller, VelocityGains
from gaident.control.ticks import Ticks, of_lines
from gaident.control.unknown import known

__all__ = [
    "clock",
    "core_controller",
    "discrete",
    "effect_record",
    "experiment",
    "held_torque",
    "is_one_equation",
    "line_record",
    "loop",
    "loop_name",
    "record",
    "recurrence",
    "servo_torque",
    "simulate",
]

Vector = NDArray[np.float64]
Roots = NDArray[np.complex128]


def loop_name(controller: Controller | None) -> str:
    """ "sampled", "continuous" or "open"."""
    return "open" if controller is None else controller.loop


def clock(dt: float) -> _core.Clock:
    """The controller's clock of a record with the sample time dt [s]."""
    return _core.Clock(period=dt)


def core_controller(controller: VelocityGains) -> _core.Controller:
    """The core's controller; ControllerError where a gain is None."""
    known(controller)
    torque, integrator = controller.limits
    return _core.Controller(kp=controller.kp, ki=controller.ki, torque_limit=torque, integrator_limit=integrator)


def loop(controller: Controller | None, dt: float) -> _core.Loop:
    """The core's loop, in a log with the sample time dt [s]."""
    return _core.Loop(kind="open") if controller is None else controller.core_loop(dt)


def simulate(
    gain: float,
    poles: Roots,
    zeros: Roots,
    dt: float,
    source: Vector,
    controller: Controller | None,
    start: Vector,
    arithmetic: str,
) -> tuple[Vector, Vector]:
    """(velocity [rad/s], torque [N m]) of a linear model in its loop; source: command [rad/s], in the open loop torque [N m]."""
    return _core.simulate(gain, poles, zeros, clock(dt), source, loop(controller, dt), start, arithmetic)


def discrete(gain: float, poles: Roots, zeros: Roots, dt: float, controller: Controller | None) -> tuple[Vector, Vector]:
    """(alpha, beta) of equation (7), without limits."""
    return _core.discrete(gain, poles, zeros, clock(dt), loop(controller, dt))


def effect_record(
    dt: float,
    source: Vector,
    position: Vector | None,
    velocity: Vector,
    start_angle: float,
    controller: Controller | None,
    torque_before: float = 0.0,
    added: Vector | None = None,
) -> _core.EffectRecord:
    """A record and its loop, for models with effects and for every controller.

    source: command [rad/s], in the open loop torque [N m], with a position controller position command [rad]; of
    `Controller.source_of`. torque_before: of the open loop, before the record [N m].
    added: to the torque of a Cascade, within its limit, at each of its samples [N m].
    """
    ticks = of_lines(source, position) if controller is None else controller.ticks(dt, source, position)
    fed = ticks.torque_feedforward
    if added is not None:
        fed = fed + added if len(fed) else np.ascontiguousarray(added, dtype=np.float64)
    return _core.EffectRecord(
        clock=_core.Clock(period=dt / ticks.log_every, log_every=ticks.log_every),
        input=ticks.source,
        position=ticks.position,
        velocity=velocity,
        start_angle=start_angle,
        loop=loop(controller, dt),
        velocity_feedforward=ticks.velocity_feedforward,
        torque_feedforward=fed,
        torque_before=torque_before,
    )


def servo_torque(dt: float, ticks: Ticks, velocity: Vector, servo: _core.Loop, stored: float = 0.0) -> Vector:
    """Torque [N m] that a servo makes of measured signals, from rest, at each of its samples: (n r,), r to a line of the log.

    dt: sample time of the log [s]; velocity (n r,) [rad/s]: at the controller's samples, as everything in `ticks`.
    stored: what its integrator, and the filters behind it, hold before the first sample [N m].
    """
    none = np.zeros(len(velocity))
    fed, added, position = ticks.velocity_feedforward, ticks.torque_feedforward, ticks.position
    return _core.servo_torque(
        clock=clock(dt / ticks.log_every),
        loop=servo,
        source=ticks.source,
        velocity=velocity,
        position=position if len(position) else none,
        velocity_feedforward=fed if len(fed) else none,
        torque_feedforward=added if len(added) else none,
        stored=stored,
    )


def record(dt: float, source: Vector, velocity: Vector, start: str, velocity0: float) -> _core.Record:
    """A record of an identification; start: "rest", "steady" or "free", with the first velocity [rad/s]."""
    return _core.Record(clock=clock(dt), input=source, output=velocity, start=start, velocity0=velocity0)


def line_record(
    dt: float,
    command: Vector,
    velocity: Vector,
    every: int,
    placed: bool,
    velocity_feed: float,
    acceleration_feed: float,
    known: Vector | None = None,
) -> _core.Record:
    """A record, from rest, of a loop whose controller takes `every` samples for each line of the log.

    command: of the velocity [rad/s] or, with a position controller (`placed`), of the position [rad] from its start.
    known: a velocity command at the controller's samples (n, every); its mean over each line counts.
    """
    between, straight = straight_part(command, placed)
    if known is not None:
        command, between, straight = with_means(command, between, straight, known)
    return _core.Record(
        clock=_core.Clock(period=dt / every, log_every=every),
        input=command,
        output=velocity,
        start="rest",
        velocity0=0.0,
        between=between,
        straight=straight,
        velocity_feedforward=velocity_feed,
        acceleration_feedforward=acceleration_feed,
    )


def is_one_equation(dt: float, controller: Controller, poles: int) -> bool:
    """Whether one difference equation describes a controller and a plant with so many poles, from line to line of a log."""
    every = controller.log_every(dt)
    try:
        order = _core.servo_order(loop=loop(controller, dt), clock=_core.Clock(period=dt / every, log_every=every))
    except ValueError:
        return False
    return poles + order <= _core.MOST_STATES


def experiment(
    records: Sequence[_core.Record],
    controller: Controller | None,
    dt: float,
    kernels: str = "",
    responses: Sequence[_core.Response] = (),
) -> _core.Experiment:
    """Records, their loop, and frequency responses for the genetic search and the local fit; dt: sample time of the log [s]."""
    return _core.Experiment(records, loop(controller, dt), kernels, responses)


def recurrence(
    model: _core.EffectModel, dt: float, controller: Controller | None, substeps: int, top_speed: float
) -> dict[str, Any]:
    """The numbers of the recurrence that simulates a model."""
    return _core.recurrence(model, clock(dt), loop(controller, dt), substeps, top_speed)


def held_torque(error: Vector, controller: VelocityGains, newest: float, before: float, rule: str, integral: float) -> Vector:
    """Torque [N m] of a PI whose integrator does not wind up; it adds newest e(n) + before e(n-1)."""
    return _core.held_torque(error, core_controller(controller), newest, before, rule, integral)
