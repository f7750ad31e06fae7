"""The records as the fit sees them: what drove the motor, where it stood, how it began.

A model is driven by the torque that the controller issued: as logged or, without a log, as the controller makes it from the
command and the *measured* velocity. Noise inside the loop then acts in the model as it did on the drive, and what is left at
the truth is the noise of the sensor and torques that nobody commanded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident.control.filtering import filtered, rate_limited
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.layout import Layout
from gaident.diagnosis.records.hygiene import quantisation
from gaident.models.drive_torque import torque_of
from gaident.models.model import Model
from gaident.models.own_effects import OWN
from gaident.models.roots import quadratic_roots
from gaident.models.simulate import simulate_values
from gaident.models.starts import noise_std, starts_moving

__all__ = ["Driven"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

FINEST = 0.125e-3  # s, of a substep: the accuracy that friction on a stiff shaft needs
AT_CONTROLLER = ("integrator_clamp", "command_rate_limit")


@dataclass(frozen=True)
class Driven:
    """Records, each also as driven by its torque (`driven`), both with an angle, measured or integrated from the velocity.

    turned: the record itself with that angle; free: torque-driven, without an angle that was not measured; read: the records
    as the controller read them, which may hold samples that the fit leaves out. finest: no substep of a simulation is much
    shorter [s]; known_noise: standard deviation of the velocity's noise where the records cannot show it.
    """

    records: tuple[Record, ...]
    controller: PI | None
    driven: tuple[Record, ...]
    turned: tuple[Record, ...]
    free: tuple[Record, ...]
    moving: tuple[bool, ...]
    spoiled: bool = False
    read: tuple[Record, ...] = ()
    finest: float = FINEST
    known_noise: float | None = None

    @classmethod
    def of(
        cls, records: Sequence[Record], controller: PI | None, spoiled: bool = False, read: Sequence[Record] | None = None
    ) -> Driven:
        """The records as driven by their torque; spoiled: some velocities are not what the controller read."""
        driven = tuple(_driven(r, torque_of(r, controller)) for r in records)
        turned = tuple(_with_angle(r, _angle(a)) for r, a in zip(records, driven, strict=True))
        free = tuple(a if r.position is not None else _with_angle(a, None) for r, a in zip(records, driven, strict=True))
        moving = tuple(starts_moving(r, None) for r in driven)
        seen = tuple(records if read is None else read)
        return cls(tuple(records), controller, driven, turned, free, moving, spoiled, seen)

    @property
    def angle_logged(self) -> bool:
        """Whether every record holds the angle."""
        return all(r.position is not None for r in self.records)

    @property
    def loop_only(self) -> bool:
        """Whether a torque is not to be had: a replay keeps what one wrong velocity adds to its integral for ever."""
        return self.spoiled and not self.torque_logged and self.loopable

    @property
    def torque_logged(self) -> bool:
        """Whether every record holds the controller's torque."""
        return all(r.torque is not None for r in self.records)

    @property
    def lengths(self) -> tuple[int, ...]:
        """Samples of each record."""
        return tuple(len(r) for r in self.records)

    @property
    def measured(self) -> Vector:
        """Velocity, records one after the other [rad/s]."""
        return np.concatenate([r.velocity for r in self.records])

    @property
    def torque(self) -> Vector:
        """Torque, records one after the other [N m]."""
        return np.concatenate([_torque(r) for r in self.driven])

    @property
    def angle(self) -> Vector:
        """Motor angle, records one after the other [rad]."""
        return np.concatenate([_angle(r) for r in self.driven])

    @property
    def time(self) -> Vector:
        """Time since each record's start, records one after the other [s]."""
        return np.concatenate([r.time for r in self.records])

    @property
    def command(self) -> Vector | None:
        """Command, records one after the other [rad/s]; None where one record has none."""
        commands = [r.command for r in self.records if r.command is not None]
        return np.concatenate(commands) if len(commands) == len(self.records) else None

    def predict(self, layout: Layout, X: Matrix) -> Matrix:
        """Simulated velocities of rows of x, (n, samples)."""
        if self._seen_askew(layout):
            return np.vstack([self._predict_turned(layout, x) for x in X])
        if layout.looped:
            names, values = layout.values(X)
            steps = self.substeps(names)
            source = self.records if layout.own_angle else self.turned
            return np.concatenate(
                [simulate_values(layout.structure, names, values, r, self.controller, substeps=steps) for r in source], axis=1
            )
        at_controller = [e for e in layout.effects if e in AT_CONTROLLER]
        if at_controller:
            return self._predict_limited(layout, X, at_controller)
        names, values = layout.values(X)
        parts = [
            simulate_values(
                layout.structure, names, values, r, initial_states=layout.start_values(X, i), substeps=self.substeps(names)
            )
            for i, r in enumerate(self.free if layout.own_angle else self.driven)
        ]
        return np.concatenate(parts, axis=1)

    def _seen_askew(self, layout: Layout) -> bool:
        """Whether the angle comes from a velocity that the sensor bends, and something else turns with the true one."""
        if layout.own_angle or self.angle_logged or set(layout.effects) & set(AT_CONTROLLER):
            return False
        turning = {e for e in layout.effects if CANDIDATES[e].harmonic}
        return ("velocity_filter" in layout.effects and bool(turning)) or ("velocity_ripple" in turning and len(turning) > 1)

    def _predict_turned(self, layout: Layout, x: Vector) -> Matrix:
        """With the angle that the sensor of the model x saw as what it integrates to, theta_m, taken back:

        theta_r = theta_m + tau w_m,   theta_r = theta + a (sin(n theta + phase) - sin(phase))
        """
        names, values = layout.values(x[None, :])
        bent = {e: layout.effect_values(x[None, :], e)[0] for e in ("velocity_filter", "velocity_ripple") if e in layout.effects}
        tau = float(bent["velocity_filter"][0]) if "velocity_filter" in bent else 0.0
        amplitude, order, phase = bent.get("velocity_ripple", np.zeros(3))
        parts = []
        for i, (turned, driven) in enumerate(zip(self.turned, self.driven, strict=True)):
            seen = _angle(driven) + tau * (driven.velocity - driven.velocity[0])
            angle = seen
            for _ in range(2):
                angle = seen - amplitude * (np.sin(order * angle + phase) - np.sin(phase))
            record = _with_angle(turned if layout.looped else driven, angle)
            controller = self.controller if layout.looped else None
            states = None if layout.looped else layout.start_values(x[None, :], i)
            steps = self.substeps(names)
            parts.append(
                simulate_values(layout.structure, names, values, record, controller, initial_states=states, substeps=steps)
            )
        return np.concatenate(parts, axis=1)

    def substeps(self, effects: Sequence[str]) -> int | None:
        """As many for every model with effects, so that no candidate is ahead for being simulated more finely."""
        acting = set(effects) - {"extra_resonance"}
        if not acting or all(e in OWN for e in acting):  # one's own are smooth, and dear to ask
            return None
        return int(2 ** np.clip(np.ceil(np.log2(self.records[0].dt / self.finest)), 0.0, 5.0))

    def _predict_limited(self, layout: Layout, X: Matrix, at_controller: Sequence[str]) -> Matrix:
        """With effects of the controller the torque itself depends on x: rows that share it are simulated together."""
        limits = np.column_stack([layout.effect_values(X, e)[:, 0] for e in at_controller])
        distinct, group = np.unique(limits, axis=0, return_inverse=True)
        out = np.empty((len(X), sum(self.lengths)))
        for i, row in enumerate(distinct):
            of_row = np.flatnonzero(group.ravel() == i)
            out[of_row] = self._predict_one(layout, X[of_row], dict(zip(at_controller, row.tolist(), strict=True)))
        return out

    def _predict_one(self, layout: Layout, X: Matrix, limits: dict[str, float]) -> Matrix:
        names, values = layout.values(X, tuple(limits))
        steps = self.substeps(layout.effects)
        parts = []
        for i, (r, read) in enumerate(zip(self.records, self.read, strict=True)):
            states = layout.start_values(X, i)
            driven = _driven(r, replayed(read, self.controller, limits))
            parts.append(simulate_values(layout.structure, names, values, driven, initial_states=states, substeps=steps))
        return np.concatenate(parts, axis=1)

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise on the velocity, as its third differences show it [rad/s]."""
        if self.known_noise is not None:
            return self.known_noise
        rounding = float(quantisation(self.records) / np.sqrt(12.0))
        return max(float(np.mean([noise_std(r.velocity) for r in self.records])), rounding)

    @property
    def loopable(self) -> bool:
        """Whether command and controller can drive a model too."""
        return self.controller is not None and self.command is not None and not any(self.moving)

    def response(self, layout: Layout, x: Vector, torques: Matrix) -> Matrix:
        """Velocity of the linear part of the model x, from rest, under rows of torque held over each sample.

        In the loop the controller answers: G d - T (G d), T the closed loop's response to the command.
        """
        for e in layout.effects:
            x, layout = layout.removed(x, e), layout.without(e)
        linear = layout.model(x)
        dt = layout.scales.dt
        d = linear.discrete(dt)
        free = filtered(d.alpha, np.append(1.0, -d.beta), torques, self.lengths)
        if not layout.looped:
            return free
        d = linear.discrete(dt, self.controller)
        return free - filtered(d.alpha, np.append(1.0, -d.beta), free, self.lengths)

    def twist(self, layout: Layout, x: Vector) -> Vector:
        """Twist of the shaft of two masses, to scale, as the linear part of the model x has it: u e0/(s^2 + e1 s + e0)."""
        _, _, e1, e0, *_ = layout.base_values(x[None, :])[0]
        twist: Vector = self._second_order(self.torque[None, :], e0, (), e1, e0)[0]
        return twist

    def coupling_response(self, layout: Layout, x: Vector, torques: Matrix) -> Matrix:
        """Motor velocity under rows of a torque between the masses: -K s/(s^2 + e1 s + e0), open loop."""
        K, _, e1, e0, *_ = layout.base_values(x[None, :])[0]
        return self._second_order(torques, -K, (0.0,), e1, e0)

    def _second_order(self, rows: Matrix, gain: float, zeros: tuple[float, ...], e1: float, e0: float) -> Matrix:
        held = Model(1.0, quadratic_roots(max(e1, 0.0), abs(e0)), zeros).discrete(self.records[0].dt)
        return filtered(gain * held.alpha, np.append(1.0, -held.beta), rows, self.lengths)

    def commanded(self, rate: float) -> Driven:
        """The same with commands that change by `rate` [rad/s^2] at most, as the controller of a closed loop then reads them."""

        def limited(records: tuple[Record, ...]) -> tuple[Record, ...]:
            commands = [None if r.command is None else rate_limited(r.command, rate, r.dt, 0.0) for r in records]
            return tuple(
                Record(r.dt, c, r.velocity, r.torque, r.position, r.name) for r, c in zip(records, commands, strict=True)
            )

        return replace(self, records=limited(self.records), turned=limited(self.turned))

    def replayed_error(self, limits: dict[str, float]) -> Vector:
        """Logged torque minus the controller's replay with these limits, records one after the other [N m]."""
        return np.concatenate([_torque(r) - replayed(r, self.controller, limits) for r in self.read])


def replayed(rec: Record, controller: PI | None, limits: dict[str, float]) -> Vector:
    """What the controller makes of command and measured velocity, with effects of its own [N m]."""
    assert controller is not None and rec.command is not None
    command = rec.command
    if "command_rate_limit" in limits:
        command = rate_limited(command, limits["command_rate_limit"], rec.dt, 0.0)
    if "integrator_clamp" in limits:
        clamp = min(limits["integrator_clamp"], controller.limits[1])
        controller = replace(controller, integrator_limit=clamp)
    return torque_of(Record(rec.dt, command=command, velocity=rec.velocity), controller)


def _with_angle(rec: Record, angle: Vector | None) -> Record:
    return Record(rec.dt, rec.command, rec.velocity, rec.torque, angle, rec.name)


def _driven(rec: Record, torque: Vector) -> Record:
    angle = rec.position
    if angle is None:
        w = rec.velocity
        angle = np.concatenate([[0.0], np.cumsum(0.5 * rec.dt * (w[1:] + w[:-1]))])
    return Record(rec.dt, velocity=rec.velocity, torque=torque, position=angle, name=rec.name)


def _torque(rec: Record) -> Vector:
    assert rec.torque is not None
    return rec.torque


def _angle(rec: Record) -> Vector:
    assert rec.position is not None
    return rec.position
