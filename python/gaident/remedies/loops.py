"""S closed loops of one controller and S sampled drives: margins, speed, stiffness and noise of each.

With L = C_w P, the loop broken at the torque:

    T = C_r P/(1 + L)          command to velocity           S = 1/(1 + L)
    stiffness = min over omega of |d/theta|                  theta = (P_theta_d - P_theta C_w P_d/(1 + L)) d
    torque noise^2 = sigma^2/pi integral of |C_w S|^2 d(omega T) over 0..pi

A position controller samples every k-th sample of the velocity controller: the closed velocity loop is taken k samples at once,

    x((m+1) k) = A^k x(m k) + (sum over i < k of A^i B) r(m),   L_q = Kv c (z I - A^k)^-1 (sum A^i B)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import trapezoid

from gaident.control.cascade import Cascade
from gaident.policy.table import POLICY
from gaident.remedies.margins import below, gain_margins, phase_margins, sensitivity_peaks
from gaident.remedies.plants import PlantResponses, Plants
from gaident.remedies.recurrence import controller_responses, controller_states

__all__ = ["Loops", "Placed", "frequencies_of", "overshoot", "position_frequencies", "settling"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

LOWEST = 1e-4  # no decision: a grid: of half the sampling frequency
WIDEST = np.radians(88.0)  # no decision: a grid: of the phase of a resonance, at whose half width it has turned by 45 degrees
EVEN = 80  # no decision: a grid: frequencies evenly apart, of an integral up to half the sampling frequency
BAND = np.sqrt(0.5)  # no decision: a formula: -3 dB, the edge of a bandwidth
SETTLED = 0.05  # no decision: a formula: the band about its end in which a step has settled, 5 % by definition
BELOW = 0.5  # no decision: of a solver: of the largest torque so far, below which that of a step stays once it has passed it
LONG_ENOUGH = 64  # no decision: of a solver: samples of a step after which the torque may have passed its largest value
FALLEN = 16.0  # no decision: a formula: time constants of the slowest pole, by which nothing is left of a step


def frequencies_of(plants: Plants, points: int, near: int) -> Vector:
    """Frequencies [rad/s] of each drive (S, f), up to half the sampling frequency: a common grid, `near` for each resonance.

    A drive with fewer resonances than another, as one is damped too much to swing, has the highest frequency in their place.
    """
    spread = np.tan(np.linspace(-WIDEST, WIDEST, near))
    highest = np.pi / plants.period
    common = np.concatenate([np.geomspace(LOWEST * highest, highest, points), np.linspace(0.0, highest, EVEN + 2)[1:-1]])
    rows = []
    for roots in plants.roots:
        # no decision: a grid: of a resonance without damping
        swings = [r.imag + max(abs(r.real), 1e-4 * r.imag) * spread for r in roots if r.imag > 0.0]
        own = np.concatenate([common, *swings])
        rows.append(np.sort(np.where((own < highest) & (own > LOWEST * highest), own, highest)))
    most = max(map(len, rows))
    return np.array([np.pad(row, (0, most - len(row)), constant_values=highest) for row in rows])


def position_frequencies(period: float, points: int) -> Vector:
    """Frequencies [rad/s] of a position loop with this sample time (1, f)."""
    highest = np.pi / period
    return np.geomspace(LOWEST * highest, highest, points)[None, :]


@dataclass(frozen=True, eq=False)
class Loops:
    """A controller around S drives; responses: of the drives, which other controllers may share."""

    plants: Plants
    cascade: Cascade
    responses: PlantResponses

    @cached_property
    def _controller(self) -> tuple[Complex, Complex]:
        return controller_responses(self.cascade, self.plants.period, self.responses.z)

    @cached_property
    def L(self) -> Complex:
        """The velocity loop broken at the torque (S, f)."""
        return self._controller[1] * self.responses.velocity

    @cached_property
    def T(self) -> Complex:
        """Velocity command to measured velocity (S, f)."""
        return self._controller[0] * self.responses.velocity / (1.0 + self.L)

    @cached_property
    def phase_margins(self) -> Vector:
        """[deg] (S,)."""
        return phase_margins(self.L)

    @cached_property
    def gain_margins(self) -> Vector:
        """[dB] (S,)."""
        return gain_margins(self.L)

    @cached_property
    def peaks(self) -> Vector:
        """Largest sensitivity (S,)."""
        return sensitivity_peaks(self.L)

    @cached_property
    def stiffness(self) -> Vector:
        """Of the velocity loop, position loop open [N m/rad] (S,)."""
        answer = self.responses
        turned = answer.pushed - answer.angle * self._controller[1] * answer.pushed_velocity / (1.0 + self.L)
        if self.cascade.velocity.ki == 0.0:
            return np.zeros(self.plants.count)
        return np.asarray(1.0 / np.max(np.abs(turned), axis=1))

    @cached_property
    def noise_gain(self) -> Vector:
        """Torque per white noise of the measured velocity, both rms [N m s/rad] (S,)."""
        size = np.abs(self._controller[1] / (1.0 + self.L)) ** 2
        x = self.responses.omega * self.plants.period
        return np.asarray(np.sqrt(trapezoid(size, x, axis=1) / np.pi))

    @cached_property
    def bandwidths(self) -> Vector:
        """Of the velocity loop [Hz] (S,)."""
        return below(self.T, self.responses.omega, BAND) / (2.0 * np.pi)

    @cached_property
    def velocity_loop(self) -> tuple[Matrix, Matrix]:
        """(A, B) (S, n, n), (S, n, 2) of the closed velocity loop, inputs r and d; states: drive, controller, the angle last."""
        p, (Ac, Bc, Cc, Dc) = self.plants, controller_states(self.cascade, self.plants.period)
        n, m = p.F.shape[-1], len(Ac)
        A, B = np.zeros((p.count, n + m + 1, n + m + 1)), np.zeros((p.count, n + m + 1, 2))
        A[:, :n, :n] = p.F + Dc[1] * p.G[:, :, None] * p.H[:, None, :]
        A[:, :n, n : n + m] = p.G[:, :, None] * Cc
        A[:, n : n + m, :n] = Bc[None, :, 1, None] * p.H[:, None, :]
        A[:, n : n + m, n : n + m] = Ac
        A[:, -1, :n] = p.turn + Dc[1] * p.turn_u[:, None] * p.H
        A[:, -1, n : n + m] = p.turn_u[:, None] * Cc
        A[:, -1, -1] = 1.0
        B[:, :n, 0], B[:, n : n + m, 0], B[:, -1, 0] = p.G * Dc[0], Bc[:, 0], p.turn_u * Dc[0]
        B[:, :n, 1], B[:, -1, 1] = p.E, p.turn_d
        return A, B

    @cached_property
    def stable(self) -> NDArray[np.bool_]:
        """Whether each velocity loop is (S,); the angle, which nothing there depends on, left out."""
        return np.asarray(np.max(np.abs(np.linalg.eigvals(self.velocity_loop[0][:, :-1, :-1])), axis=1) < 1.0 - 1e-12)

    def step(self) -> tuple[Vector, Vector, float]:
        """(velocity (S, k), torque (S, k), time between them [s]) of a unit step of the velocity command."""
        A, B = self.velocity_loop
        Ac = controller_states(self.cascade, self.plants.period)
        n, m = self.plants.F.shape[-1], len(Ac.A)
        states = _stepped(A[:, :-1, :-1], B[:, :-1, 0])
        velocity = np.einsum("sn,skn->sk", self.plants.H, states[:, :, :n])
        torque = states[:, :, n : n + m] @ Ac.C + Ac.D[0] + Ac.D[1] * velocity
        return velocity, torque, self.plants.period

    def step_torque(self) -> float:
        """The largest torque of all drives [N m] in a unit step of the velocity command.

        The step goes on until the torque has stayed below half of the largest for as long as the step took up to there.
        """
        A, B = self.velocity_loop
        Ac = controller_states(self.cascade, self.plants.period)
        n, m = self.plants.F.shape[-1], len(Ac.A)
        largest = abs(float(Ac.D[0]))  # at the first sample
        for states in _doubled(A[:, :-1, :-1], B[:, :-1, 0]):
            velocity = np.einsum("sn,skn->sk", self.plants.H, states[:, :, :n])
            torque = float(np.max(np.abs(states[:, :, n : n + m] @ Ac.C + Ac.D[0] + Ac.D[1] * velocity)))
            if torque < BELOW * largest and states.shape[1] >= LONG_ENOUGH:
                break
            largest = max(largest, torque)
        return largest

    def placed(self, every: int) -> Placed:
        """The position loop, which samples every so many samples."""
        A, B = self.velocity_loop
        power, summed = A, B
        for _ in range(every - 1):
            summed = B + A @ summed
            power = A @ power
        return Placed(power, summed, self.plants.period * every)


@dataclass(frozen=True, eq=False)
class Placed:
    """S closed velocity loops as a position controller sees them: A (S, n, n), B (S, n, 2) at its sample time [s]."""

    A: Matrix
    B: Matrix
    period: float

    def response(self, omega: Vector) -> Complex:
        """Velocity command to angle (S, f), at frequencies (1, f) [rad/s]."""
        z = np.exp(1j * omega * self.period)
        n = self.A.shape[-1] - 1  # the angle apart
        system = z[..., None, None] * np.eye(n) - self.A[:, None, :n, :n]
        driven = np.broadcast_to(self.B[:, None, :n, :1], (len(self.A), omega.shape[-1], n, 1)).astype(np.complex128)
        x = np.linalg.solve(np.broadcast_to(system, (len(self.A), omega.shape[-1], n, n)), driven)[..., 0]
        return np.asarray((np.einsum("sn,sfn->sf", self.A[:, -1, :n], x) + self.B[:, -1, :1]) / (z - 1.0))

    def closed(self, gain: float) -> Matrix:
        """A of the closed position loop (S, n, n)."""
        A = self.A.copy()
        A[:, :, -1] -= gain * self.B[:, :, 0]
        return A

    def stable(self, gain: float) -> NDArray[np.bool_]:
        """(S,)."""
        return np.asarray(np.max(np.abs(np.linalg.eigvals(self.closed(gain))), axis=1) < 1.0 - 1e-12)

    def step(self, gain: float) -> Vector:
        """Angle of a unit step of the position command (S, k), without feedforward."""
        return _stepped(self.closed(gain), gain * self.B[:, :, 0])[:, :, -1]

    def stiffness(self, gain: float, omega: Vector) -> Vector:
        """Least |d/theta| of the closed position loop [N m/rad] (S,)."""
        z = np.exp(1j * omega * self.period)
        system = z[..., None, None] * np.eye(self.A.shape[-1]) - self.closed(gain)[:, None]
        driven = np.broadcast_to(self.B[:, None, :, 1:], (*system.shape[:-1], 1)).astype(np.complex128)
        return np.asarray(1.0 / np.max(np.abs(np.linalg.solve(system, driven)[..., -1, 0]), axis=1))


def _stepped(A: Matrix, B: Vector) -> Matrix:
    """States (S, k, n) of x(n+1) = A x(n) + B from 0, until nothing changes or as long as the policy allows.

    Twice as many samples at once:  x(m + i) = A^m x(i) + x(m).
    """
    return np.concatenate([np.zeros((len(A), 1, A.shape[-1])), *_doubled(A, B)], axis=1)


def _doubled(A: Matrix, B: Vector) -> Iterator[Matrix]:
    """The same states from the second on, each time as many more as there were."""
    slowest = float(np.max(np.abs(np.linalg.eigvals(A))))
    wanted = FALLEN / -np.log(min(max(slowest, 1e-9), 1.0 - 1e-9))
    states, power, end = np.zeros((len(A), 1, A.shape[-1])), A, B[:, None, :]
    while states.shape[1] < min(wanted, POLICY.step_samples):
        more = states @ power.transpose(0, 2, 1) + end
        yield more
        states = np.concatenate([states, more], axis=1)
        end = end @ power.transpose(0, 2, 1) + end
        power = power @ power


def settling(y: Vector, dt: float) -> Vector:
    """Time [s] from which on each step response stays within 5 % of 1 (S,); inf where it never does."""
    outside = np.abs(y - 1.0) > SETTLED
    last = y.shape[1] - 1 - np.argmax(outside[:, ::-1], axis=1)
    return np.where(outside[:, -1], np.inf, np.where(outside.any(axis=1), (last + 1.0) * dt, 0.0))


def overshoot(y: Vector) -> Vector:
    """How far each step response goes beyond 1 [%] (S,)."""
    return np.asarray(100.0 * np.maximum(np.max(y, axis=1) - 1.0, 0.0))
