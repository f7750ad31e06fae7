"""Courses of a parameter over a year of daily logs: nothing, a step, a drift, temperature; whether a change is found in time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from rows.case import Case, Result, digest

from gaident.fleets.changes import Scale, levels_of, shifts_of

__all__ = ["DAYS", "KINDS_OF_COURSE", "change_found", "course_of", "courses"]

DAYS = 365
IN_TIME = 21  # days
STEP = 0.2
KINDS_OF_COURSE = ("nothing", "step", "drift", "warm", "warm step", "outliers", "warm with gaps", "warm step with gaps")

Vector = NDArray[np.float64]


def courses(count: int, seed: int) -> list[Case]:
    return [Case("courses", f"{kind}/{seed}/{k}", kind, k + 1000 * seed) for k in range(count) for kind in KINDS_OF_COURSE]


def course_of(kind: str, seed: int, deviation: float = 0.02, scatter: float = 0.02) -> tuple[Vector, Vector, Vector | None, int]:
    """(values, deviations, temperatures or None, day of the change, -1 for none).

    deviation: median of the logs' standard deviations, of the value; scatter: what they scatter beyond it.
    A drift takes 60 days to STEP, and its day is the one on which it has come there.
    Viscous friction falls by 2 % with a degree, over a year of +-10 degrees and days of +-3.
    """
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    day = np.arange(DAYS)
    s = deviation * np.exp(0.3 * rng.standard_normal(DAYS))
    y = s * rng.standard_normal(DAYS) + scatter * rng.standard_normal(DAYS)
    at = int(rng.integers(60, DAYS - 60))
    temperature = None
    if "warm" in kind:
        temperature = 10.0 * np.sin(2.0 * np.pi * day / DAYS + rng.uniform(0.0, 6.3)) + 3.0 * rng.standard_normal(DAYS)
        y -= 0.02 * temperature
    if temperature is not None and "gaps" in kind:  # no thermometer for 60 days, and in one log of twenty
        gone = int(rng.integers(30, DAYS - 60))
        temperature = np.where((rng.random(DAYS) < 0.05) | ((day >= gone) & (day < gone + 60)), np.nan, temperature)
    if kind == "outliers":
        y[rng.random(DAYS) < 0.02] += rng.choice([-1.0, 1.0])
    if "step" in kind:
        y[at:] += np.log1p(STEP)
    elif kind == "drift":
        y += np.log1p(STEP) * np.clip((day - at + 60) / 60.0, 0.0, 1.0)
    else:
        at = -1
    values = 0.3 * np.exp(y)
    return values, s * values, temperature, at


def change_found(case: Case) -> Result:
    """Right: the change within three weeks, or none where there is none; in set: with a second one that is not there."""
    values, deviations, temperature, at = course_of(case.what, case.number)
    y, s = Scale.of_course(values)(values, deviations)
    found = shifts_of(y, s, temperature)
    said = ", ".join(f"{f.found} ({100.0 * f.size:.0f} %)" for f in found) or "none"
    rest = digest([f"{level:.3g}" for _, _, level in levels_of(y, found)])
    if at < 0:
        return Result("right" if not found else "false alarm", said, rest)
    begun = at - 60 if case.what == "drift" else at
    if any(f.found < begun for f in found):
        return Result("wrong", said, rest)
    in_time = any(begun <= f.found <= at + IN_TIME for f in found)
    return Result("missed" if not in_time else "right" if len(found) == 1 or case.what == "drift" else "in set", said, rest)
