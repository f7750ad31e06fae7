"""A recurrent network beside the linear model, by jax-sysid in an environment of its own: it predicts and names nothing.

    python -m venv build/jax-sysid && build/jax-sysid/bin/pip install "jax-sysid>=1.1"

The network begins as the sampled linear mechanism, one mass or two, with STATES more states of its own, and is fitted to
the simulation of the whole record (`recurrent_fit.py`, a process of its own in that environment).
It gets the torque and the sine and cosine of the angle of one turn.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from case import Answer, Case
from in_the_loop import mechanism
from numpy.typing import NDArray
from prediction import ONLY, Step, closest

Vector = NDArray[np.float64]

PYTHON = Path(__file__).resolve().parents[2] / "build" / "jax-sysid" / "bin" / "python"
"""Of the environment with jax-sysid."""
FIT = Path(__file__).with_name("recurrent_fit.py")
LONGEST = 60.0
"""Seconds of one fit, after which there is no answer."""
ADAM, LBFGS = 200, 1200
"""Iterations."""
STATES, UNITS = 2, 8
"""Further states, and units of the one hidden layer."""
STEEP = (20.0, 5.0)
"""Weights of the velocity in the first units: near to its sign."""


def began(case: Case) -> tuple[dict[str, Vector], float, float]:
    """(the network to begin with, scale of the velocity [rad/s], of the torque [N m]); states have an rms of 1."""
    sampled, rec = mechanism(case).to_scipy(case.record.dt), case.record
    speed, torque = float(np.sqrt(np.mean(rec.velocity**2))), float(np.sqrt(np.mean(rec.torque**2)))
    A, B, C = sampled.A, sampled.B[:, 0], sampled.C[0]
    n = len(A)
    x = np.zeros((len(rec), n))
    for k in range(len(rec) - 1):
        x[k + 1] = A @ x[k] + B * rec.torque[k]
    size = np.sqrt(np.mean(x**2, axis=0))
    rng = np.random.default_rng(0)
    start = {
        "A": np.block([[A * size / size[:, None], np.zeros((n, STATES))], [np.zeros((STATES, n)), np.diag([0.9, 0.5])]]),
        "B": np.zeros((n + STATES, 3)),
        "C": np.concatenate([C * size / speed, np.zeros(STATES)])[None, :],
        "V": 1e-3 * rng.standard_normal((n + STATES, UNITS)),
        "W": rng.standard_normal((UNITS, n + STATES + 3)),
        "b": np.zeros(UNITS),
    }
    start["B"][:n, 0] = B * torque / size
    for unit, steep in enumerate(STEEP):
        start["W"][unit] = 0.0
        start["W"][unit, : n + STATES] = steep * start["C"][0]
    return start, speed, torque


def angle_of(velocity: Vector, dt: float) -> Vector:
    return dt * np.concatenate([[0.0], np.cumsum(velocity)[:-1]])


def inputs(torque: Any, theta: Any) -> Vector:
    """Of the network, (n, 3)."""
    return np.stack([torque, np.cos(theta), np.sin(theta)], axis=-1)


def fitted(start: dict[str, Vector], v: Vector, w: Vector) -> dict[str, Vector]:
    """The network after the iterations; subprocess.TimeoutExpired after LONGEST."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder, "given.npz"), Path(folder, "found.npz")
        np.savez(given, v=v, w=w[:, None], adam=ADAM, lbfgs=LBFGS, **start)
        child = [str(PYTHON), str(FIT), str(given), str(found)]
        one_core = os.environ | {"XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}
        subprocess.run(child, check=True, timeout=LONGEST, capture_output=True, env=one_core)
        with np.load(found) as arrays:
            return dict(arrays)


def recurrent(case: Case) -> dict[float, Answer]:
    """The free run of the fitted network, or of what it began with where that comes closer to the record itself."""
    start, speed, torque = began(case)
    rec = case.record
    found = fitted(start, inputs(rec.torque / torque, angle_of(rec.velocity, rec.dt)), rec.velocity / speed)
    return {ONLY: Answer({}, rmse=closest(case, [partial(moved, p, rec.dt, speed, torque) for p in (start, found)]))}


def moved(p: dict[str, Vector], dt: float, speed: float, torque: float) -> Step:
    """The network from sample to sample, from rest; to be called once a sample."""
    x, theta = np.zeros(len(p["A"])), 0.0

    def step(w: Vector, u: Vector) -> float:
        nonlocal x, theta
        v = inputs(u[0] / torque, theta)
        theta += dt * float(w[0])
        x = p["A"] @ x + p["B"] @ v + p["V"] @ np.tanh(p["W"] @ np.concatenate([x, v]) + p["b"])
        return speed * float(p["C"][0] @ x)

    return step
