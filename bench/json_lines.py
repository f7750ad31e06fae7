"""Results as JSON lines: every finished case is a line of a file, and what is in it is not run again."""

from __future__ import annotations

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Lines by their key; a last line that was cut off is dropped."""
    lines = {}
    for text in path.read_text().splitlines() if path.exists() else []:
        try:
            line = json.loads(text)
        except json.JSONDecodeError:
            continue
        lines[line["key"]] = line
    return lines


def work(path: Path, jobs: list[tuple[Any, ...]], workers: int, **pool: Any) -> None:
    """Run jobs (function, arguments ...) and write each result as it comes; `pool`: what its processes are started with."""
    started = time.perf_counter()
    cut_off = path.exists() and not path.read_text().endswith("\n") and path.stat().st_size > 0
    with path.open("a") as out, ProcessPoolExecutor(workers, **pool) as processes:
        out.write("\n" if cut_off else "")
        waiting = [processes.submit(*job) for job in jobs]
        try:
            for done, future in enumerate(as_completed(waiting), 1):
                out.write(json.dumps(future.result()) + "\n")
                out.flush()
                if sys.stderr.isatty():
                    print(f"\r{done} of {len(jobs)}, {time.perf_counter() - started:.0f} s", end="", file=sys.stderr)
        except KeyboardInterrupt:
            processes.shutdown(wait=False, cancel_futures=True)
            print(f"\ninterrupted; what is done stands in {path}", file=sys.stderr)
