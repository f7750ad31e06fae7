"""Fleets: false alarms, recall and delay of changes; a small fleet of real diagnoses; speed and memory.

    python bench/fleets/fleet.py courses 400          so many simulated axis-years of each kind of course, daily logs
    python bench/fleets/fleet.py drives 6             so many simulated axes with 40 logs each, diagnosed, one of them changed
    python bench/fleets/fleet.py speed 24             so many logs one after the other, and by 1 and 2 processes
    python bench/fleets/fleet.py speed 10000 --method identify --seconds 3.5        longer logs, identified
    python bench/fleets/fleet.py memory 3000          so many tasks that are done at once: what the parent keeps of each

Figures stand in bench/README.md. --workers N bounds the processes.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(HERE), str(HERE.parent / "tests" / "python" / "support")]

from rows.made.courses import DAYS, KINDS_OF_COURSE, course_of  # noqa: E402

import gaident as ga  # noqa: E402
from drive_rig import Noise, Plant, rig  # noqa: E402
from gaident.fleets.changes import Scale, shifts_of  # noqa: E402

PLANT = Plant(J=3e-4, D=2e-3, kp=0.03, ki=1.9, dt=1e-3)
COMMAND = np.repeat([60.0, -80.0, 30.0, -15.0, 45.0, -45.0], 80)
DRAWN = 100  # logs that are simulated, of those whose speed is measured


def followed(kind: str, seed: int) -> tuple[str, int, int, int]:
    """(kind, false alarms, days from the change to its alarm, -1 for none, days that count for false alarms)."""
    values, deviations, temperature, at = course_of(kind, seed)
    y, s = Scale.of_course(values)(values, deviations)
    found = [shift.found for shift in shifts_of(y, s, temperature)]
    if at < 0:
        return kind, len(found), -1, DAYS
    begun = at - 60 if kind == "drift" else at
    late = [f - at for f in found if f >= begun]
    return kind, sum(f < begun for f in found), max(late[0], 0) if late else -1, begun


def courses(count: int, workers: int) -> None:
    print(f"{'course':12} {'false alarms':>14} {'axis-years':>11} {'within 21 days':>15} {'median delay':>13}")
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for kind in KINDS_OF_COURSE:
            found = list(pool.map(followed, repeat(kind, count), range(count), chunksize=10))
            years = sum(days for *_, days in found) / DAYS
            delays = [d for _, _, d, _ in found]
            changed = "step" in kind or kind == "drift"
            share = f"{100.0 * sum(0 <= d <= 21 for d in delays) / count:.1f} %" if changed else ""
            median = f"{np.median([d for d in delays if d >= 0]):.0f} days" if changed else ""
            print(f"{kind:12} {sum(f for _, f, _, _ in found):14} {years:11.0f} {share:>15} {median:>13}", flush=True)


def simulated(friction: float, seed: int, command: np.ndarray = COMMAND) -> ga.Record:
    effects = {"coulomb_friction": {"torque": friction}} if friction else {}
    return rig(PLANT, command, effects, noise=Noise(white=0.1), seed=seed)


def write_log(path: Path, friction: float, seed: int) -> None:
    written(path, simulated(friction, seed))


def written(path: Path, rec: ga.Record) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    table = zip(rec.time.tolist(), rec.command.tolist(), rec.velocity.tolist(), rec.torque.tolist(), strict=True)
    path.write_text("time,command,velocity,torque\n" + "".join(f"{t!r},{r!r},{w!r},{u!r}\n" for t, r, w, u in table))


def drives(count: int, workers: int) -> None:
    """Axes of one type, 40 logs each; dry friction that scatters by 3 %; the first grows by 20 % on day 30; 2 % damaged."""
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        damaged = 0
        for k in range(count):
            level = 0.05 * np.exp(0.1 * rng.standard_normal())
            for day in range(40):
                step = 1.2 if k == 0 and day >= 30 else 1.0
                month, of = divmod(day, 28)
                path = Path(folder) / "logs" / f"axis{k}" / f"2026-{month + 1:02d}-{of + 1:02d}.csv"
                write_log(path, level * step * float(np.exp(0.03 * rng.standard_normal())), 100 * k + day)
                if rng.random() < 0.02:
                    damaged += 1
                    path.write_text(path.read_text()[:3000] + "\n,,,\nx")
        found = ga.fleet(f"{folder}/logs/*/*.csv", ga.PI(PLANT.kp, PLANT.ki), out=f"{folder}/fleet", quick=True, workers=workers)
        print(found.summary().splitlines()[0], f"({damaged} damaged)")
        shown = ga.trends(f"{folder}/fleet")
        print(shown.summary())
        values = [p for p in found.rows("parameters") if p["parameter"] in ("inertia", "viscous_friction", "dry_friction")]
        for name in ("inertia", "viscous_friction", "dry_friction"):
            own = [p for p in values if p["parameter"] == name and p["of"] != "regression" and p["value"]]
            stds = np.median([p["std"] / abs(p["value"]) for p in own])
            spread = np.median(
                [np.std([np.log(abs(p["value"])) for p in own if p["axis"] == a]) for a in {p["axis"] for p in own}]
            )
            print(f"{name}: {len(own)} values, deviation {100 * stds:.2f} %, scatter from log to log {100 * spread:.2f} %")


def speed(count: int, method: str, seconds: float) -> None:
    """The same logs by single calls in this process, and by ga.fleet with 1 and 2 processes; memory of the parent.

    Logs of so many seconds, on one core each; DRAWN of them are simulated, the others are these with more noise, no two alike.
    Some DRAWN of them are called singly, before and after each run: machines are noisy.
    """
    controller = ga.PI(PLANT.kp, PLANT.ki)

    def call(log: Path, saved: bool = False) -> None:
        rec = ga.read(log)
        identified = method == "identify"
        found = ga.identify(rec, controller, workers=1) if identified else ga.diagnose(rec, controller, quick=True)
        if saved:
            found.save(log.with_suffix(".json"))

    with tempfile.TemporaryDirectory() as folder:
        logs = [Path(folder) / "logs" / f"axis{k % 20:02d}" / f"{k:05d}.csv" for k in range(count)]
        long = np.resize(COMMAND, round(seconds / PLANT.dt))
        friction = 0.0 if method == "identify" else 0.05
        drawn = [simulated(friction, k, long) for k in range(min(count, DRAWN))]
        for k, log in enumerate(logs):
            rec = drawn[k % len(drawn)]
            more = 0.0 if k < len(drawn) else 0.01 * np.random.default_rng(k).standard_normal(len(rec))
            written(log, rec.with_channels(velocity=rec.velocity + more))
        call(logs[0])

        def singly(when: str) -> None:
            some, rates = logs[:: max(count // DRAWN, 1)], []
            for saved in (False, True):
                began = time.perf_counter()
                for log in some:
                    call(log, saved)
                rates.append(len(some) / (time.perf_counter() - began))
            print(f"single calls {when}: {rates[0]:.3f} logs/s, {rates[1]:.3f} with the result saved", flush=True)

        print(f"{count} logs of {len(long)} samples, {method}")
        singly("before")
        for workers in (1, 2):
            code = f"import bench_speed as b; b.run({folder!r}, {workers}, {method!r})"
            script = Path(folder) / "bench_speed.py"
            script.write_text(RUN)
            again = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
            print(again.stdout.strip(), flush=True)
            singly(f"after {workers}")


RUN = f"""
import resource, time
import gaident as ga

def run(folder, workers, method):
    began = []
    def told(done, message):
        began.append(time.perf_counter())
    how = dict(quick=True) if method == "diagnose" else dict()
    found = ga.fleet(f"{{folder}}/logs/*/*.csv", ga.PI({PLANT.kp}, {PLANT.ki}), out=f"{{folder}}/{{workers}}", method=method,
                     workers=workers, progress=told, **how)
    # From the first result on: processes that start are no work on logs.
    rate = (len(began) - 1) / (began[-1] - began[0])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{{workers}} processes: {{rate:.3f}} logs/s, {{found.failed}} failed, parent {{peak:.0f}} MB")
"""


def memory(count: int) -> None:
    """Peak memory of a parent whose tasks are done at once: what it keeps of each log."""
    from gaident.fleets import fleet as _  # noqa: F401
    from gaident.fleets.task import Outcome

    def at_once(work: object, jobs: list[object]) -> list[Outcome]:
        return [Outcome(j.log, j.key, "done", "", 1.0, {"verdict": "adequate"}, (), "{}") for j in jobs]  # type: ignore[attr-defined]

    with tempfile.TemporaryDirectory() as folder:
        for k in range(count):
            path = Path(folder) / "logs" / f"x{k % 20}" / f"2026-{1 + k % 12:02d}-01T{k % 24:02d}-{k % 60:02d}_{k}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(str(k))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        began = time.perf_counter()
        ga.fleet(f"{folder}/logs/*/*.csv", out=f"{folder}/out", executor=at_once)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        rate = count / (time.perf_counter() - began)
        print(f"{count} logs: parent {before:.0f} -> {peak:.0f} MB, {rate:.0f} logs/s at most by the parent")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("courses", "drives", "speed", "memory"))
    parser.add_argument("count", nargs="?", type=int, default=100)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--method", choices=("diagnose", "identify"), default="diagnose", help="of speed")
    parser.add_argument("--seconds", type=float, default=0.48, help="of speed: length of a log")
    args = parser.parse_args()
    if args.what == "courses":
        courses(args.count, args.workers)
    elif args.what == "drives":
        drives(args.count, args.workers)
    elif args.what == "memory":
        memory(args.count)
    else:
        speed(args.count, args.method, args.seconds)


if __name__ == "__main__":
    main()
