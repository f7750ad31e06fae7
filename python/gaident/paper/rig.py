"""A rig in place of the rig: the robot arm of Table III with the dry friction that the paper suspects, integrated finely.

    J_M dw/dt   = u - D_M w - K_G x - T_f        x: twist of the shaft [rad], dx/dt = w - w_L
    J_L dw_L/dt = K_G x - D_L w_L                without a load arm K_G x = 0
    T_f = T(w) sign(w) while it turns, whatever holds it still up to T(0) at standstill
    T(w) = T_c + (T_s - T_c) exp(-(w/v_s)^2)     (Stribeck)

The velocity loop is digital (the paper: "digitally performed", Ts = 444 us): it reads the noisy velocity, computes the PI's
torque and holds it for a sample. In between, leapfrog steps of Ts/SUBSTEPS; friction clips the velocity that the other torques
would bring (Moreau's time stepping), so that it sticks without a threshold. None of this uses the package's simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.models.controller import PI
from gaident.models.mechanics import OneMass, TwoMass

__all__ = ["Friction", "Rig"]

Vector = NDArray[np.float64]
SUBSTEPS = 20


@dataclass(frozen=True)
class Friction:
    """Dry friction at the motor: T_c, T_s [N m], v_s [rad/s]."""

    coulomb: float
    static: float
    stribeck_velocity: float

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
        """One run from rest per seed of the noise, all integrated side by side."""
        samples, runs = len(command), len(seeds)
        noise = np.column_stack([np.random.default_rng(seed).standard_normal(samples) for seed in seeds])
        velocity, torque = self._integrate(command, self.noise * noise)
        return [Record(self.dt, command, velocity[:, k], torque[:, k], name=name) for k in range(runs)]

    def _integrate(self, command: Vector, noise: Vector, substeps: int = SUBSTEPS) -> tuple[Vector, Vector]:
        """(velocity as read, torque), both (samples, runs)."""
        h, c = self.dt / substeps, self.controller
        JM, DM, JL, DL, KG = self._constants()
        damp_M, damp_L = 0.5 * h * DM / JM, 0.5 * h * DL / JL
        w, w_L, x, integral, last_error = (np.zeros(noise.shape[1]) for _ in range(5))
        velocity, torque = np.empty_like(noise), np.empty_like(noise)
        for n, r in enumerate(command):
            velocity[n] = w + noise[n]
            error = r - velocity[n]
            integral = integral + 0.5 * c.ki * self.dt * (error + last_error)
            last_error = error
            u = torque[n] = c.kp * error + integral
            for _ in range(substeps):
                x = x + 0.5 * h * (w - w_L)
                shaft = KG * x
                free = ((1.0 - damp_M) * w + h / JM * (u - shaft)) / (1.0 + damp_M)
                reach = h / JM * self.friction.level(0.5 * (w + free))
                w = np.sign(free) * np.maximum(np.abs(free) - reach, 0.0)
                w_L = ((1.0 - damp_L) * w_L + h / JL * shaft) / (1.0 + damp_L)
                x = x + 0.5 * h * (w - w_L)
        return velocity, torque

    def _constants(self) -> tuple[float, float, float, float, float]:
        """(J_M, D_M, J_L, D_L, K_G); without a load arm the load is there but not coupled."""
        if isinstance(self.drive, OneMass):
            return self.drive.J, self.drive.D, self.drive.J, self.drive.D, 0.0
        return self.drive.JM, self.drive.DM, self.drive.JL, self.drive.DL, self.drive.KG
