"""A servo axis simulated by other means than the library's: the plant by SciPy's exact hold, the controller line by line.

It follows the definition of the controller and shares no code with gaident: filters come from scipy.signal, the plant is a state
space in physical coordinates, stepped ten times in a controller sample.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import signal

FINE = 10


@dataclass
class Axis:
    """Motor [kg m^2, N m s/rad], and where `stiffness` is above 0 a load on a shaft [N m/rad, N m s/rad]."""

    inertia: float
    damping: float
    load: float = 0.0
    load_damping: float = 0.0
    stiffness: float = 0.0
    shaft_damping: float = 0.0

    def state_space(self) -> tuple[np.ndarray, np.ndarray]:
        """(A, B) of (motor angle, motor velocity[, load velocity, twist])."""
        if self.stiffness == 0.0:
            return np.array([[0, 1], [0, -self.damping / self.inertia]]), np.array([[0], [1 / self.inertia]])
        J, D, L, E, K, C = self.inertia, self.damping, self.load, self.load_damping, self.stiffness, self.shaft_damping
        A = np.array([[0, 1, 0, 0], [0, -(D + C) / J, C / J, -K / J], [0, C / L, -(E + C) / L, K / L], [0, 1, -1, 0]])
        return A, np.array([[0], [1 / J], [0], [0]])


@dataclass
class Filter:
    """A filter of SciPy's, run sample by sample."""

    b: np.ndarray
    a: np.ndarray
    state: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.state = np.zeros(max(len(self.a), len(self.b)) - 1)

    def __call__(self, x: float) -> float:
        y, self.state = signal.lfilter(self.b, self.a, [x], zi=self.state)
        return float(y[0])


def low_pass(tau: float, T: float) -> Filter:
    """The step response of 1/(tau s + 1), sampled where the held input ends."""
    A, B, *_ = signal.cont2discrete((np.array([[-1 / tau]]), np.array([[1 / tau]]), np.eye(1), np.zeros((1, 1))), T, "zoh")
    return Filter(np.array([B[0, 0]]), np.array([1.0, -A[0, 0]]))


def notch(hz: float, zn: float, zd: float, T: float) -> Filter:
    w = 2 * np.pi * hz
    b, a = signal.bilinear([1, 2 * zn * w, w * w], [1, 2 * zd * w, w * w], fs=w / (2 * np.tan(w * T / 2)))
    return Filter(b, a)


def simulate(axis: Axis, source: np.ndarray, T: float, every: int = 1, **c: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(velocity, torque, position) at every `every`-th controller sample; source: command at the controller's samples.

    c: kp, ki, rule, weight, windup, tracking, torque_limit, integrator_limit, position_gain, position_every, kff, aff, fff,
    rate_limit [rad/s^2] of the velocity command behind its filters, filters as lists of Filter (torque_filters,
    velocity_filters, command_filters), delay in tenths of T: a line of past torques, one each fine step, from whose end the motor
    takes its own.
    """
    A, B = axis.state_space()
    F, G, *_ = signal.cont2discrete((A, B, np.eye(len(A)), np.zeros((len(A), 1))), T / FINE, "zoh")
    x = np.zeros(len(A))
    followed = 0.0
    I = last = r = ff = fu = 0.0
    limit, clamp = c.get("torque_limit", np.inf), c.get("integrator_limit", np.inf)
    every_q, N = c.get("position_every", 1), len(source)
    rows = []
    on_the_way = [0.0] * int(c.get("delay", 0))
    for n in range(N):
        w, q = x[1], x[0]
        placed = c.get("position_gain", 0.0) > 0.0
        if n % (every_q if placed else 1) == 0:
            step = every_q if placed else 1

            def at(k: int, step: int = step, n: int = n) -> float:
                return float(source[min(n + k * step, N - 1)])

            if placed:
                v = (at(1) - at(0)) / (step * T)
                a = (at(2) - 2 * at(1) + at(0)) / (step * T) ** 2
                r = c["position_gain"] * (source[n] - q) + c.get("kff", 0.0) * v
            else:
                r = v = float(source[n])
                a = (at(1) - at(0)) / T
            fu = c.get("aff", 0.0) * a + c.get("fff", 0.0) * np.sign(v)
        ff = r
        for f in c.get("command_filters", ()):
            ff = f(ff)
        farthest = c.get("rate_limit", np.inf) * T
        ff = followed = min(max(ff, followed - farthest), followed + farthest)
        for f in c.get("velocity_filters", ()):
            w = f(w)
        e = ff - w
        rule = c.get("rule", "trapezoidal")
        new = I + c["ki"] * T * {"trapezoidal": (e + last) / 2, "backward": e, "forward": last}[rule]
        new = float(np.clip(new, -clamp, clamp))
        free = c["kp"] * (c.get("weight", 1.0) * ff - w) + fu
        u = float(np.clip(free + new, -limit, limit))
        if c.get("windup") == "hold" and u != free + new and (free + new - u) * e > 0:
            new = I
            u = float(np.clip(free + new, -limit, limit))
        elif c.get("windup") == "tracking":
            new += (u - (free + new)) * T / c["tracking"]
        I, last = new, e
        for f in c.get("torque_filters", ()):
            u = f(u)
        if n % every == 0:
            rows.append((x[1], u, x[0]))
        for _ in range(FINE):
            on_the_way.append(u)
            x = F @ x + G[:, 0] * on_the_way.pop(0)
    velocity, torque, position = np.array(rows).T
    return velocity, torque, position
