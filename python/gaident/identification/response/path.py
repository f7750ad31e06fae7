"""What a frequency response contains beside the axis: a delay tau and a lag T of the torque's path.

    G(f) = H(f) G_axis(f),   H(f) = exp(-j omega tau) / (1 + j omega T)

The delay is that of the controller's computing and of a bus, the lag that of a current loop.
Looked for where no chain of masses holds without them.
From each delay of a grid the structures are searched anew.
From each chain of masses tau alone, T alone, then tau and T go on by Gauss-Newton steps together with the parameters x, which are
then fitted again:

    e(tau + d, T + l, x + dx) = e + e_tau d + e_T l - J dx,
    e_tau = j omega w G/H,   e_T = j omega/(1 + j omega T) w G/H
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["LONGEST", "NO_PATH", "SMALL", "STEPS", "Path", "Turned", "freed", "path_step", "starts", "with_lag"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

GRID = tuple(0.5 + k for k in range(9))  # no decision: a grid: rad, the phase of a path at the highest frequency
LAGS = (0.5, 0.9)  # no decision: a grid: parts of a path that its lag begins from; the rest is the delay
STEPS = 12  # no decision: of a solver
LONGEST = 1.0  # no decision: of a solver: rad at the highest frequency, of a step
SMALL = 1e-4  # no decision: of a solver: rad at the highest frequency


@dataclass(frozen=True)
class Path:
    """A delay [s] and a lag [s], each None where there is none."""

    delay: float | None = None
    lag: float | None = None

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of what there is."""
        return tuple(name for name in ("delay", "lag") if getattr(self, name) is not None)

    @property
    def total(self) -> float:
        """By how much it is late at low frequencies [s]."""
        return (self.delay or 0.0) + (self.lag or 0.0)

    def inverse(self, omega: Vector) -> Complex:
        """1/H at omega [rad/s]."""
        made: Complex = np.exp(1j * omega * (self.delay or 0.0)) * (1.0 + 1j * omega * (self.lag or 0.0))
        return made

    def derivatives(self, omega: Vector) -> list[Complex]:
        """d log(1/H) by each of the unknowns."""
        of = {"delay": 1j * omega, "lag": 1j * omega / (1.0 + 1j * omega * (self.lag or 0.0))}
        return [of[name] for name in self.unknowns]

    def moved(self, step: Vector) -> Path:
        """After a step of the unknowns; what falls below 0 is left out."""
        values = {name: getattr(self, name) + float(d) for name, d in zip(self.unknowns, step, strict=True)}
        return Path(**{name: value for name, value in values.items() if value > 0.0})


NO_PATH = Path()


@dataclass(frozen=True)
class Turned:
    """e and its derivatives, real and imaginary parts in turn: by parameters of the model, and by the unknowns of a path."""

    error: Vector  # (2 n,)
    of_model: Vector  # (parameters, 2 n)
    of_path: Vector  # (unknowns, 2 n)


def starts(highest: float) -> list[float]:
    """Delays [s] to begin from; highest: frequency [rad/s]."""
    return [phase / highest for phase in GRID]


def with_lag(path: Path) -> list[Path]:
    """Where the search goes on once the best delay alone is known: from a lag alone, then from a delay and a lag."""
    return [Path(lag=path.total), *(Path((1.0 - part) * path.total, part * path.total) for part in LAGS)]


def path_step(turned: Turned) -> tuple[Vector, Vector]:
    """(what a Gauss-Newton step adds to the unknowns [s], their covariance for errors of unit variance)."""
    # What the model's parameters can do is taken out of both.
    q, _ = np.linalg.qr(turned.of_model.T)
    of_path = turned.of_path - (turned.of_path @ q) @ q.T
    normal = of_path @ of_path.T
    if not np.all(np.isfinite(normal)) or np.linalg.matrix_rank(normal, hermitian=True) < len(normal):
        return np.zeros(len(normal)), np.full(normal.shape, math.inf)
    inverse: Vector = np.linalg.inv(normal)
    return -inverse @ (of_path @ turned.error), inverse


def freed(turned: Turned, plain: Vector) -> Vector:
    """J'J of the model's parameters where the path is unknown, too: its Schur complement."""
    cross = turned.of_model @ turned.of_path.T
    # A lag that is nothing moves the response as a delay does: then they are one unknown.
    left: Vector = plain - cross @ np.linalg.pinv(turned.of_path @ turned.of_path.T, hermitian=True) @ cross.T
    return left
