"""A simulated fleet with one log a week: what ga.fleet and ga.trends tell of it, by kind of axis.

    python bench/fleets/simulated.py --axes 200 --weeks 50 --workers 2          the whole of it
    python bench/fleets/simulated.py --axes 6 --weeks 30                        one axis of each kind
    python bench/fleets/simulated.py --axes 24 --folder DIR      kept there; the same again goes on where it was stopped

The drive is tests/cpp/drive_rig.cpp, which knows nothing of the library; a log is 480 samples of 1 ms in a velocity loop, with
white noise of 0.1 rad/s inside it.
Axes of one kind are units: inertia, viscous friction and what changes are each exp(0.05 e) of the kind's, e standard normal.
The temperature T is logged: a season of +-10 degrees, with 3 degrees of scatter; of all axes

    D = D0 exp(-0.02 (T - 20)),   from log to log dry friction, gap and stiffness scatter by 2 %.

One kind after the other (--kinds):

    quiet            one mass, dry friction; nothing changes
    friction drift   the same; dry friction grows by 20 % within 10 weeks
    friction step    the same; by 20 % from one log to the next
    gap drift        two masses on a shaft with a gap, which grows by 20 % within 10 weeks
    belt             two masses on a belt that slips out of its tension: from one log to the next its stiffness is 20 % lower
                     (a strand that is slack carries no load; the last strand alone would have half).
                     The axis is driven at the motor and measured there, so that lost angle itself is not in the log.
    quiet belt       the same; nothing changes

Damaged are 2 % of the logs (--damaged), each in one of four ways: cut in the middle of a line, a column without numbers, other
names of columns, empty.
Found is a change of the quantity that changed, in an axis in which it did, told from the log on in which the change begins.
Every other change is a false alarm, also one of another quantity of the same axis, but for the frequencies and dampings of the
resonance that follow from the stiffness of the belt.
The delay counts from the first log that has the change, of a drift from that in which it has come to 20 %.
Figures stand in bench/README.md.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from contextlib import nullcontext
from dataclasses import dataclass, replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(HERE.parent / "tests" / "python" / "support")]

import gaident as ga  # noqa: E402
from drive_rig import Noise, Plant, rig  # noqa: E402

KP, KI = 0.03, 1.0
ONE = Plant(J=3e-4, D=2e-3, kp=KP, ki=KI, dt=1e-3)
TWO = Plant(J=1.5e-4, D=1e-3, JL=1.5e-4, DL=1e-3, KG=30.0, DG=2e-3, kp=KP, ki=KI, dt=1e-3)
COMMAND = np.repeat([60.0, -80.0, 30.0, -15.0, 45.0, -45.0], 80)
FRICTION, GAP = 0.05, 0.02
CHANGE, DRIFT, BEFORE, WITHIN = 0.2, 10, 22, 3
UNITS, SCATTER, SLOPE, DAMAGED = 0.05, 0.02, -0.02, 0.02
KINDS = {
    "quiet": "",
    "friction drift": "dry friction",
    "friction step": "dry friction",
    "gap drift": "gap of backlash",
    "belt": "stiffness",
    "quiet belt": "",
}
FOLLOWS = {"belt": ("resonance", "antiresonance", "resonance damping", "antiresonance damping")}
DAMAGES = ("cut", "no numbers", "other names", "empty")
BEGIN = date(2025, 1, 6)


@dataclass(frozen=True)
class Axis:
    """name, kind, and the log in which the change begins and that which has the whole of it; -1: none."""

    name: str
    kind: str
    begins: int
    whole: int

    def size(self, week: int) -> float:
        """What the parameter that changes is multiplied by."""
        if self.begins < 0 or week < self.begins:
            return 1.0
        share = min((week - self.begins + 1) / (self.whole - self.begins + 1), 1.0)
        return 1.0 + (-CHANGE if self.kind == "belt" else CHANGE) * share


@dataclass
class Row:
    """A line of the table."""

    axes: int = 0
    changed: int = 0
    found: int = 0
    false: int = 0
    late: tuple[int, ...] = ()


def axes_of(count: int, weeks: int, kinds: list[str], seed: int) -> list[Axis]:
    """A step comes behind 22 logs at least, a drift begins behind as many; both early enough that three more show it."""
    made = []
    for k in range(count):
        kind = kinds[k % len(kinds)]
        begins = whole = -1
        if KINDS[kind]:
            rng = np.random.default_rng([seed, k, 1])
            length = DRIFT - 1 if "drift" in kind else 0
            begins = int(rng.integers(BEFORE, max(weeks - WITHIN - length, BEFORE + 1)))
            whole = begins + length
        made.append(Axis(f"{kind.replace(' ', '_')}_{k:03d}", kind, begins, whole))
    return made


def write_logs(folder: Path, axes: list[Axis], weeks: int, seed: int, share: float) -> int:
    """Writes the logs that are not there; returns how many of all are damaged."""
    broken = 0
    for axis in axes:
        for week in range(weeks):
            rng = np.random.default_rng([seed, int(axis.name[-3:]), 2, week])
            how = str(rng.choice(DAMAGES)) if rng.random() < share else ""
            broken += bool(how)
            path = folder / axis.name / f"{(BEGIN + timedelta(weeks=week)).isoformat()}.csv"
            if not path.exists():
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(damaged(log_of(axis, week, seed), how), encoding="utf-8")
    return broken


def log_of(axis: Axis, week: int, seed: int) -> str:
    number = int(axis.name[-3:])
    unit = np.exp(UNITS * np.random.default_rng([seed, number, 3]).standard_normal(3))
    phase = np.random.default_rng([seed, number, 4]).uniform(0.0, 2.0 * np.pi)
    rng = np.random.default_rng([seed, number, 5, week])
    heat = 20.0 + 10.0 * np.sin(2.0 * np.pi * week / 52.0 + phase) + 3.0 * rng.standard_normal()
    level = float(unit[2] * np.exp(SCATTER * rng.standard_normal()) * axis.size(week))
    thin = float(unit[1] * np.exp(SLOPE * (heat - 20.0)))
    if "belt" in axis.kind or "gap" in axis.kind:
        stiffness = TWO.KG * (level if "belt" in axis.kind else 1.0)
        plant = replace(TWO, J=TWO.J * unit[0], JL=TWO.JL * unit[0], D=TWO.D * thin, DL=TWO.DL * thin, KG=stiffness)
        effects = {"backlash": {"gap": GAP * level}} if "gap" in axis.kind else {}
    else:
        plant = replace(ONE, J=ONE.J * unit[0], D=ONE.D * thin)
        effects = {"coulomb_friction": {"torque": FRICTION * level}}
    rec = rig(plant, COMMAND, effects, noise=Noise(white=0.1), seed=int(rng.integers(2**31)))
    table = np.column_stack([rec.time, rec.command, rec.velocity, rec.torque, np.full(len(COMMAND), heat)])
    return "time,command,velocity,torque,heat\n" + "".join(",".join(f"{x:.9g}" for x in line) + "\n" for line in table)


def damaged(text: str, how: str) -> str:
    lines = text.splitlines()
    if how == "cut":
        return text[: len(text) // 8]
    if how == "no numbers":
        return "\n".join([lines[0], *(",".join([*line.split(",")[:2], "nan", *line.split(",")[3:]]) for line in lines[1:])])
    if how == "other names":
        return "\n".join(["a,b,c,d,e", *lines[1:]])
    return "" if how == "empty" else text


def judged(axes: list[Axis], shown: ga.Trends) -> tuple[dict[str, Row], list[str]]:
    """(kind -> its row, the false alarms in words)."""
    rows = {axis.kind: Row() for axis in axes}
    week_of = {(BEGIN + timedelta(weeks=w)).isoformat(): w for w in range(1000)}
    false = []
    for axis in axes:
        row = rows[axis.kind]
        row.axes += 1
        row.changed += axis.begins >= 0
        late: list[int] = []
        for change in shown.changes:
            if change.axis != axis.name:
                continue
            seen = week_of[change.found[:10]]
            if axis.begins >= 0 and KINDS[axis.kind] in change.quantity and seen >= axis.begins:
                late.append(max(seen - axis.whole, 0))
            elif axis.begins < 0 or seen < axis.begins or change.quantity not in FOLLOWS.get(axis.kind, ()):
                row.false += 1
                since = f"its change begins on {axis.begins}" if axis.begins >= 0 else "nothing changes"
                false.append(f"{axis.name}: {change.quantity} {change.share:+.0%}, seen in week {seen}; {since}")
        if late:
            row.late = (*row.late, late[0])
            row.found += late[0] <= WITHIN
    return rows, false


def run(
    folder: Path, count: int, weeks: int, kinds: list[str], seed: int = 1, workers: int = 1, share: float = DAMAGED
) -> dict[str, Row]:
    """Writes the logs, diagnoses them, follows them, prints the table, and returns it."""
    axes = axes_of(count, weeks, kinds, seed)
    broken = write_logs(folder / "logs", axes, weeks, seed, share)
    began = time.perf_counter()
    found = ga.fleet(
        f"{folder}/logs/*/*.csv", ga.PI(KP, KI), out=f"{folder}/fleet", quick=True, temperature="heat", workers=workers
    )
    seconds = time.perf_counter() - began
    shown = ga.trends(f"{folder}/fleet")
    rows, false = judged(axes, shown)
    print(f"{found.summary().splitlines()[0]}; {broken} damaged; {seconds:.0f} s")
    print(f"{len(shown.courses)} courses, {len(shown.poor)} of them too poor to say")
    heads = ("axes", "number", "axis-years", "found within 3 weeks", "found", "median delay", "false alarms")
    print(f"| {' | '.join(heads)} |\n{'|---' * len(heads)}|")
    for kind, row in rows.items():
        told = [f"{row.found} of {row.changed}", f"{len(row.late)} of {row.changed}"] if row.changed else ["", ""]
        told.append(f"{np.median(row.late):.0f} weeks" if row.late else "")
        print(f"| {kind} | {row.axes} | {row.axes * weeks / 50.0:.1f} | {' | '.join(told)} | {row.false} |")
    print("\n".join(false) or "no false alarm")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--axes", type=int, default=200)
    parser.add_argument("--weeks", type=int, default=50)
    parser.add_argument("--kinds", nargs="+", choices=tuple(KINDS), default=list(KINDS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--damaged", type=float, default=DAMAGED)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--folder", type=Path)
    args = parser.parse_args()
    with nullcontext(args.folder) if args.folder else tempfile.TemporaryDirectory() as folder:
        run(Path(folder), args.axes, args.weeks, args.kinds, args.seed, args.workers, args.damaged)


if __name__ == "__main__":
    main()
