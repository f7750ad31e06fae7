"""Experiments that are proposed for axes of which more or less is known: whether the axis keeps to the limits when they are run.

Each axis is one mass under a PI controller. First experiment and whole menu are simulated on it, without a limit of the torque.
"""

from __future__ import annotations

import math

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
from gaident.diagnosis.experiments.first_experiment import candidate_commands, first_experiment
from gaident.results.experiment import Limits

__all__ = ["kept", "proposals"]

DT, J, KP = 1e-3, 2e-4, 0.02
KNOWN: dict[str, dict[str, float]] = {
    "nothing": {},
    "inertia": {"inertia": J},
    "kp": {"kp": KP},
    "both": {"inertia": J, "kp": KP},
}
TRAVELS = (math.inf, 20.0, 0.5)  # rad
SHORT = 0.5  # s, which is a little more than the shortest experiment


def proposals(count: int, seed: int) -> list[Case]:
    made = [(known, travel, seconds) for known in KNOWN for travel in TRAVELS for seconds in (3.5, SHORT)]
    return [Case("proposals", f"{known}/{travel:g}/{seconds:g}/{seed}/{n}", (known, travel, seconds), n + 1000 * seed)
            for n in range(count) for known, travel, seconds in made]  # fmt: skip


def kept(case: Case) -> Result:
    """Right: travel is always kept, torque and speed where kp and inertia are known, and otherwise the command's own speed."""
    known, travel, seconds = case.what
    rng = np.random.default_rng(case.number)
    limits = Limits(float(rng.uniform(60.0, 150.0)), float(rng.uniform(0.5, 1.5)), travel, seconds)
    items = [i.command for i in candidate_commands(DT, limits, **KNOWN[known])]
    commands = [first_experiment(DT, limits, **KNOWN[known]).command, *items]
    model, controller = ga.OneMass(J=J, D=3e-3).model(), ga.PI(KP, 0.5)
    torque, speed, way, asked = np.max([_shares(model, controller, c, limits) for c in commands], axis=0)
    right = max(asked, way) <= 1.0 and (known != "both" or max(torque, speed) <= 1.0)
    said = f"torque {torque:.2f}, speed {speed:.2f}, command {asked:.2f}, travel {way:.2f} of the limits"
    return Result("right" if right else "wrong", said, digest([[len(c), f"{np.sum(c**2):.4g}"] for c in commands]))


def _shares(model: ga.Model, controller: ga.PI, command: np.ndarray, limits: Limits) -> tuple[float, float, float, float]:
    """Largest (torque, speed, travel of the command, speed of the command), each over its limit."""
    done = ga.run(model, ga.Record(DT, command=command, velocity=np.zeros(len(command))), controller)
    path = np.append(0.0, DT * np.cumsum(command))
    way = float(np.ptp(path)) / limits.travel if math.isfinite(limits.travel) else 0.0
    largest = [float(np.abs(x).max()) for x in (done.torque, done.velocity, command)]
    return largest[0] / limits.torque, largest[1] / limits.speed, way, largest[2] / limits.speed
