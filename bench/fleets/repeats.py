"""Three repeats of four joint actuators as a fleet: what is told of them, and whether repeats differ by more than repeats do.

    python bench/fleets/repeats.py          needs the recorded data (GAIDENT_DATA)

Three logs of an axis do not show how its logs scatter, so that `ga.trends` tells no change of them: their courses are too poor.
What repeats show instead is their spread, of all axes of a type together.
y_mr is the logarithm of a parameter of motor m in repeat r, s_mr its deviation,

    spread = median |y_mr - y_mq| / (0.6745 sqrt(2)) over the pairs of repeats of all motors,
    away   = (y_mr - mean of the others of motor m) / sqrt(S_mr^2 + mean of the others' S^2 / their number),
             S^2 = max(spread^2, s^2),

and one differs where |away| is beyond the quantile of Student's distribution at 1 % for all of them together.
It has as many degrees of freedom as there are values less means: 8 of four motors.
Figures stand in bench/README.md.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterable
from datetime import date
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
HERE = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(HERE), str(HERE / "measured"), str(HERE.parent / "tests" / "python" / "support")]

import numpy as np  # noqa: E402
from real_records import ACTUATOR_GAINS, actuator  # noqa: E402
from scipy.stats import norm  # noqa: E402
from scipy.stats import t as student  # noqa: E402

import gaident as ga  # noqa: E402
from gaident.fleets.found import Course  # noqa: E402

RUNS = (1, 2, 3)
LEVEL = 0.01


class Away(NamedTuple):
    """One value: axis, number of its repeat, how far it is from the others in deviations, and the bound."""

    axis: str
    repeat: int
    away: float
    bound: float


class Compared(NamedTuple):
    """A quantity: median of its own deviations, spread of the repeats (both of the value), and its values."""

    quantity: str
    deviation: float
    spread: float
    values: tuple[Away, ...]


def written(folder: Path, motors: Iterable[int]) -> list[str]:
    """The logs of some motors, each repeat a day."""
    names = []
    for motor in motors:
        for run in RUNS:
            rec = actuator(motor, run)[0][0]
            path = folder / f"motor {motor}" / f"{date(2026, 1, run).isoformat()}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            table = np.column_stack([rec.time, rec.command, rec.velocity, rec.torque, rec.position])
            np.savetxt(path, table, delimiter=",", header="time,command,velocity,torque,position", comments="")
            names.append(str(path))
    return names


def followed(folder: Path) -> list[ga.Trends]:
    """Diagnosed and followed: motors with one gain of their velocity law are one fleet."""
    found = []
    for gain in sorted(set(ACTUATOR_GAINS.values())):
        logs = written(folder / "logs", (m for m, k in ACTUATOR_GAINS.items() if k == gain))
        out = folder / f"fleet {gain}"
        controller = ga.PI(gain, 0.0, loop="continuous")
        done = ga.fleet(logs, controller, out=out, read={"torque_is": "measured"}, quick=True, executor=map)
        print(f"gain {gain} N m s/rad: {done.summary().splitlines()[0]}")
        found.append(ga.trends(out))
    return found


def compared(courses: Iterable[Course]) -> list[Compared]:
    """The quantities of which all repeats of two axes at least have a value."""
    by_quantity: dict[str, list[Course]] = {}
    for course in courses:
        if len(course.values) == len(RUNS) and np.all(course.values > 0.0):
            by_quantity.setdefault(course.quantity, []).append(course)
    found = []
    for quantity, own in by_quantity.items():
        if len(own) < 2:
            continue
        y = np.array([np.log(c.values) for c in own])
        s = np.array([c.deviations / c.values for c in own])
        apart = [abs(row[a] - row[b]) for row in y for a, b in combinations(range(len(RUNS)), 2)]
        spread = float(np.median(apart)) / (float(norm.ppf(0.75)) * np.sqrt(2.0))
        scale = np.maximum(spread, s) ** 2
        others = len(RUNS) - 1
        away = (y - (y.sum(axis=1, keepdims=True) - y) / others) / np.sqrt(
            scale + (scale.sum(axis=1, keepdims=True) - scale) / others**2
        )
        bound = float(student.isf(0.5 * LEVEL / y.size, y.size - len(own)))
        values = tuple(
            Away(c.axis, r, float(a), bound) for c, row in zip(own, away, strict=True) for r, a in zip(RUNS, row, strict=True)
        )
        found.append(Compared(quantity, float(np.median(s)), spread, values))
    return found


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        shown = followed(Path(folder))
    courses = [course for trends in shown for course in trends.courses]
    changes = sum(len(t.changes) for t in shown)
    print(f"{len(courses)} courses, {sum(bool(c.poor) for c in courses)} too poor to say, {changes} changes told")
    heads = ("parameter", "axes", "own deviation", "spread between repeats", "furthest from its repeats", "bound")
    print(f"| {' | '.join(heads)} |\n{'|---' * len(heads)}|")
    for c in compared(courses):
        far = max(c.values, key=lambda v: abs(v.away))
        where = f"{far.away:+.1f} ({far.axis}, repeat {far.repeat})"
        figures = (
            f"{len(c.values) // len(RUNS)} | {100.0 * c.deviation:.1f} % | {100.0 * c.spread:.1f} % | {where} | {far.bound:.1f}"
        )
        print(f"| {c.quantity} | {figures} |")


if __name__ == "__main__":
    main()
