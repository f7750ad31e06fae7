"""What a row of the policy decides: the same cases with the row at its value, at half of it and at twice.

    python bench/policy.py NAME [...] [--workers 2] [--cases 4] [--seed 5] [--out FILE] [--write]
    python bench/policy.py NAME [...] --report     # from what is in the file; nothing is run
    python bench/policy.py                         # the table of what is in the data of the page

NAME is a row of `gaident.policy.table` that decides, or the kind of cases by which rows are shown: "drives" measures every row
that they show, "all" every row. `--kind` runs other cases than those that a row names.
`--cases` is the count of each combination; which cases a kind contains says bench/rows/cases.py.
`--only` keeps those whose key contains one of some texts: where a case takes minutes, fewer of them.
Every finished case is a line of the file: stop at will, start again and it goes on.
`--write` puts what was measured into the data of docs/theory/policy.md (bench/rows/measured.json); `python docs/tools/policy.py`
writes the page then.

"Half" and "twice" follow from the row's unit (`moved` in bench/rows/watch.py).
Each case runs once with the policy as it is and every row watched:
that tells for each step of each row whether any decision of the case would be another.
Where none would, the result is the same, and the case is not run with it;
else it is run again (not with --ranges), and the two results are compared.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import time
from datetime import date
from multiprocessing import get_context
from pathlib import Path
from typing import Any

# One core per case, also in the linear algebra.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH), str(BENCH / "measured"), str(BENCH.parent / "tests" / "python" / "support")]

# Nothing here imports a module that decides: a process has to put its policy in place before.
from dataclasses import replace

from json_lines import read, work
from rows.tables import MEASURED, merged, report, summary
from rows.watch import Watch, neighbours, watched

from gaident.policy.declared import SHOWN_BY
from gaident.policy.table import Policy, PolicyRow, rows
from gaident.policy.trial import decide_by

WATCH = Watch()
RUNS = ("watched", "moved")
DECIDING = {r.name: r for r in rows() if r.cases}


def prepare(name: str | None, value: float) -> None:
    """What a process does first: the policy with a row at another value, or (no name) the policy itself, watched."""
    decide_by(replace(Policy(), **{name: value}) if name else watched(Policy(), WATCH))


def measure(key: str, case: Any) -> dict[str, Any]:
    """One case under the policy of this process, as a line of the file."""
    from rows.cases import run

    WATCH.clear()
    started = time.process_time()
    line: dict[str, Any] = {"key": key, "case": case.key}
    try:
        found = run(case)
        line |= {"outcome": found.outcome, "said": found.said, "detail": found.detail}
    except Exception as failure:  # a crash is a result, too
        line |= {"outcome": "crash", "said": f"{type(failure).__name__}: {failure}", "detail": ""}
    line["seconds"] = time.process_time() - started
    turned: dict[str, list[float]] = {}
    for name, step in sorted(WATCH.turned):
        turned.setdefault(name, []).append(step)
    return line | {"used": sorted(WATCH.used), "turned": turned}


def key_of(case: Any, name: str | None, value: float) -> str:
    """The key of a line: the policy (another one is another line), the row that is moved, the case."""
    table = hashlib.sha1(repr(Policy()).encode()).hexdigest()[:8]
    return f"{table}/{f'{name}={value:.6g}' if name else 'watched'}/{case.key}"


def measured(row: PolicyRow, cases: list[Any], out: Path, workers: int, runs: tuple[str, ...] = RUNS) -> dict[str, Any]:
    """What a row decides in some cases, of those in the file; first runs those of `runs` that are not there yet."""
    if "watched" in runs:
        _run(out, None, 0.0, cases, workers)
    lines = read(out)
    base = {case.key: lines[key_of(case, None, 0.0)] for case in cases if key_of(case, None, 0.0) in lines}
    found = {}
    for step, value in zip((-1.0, 1.0), neighbours(row), strict=True):
        turned = [c for c in cases if c.key in base and step in base[c.key]["turned"].get(row.name, [])]
        if "moved" in runs:
            _run(out, row.name, value, turned, workers)
        lines = read(out)
        moved = {c.key: lines.get(key_of(c, row.name, value)) for c in turned}
        found[value] = {key: moved.get(key, line) for key, line in base.items()}
    return summary(row, base, found)


def _run(out: Path, name: str | None, value: float, cases: list[Any], workers: int) -> None:
    there = read(out)
    jobs = [(measure, key, case) for case in cases if (key := key_of(case, name, value)) not in there]
    if jobs:
        work(out, jobs, workers, mp_context=get_context("spawn"), initializer=prepare, initargs=(name, value))


def options_of(arguments: list[str] | None = None) -> argparse.Namespace:
    """The options of a call; `rows` are those that it measures."""
    parser = argparse.ArgumentParser(description="what a row of the policy decides", epilog=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("names", nargs="*", metavar="NAME", help="rows of the policy, or kinds: " + ", ".join(SHOWN_BY))
    parser.add_argument("--out", type=Path, default=Path("build/policy.jsonl"), help="JSON lines; what is in it is not run again")
    parser.add_argument("--cases", type=int, default=4)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=5)
    parser.add_argument("--kind", choices=SHOWN_BY, help="other cases than those that the row names")
    parser.add_argument("--only", nargs="+", default=[""], metavar="TEXT", help="cases whose key contains one of these texts")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--ranges", action="store_true", help="only the watched run: in which range no decision changes")
    which.add_argument("--report", action="store_true", help="run nothing: from what is there")
    parser.add_argument("--write", action="store_true", help="put the result into bench/rows/measured.json")
    options = parser.parse_args(arguments)
    unknown = [n for n in options.names if n not in DECIDING and n not in (*SHOWN_BY, "all")]
    if unknown:
        parser.error(f"{', '.join(unknown)}: no row that decides, and no kind of cases; rows: {', '.join(DECIDING)}")
    options.rows = [r for r in DECIDING.values() if {r.name, r.cases, "all"} & set(options.names)]
    return options


def main() -> None:
    options = options_of()
    if not options.rows:
        print(report(merged([])))
        return
    from rows.cases import cases

    options.out.parent.mkdir(parents=True, exist_ok=True)
    found = []
    for row in options.rows:
        kind = options.kind or row.cases
        of_row = [c for c in cases(kind, options.cases, options.seed) if any(text in c.key for text in options.only)]
        told = {"date": date.today().isoformat(), "kind": kind, "each": options.cases, "seed": options.seed}
        told |= {"only": options.only} if any(options.only) else {}
        runs = () if options.report else RUNS[:1] if options.ranges else RUNS
        found.append({"name": row.name} | told | measured(row, of_row, options.out, options.workers, runs))
        print(report([found[-1]], head=row is options.rows[0]), flush=True)
    if options.write:
        MEASURED.write_text(json.dumps(merged(found), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
