"""Logs of a servo controller of another form than the bare PI that is given: which form the torque shows.

The referee is tests/python/support/servo_referee.py, which shares no code with the library.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from rows.case import Case, Result, digest

import gaident as ga
import servo_referee as referee
from gaident.diagnosis.controller.forms import form_shown

__all__ = ["forms", "shown"]

T, KP, KI = 250e-6, 0.05, 2.0
AXIS = referee.Axis(4e-4, 0.004, 9e-4, 0.006, 60.0, 0.02)
FORMS: dict[str, tuple[Any, set[str]]] = {
    "bare": (dict, set()),
    "backward": (lambda: {"rule": "backward"}, {"integration_rule"}),
    "half": (lambda: {"weight": 0.5}, {"command_weight"}),
    "IP, backward": (lambda: {"weight": 0.0, "rule": "backward"}, {"integration_rule", "command_weight"}),
    "low pass": (lambda: {"torque_filters": [referee.low_pass(4e-4, T)]}, {"torque_filter"}),
    "notch": (lambda: {"torque_filters": [referee.notch(80.0, 0.1, 0.7, T)]}, {"torque_filter"}),
    "acceleration": (lambda: {"aff": 9e-4}, {"acceleration_feedforward"}),
    "gains": (lambda: {"kp": 1.2 * KP}, {"other_gains"}),
}
"""Name -> (what the referee is given, what has to be named)."""


def forms(count: int, seed: int) -> list[Case]:
    """Each form with a torque of full precision, of four digits, and measured with 1 % noise."""
    made = [(name, digits, noise) for name in FORMS for digits, noise in ((0, 0.0), (4, 0.0), (0, 0.01))]
    return [Case("forms", f"{name}/{digits}/{noise:g}/{seed}/{n}", (name, digits, noise), n + 1000 * seed)
            for n in range(count) for name, digits, noise in made]  # fmt: skip


def shown(case: Case) -> Result:
    name, digits, noise = case.what
    made, expected = FORMS[name]
    rng = np.random.default_rng(case.number)
    levels = rng.uniform(-30.0, 30.0, 9)
    r = np.interp(np.arange(2400), np.arange(0, 2700, 300), levels)
    r[:1200] = np.repeat(levels[:4], 300)
    w, u, _ = referee.simulate(AXIS, r, T, **{"kp": KP, "ki": KI, **made()})
    u = u + noise * np.std(u) * rng.standard_normal(len(u))
    u = np.array([float(f"{x:.{digits}g}") for x in u]) if digits else u
    found = form_shown([ga.Record(T, command=r, velocity=w, torque=u)], ga.PI(KP, KI))
    names = set(found.numbers) if found else set()
    called = "right" if names == expected else "false alarm" if not expected else "wrong" if names - expected else "missed"
    rest = {n: {k: f"{v:.3g}" for k, (v, _) in p.items()} for n, p in found.numbers.items()} if found else {}
    return Result(called, " + ".join(sorted(names)), digest([rest, found.rivals if found else ()]))
