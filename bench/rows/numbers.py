"""Logs of controllers with numbers that nobody gave, near the ends of the ranges in which they are looked for, and inside.

The logs are those of the servo's referee, with noise on the torque: a PI with a low pass, a notch or a position controller.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
import servo_referee as referee
from gaident.identification.controller_numbers import with_estimates
from referee_logs import AXIS, KI, KP, T, command, log

__all__ = ["found_numbers", "numbers"]

NOISES = (0.0, 1e-3, 0.02)  # of the torque's deviation
GAINS = ga.PI(None, None)

Numbers = dict[str, float]


def low_pass(periods: float, noise: float, seed: int) -> tuple[ga.Record, ga.Cascade, Numbers]:
    """A torque low pass of a time constant, in the controller's periods."""
    rec = log(seed, noise=noise, torque_filters=[referee.low_pass(periods * T, T)])
    return rec, ga.Cascade(GAINS, T, torque_filters=ga.LowPass(None)), {"torque_filters[0].time_constant": periods * T}  # type: ignore[arg-type]


def notch(share: float, zeros: float, poles: float, noise: float, seed: int) -> tuple[ga.Record, ga.Cascade, Numbers]:
    """A notch at a share of the sampling frequency, with its dampings."""
    truth = {"frequency": share / T, "numerator_damping": zeros, "denominator_damping": poles}
    rec = log(seed, noise=noise, torque_filters=[referee.notch(*truth.values(), T)])
    given = ga.Cascade(ga.PI(KP, KI), T, torque_filters=ga.Notch(None, None, None))  # type: ignore[arg-type]
    return rec, given, {f"torque_filters[0].{name}": value for name, value in truth.items()}


def position(gain: float, noise: float, seed: int) -> tuple[ga.Record, ga.Cascade, Numbers]:
    """A position controller of a gain [1/s]."""
    q = np.cumsum(command(seed=seed)) * T
    w, u, p = referee.simulate(AXIS, q, T, kp=KP, ki=KI, position_gain=gain)
    u = u + noise * np.std(u) * np.random.default_rng(seed).standard_normal(len(u))
    rec = ga.Record(T, position_command=q, velocity=w, torque=u, position=p)
    return rec, ga.Cascade(ga.PI(KP, KI), T, position=ga.P(None)), {"position.gain": gain}


MAKERS: dict[str, Callable[[float, int], tuple[ga.Record, ga.Cascade, Numbers]]] = {
    **{f"low pass/{k:g} T": lambda noise, seed, k=k: low_pass(k, noise, seed) for k in (0.03, 0.08, 0.2, 1.0, 8.0, 60.0)},
    **{f"notch/{f:g}/{zn:g}/{zd:g}": lambda noise, seed, f=f, zn=zn, zd=zd: notch(f, zn, zd, noise, seed)
       for f, zn, zd in ((0.004, 0.1, 0.7), (0.02, 0.1, 0.7), (0.2, 0.0, 0.3), (0.45, 0.1, 0.7), (0.02, 1.0, 0.02),
                         (0.02, 3.0, 4.0))},
    **{f"position/{k:g} per s": lambda noise, seed, k=k: position(k, noise, seed) for k in (0.5, 5.0, 40.0, 150.0)},
}  # fmt: skip
"""Name -> (record, what is given of its controller, the numbers that are not)."""


def numbers(count: int, seed: int) -> list[Case]:
    return [Case("numbers", f"{name}/{noise:g}/{seed}/{k}", (name, noise), k + 100 * seed)
            for k in range(count) for name in MAKERS for noise in NOISES]  # fmt: skip


def found_numbers(case: Case) -> Result:
    """Every number within five of its deviations and a percent; a refusal says which one the log does not show."""
    name, noise = case.what
    record, given, truth = MAKERS[name](noise, case.number)
    found = with_estimates([record], given).trusted().estimates
    off = [n for n, value in truth.items() if abs(found[n].value - value) > 5.0 * found[n].std + 0.01 * value]
    return Result("wrong" if off else "right", ", ".join(off), digest([f"{found[n].value:.3g}" for n in truth]))
