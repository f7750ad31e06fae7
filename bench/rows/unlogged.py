"""Logs without a torque of a loop whose controller has a filter that the given PI has not: which form is found.

One mass under steps of its speed, noise of 0.03 rad/s in the loop; filters in the middle and at the ends of what is looked for.
"""

from __future__ import annotations

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga

__all__ = ["form_found", "unlogged"]

DT, J, D = 1e-3, 3e-4, 2e-3
PI = ga.PI(0.05, 1.5)
LEVELS = (0.0, 20.0, -35.0, 10.0, -10.0, 50.0, -50.0, 25.0, -5.0, 5.0, -20.0, 40.0, -30.0, 15.0, -15.0, 0.0)
FORMS: dict[str, tuple[ga.Cascade, str]] = {
    "bare": (ga.Cascade(PI), ""),
    "notch": (ga.Cascade(PI, torque_filters=(ga.Notch(60.0, 0.1, 0.7),)), "torque_filter"),
    "narrow notch": (ga.Cascade(PI, torque_filters=(ga.Notch(60.0, 0.005, 0.07),)), "torque_filter"),
    "wide notch": (ga.Cascade(PI, torque_filters=(ga.Notch(60.0, 0.1, 1.6),)), "torque_filter"),
    "fast notch": (ga.Cascade(PI, torque_filters=(ga.Notch(440.0, 0.1, 1.0),)), "torque_filter"),
    "low pass": (ga.Cascade(PI, velocity_filters=(ga.LowPass(2e-3),)), "velocity_feedback_filter"),
    "slow command": (ga.Cascade(PI, command_filters=(ga.LowPass(0.1),)), "command_filter"),
}
"""Name -> (the controller, the finding that names it)."""


def unlogged(count: int, seed: int) -> list[Case]:
    return [Case("unlogged", f"{name}/{seed}/{n}", name, n + 1000 * seed) for n in range(count) for name in FORMS]


def form_found(case: Case) -> Result:
    controller, expected = FORMS[case.what]
    rng = np.random.default_rng(case.number)
    levels = np.repeat(LEVELS, 90)
    noise = 0.03 * rng.standard_normal(len(levels))
    drive = ga.OneMass(J=J, D=D).model()
    done = ga.run(drive, ga.Record(DT, command=levels - noise, velocity=np.zeros(len(levels))), controller)
    dia = ga.diagnose(ga.Record(DT, command=levels, velocity=done.velocity + noise), PI)
    names = {f.effect for f in dia.causes}
    right = names == ({expected} if expected else set())
    called = "right" if right else "false alarm" if not expected else "wrong" if names - {expected} else "missed"
    rest = {f.effect: {k: f"{e.value:.3g}" for k, e in f.parameters.items()} for f in dia.causes}
    return Result(called, f"{dia.verdict}: {' + '.join(sorted(names))}", digest([rest, dia.notes]))
