"""Fleets with a log a week: false alarms, recall and delay of changes in a year of 50 logs.

    python bench/fleets/weekly.py 400                 so many courses of each kind, on draws that chose nothing
    python bench/fleets/weekly.py 400 --seed 2        others
    python bench/fleets/weekly.py 3000 --kinds "scatter alone" "scatter alone, temperature"    what is hardest to hold

y_i is the logarithm of a parameter in week i = 0 .. 49; s_i the deviation that its log is told with, of 2 % in the median,

    y_i = s_i e_i + 0.02 f_i + c T_i + 0.2's share of the change,   e, f standard normal,  c = -0.02 a degree.

T_i is logged: a season of +-10 degrees with 3 degrees of scatter.
Outliers are 5 deviations of sqrt(s^2 + 0.02^2) in 1 % of the logs.
"scatter alone" is told with deviations of 0.4 % and scatters by 2.8 %.
"Long tails" has f of Student's distribution with 5 degrees
of freedom.
Steps of 20 % begin in a week from 20 on; drifts come to 20 % within 10 weeks, which begin with week 20 at the earliest.
"the 3rd log" is the share that was told with the third log that has the step, which is within three weeks of the change whenever
it happened between two logs; "the 4th" three weeks after the first log that has it.
Of drifts both count from the log in which it has come to 20 %.
An axis-year is ten courses of a year.
Figures stand in bench/README.md.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.fleets.changes import Scale, shifts_of

WEEKS, EARLIEST, DRIFT = 50, 20, 10
A_YEAR = 365.25 / 7.0
STEP, DEVIATION, SCATTER, SLOPE = 0.2, 0.02, 0.02, -0.02
COURSES = 10  # of an axis
KINDS = ("nothing", "temperature", "outliers", "scatter alone", "long tails", "step", "step at 20", "step, temperature",
         "step at 20, temperature", "step, outliers", "drift", "drift, temperature", "scatter alone, temperature")  # fmt: skip

Vector = NDArray[np.float64]


class Told(NamedTuple):
    """Of one course: false alarms, weeks that count for them, logs from the change to its alarm (0: its first; -1: none)."""

    false: int
    weeks: int
    late: int


def course_of(kind: str, seed: int, number: int) -> tuple[Vector, Vector, Vector | None, int]:
    """(values, deviations, temperatures or None, week that has the whole change, -1 for none)."""
    rng = np.random.default_rng([seed, number, KINDS.index(kind)])
    week = np.arange(WEEKS)
    alone = "scatter alone" in kind
    s = (0.2 if alone else 1.0) * DEVIATION * np.exp(0.3 * rng.standard_normal(WEEKS))
    f = np.sqrt(0.6) * rng.standard_t(5, WEEKS) if kind == "long tails" else rng.standard_normal(WEEKS)
    y = s * rng.standard_normal(WEEKS) + (np.sqrt(2.0) if alone else 1.0) * SCATTER * f
    at = EARLIEST if "at 20" in kind else int(rng.integers(EARLIEST + DRIFT * ("drift" in kind), WEEKS - 4))
    temperature = None
    if "temperature" in kind:
        season = 10.0 * np.sin(2.0 * np.pi * week / A_YEAR + rng.uniform(0.0, 2.0 * np.pi))
        temperature = season + 3.0 * rng.standard_normal(WEEKS)
        y += SLOPE * temperature
    if "outliers" in kind:
        hit = rng.random(WEEKS) < 0.01
        y[hit] += 5.0 * np.hypot(s, SCATTER)[hit] * rng.choice([-1.0, 1.0], int(hit.sum()))
    if "step" in kind:
        y[at:] += np.log1p(STEP)
    elif "drift" in kind:
        y += np.log1p(STEP) * np.clip((week - at + DRIFT) / DRIFT, 0.0, 1.0)
    else:
        at = -1
    values = 0.3 * np.exp(y)
    return values, s * values, temperature, at


def told(kind: str, seed: int, number: int) -> Told:
    values, deviations, temperature, at = course_of(kind, seed, number)
    y, s = Scale.of_course(values)(values, deviations)
    found = [shift.found for shift in shifts_of(y, s, temperature, A_YEAR)]
    if at < 0:
        return Told(len(found), WEEKS, -1)
    begun = at - DRIFT if "drift" in kind else at
    late = [max(f - at, 0) for f in found if f >= begun]
    return Told(sum(f < begun for f in found), begun, late[0] if late else -1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", nargs="?", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    print("| course | false alarms | axis-years | told by the 3rd log | by the 4th | median |\n|---|---|---|---|---|---|")
    with ProcessPoolExecutor(args.workers, mp_context=get_context("spawn")) as pool:
        for kind in args.kinds:
            found = list(pool.map(told, repeat(kind), repeat(args.seed), range(args.count), chunksize=10))
            late = np.array([f.late for f in found])
            row = [kind, f"{sum(f.false for f in found)}", f"{sum(f.weeks for f in found) / WEEKS / COURSES:.0f}"]
            changed = "step" in kind or "drift" in kind
            row += [f"{100.0 * np.mean((late >= 0) & (late <= n)):.1f} %" if changed else "" for n in (2, 3)]
            row += [f"log {np.median(late[late >= 0]) + 1:.0f}" if changed and np.any(late >= 0) else ""]
            print(f"| {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
