"""The core's functions that take a controller: the only file that makes the core's controller, loop and clock of a PI and a dt.

controller: None for the open loop, where the torque drives the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.control.cascade import Cascade, Controller, cascade_of
from gaident.control.pi import PI, RULES
from gaident.control.ticks import ticks_of
from gaident.control.unknown import known

__all__ = [
    "clock",
    "core_controller",
    "discrete",
    "effect_record",
    "experiment",
    "held_torque",
    "loop",
    "loop_name",
    "one_equation",
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


def one_equation(controller: Controller | None) -> TypeGuard[PI | None]:
    """Whether one difference equation holds controller and plant, limits left out: of a bare PI, and in the open loop."""
    return controller is None or cascade_of(controller) is None


def clock(dt: float) -> _core.Clock:
    """The controller's clock of a record with the sample time dt [s]."""
    return _core.Clock(period=dt)


def core_controller(controller: PI) -> _core.Controller:
    """The core's controller; ControllerError where a gain is None."""
    known(controller)
    torque, integrator = controller.limits
    return _core.Controller(kp=controller.kp, ki=controller.ki, torque_limit=torque, integrator_limit=integrator)


def loop(controller: PI | None) -> _core.Loop:
    """The core's loop."""
    if controller is None:
        return _core.Loop(kind="open")
    return _core.Loop(kind=controller.loop, controller=core_controller(controller))


def simulate(
    gain: float, poles: Roots, zeros: Roots, dt: float, source: Vector, controller: PI | None, start: Vector, arithmetic: str
) -> tuple[Vector, Vector]:
    """(velocity [rad/s], torque [N m]) of a linear model in its loop; source: command [rad/s], in the open loop torque [N m]."""
    return _core.simulate(gain, poles, zeros, clock(dt), source, loop(controller), start, arithmetic)


def discrete(gain: float, poles: Roots, zeros: Roots, dt: float, controller: PI | None) -> tuple[Vector, Vector]:
    """(alpha, beta) of equation (7), without limits."""
    return _core.discrete(gain, poles, zeros, clock(dt), loop(controller))


def effect_record(
    dt: float, source: Vector, position: Vector | None, velocity: Vector, start_angle: float, controller: Controller | None
) -> _core.EffectRecord:
    """A record and its loop, for models with effects and for every controller.

    source: command [rad/s], in the open loop torque [N m], with a position controller position command [rad].
    """
    cascade = None if controller is None else cascade_of(controller)
    if cascade is not None:
        return _servo_record(dt, source, position, velocity, start_angle, cascade)
    assert not isinstance(controller, Cascade)
    return _core.EffectRecord(
        clock=clock(dt),
        input=source,
        position=np.zeros(0) if position is None else position,
        velocity=velocity,
        start_angle=start_angle,
        loop=loop(controller),
    )


def _servo_record(
    dt: float, source: Vector, position: Vector | None, velocity: Vector, start_angle: float, cascade: Cascade
) -> _core.EffectRecord:
    known(cascade)
    ticks = ticks_of(cascade, dt, source, position)
    period = dt / ticks.log_every
    return _core.EffectRecord(
        clock=_core.Clock(period=period, log_every=ticks.log_every),
        input=ticks.source,
        position=ticks.position,
        velocity=velocity,
        start_angle=start_angle,
        loop=_servo(cascade, period, cascade.position_every(dt)),
        velocity_feedforward=ticks.velocity_feedforward,
        torque_feedforward=ticks.torque_feedforward,
    )


def servo_torque(dt: float, source: Vector, velocity: Vector, position: Vector | None, cascade: Cascade) -> Vector:
    """Torque [N m] that a cascade makes of measured signals, from rest, at each of its samples: (n r,), r to a line of the log.

    source, position: at the n lines of the log; velocity: at the controller's samples (n r,). Raises ControllerError where
    something of the cascade is None.
    """
    known(cascade)
    ticks = ticks_of(cascade, dt, source, position)
    none = np.zeros(len(ticks.source))
    fed, added = ticks.velocity_feedforward, ticks.torque_feedforward
    period = dt / ticks.log_every
    return _core.servo_torque(
        clock=clock(period),
        loop=_servo(cascade, period, cascade.position_every(dt)),
        source=ticks.source,
        velocity=velocity,
        position=ticks.position if len(ticks.position) else none,
        velocity_feedforward=fed if len(fed) else none,
        torque_feedforward=added if len(added) else none,
    )


def _servo(cascade: Cascade, period: float, position_every: int) -> _core.Loop:
    pi = cascade.velocity
    settings = _core.ServoSettings(
        newest=RULES[pi.rule],
        command_weight=pi.command_weight,
        anti_windup=pi.anti_windup,
        tracking_time=pi.tracking_time or 0.0,
        command_filters=[f.digital(period) for f in cascade.command_filters],
        velocity_filters=[f.digital(period) for f in cascade.velocity_filters],
        torque_filters=[f.digital(period) for f in cascade.torque_filters],
        position_gain=0.0 if cascade.position is None else cascade.position.gain,
        position_every=position_every,
        delay=cascade.delay,
    )
    return _core.Loop(kind="servo", controller=core_controller(pi), servo=settings)


def record(dt: float, source: Vector, velocity: Vector, start: str, velocity0: float) -> _core.Record:
    """A record of an identification; start: "rest", "steady" or "free", with the first velocity [rad/s]."""
    return _core.Record(clock=clock(dt), input=source, output=velocity, start=start, velocity0=velocity0)


def experiment(records: Sequence[_core.Record], controller: PI | None, kernels: str = "") -> _core.Experiment:
    """Records and their loop, for the genetic search and the local fit."""
    return _core.Experiment(records, loop(controller), kernels)


def recurrence(model: _core.EffectModel, dt: float, controller: PI | None, substeps: int, top_speed: float) -> dict[str, Any]:
    """The numbers of the recurrence that simulates a model."""
    return _core.recurrence(model, clock(dt), loop(controller), substeps, top_speed)


def held_torque(error: Vector, controller: PI, newest: float, before: float, rule: str, integral: float) -> Vector:
    """Torque [N m] of a PI whose integrator does not wind up; it adds newest e(n) + before e(n-1)."""
    return _core.held_torque(error, core_controller(controller), newest, before, rule, integral)
