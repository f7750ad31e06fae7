"""Who names the cause? gaident and its peers on the same blind records, judged by the same code.

    pip install .[naming]                       # scikit-learn, PySINDy, SysIdentPy; what is not installed is left out
    python -m venv build/jax-sysid && build/jax-sysid/bin/pip install "jax-sysid>=1.1"     # for the recurrent network
    python bench/naming.py --out naming.jsonl [--cases 1] [--open-cases 1] [--seed 1] [--only NAME ...] [--workers 1]
    python bench/naming.py --out naming.jsonl --report

Records are those of bench/blind.py with a logged torque: clean ones, one effect, two effects, effects outside the library, and
loops of servo drives; --groups takes only some of them.
Thresholds are each method's best on the open set of records (--open-seed) and are reported on the closed one (--seed).
--training records of other seeds teach the classifier first; they stand in --training-file and are drawn once.
Every record x method is a line of the file; stop at will, start again and it goes on.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

# One core per method, also in the linear algebra.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH), *(str(BENCH / folder) for folder in ("naming_peers", "measured"))]
sys.path.insert(0, str(BENCH.parent / "tests" / "python" / "support"))

import numpy as np
from blind import Cell, cells
from boosted import classifiers, train
from case import Case, drawn
from in_the_loop import refitted
from json_lines import read, work
from methods import Method, methods
from naming_tables import chosen_threshold, middle, report

from drive_cases import NOISE_EFFECTS

GROUPS = ("clean", "effects", "pairs", "outside", "loops")
KINDS = ("multi", "move")
"""Records that a second one is held out beside."""
EACH = {"clean": 2, "effects": 1, "pairs": 12, "outside": 2, "loops": 1}
"""Numbers of a group that one case has."""
FORETOLD = ("effects", "pairs", "outside")
"""Groups with something to predict; what only predicts sees no other one."""
LOOPS_TAKEN = 13
"""Of the 96 loops of a number every thirteenth is taken, clean ones and others in turn; each number begins at another one."""
PHASES = ("open", "closed")


def cells_of(group: str, cases: int, seed: int) -> Iterator[Cell]:
    """The cells of a group with a torque that is logged; effects take levels and moves in turn."""
    seen = set()
    for i, cell in enumerate(cells(group, cases * EACH[group], seed)):
        turn = cell.seed + zlib.crc32("".join(cell.effects).encode())
        if cell.loop:
            taken = i % LOOPS_TAKEN == cell.seed % LOOPS_TAKEN
        elif group == "effects":
            taken = cell.kind == KINDS[turn % len(KINDS)]
        else:
            taken = cell.kind in KINDS
        cell = replace(cell, torque=True)
        if taken and cell.key not in seen and not {*cell.effects} & {*NOISE_EFFECTS}:
            seen.add(cell.key)
            yield cell


def answered(cell: Cell, phase: str, name: str, training: Path, threshold: str | None) -> dict[str, Any]:
    """One method on one record, as a line of the file. threshold: for which the names of a regression are fitted in the loop."""
    line: dict[str, Any] = {"key": f"{phase}/{cell.key}/{name}", "phase": phase, "method": name, "cell": asdict(cell)}
    try:
        case = drawn(cell)
    except RuntimeError as none:  # this effect does not act there
        return line | {"impossible": str(none)}
    method = methods(training)[name]
    line |= {"digest": case.digest, "hidden": case.truth.effects, "plant": case.truth.plant.name}
    try:
        found, seconds = case.timed(method.answers)
    except Exception as failure:  # a crash is a result, too
        return line | {"crash": f"{type(failure).__name__}: {failure}"}
    answers = {f"{t:g}": {"judged": a.judged(case.truth.effects), "rmse": a.rmse} for t, a in found.items()}
    line |= {"seconds": seconds, "answers": answers}
    if phase == "closed" and not cell.loop:
        line |= {"before": case.before, "oracle": case.shared("oracle", lambda: case.oracle)}
        if method.refits:
            chosen = threshold or middle([line])
            answers[chosen]["rmse"] = rmse_of_names(case, list(next(a for t, a in found.items() if f"{t:g}" == chosen).effects))
    return line


def rmse_of_names(case: Case, effects: list[str]) -> float:
    """Of the held-out free run of the linear model with these effects, fitted by the library; of the linear model without."""
    return case.shared(f"refit {sorted(effects)}", lambda: _rmse_of_names(case, effects))


def _rmse_of_names(case: Case, effects: list[str]) -> float:
    try:
        model = refitted(case, effects) if effects else None
        return case.before if model is None else case.free_run(model)
    except Exception:  # names that no model can carry together predict nothing
        return float("inf")


def at_hand(wanted: list[str] | None, training: Path) -> dict[str, Method]:
    """The methods that are wanted and installed; one that is only wanted is named with what it needs."""
    found = {}
    for name, method in methods(training).items():
        if wanted and name not in wanted:
            continue
        if method.missing:
            print(f"{name} is left out, it needs {', '.join(method.missing)}", file=sys.stderr)
        else:
            found[name] = method
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/naming.jsonl"), help="JSON lines; what is in it is not run again")
    parser.add_argument("--cases", type=int, default=1, help="of the closed set")
    parser.add_argument("--open-cases", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--open-seed", type=int, default=501)
    parser.add_argument("--groups", nargs="+", choices=GROUPS, default=list(GROUPS))
    parser.add_argument("--only", nargs="+", choices=list(methods(Path())), metavar="NAME", help=", ".join(methods(Path())))
    parser.add_argument("--training", type=int, default=1000, help="records that the classifier learns from")
    parser.add_argument("--training-file", type=Path, default=Path("build/naming_training.npz"))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--report", action="store_true", help="tables only, from what is there")
    options = parser.parse_args()
    if options.seed == options.open_seed:
        parser.error("the open set needs another seed than the closed one")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    everything = methods(options.training_file)
    if not options.report:
        run(options)
    nothing = [name for name, m in everything.items() if not m.named]
    print(report(list(read(options.out).values()), {name: m.lines for name, m in everything.items()}, nothing))


def run(options: argparse.Namespace) -> None:
    """Both sets, the open one first: what is chosen by it decides which names are fitted in the loop."""
    found = at_hand(options.only, options.training_file)
    learnt = options.training_file if "boosted trees" in found else None
    if learnt:
        train(learnt, options.training, options.workers)
    for phase, cases, seed in zip(PHASES, (options.open_cases, options.cases), (options.open_seed, options.seed), strict=True):
        there = read(options.out)
        thresholds: dict[str, str | None] = {}
        for name in found:
            mine = [x for x in there.values() if x["method"] == name and x["phase"] == "open" and "answers" in x]
            thresholds[name] = chosen_threshold(mine)
        named = {name for name, m in found.items() if m.named and name != "gaident.diagnose"}
        jobs = [
            (answered, cell, phase, name, options.training_file, thresholds[name])
            for group in options.groups
            for cell in cells_of(group, cases, seed)
            for name, method in found.items()
            if name in named or (phase == "closed" and (method.named or group in FORETOLD))
        ]
        began = time.perf_counter()
        jobs = [job for job in jobs if f"{job[2]}/{job[1].key}/{job[3]}" not in there]
        work(options.out, jobs, options.workers, initializer=quiet, initargs=(learnt,))
        print(f"{phase} set: {len(jobs)} answers in {time.perf_counter() - began:.0f} s", file=sys.stderr)


def quiet(learnt: Path | None) -> None:
    """In each process: no warnings of the packages, and before any clock runs their imports and what the classifier learns."""
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    for package in ("pysindy", "sklearn.ensemble", "sysidentpy.model_structure_selection"):
        try:
            __import__(package)
        except ImportError:
            continue
    if learnt:
        classifiers(str(learnt), learnt.stat().st_mtime)


if __name__ == "__main__":
    main()
