"""What a diagnosis says where the given controller is not the drive's: several forms, a position loop, other limit schemes.

    python bench/loops/hidden_loops.py --out hidden.jsonl [--group NAME ...] [--every 4] [--cases 1] [--seed 1] [--name NAME ...]
    python bench/loops/hidden_loops.py --out hidden.jsonl --report

The drives are small servo axes (tests/python/support/drive_cases.py), clean, in the closed loop of the independent rig.
They have white noise or that of an encoder in turn, and the torque is logged.

several   an IP controller with a notch or a low pass; a bare PI in a Cascade of the right period is given
position  a position controller; what is given lacks the notch, or has another position gain or feedforward
clock     other gains with a low pass; a bare PI without a period is given
schemes   what PI has no word for: a decay of the integral for each limited sample (ODrive), a clamp of integral and output
          (SimpleFOC), a dead band on the error, a reset of the integral at zero error; a bare PI with its period is given.
          The rig has none of them: these run in this file, on the exact matrices of the axis behind the held torque.

Judged: the findings of place "controller" are those expected, no mechanics are named, and the inertia is right.
"""

from __future__ import annotations

import argparse
import os
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
import sys

BENCH = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(BENCH), str(BENCH.parent / "tests" / "python" / "support")]

import numpy as np
from json_lines import read, work

import gaident as ga
from drive_cases import command_for, random_case, random_plant, stable
from drive_rig import Plant
from loop_cases import LOOPS, PERIOD, SCHEMES, loop_noise, low_pass, notch, pi, scheme_log

Build = Callable[[Plant, np.random.Generator], ga.Cascade]


def beside(plant: Plant, rng: np.random.Generator, low: float = 0.1, high: float = 0.15) -> ga.PI:
    """Gains that are so far from the given ones, each to either side."""
    kp, ki = (1.0 + float(rng.choice([-1, 1]) * rng.uniform(low, high)) for _ in range(2))
    return ga.PI(kp * plant.kp, ki * plant.ki)


def ip(plant: Plant) -> ga.PI:
    return pi(plant, command_weight=0.0)


def without(loop: ga.Cascade, **fields: Any) -> ga.Cascade:
    return replace(loop, **fields)


HIDDEN: dict[str, dict[str, tuple[Build, Callable[[ga.Cascade, Plant], Any], set[str]]]] = {
    "several": {
        "ip notch": (
            lambda plant, rng: ga.Cascade(ip(plant), PERIOD, torque_filters=(notch(plant, rng),)),
            lambda loop, plant: ga.Cascade(pi(plant), PERIOD),
            {"command_weight", "torque_filter"},
        ),
        "ip low pass": (
            lambda plant, rng: ga.Cascade(ip(plant), PERIOD, torque_filters=(low_pass(rng, 0.3e-3, 0.8e-3),)),
            lambda loop, plant: ga.Cascade(pi(plant), PERIOD),
            {"command_weight", "torque_filter"},
        ),
        "gains low pass": (
            lambda plant, rng: ga.Cascade(beside(plant, rng), PERIOD, torque_filters=(low_pass(rng, 0.3e-3, 0.8e-3),)),
            lambda loop, plant: ga.Cascade(pi(plant), PERIOD),
            {"other_gains", "torque_filter"},
        ),
        "low pass notch": (
            lambda plant, rng: ga.Cascade(pi(plant), PERIOD, torque_filters=(low_pass(rng, 0.3e-3, 0.8e-3), notch(plant, rng))),
            lambda loop, plant: ga.Cascade(pi(plant), PERIOD),
            {"torque_filter"},
        ),
        "velocity filter notch": (
            lambda plant, rng: ga.Cascade(
                pi(plant), PERIOD, velocity_filters=(low_pass(rng, 0.3e-3, 0.8e-3),), torque_filters=(notch(plant, rng),)
            ),
            lambda loop, plant: ga.Cascade(pi(plant), PERIOD),
            {"velocity_feedback_filter", "torque_filter"},
        ),
    },
    "position": {
        "notch": (
            lambda plant, rng: without(LOOPS["position"](plant, rng), torque_filters=(notch(plant, rng),)),
            lambda loop, plant: without(loop, torque_filters=()),
            {"torque_filter"},
        ),
        "notch, no feedforward": (
            lambda plant, rng: without(
                LOOPS["position"](plant, rng), torque_filters=(notch(plant, rng),), acceleration_feedforward=0.0
            ),
            lambda loop, plant: without(loop, torque_filters=()),
            {"torque_filter"},
        ),
        "gain": (
            lambda plant, rng: without(LOOPS["position"](plant, rng), velocity_feedforward=0.5),
            lambda loop, plant: without(loop, position=ga.P(1.15 * loop.position.gain)),
            {"other_gains"},
        ),
        "velocity feedforward": (
            lambda plant, rng: without(LOOPS["position"](plant, rng), velocity_feedforward=0.8),
            lambda loop, plant: without(loop, velocity_feedforward=1.0),
            {"velocity_feedforward"},
        ),
        "acceleration feedforward": (
            LOOPS["position"],
            lambda loop, plant: without(loop, acceleration_feedforward=0.0),
            {"acceleration_feedforward"},
        ),
    },
    "clock": {
        "gains low pass": (
            lambda plant, rng: ga.Cascade(beside(plant, rng), PERIOD, torque_filters=(low_pass(rng, 0.3e-3, 0.8e-3),)),
            lambda loop, plant: pi(plant),
            {"other_gains", "torque_filter"},
        ),
        "low pass": (
            LOOPS["torque low pass"],
            lambda loop, plant: pi(plant),
            {"torque_filter"},
        ),
    },
    "schemes": {
        name: (LOOPS["bare"], lambda loop, plant: ga.Cascade(pi(plant), PERIOD), expected) for name, expected in SCHEMES.items()
    },
}  # fmt: skip
"""Group -> name -> (the drive's controller, what is given of it, findings expected)."""


@dataclass(frozen=True)
class Case:
    """One case, complete: the same case is the same record."""

    group: str
    name: str
    every: int
    number: int

    @property
    def key(self) -> str:
        return f"{self.group}/{self.name}/{self.every}/{self.number}"

    def drawn(self) -> tuple[ga.Record, ga.Record | None, Any, Plant]:
        """Record, validation record, the controller that is given, and the drive."""
        build, given, _ = HIDDEN[self.group][self.name]
        rng = np.random.default_rng([self.number, zlib.crc32(f"{self.group} {self.name} {self.every}".encode())])
        for _ in range(50):
            plant = replace(random_plant(rng), dt=PERIOD * self.every)
            plant = replace(plant, cascade=build(plant, rng))
            if stable(plant, {}):
                break
        else:
            raise RuntimeError(f"no stable drive found in the loop {self.name!r}")
        assert plant.cascade is not None
        if self.group == "schemes":
            commands = [command_for("multi", plant, rng, other) for other in (False, True)]
            record, later = (scheme_log(plant, command, self.name, self.number + k) for k, command in enumerate(commands))
        else:
            noise = loop_noise("white" if rng.integers(2) else "encoder", self.number)
            kind = "move" if plant.placed else "multi"
            record, later, _, _ = random_case(self.number, (), kind, noise, plant=plant, position_logged=plant.placed)
        return record, later, given(plant.cascade, plant), plant


def run(case: Case) -> dict[str, Any]:
    """One diagnosis, judged."""
    expected = HIDDEN[case.group][case.name][2]
    line: dict[str, Any] = {"key": case.key, "group": case.group}
    try:
        record, validation, given, plant = case.drawn()
    except RuntimeError as none:
        return line | {"impossible": str(none)}
    started = time.perf_counter()
    try:
        dia = ga.diagnose(record, controller=given, validation=validation)
    except Exception as failure:
        return line | {"crash": f"{type(failure).__name__}: {failure}", "seconds": time.perf_counter() - started}
    real = [f for f in dia.findings if not f.is_noise]
    form = {f.effect for f in real if f.place == "controller"}
    total = plant.J + plant.JL
    found = dia.mechanics.get("inertia") or dia.mechanics.get("total_inertia")
    motor, load = dia.mechanics.get("motor_inertia"), dia.mechanics.get("load_inertia")
    inertia = found.value if found is not None else motor.value + load.value if motor and load else np.nan
    return line | {
        "expected": sorted(expected),
        "form": sorted(form),
        "form_right": form == expected,
        "mechanical": [[f.effect, *f.alternatives] for f in real if f.place != "controller"],
        "verdict": dia.verdict,
        "inertia_off": inertia / total - 1.0,
        "before": dia.before.rmse,
        "after": dia.after.rmse,
        "seconds": time.perf_counter() - started,
        "notes": [str(n)[:400] for n in dia.notes],
        "findings": [f"{f.effect} { ({n: (e.value, e.std) for n, e in f.parameters.items()}) }" for f in real],
        "controller": repr(dia.controller),
        "plant": repr(plant),
    }


def report(lines: list[dict[str, Any]]) -> str:
    """Counts of each group, and each case."""
    said = []
    for group in HIDDEN:
        part = [x for x in lines if x["group"] == group and "verdict" in x]
        if part:
            alone = [any(len(s) == 1 for s in x["mechanical"]) for x in part]
            said.append(
                f"{group}: {len(part)} cases, form right {sum(x['form_right'] for x in part)}, a mechanical name "
                f"{sum(bool(x['mechanical']) for x in part)} (without alternatives {sum(alone)}), explained or adequate "
                f"{sum(x['verdict'] in ('explained', 'adequate') for x in part)}, inertia off by more than 1 % "
                f"{sum(not abs(x['inertia_off']) < 0.01 for x in part)}"
            )
    for x in lines:
        if "verdict" in x:
            said.append(
                f"  {x['key']}: {x['verdict']}, form {x['form']} of {x['expected']}, mechanics {x['mechanical']}, "
                f"inertia {100 * x['inertia_off']:+.2f} %, {x['seconds']:.0f} s"
            )
        else:
            said.append(f"  {x['key']}: {x.get('crash') or x.get('impossible')}")
    return "\n".join(said)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/hidden_loops.jsonl"))
    parser.add_argument("--group", nargs="+", choices=list(HIDDEN), default=list(HIDDEN))
    parser.add_argument("--name", nargs="+", help="of the loops of these groups; default: all")
    parser.add_argument("--every", nargs="+", type=int, default=[4])
    parser.add_argument("--cases", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--report", action="store_true")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    if not options.report:
        there = read(options.out)
        cases = [
            Case(group, name, every, options.seed * 1000 + k)
            for k in range(options.cases)
            for group in options.group
            for name in HIDDEN[group]
            if not options.name or name in options.name
            for every in options.every
        ]
        work(options.out, [(run, case) for case in cases if case.key not in there], options.workers)
    print(report(list(read(options.out).values())))


if __name__ == "__main__":
    main()
