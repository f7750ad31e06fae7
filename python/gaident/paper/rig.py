"""A rig in place of the rig: the robot arm of Table III with the dry friction that the paper suspects, integrated finely.

    J_M dw/dt   = u - D_M w - K_G x - T_f        x: twist of the shaft [rad], dx/dt = w - w_L
    J_L dw_L/dt = K_G x - D_L w_L                without a load arm K_G x = 0
    T_f = T(w) sign(w) while it turns, whatever holds it still up to T(0) at standstill
    T(w) = T_c + (T_s - T_c) exp(-(w/v_s)^2)     (Stribeck)

The velocity loop is digital (the paper: "digitally performed", Ts = 444 us): it reads the noisy velocity, computes the PI's
torque and holds it for a sample.
In between, leapfrog steps of Ts/SUBSTEPS; friction clips the velocity that the other torques would bring (Moreau's time
stepping), so that it sticks without a threshold. None of this uses the package's simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.models.mechanics import OneMass, TwoMass

__all__ = ["Friction", "Rig", "RigRun", "integrate", "side_by_side"]

Vector = NDArray[np.float64]
SUBSTEPS = 20


@dataclass(frozen=True)
class Friction:
    """Dry friction at the motor: T_c, T_s [N m], v_s [rad/s]; or of several runs, an array of each."""

    coulomb: float | Vector
    static: float | Vector
    stribeck_velocity: float | Vector

    def level(self, w: Vector) -> Vector:
        """T(w) [N m] >= 0."""
        level: Vector = self.coulomb + (self.static - self.coulomb) * np.exp(-((w / self.stribeck_velocity) ** 2))
        return level


NO_FRICTION = Friction(0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Rig:
    """The arm, its friction, the digital loop (without limits) and the noise of the velocity that it reads [rad/s]."""

    drive: OneMass | TwoMass
    controller: PI
    dt: float
    friction: Friction = NO_FRICTION
    noise: float = 0.0

    def record(self, command: Vector, seed: int, name: str = "") -> Record:
        """One run from rest: command, noisy velocity, torque."""
        return self.records(command, [seed], name)[0]

    def records(self, command: Vector, seeds: Sequence[int], name: str = "") -> list[Record]:
        """One run from rest per seed of the noise."""
        return side_by_side([RigRun(self, command, seed, name) for seed in seeds])

    def _constants(self) -> tuple[float, float, float, float, float]:
        """(J_M, D_M, J_L, D_L, K_G); without a load arm the load is there but not coupled."""
        if isinstance(self.drive, OneMass):
            return self.drive.J, self.drive.D, self.drive.J, self.drive.D, 0.0
        return self.drive.JM, self.drive.DM, self.drive.JL, self.drive.DL, self.drive.KG


@dataclass(frozen=True, eq=False)
class RigRun:
    """One run of a rig from rest."""

    rig: Rig
    command: Vector
    seed: int  # of the noise
    name: str = ""


def side_by_side(runs: Sequence[RigRun]) -> list[Record]:
    """The record of each run, all integrated at once; their commands have the same length."""
    noise = np.column_stack([r.rig.noise * np.random.default_rng(r.seed).standard_normal(len(r.command)) for r in runs])
    velocity, torque = integrate([r.rig for r in runs], np.column_stack([r.command for r in runs]), noise)
    return [Record(r.rig.dt, r.command, velocity[:, k], torque[:, k], name=r.name) for k, r in enumerate(runs)]


def integrate(rigs: Sequence[Rig], command: Vector, noise: Vector, substeps: int = SUBSTEPS) -> tuple[Vector, Vector]:
    """(velocity as read, torque), arrays as given: (samples, runs), a rig for each run. No column depends on its neighbours."""
    JM, DM, JL, DL, KG = np.array([rig._constants() for rig in rigs]).T
    kp, ki, dt = np.array([(rig.controller.kp, rig.controller.ki, rig.dt) for rig in rigs]).T
    T_c, T_s, v_s = np.array([(f.coulomb, f.static, f.stribeck_velocity) for f in (rig.friction for rig in rigs)]).T
    friction = Friction(T_c, T_s, v_s)
    h = dt / substeps
    half, per_JM, per_JL, damp_M, damp_L = 0.5 * h, h / JM, h / JL, 0.5 * h * DM / JM, 0.5 * h * DL / JL
    kept_M, lost_M, kept_L, lost_L = 1.0 - damp_M, 1.0 + damp_M, 1.0 - damp_L, 1.0 + damp_L
    w, w_L, x, half_twist, integral, last_error = np.zeros((6, len(rigs)))
    velocity, torque = np.empty_like(noise), np.empty_like(noise)
    for n, r in enumerate(command):
        velocity[n] = w + noise[n]
        error = r - velocity[n]
        integral = integral + 0.5 * ki * dt * (error + last_error)
        last_error = error
        u = torque[n] = kp * error + integral
        for _ in range(substeps):
            x = x + half_twist
            shaft = KG * x
            free = (kept_M * w + per_JM * (u - shaft)) / lost_M
            reach = per_JM * friction.level(0.5 * (w + free))
            w = np.copysign(np.maximum(np.abs(free) - reach, 0.0), free)
            w_L = (kept_L * w_L + per_JL * shaft) / lost_L
            half_twist = half * (w - w_L)
            x = x + half_twist
    return velocity, torque
