"""How time and memory of the genetic search grow with population, record length, order and threads.

    python bench/scaling.py [--quick]

Every row runs in a process of its own.
Time per generation is the difference between long and short runs of `_core.Experiment.search` (engine "plain",
continuous loop), so that setting up costs nothing; the median run of each.
Processor time, so that a busy machine matters little; where threads are compared, the clock on the wall and the shortest runs,
which want an idle machine: the load is printed.
Each row asserts its answer: the best fitness is the error sum of that candidate's own simulation.
Memory: the process's peak, and what of it the interpreter, numpy, gaident and the record took before the search began.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class Row:
    """What is searched: p and q are ranges; workers are threads, `threaded` where their number is what is compared."""

    title: str
    population: int = 50
    samples: int = 250
    p: tuple[int, int] = (0, 3)
    q: tuple[int, int] = (0, 3)
    arithmetic: str = "double"
    trials: int = 1
    workers: int = 1
    identify: bool = False
    threaded: bool = False
    repeats: int = 7


def of_order(p: int, q: int) -> Row:
    return Row(f"order {1 + p + q}: p = {p}, q = {q}", p=(p, p), q=(q, q))


TABLES: dict[str, list[Row]] = {
    "population": [Row(f"population {n}", population=n) for n in (50, 500, 5000)],
    "record length": [Row(f"{n} samples", samples=n) for n in (250, 2500, 25_000, 250_000, 1_000_000)],
    "order": [of_order(1, 0), of_order(1, 2), of_order(3, 3), of_order(7, 7)],
    "number type": [Row("float", arithmetic="float"), Row("float, population 500", arithmetic="float", population=500)],
}
THREADS: list[Row] = [
    Row("8 trials, 250 samples", trials=8, threaded=True, repeats=50),
    Row("one trial, 25 000 samples", samples=25_000, threaded=True, repeats=50),
    Row("identify(), 25 000 samples", samples=25_000, identify=True, threaded=True, repeats=30),
]


def peak() -> float:
    """Most memory this process ever used, MiB."""
    try:
        with open("/proc/self/status") as status:
            return next(float(line.split()[1]) for line in status if line.startswith("VmHWM")) / 1024.0
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # bytes, where there is no /proc


def record(samples: int):  # type: ignore[no-untyped-def]
    """The paper's two-mass drive, a step for 250 samples and a staircase for more, noise 0.3 rad/s."""
    import numpy as np

    import gaident as ga

    n = np.arange(samples)
    command = np.full(samples, 43.6) if samples <= 250 else 43.6 * ((n // 250) % 3) - 20.0
    pi = ga.PI(0.0232 * 5.5637, 1.367 * 5.5637, loop="continuous")
    model = ga.Model(6545.29, [-15.41, -10.30 + 150.9j, -10.30 - 150.9j], [-4.26 + 93.98j, -4.26 - 93.98j])
    rec = ga.Record(dt=0.444e-3, command=command, velocity=np.zeros(samples))
    w = ga.simulate(model, rec, pi) + 0.3 * np.random.default_rng(1).standard_normal(samples)
    return ga.Record(dt=0.444e-3, command=command, velocity=w), pi


def time_of(call: Callable[[], object], clock: Callable[[], float]) -> float:
    began = clock()
    call()
    return clock() - began


def measure(row: Row) -> dict[str, float]:
    """Seconds per generation (of all trials; of the whole call for identify) and MiB, of this process."""
    import numpy as np

    import gaident as ga
    from gaident import _core
    from gaident.control import core

    rec, pi = record(row.samples)
    before = peak()
    clock = time.perf_counter if row.threaded else time.process_time
    if row.identify:
        found: list[ga.Identification] = []

        def work() -> None:
            found.append(ga.identify(rec, pi, workers=row.workers, seed=1))

        seconds = [time_of(work, clock) for _ in range(row.repeats)]
        assert (found[0].p, found[0].q) == (1, 2), "wrong answer: structure"
        return {"seconds": min(seconds), "peak": peak(), "before": before}

    experiment = core.experiment([core.record(rec.dt, rec.command, rec.velocity, "rest", 0.0)], pi, rec.dt)
    ranges = ga.SearchSpace(p=row.p, q=row.q).ranges(paper=True)

    def search(generations: int) -> list[_core.Trial]:
        settings = ga.Settings(
            code="binary",
            scale="linear",
            engine="plain",
            population=row.population,
            generations=generations,
            arithmetic=row.arithmetic,
        )
        return experiment.search(ranges, settings.engine_settings(), row.trials, 1, row.workers)

    first = search(2)[0]
    K, poles, zeros = _core.decode(first.best, ranges, False, False)
    e = rec.velocity - ga.simulate(ga.Model(K, poles, zeros), rec, pi)
    expected = float(np.sum(e**2)) + 2.0 * len(poles)
    tolerance = 1e-9 if row.arithmetic == "double" else 1e-2
    assert abs(first.best_fitness - expected) <= tolerance * expected, f"wrong answer: {first.best_fitness}, not {expected}"

    estimate = time_of(lambda: search(4), clock) / 4.0
    # Where threads are compared the shortest of many runs counts: it finds a moment in which both processors are free.
    few = 2 if row.threaded else max(2, int(0.01 / estimate))
    many = few + max(2, int((0.05 if row.threaded else 0.1) / estimate))
    pairs = [(time_of(lambda: search(few), clock), time_of(lambda: search(many), clock)) for _ in range(row.repeats)]
    middle = min if row.threaded else statistics.median  # on the wall, whatever else runs can only add
    short, long = (middle(column) for column in zip(*pairs, strict=True))
    return {"seconds": (long - short) / (many - few), "peak": peak(), "before": before}


def in_own_process(row: Row) -> dict[str, float]:
    command = [sys.executable, __file__, "--row", json.dumps(asdict(row))]
    out = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    result: dict[str, float] = json.loads(out)
    return result


def shown(seconds: float) -> str:
    return f"{1e6 * seconds:.4g} us" if seconds < 1e-3 else f"{1e3 * seconds:.4g} ms"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, nothing above 25 000 samples")
    parser.add_argument("--row", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        print(json.dumps(measure(Row(**json.loads(options.row)))))
        return
    repeats = {"repeats": 3} if options.quick else {}
    print("| what | time per generation | ps per candidate and sample | peak memory | of it before the search |")
    print("|---|---|---|---|---|", flush=True)
    for rows in TABLES.values():
        for row in rows:
            if options.quick and row.samples > 25_000:
                continue
            m = in_own_process(Row(**{**asdict(row), **repeats}))
            each = 1e12 * m["seconds"] / (row.population * row.samples)
            print(
                f"| {row.title} | {shown(m['seconds'])} | {each:.0f} | {m['peak']:.1f} MiB | {m['before']:.1f} MiB |", flush=True
            )
    print(f"\nLoad of the machine before the threads' rows: {os.getloadavg()[0]:.1f} (they want 0)")
    print("\n| threads | one | two | gain |\n|---|---|---|---|", flush=True)
    for row in THREADS:
        one, two = (in_own_process(Row(**{**asdict(row), **repeats, "workers": n}))["seconds"] for n in (1, 2))
        print(f"| {row.title} | {shown(one)} | {shown(two)} | {one / two:.2f} |", flush=True)


if __name__ == "__main__":
    main()
