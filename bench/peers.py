"""Peers beside gaident, in one run on one core: time per generation, and time to the optimum.

    pip install .[peers]
    python bench/peers.py [--quick] [--seeds 10] [--limit 20] [--only NAME ...]

Every row asserts its answer: the error sum that a peer reports for its best candidate is the one that SciPy computes
independently, in state space. What the peers are given stands in peer_problem.py, how each is called in peer_runs.py.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).resolve().parent / "packages"))

import argparse
import importlib.metadata
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import peer_numba
import peer_runs
from peer_problem import BITS, Fitness, Problem, Reached, independent_error, problem, scipy_error
from success import DT

import gaident as ga
from gaident import _core
from gaident.control import core

PACKAGES = {
    "whole GA in numba": "numba",
    "SciPy least squares, many starts": "scipy",
    "DEAP": "deap",
    "PyGAD": "pygad",
    "pymoo": "pymoo",
    "pygmo": "pygmo",
    "SciPy differential evolution": "scipy",
    "CMA-ES": "cma",
}
RECORDS = ("two masses (paper)", "hard")
POPULATION = peer_runs.POPULATION
ORDER_WEIGHT = 2.0


def label(name: str) -> str | None:
    """Peer with package and version; None where it is not installed."""
    try:
        found = importlib.metadata.version(PACKAGES[name])
    except importlib.metadata.PackageNotFoundError:
        return None
    return f"{name} {found}" if name.lower() == PACKAGES[name] else f"{name} ({PACKAGES[name]} {found})"


def compiled(p: Problem) -> tuple:
    """What the numba functions take after the candidates."""
    c = p.case
    return p.ranges(), p.logarithmic, (DT, c.controller.kp, c.controller.ki), c.command, p.output


def check(p: Problem, K: float, A: list, B: list, claimed: float, tolerance: float = 1e-6) -> None:
    """The claimed error sum is what SciPy finds another way."""
    found = independent_error(p.case, p.output, K, A, B)
    assert abs(claimed - found) <= tolerance * found, f"wrong answer: error sum {claimed!r}, independently {found!r}"


def median_of(seconds: list[float]) -> str:
    return f"{1e6 * float(np.median(seconds)):.3g} [{1e6 * min(seconds):.3g}, {1e6 * max(seconds):.3g}]"


# Time per generation


def on_bits(p: Problem, fast: bool) -> Fitness:
    def one(x: np.ndarray) -> float:
        K, A, B = p.from_bits(x)
        return scipy_error(p.case, p.output, K, A, B) + ORDER_WEIGHT * len(A)

    if not fast:
        return Fitness(one)
    args = compiled(p)
    return Fitness(
        lambda x: peer_numba.costs_of_bits(np.asarray(x, dtype=np.uint8).reshape(1, BITS), *args)[0],
        lambda X: peer_numba.costs_of_bits(np.asarray(X, dtype=np.uint8), *args),
    )


def on_numbers(p: Problem, fast: bool = True, **until: object) -> Fitness:
    if not fast:
        return Fitness(lambda x: scipy_error(p.case, p.output, *p.from_numbers(x)), **until)
    args = compiled(p)
    return Fitness(
        lambda x: peer_numba.error_of_numbers(np.asarray(x), *args),
        lambda X: peer_numba.errors_of_numbers(np.asarray(X), *args),
        **until,
    )


def peer_generation(name: str, p: Problem, fast: bool, generations: int, repeats: int) -> str:
    bits = peer_runs.PER_GENERATION[name].__name__.startswith("bits")
    make = on_bits if bits else on_numbers
    peer_runs.PER_GENERATION[name](make(p, fast), 2, 0)  # warm
    seconds = []
    for seed in range(repeats):
        fitness = make(p, fast)
        began = time.perf_counter()
        peer_runs.PER_GENERATION[name](fitness, generations, seed)
        seconds.append((time.perf_counter() - began) / fitness.evaluations * POPULATION)
        K, A, B = (p.from_bits if bits else p.from_numbers)(fitness.x)
        # In powers of z, as SciPy's lfilter needs them, the longest models lose digits.
        check(p, K, A, B, fitness.best - (ORDER_WEIGHT * len(A) if bits else 0.0), 1e-6 if fast else 1e-3)
    return median_of(seconds)


def numba_generation(p: Problem, generations: int, repeats: int) -> str:
    free, best, args = np.array([-1, -1]), np.zeros(21, np.int64), compiled(p)
    seconds = []
    for seed in range(repeats + 1):
        people = peer_numba.fields_of_bits(np.random.default_rng(seed).integers(0, 2, (POPULATION, BITS)))
        began = time.perf_counter()
        cost = peer_numba.genetic(seed, people, generations, free, *args, best)
        seconds.append((time.perf_counter() - began) / (generations + 1))
        K, A, B = p.from_bits(bits_of(best))
        check(p, K, A, B, cost - ORDER_WEIGHT * len(A))
    return median_of(seconds[1:])


def bits_of(fields: np.ndarray) -> np.ndarray:
    return (fields[peer_numba.FIELD_OF_BIT] >> peer_numba.SHIFT_OF_BIT) & 1


def our_generation(p: Problem, arithmetic: str, generations: int, repeats: int) -> str:
    settings = ga.Settings(code="binary", scale="linear", engine="plain", generations=generations, arithmetic=arithmetic)
    pi = p.case.controller
    experiment = core.experiment([core.record(DT, p.case.command, p.output, "rest", 0.0)], pi, DT)
    seconds = []
    for seed in range(repeats + 1):
        began = time.perf_counter()
        trial = experiment.search(p.space.ranges(paper=True), settings.engine_settings(), 1, seed, 1)[0]
        seconds.append((time.perf_counter() - began) / trial.evaluations * POPULATION)
        K, poles, zeros = _core.decode(trial.best, p.space.ranges(paper=True), False, False)
        claimed = trial.best_fitness - ORDER_WEIGHT * len(poles)
        check(p, K, list(-poles), list(-zeros), claimed, 1e-3 if arithmetic == "float" else 1e-9)
    return median_of(seconds[1:])


def generation_table(options: argparse.Namespace) -> None:
    p = problem(RECORDS[0], 0)
    repeats, slow, fast = (3, 5, 200) if options.quick else (9, 20, 2000)
    print(
        f"\nTime per generation: population {POPULATION}, 250 samples, everything included; median [min, max] of {repeats} runs"
    )
    print("\n| who | candidate | fitness | us per generation |\n|---|---|---|---|", flush=True)
    for arithmetic in ("double", "float"):
        print(f"| gaident | 194 bits | {arithmetic} | {our_generation(p, arithmetic, fast, repeats)} |", flush=True)
    if wanted(options, "whole GA in numba"):
        print(
            f"| {label('whole GA in numba')} | 194 bits | numba, double, fastmath | {numba_generation(p, fast, repeats)} |",
            flush=True,
        )
    for name, call in peer_runs.PER_GENERATION.items():
        if not at_hand(options, name):
            continue
        coded = "194 bits" if call.__name__.startswith("bits") else "6 numbers, structure given"
        for numba in (False, True):
            row = peer_generation(name, p, numba, 4 * slow if numba else slow, repeats)
            print(f"| {label(name)} | {coded} | {'numba' if numba else 'SciPy lfilter'} | {row} |", flush=True)


# Time to the optimum


@dataclass
class Outcome:
    """One run: seconds until the optimum was reached (or given up), and evaluations of the error sum, where counted."""

    right: bool
    seconds: float
    evaluations: int = 0


def limit_reached(p: Problem) -> Callable[[np.ndarray], bool]:
    """Whether six numbers are the optimum: rms(response - noise-free truth) below success.py's limit."""
    args = compiled(p)[:-1]
    largest = (p.case.limit * p.case.noise) ** 2 * len(p.truth)

    def reached(x: np.ndarray) -> bool:
        e = peer_numba.response_of_numbers(x, *args) - p.truth
        return float(e @ e) < largest

    return reached


def peer_run(call: Callable[[Fitness, int], None], p: Problem, seed: int, limit: float) -> Outcome:
    fitness = on_numbers(p, until=limit_reached(p), seconds=limit)
    began = time.perf_counter()
    try:
        restart = 0
        while True:
            call(fitness, 1 + seed + 1000 * restart)
            restart += 1
    except Reached:
        pass
    outcome = Outcome(fitness.reached, time.perf_counter() - began, fitness.evaluations)
    check(p, *p.from_numbers(fitness.x), fitness.best)
    return outcome


def least_squares_starts(fitness: Fitness, seed: int, p: Problem) -> None:
    """One start of scipy.optimize.least_squares at a random point of the ranges; restarted by peer_run."""
    from scipy.optimize import least_squares

    args = compiled(p)

    def residual(x: np.ndarray) -> np.ndarray:
        fitness.one(x)
        e = p.output - peer_numba.response_of_numbers(x, *args[:-1])
        return np.nan_to_num(np.clip(e, -1e6, 1e6))

    start = np.random.default_rng(seed).random(peer_runs.NUMBERS)
    least_squares(residual, start, bounds=(0.0, 1.0), x_scale="jac", max_nfev=60)


def numba_run(p: Problem, seed: int, limit: float) -> Outcome:
    """The GA in numba, with the structure given too; looked at every 50 generations."""
    people = peer_numba.fields_of_bits(np.random.default_rng(seed).integers(0, 2, (POPULATION, BITS)))
    fields, given, args = np.zeros(21, np.int64), np.array([1, 2]), compiled(p)
    people[:, :2] = given
    best = np.inf
    began = time.perf_counter()
    largest = (p.case.limit * p.case.noise) ** 2 * len(p.truth)
    for turn in range(10**9):
        cost = peer_numba.genetic(seed + 1000 * turn, people, 50, given, *args, fields)
        if cost < best:
            best = cost
            K, A, B = p.from_bits(bits_of(fields))
            w = ga.simulate(ga.Model(K, [-a for a in A], [-b for b in B]), p.record, p.case.controller)
            right = float(np.sum((w - p.truth) ** 2)) < largest
            if right or turn == 0:
                check(p, K, A, B, cost - ORDER_WEIGHT * len(A))
            if right:
                return Outcome(True, time.perf_counter() - began, 51 * POPULATION * (turn + 1))
        if time.perf_counter() - began > limit:
            return Outcome(False, time.perf_counter() - began, 51 * POPULATION * (turn + 1))
    raise AssertionError


def our_run(p: Problem, seed: int, structure_given: bool) -> Outcome:
    from dataclasses import replace

    space = replace(p.space, p=(1, 1), q=(2, 2)) if structure_given else p.space
    began = time.perf_counter()
    idn = ga.identify(p.record, p.case.controller, space=space, seed=seed, workers=1)
    seconds = time.perf_counter() - began
    m = idn.model
    check(p, m.gain, [-r for r in m.poles], [-r for r in m.zeros], float(np.sum(idn.residual(p.record) ** 2)))
    deviation = float(np.sqrt(np.mean((idn.simulate(p.record) - p.truth) ** 2)))
    return Outcome((idn.p, idn.q) == (1, 2) and deviation < p.case.limit * p.case.noise, seconds)


def optimum_row(who: str, run: Callable[[Problem, int, float], Outcome], record: str, seeds: int, limit: float) -> None:
    run(problem(record, 999), 999, 0.2)  # warm: compiles, imports
    found = [run(problem(record, k), k, limit) for k in range(seeds)]
    right = [o for o in found if o.right]
    times = [1e3 * (o.seconds if o.right else np.inf) for o in found]
    middle, low, high = float(np.median(times)), min(times), max(times)
    counts = [o.evaluations for o in found if o.evaluations]
    shown = ["not reached" if not np.isfinite(t) else f"{t:.3g}" for t in (middle, low, high)]
    print(
        f"| {who} | {len(right)} of {seeds} | {shown[0]} [{shown[1]}, {shown[2]}] | "
        f"{f'{float(np.median(counts)):.3g}' if counts else ''} |",
        flush=True,
    )


def optimum_table(options: argparse.Namespace, record: str) -> None:
    p, how = problem(record, 0), (options.seeds, options.limit)
    K, re, im = p.ranges()
    print(
        f"\nTime to the optimum, record {record!r}: K {K[0]:.4g}..{K[1]:.4g}, real parts {re[0]:.4g}..{re[1]:.4g}, "
        f"imaginary parts {im[0]:.4g}..{im[1]:.4g} rad/s; {options.seeds} seeds, at most {options.limit:g} s each"
    )
    print("\n| who | right | ms, median [min, max] | evaluations |\n|---|---|---|---|", flush=True)
    optimum_row("gaident.identify, structure searched", lambda p, k, _: our_run(p, k, False), record, *how)
    optimum_row("gaident.identify, structure given", lambda p, k, _: our_run(p, k, True), record, *how)
    runs: dict[str, Callable[[Problem, int, float], Outcome]] = {
        "whole GA in numba": numba_run,
        "SciPy least squares, many starts": lambda p, k, limit: peer_run(
            lambda f, seed: least_squares_starts(f, seed, p), p, k, limit
        ),
    }
    for name, call in peer_runs.ON_NUMBERS.items():
        runs[name] = lambda p, k, limit, call=call: peer_run(call, p, k, limit)
    for name, run in runs.items():
        if not at_hand(options, name):
            continue
        optimum_row(label(name), run, record, *how)


def wanted(options: argparse.Namespace, name: str) -> bool:
    return not options.only or name in options.only


def at_hand(options: argparse.Namespace, name: str) -> bool:
    """Whether a library is wanted and installed; one that is only wanted gets a row that says so."""
    if not wanted(options, name):
        return False
    if label(name) is None:
        print(f"| {name} | not installed (`pip install .[peers]`; pygmo has wheels for Linux only) | | |")
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a short run: 2 seeds, 2 s each, few generations")
    parser.add_argument("--seeds", type=int, help="runs per row of the time to the optimum (10)")
    parser.add_argument("--limit", type=float, help="seconds after which a run is given up (20)")
    parser.add_argument("--only", nargs="*", metavar="NAME", help=f"peers, from: {', '.join(PACKAGES)}")
    parser.add_argument("--table", choices=("generation", "optimum"), help="one of the two")
    options = parser.parse_args()
    options.seeds = options.seeds or (2 if options.quick else 10)
    options.limit = options.limit or (2.0 if options.quick else 20.0)
    versions = ", ".join(f"{n} {importlib.metadata.version(n)}" for n in ("numpy", "scipy", "numba"))
    kernels = core.experiment([core.record(DT, np.ones(20), np.ones(20), "rest", 0.0)], None, DT).kernels
    print(f"gaident {ga.__version__} ({kernels}), {versions}; one thread")
    if options.table != "optimum":
        generation_table(options)
    if options.table != "generation":
        for record in RECORDS:
            optimum_table(options, record)


if __name__ == "__main__":
    main()
