"""Slow logs: a line for every fourth sample of the controller, which is given as a bare PI, and which form the torque shows.

The referee is tests/python/support/servo_referee.py, which shares no code with the library.
What the command does between two lines is written here, too: it is held at a step, goes straight on a ramp, and follows a cosine.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from rows.case import Case, Result, digest
from rows.forms import AXIS, KI, KP, T

import gaident as ga
import servo_referee as referee
from gaident.diagnosis.controller.form_findings import loop_of

__all__ = ["shown_slower", "slower_forms"]

EVERY, LINES = 4, 1600
NOISE = 0.02  # rad/s, of the velocity that the controller reads
FORMS: dict[str, tuple[Any, set[str]]] = {
    "bare": (dict, set()),
    "limit": (lambda: {"torque_limit": 0.6}, {"torque_saturation"}),
    "IP": (lambda: {"weight": 0.0}, {"command_weight"}),
    "low pass": (lambda: {"torque_filters": [referee.low_pass(2e-3, T)]}, {"torque_filter"}),
    "gains": (lambda: {"kp": 1.2 * KP}, {"other_gains"}),
}
"""Name -> (what the referee is given, what has to be named)."""
COMMANDS = ("steps", "ramps", "cosine")


def slower_forms(count: int, seed: int) -> list[Case]:
    """Each form under each command."""
    made = [(name, command) for name in FORMS for command in COMMANDS]
    return [Case("slower", f"{name}/{command}/{seed}/{n}", (name, command), n + 1000 * seed)
            for n in range(count) for name, command in made]  # fmt: skip


def command_of(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Velocity command at the controller's samples [rad/s]: another speed for every 300 lines."""
    n = np.arange(LINES * EVERY)
    speeds = rng.uniform(-30.0, 30.0, LINES // 300 + 2)
    part, within = np.divmod(n / (300 * EVERY), 1.0)
    before, after = speeds[part.astype(int)], speeds[part.astype(int) + 1]
    share = {"steps": 0.0 * within, "ramps": within, "cosine": 0.5 - 0.5 * np.cos(np.pi * within)}[kind]
    return before + share * (after - before)


def shown_slower(case: Case) -> Result:
    name, command = case.what
    made, expected = FORMS[name]
    rng = np.random.default_rng([case.number, len(command)])
    r = command_of(command, rng)
    noise = NOISE * rng.standard_normal(len(r))
    reads = iter(noise)
    w, u, _ = referee.simulate(
        AXIS, r, T, EVERY, **{"kp": KP, "ki": KI, "velocity_filters": [lambda w: w + next(reads)], **made()}
    )
    rec = ga.Record(EVERY * T, command=r[::EVERY], velocity=w + noise[::EVERY], torque=u)
    loop = loop_of([rec], ga.Cascade(ga.PI(KP, KI), T))
    names = {f.effect for f in loop.findings}
    called = "right" if names == expected else "false alarm" if not expected else "wrong" if names - expected else "missed"
    rest = {f.effect: {k: f"{e.value:.3g}" for k, e in f.parameters.items()} for f in loop.findings}
    return Result(called, " + ".join(sorted(names)), digest([rest, loop.notes]))
