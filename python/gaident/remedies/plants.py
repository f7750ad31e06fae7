"""Sampled drives side by side: what a digital controller sees of many models of one structure.

    u(k), held for T, `delay` later -> lag -> mechanism -> velocity w -> filter -> measured velocity
                                          ^ d, a torque at the shaft, held for T

Everything is exact for the held torques:

    x(k+1) = Phi x(k) + Gamma u + E d(k)        Phi = e^(A T), the integrals as in gaident.export.lti
    theta(k+1) = theta(k) + integral of w over the sample

A drive that takes the difference of its encoder's angle for the velocity reads the mean over the last sample, a state of its own.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, expm

from gaident.errors import ModelError
from gaident.export.lti import in_a_row
from gaident.models.effects import Effect
from gaident.models.effects_linear import LATE, LINEAR, Transfer
from gaident.models.model import Model

__all__ = ["Plants", "PlantResponses", "sampled_plants"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Complex = NDArray[np.complex128]

MATRICES = ("F", "G", "E", "H", "turn", "turn_u", "turn_d")
MOST_WAITING = 64  # no decision: memory: torques on their way through a delay that the matrices contain


@dataclass(frozen=True, eq=False)
class PlantResponses:
    """Frequency responses of S plants at their own frequencies, (S, f) each: z = exp(j omega T).

    velocity, angle: of the measured velocity [rad/s] and the angle [rad] to the controller's torque; pushed: of the angle to a
    torque at the shaft; pushed_velocity: of the measured velocity to it.
    """

    omega: Vector
    z: Complex
    velocity: Complex
    angle: Complex
    pushed_velocity: Complex
    pushed: Complex


@dataclass(frozen=True, eq=False)
class Plants:
    """S sampled drives with n states, the angle apart: it follows, and nothing depends on it.

    F (S, n, n), G (S, n): x(k+1) = F x(k) + G u(k) + E d(k); measured velocity H x.
    turn (S, n), turn_u, turn_d (S,): theta(k+1) - theta(k) = turn x(k) + turn_u u(k) + turn_d d(k).
    roots: of each drive's mechanism, whose frequencies need points of a grid.
    """

    period: float
    F: Matrix
    G: Matrix
    E: Matrix
    H: Matrix
    turn: Matrix
    turn_u: Vector
    turn_d: Vector
    roots: tuple[tuple[complex, ...], ...]

    @property
    def count(self) -> int:
        """S."""
        return len(self.F)

    def chosen(self, index: slice | NDArray[np.intp]) -> Plants:
        """Some of them."""
        matrices = {name: getattr(self, name)[index] for name in MATRICES}
        return Plants(self.period, **matrices, roots=tuple(self.roots[i] for i in np.arange(self.count)[index]))

    def responses(self, omega: Vector) -> PlantResponses:
        """At omega [rad/s], (S, f)."""
        z = np.exp(1j * omega * self.period)
        n = self.F.shape[-1]
        system = z[..., None, None] * np.eye(n) - self.F[:, None]
        driven = np.stack([self.G, self.E], axis=-1)[:, None]
        x = np.linalg.solve(system, np.broadcast_to(driven, (*z.shape, n, 2)).astype(np.complex128))
        velocity = np.einsum("sn,sfni->sfi", self.H, x)
        through = np.stack([self.turn_u, self.turn_d], axis=-1)[:, None]
        angle = (np.einsum("sn,sfni->sfi", self.turn, x) + through) / (z - 1.0)[..., None]
        return PlantResponses(omega, z, velocity[..., 0], angle[..., 0], velocity[..., 1], angle[..., 1])


def sampled_plants(models: Sequence[Model], period: float, delay: float, differenced: bool) -> Plants:
    """The linear parts of models of one structure, sampled; period, delay [s]: of the controller.

    differenced: the controller reads the difference of an encoder's angle. Raises ModelError for a delay of very many samples.
    """
    made = [_continuous(model, period) for model in models]
    late = [(delay + one.delay) / period for one in made]
    waiting = max(_waiting(samples) for samples in late)
    if waiting > MOST_WAITING:
        raise ModelError(
            f"the delay of the model and of the controller is {max(late):.0f} samples of the controller: a loop over more than "
            f"{MOST_WAITING} samples is not designed here; check delay and period"
        )
    parts = [_held(one, samples, waiting, differenced, period) for one, samples in zip(made, late, strict=True)]
    matrices = {name: np.array(column) for name, column in zip(MATRICES, zip(*parts, strict=True), strict=True)}
    return Plants(period, **matrices, roots=tuple((*m.mechanism.poles, *m.mechanism.zeros) for m in models))


@dataclass(frozen=True, eq=False)
class _Continuous:
    """x' = A x + B u + E d, time in samples; w = C x, measured velocity H x; the torque comes `delay` [s] late."""

    A: Matrix
    B: Vector
    E: Vector
    C: Vector
    H: Vector
    delay: float


def _continuous(model: Model, period: float) -> _Continuous:
    linear = [effect for effect in model.effects if effect.name in LINEAR and effect.row.place != "plant"]
    before, behind = ([e for e in linear if (e.row.place == "sensor") is at] for at in (False, True))
    mechanism = model.mechanism
    drive = Transfer(mechanism.gain, mechanism.poles, mechanism.zeros)
    lag, measured = _joined(before), _joined(behind)
    late = sum(LATE[e.name](e.values, period) for e in model.effects if e.name in LATE)  # a sensor's: in the loop it is a delay
    (A0, B0, C0), (A1, B1, C1), (A2, B2, C2) = (_states(t, period) for t in (lag, drive, measured))
    direct, shown = (float(not t.poles) * t.gain for t in (lag, measured))  # without a lag the torque goes through
    n0, n1 = len(A0), len(A1)
    A = block_diag(A0, A1, A2)
    A[n0 : n0 + n1, :n0] = np.outer(B1, C0)
    A[n0 + n1 :, n0 : n0 + n1] = np.outer(B2, C1)
    none0, none2 = np.zeros(n0), np.zeros(len(A2))
    B = np.concatenate([B0, direct * B1, none2])
    E = np.concatenate([none0, B1, none2])
    C = np.concatenate([none0, C1, none2])
    return _Continuous(A, B, E, C, np.concatenate([none0, shown * C1, C2]), lag.delay + measured.delay + late)


def _joined(effects: Sequence[Effect]) -> Transfer:
    chain = Transfer()
    for effect in effects:
        more = LINEAR[effect.name](effect.values)
        chain = Transfer(
            chain.gain * more.gain, (*chain.poles, *more.poles), (*chain.zeros, *more.zeros), chain.delay + more.delay
        )
    return chain


def _states(chain: Transfer, period: float) -> tuple[Matrix, Vector, Vector]:
    if not chain.poles:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0)
    return in_a_row(chain, period)


def _waiting(samples: float) -> int:
    d = math.floor(samples + 1e-9)
    return d + (samples - d > 1e-9)


def _held(
    one: _Continuous, samples: float, waiting: int, differenced: bool, period: float
) -> tuple[Matrix | Vector | float, ...]:
    """(F, G, E, H, turn, turn_u, turn_d); states: those of the drive, torques on their way, the mean over the last sample."""
    n = len(one.A)
    # The angle, and what the encoder's difference is of, are integrals beside the drive's states.
    whole = np.zeros((n + 2, n + 2))
    whole[:n, :n], whole[n, :n], whole[n + 1, :n] = one.A, one.C, one.H

    def over(share: float, driven: Vector) -> tuple[Matrix, Vector]:
        M = np.zeros((n + 3, n + 3))
        M[: n + 2, : n + 2], M[:n, n + 2] = share * whole, share * driven
        found = expm(M)
        return found[: n + 2, : n + 2], found[: n + 2, n + 2]

    d = math.floor(samples + 1e-9)
    f = max(samples - d, 0.0)
    f = f if f > 1e-9 else 0.0
    late, newer = over(1.0 - f, one.B)
    _, early = over(f, one.B)
    older = late @ early
    step, pushed = over(1.0, one.E)
    size = n + waiting + differenced
    rows = np.zeros((n + 2, size + 1))  # the last column: of the newest torque
    rows[:, :n] = step[:, :n]
    for column, gamma in ((d, newer), (d + 1, older)):  # of u(k - column)
        if column == 0:
            rows[:, size] += gamma
        elif column <= waiting:
            rows[:, n + column - 1] += gamma
    F, G, E, H = np.zeros((size, size)), np.zeros(size), np.zeros(size), np.zeros(size)
    F[:n], G[:n], E[:n] = rows[:n, :size], rows[:n, size], pushed[:n]
    for i in range(waiting):
        if i == 0:
            G[n] = 1.0
        else:
            F[n + i, n + i - 1] = 1.0
    if differenced:
        F[-1], G[-1], E[-1], H[-1] = rows[n + 1, :size], rows[n + 1, size], pushed[n + 1], 1.0
    else:
        H[:n] = one.H
    return F, G, E, H, *(period * part for part in (rows[n, :size], rows[n, size], pushed[n]))
