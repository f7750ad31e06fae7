"""How time and memory of identify() or diagnose() grow with the record's length.

    python bench/long_records.py [--samples N ...]        # GAIDENT_DATA=... for the six runs of a measured servo motor
    python bench/long_records.py --diagnose [--samples N ...]

Each row in a process of its own: the least of several runs (others on the machine can only add), of one diagnosis; the peak of
memory is during the first one, above what stood before it (Linux).
Every row asserts its structure, a diagnosis the friction that is hidden in its record.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import gaident as ga

DT = 0.444e-3
CONTROLLER = ga.PI(0.116, 6.8)
DRIVE = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model()
FRICTION = 0.05  # N m
MOTOR = "the motor's six runs"


def record(samples: int) -> ga.Record:
    """A staircase of 500 samples a stair, white noise of 0.1 rad/s."""
    rng = np.random.default_rng(0)
    command = np.repeat(rng.uniform(-40.0, 40.0, samples // 500), 500)
    w = ga.simulate(DRIVE, ga.Record(dt=DT, command=command, velocity=np.zeros(samples)), CONTROLLER)
    return ga.Record(dt=DT, command=command, velocity=w + 0.1 * rng.standard_normal(samples))


def with_friction(samples: int) -> ga.Record:
    """The same with dry friction, and a controller that reads the noise, too."""
    rng = np.random.default_rng(0)
    command, noise = np.repeat(rng.uniform(-40.0, 40.0, samples // 500), 500), 0.1 * rng.standard_normal(samples)
    drive = DRIVE.with_effect("coulomb_friction", torque=FRICTION)
    run = ga.run(drive, ga.Record(dt=DT, command=command - noise, velocity=noise), CONTROLLER)
    return ga.Record(dt=DT, command=command, velocity=run.velocity + noise, torque=run.torque)


def motor_runs() -> list[ga.Record]:
    logs = sorted((Path(os.environ["GAIDENT_DATA"]) / "hsm150").glob("*.mat"))
    return [ga.read(log, columns={"velocity": "data[:,3]", "torque": "data[:,4]", "time": "data[:,0]"}) for log in logs]


def mebibytes(field: str) -> float:
    """A field of /proc/self/status; NaN elsewhere than on Linux."""
    status = Path("/proc/self/status")
    if not status.exists():
        return float("nan")
    return next(float(line.split()[1]) for line in status.read_text().splitlines() if line.startswith(field)) / 1024.0


def identified(records: list[ga.Record], controller: ga.PI | None) -> None:
    idn = ga.identify(records, controller, workers=1)
    assert idn.falsified if controller is None else (idn.p, idn.q) == (1, 2), "wrong answer"


def diagnosed(records: list[ga.Record], controller: ga.PI | None) -> None:
    dia = ga.diagnose(records, controller)
    (cause,) = dia.causes
    assert dia.verdict == "explained" and cause.effect == "coulomb_friction", "wrong answer"
    assert abs(cause.parameters["torque"].value - FRICTION) < 0.02 * FRICTION, "wrong answer"


def measure(what: str, diagnose: bool) -> str:
    made = with_friction if diagnose else record
    records = motor_runs() if what == MOTOR else [made(int(what))]
    controller = None if what == MOTOR else CONTROLLER
    runs = 1 if diagnose else 2 if sum(map(len, records)) > 5_000_000 else 5
    work = diagnosed if diagnose else identified
    ga.identify([rec[:2000] for rec in records], controller, workers=1)
    reset = Path("/proc/self/clear_refs")
    if reset.exists():
        reset.write_text("5")
    before, peak = mebibytes("VmRSS"), 0.0
    processor, wall = [], []
    for _ in range(runs):
        began = time.perf_counter(), time.process_time()
        work(records, controller)
        wall.append(time.perf_counter() - began[0])
        processor.append(time.process_time() - began[1])
        peak = peak or mebibytes("VmHWM") - before
    samples = f"{sum(map(len, records)):_}".replace("_", " ")
    return f"| {samples}{', ' + what if what == MOTOR else ''} | {min(processor):.2g} s | {min(wall):.2g} s | {peak:.0f} MiB |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--samples", type=int, nargs="+", default=[25_000, 100_000, 1_000_000, 10_000_000], help="multiples of 500"
    )
    parser.add_argument("--diagnose", action="store_true", help="diagnose() of a drive with dry friction, in place of identify()")
    parser.add_argument("--row", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.row:
        print(measure(options.row, options.diagnose))
        return
    print("| samples | processor time | wall time | memory beyond the data |\n|---|---|---|---|", flush=True)
    motor = "GAIDENT_DATA" in os.environ and not options.diagnose
    for row in [*map(str, options.samples), *([MOTOR] if motor else [])]:
        subprocess.run([sys.executable, __file__, "--row", row, *["--diagnose"] * options.diagnose], check=True)


if __name__ == "__main__":
    main()
