"""Text tables with known values, in random dialects and with faults, are read as they are or refused, never wrongly.

    python tests/fuzz/oracle.py --cases 100000        the long form
    python tests/fuzz/oracle.py --only 4711           one case: the file, what must come of it, what came of it

The exit code is 1 where a case is read wrongly, is read and must not be, or is refused and must be read; and where none was
tried.
"""

from __future__ import annotations

import argparse
import math
import os
import sys
import tempfile
import time
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import chain, repeat
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from tables import Case, case

import gaident as ga
from gaident.data.formats import delimited

PART = 200  # cases that a process takes at once


def judged(given: Case, path: Path) -> tuple[str, str]:
    """(read, refused, noted or unknown; what is wrong, "" if nothing is)."""
    path.write_bytes(given.content)
    delimited.WHOLE, delimited.ROWS = (0, 16) if given.blocks else (1 << 25, 8192)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            rec = ga.read(path, given.columns, dt=given.dt)
    except ga.GaidentError as error:
        return "refused", f"refused: {error}" if given.must == "read" else ""
    if given.must == "noted":
        return "noted", "" if any("may be cut" in str(note) for note in rec.notes) else f"read without a word: {rec!r}"
    if given.must == "unknown":
        return "unknown", ""
    if given.must == "refuse":
        return "read", f"read without a word: {rec!r}"
    if abs(rec.dt - given.step) > 1e-6 * given.step:
        return "read", f"dt is {rec.dt}, not {given.step}"
    for channel, values in given.values.items():
        found = getattr(rec, channel)
        if found is None or found.shape != values.shape:
            return "read", f"{channel} has {None if found is None else found.shape} values, not {values.shape}"
        apart = np.flatnonzero(np.abs(found - values) > 1e-12 * np.abs(values))
        if apart.size:
            k = int(apart[0])
            return "read", f"{channel} is {found[k]!r} at {k}, not {values[k]!r}, and differs at {apart.size} places"
    return "read", ""


def part(seed: int, start: int, stop: int) -> list[tuple[int, str, str, str]]:
    """(number, fault, what became of it, what is wrong) of some cases."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(start, stop):
            given = case(seed, number)
            became, wrong = judged(given, Path(folder) / "log.csv")
            found.append((number, str(given.what["fault"]), became, wrong))
    return found


def only(seed: int, number: int) -> int:
    """Show one case."""
    given = case(seed, number)
    print(given.what, given.columns, f"must: {given.must}", sep="\n")
    print(given.content.decode(str(given.what["encoding"]), "replace"))
    with tempfile.TemporaryDirectory() as folder:
        print(*judged(given, Path(folder) / "log.csv"))
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=5000, help="how many (%(default)s)")
    parser.add_argument("--minutes", type=float, default=math.inf, help="how long at most (no limit)")
    parser.add_argument("--seed", type=int, default=1, help="another seed makes other cases (%(default)s)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (%(default)s)")
    parser.add_argument("--only", type=int, metavar="NUMBER", help="one case, with its file")
    parser.add_argument("--shown", type=int, default=40, help="how many that are wrong are listed (%(default)s)")
    given = parser.parse_args()
    if given.only is not None:
        return only(given.seed, given.only)
    starts = range(0, given.cases, PART)
    stops = [min(start + PART, given.cases) for start in starts]
    counts: Counter[tuple[str, str]] = Counter()
    flawed: list[int] = []
    until = time.monotonic() + 60.0 * given.minutes
    with ProcessPoolExecutor(given.workers) as pool:
        for first in range(0, len(starts), 4 * given.workers):
            if time.monotonic() > until:
                break
            taken = slice(first, first + 4 * given.workers)
            answers = pool.map(part, repeat(given.seed), starts[taken], stops[taken])
            for number, fault, became, wrong in chain.from_iterable(answers):
                counts[fault, became] += 1
                if wrong:
                    flawed.append(number)
                    if len(flawed) <= given.shown:
                        print(f"case {number} ({fault}): {wrong[:300]}", flush=True)
    print(f"{'fault':8} {'read':>8} {'refused':>8} {'noted':>8} {'cannot be known':>16}")
    for fault in sorted({f for f, _ in counts}):
        print(
            f"{fault:8}",
            *(f"{counts[fault, became]:8}" for became in ("read", "refused", "noted")),
            f"{counts[fault, 'unknown']:16}",
        )
    print(f"{counts.total()} cases of seed {given.seed}: {len(flawed)} wrong")
    return 1 if flawed or not counts else 0


if __name__ == "__main__":
    sys.exit(main())
