"""Small logs of several axes, what a run over them leaves, and a worker that ends its process."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import numpy as np

import gaident as ga
from gaident.fleets.task import Job, Outcome

__all__ = ["content", "children", "fatal", "write_log", "write_logs"]

DT = 1e-3


def write_log(path: Path, seed: int, inertia: float = 0.01, temperature: float = 30.0) -> None:
    """An axis under known torques, without a controller: a second of work."""
    torque = np.repeat([1.0, -1.0, 0.5, -0.5], 60)
    still = ga.Record(DT, torque=torque, velocity=0.0 * torque)
    velocity = ga.simulate(ga.OneMass(J=inertia, D=0.05), still) + 0.05 * np.random.default_rng(seed).standard_normal(240)
    path.parent.mkdir(parents=True, exist_ok=True)
    table = np.column_stack([still.time, torque, velocity, np.full(240, temperature)])
    np.savetxt(path, table, delimiter=",", header="time,torque,velocity,heat", comments="")


def write_logs(folder: Path, days: int = 3) -> None:
    """Two axes, so many days of each, and a damaged log."""
    for k, axis in enumerate(("x", "y")):
        for day in range(1, days + 1):
            write_log(folder / axis / f"2026-0{1 + day // 3}-{10 + day}.csv", 10 * k + day, 0.01 + 0.01 * k)
    (folder / "y" / "2026-01-20.csv").write_text("time,torque,velocity,heat\n0,1,2\n1,no,3\n")


def content(out: Path) -> dict[str, object]:
    """Every file of a dataset, its bytes, and of a JSON what it says but for the time that it took."""
    found: dict[str, object] = {}
    for file in sorted(f for f in out.rglob("*") if f.suffix in (".parquet", ".csv", ".json")):
        name = file.relative_to(out).as_posix()
        found[name] = file.read_bytes() if file.suffix != ".json" else _timeless(json.loads(file.read_text()))
    return found


def _timeless(data: object) -> object:
    if isinstance(data, dict):
        return {k: _timeless(v) for k, v in data.items() if k != "seconds"}
    return [_timeless(v) for v in data] if isinstance(data, list) else data


def children(pid: int) -> list[int]:
    """Processes whose parent is this one, those that a tracker of resources is not."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                parent = int((folder / "stat").read_text().rsplit(")", 1)[1].split()[1])
                command = (folder / "cmdline").read_bytes()
            except OSError:
                continue
            if parent == pid and b"spawn_main" in command:
                found.append(int(folder.name))
    return found


def fatal(job: Job) -> Outcome:
    """Work that ends its process with the log "fatal"."""
    if job.log == "fatal":
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(job.log, job.key, "done")
