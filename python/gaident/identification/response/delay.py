"""A delay that a frequency response contains beside the axis: the controller's computing, a bus, about that of the current loop.

    G(f) = exp(-j omega tau) G_axis(f)

Looked for where no chain of masses holds without one.
From each delay of a grid the structures are searched anew, and from each chain of masses the delay goes on by Gauss-Newton steps
together with the parameters x, which are then fitted again:

    e(tau + d, x + dx) = e + e_tau d - J dx,   e_tau = j omega e^(j omega tau) w G
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.identification.response.weighed import Weighed
from gaident.identification.selection import Candidate

__all__ = ["SMALL", "STEPS", "delay_step", "freed", "starts"]

Vector = NDArray[np.float64]

GRID = tuple(0.5 + k for k in range(9))  # no decision: a grid: rad, the phase of a delay at the highest frequency
STEPS = 12  # no decision: of a solver
SMALL = 1e-4  # no decision: of a solver: rad at the highest frequency


@dataclass(frozen=True)
class _Linear:
    """e and its derivatives, by parameters of the model and by the delay, real and imaginary parts in turn."""

    error: Vector  # (2 n,)
    of_model: Vector  # (parameters, 2 n)
    of_delay: Vector  # (2 n,)


def starts(parts: list[Weighed]) -> list[float]:
    """Delays [s] to begin from."""
    highest = max(float(p.response.omega[-1]) for p in parts)
    return [phase / highest for phase in GRID]


def _linear(experiment: _core.Experiment, parts: list[Weighed], c: Candidate) -> _Linear:
    error, columns, _ = experiment.sensitivities(c.fit.gain, c.fit.poles, c.fit.zeros, [], [])
    turned = np.concatenate([1j * p.response.omega * p.weight * p.value for p in parts])
    return _Linear(error, columns, np.stack([turned.real, turned.imag], axis=1).ravel())


def delay_step(experiment: _core.Experiment, parts: list[Weighed], c: Candidate) -> tuple[float, float]:
    """(what a Gauss-Newton step adds to the delay [s], its standard deviation for errors of unit variance)."""
    linear = _linear(experiment, parts, c)
    # What the model's parameters can do is taken out of both.
    q, _ = np.linalg.qr(linear.of_model.T)
    of_delay = linear.of_delay - q @ (q.T @ linear.of_delay)
    error = linear.error - q @ (q.T @ linear.error)
    size = float(of_delay @ of_delay)
    return (-float(of_delay @ error) / size, 1.0 / math.sqrt(size)) if size > 0.0 else (0.0, math.inf)


def freed(experiment: _core.Experiment, parts: list[Weighed], c: Candidate, plain: Vector) -> Vector:
    """J'J of the model's parameters where the delay is unknown, too: its Schur complement."""
    linear = _linear(experiment, parts, c)
    cross = linear.of_model @ linear.of_delay
    left: Vector = plain - np.outer(cross, cross) / float(linear.of_delay @ linear.of_delay)
    return left
