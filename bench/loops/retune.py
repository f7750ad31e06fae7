"""Gains that `ga.retune` proposes, on the drive that nobody knows: margins, settling, stiffness, torque.

    python bench/loops/retune.py [--drives 100] [--seed 0] [--out build/retune.jsonl]

Each drive is a random one of the tests' independent rig under a PI, or a two-mass drive of any inertia ratio, with nothing or one
linear effect (delay, lag, filter, resonance) or dry friction in it.
Its log is diagnosed, and gains are proposed for the default
margins and a torque limit: twice the torque that a step of 50 rad/s asks for under the given gains.
The margins are those of the true drive. Settling and torque of the step are the rig's, without noise.
Every drive is a line of the file; stop at will, start again and it goes on.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
BENCH = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(BENCH), str(BENCH.parent / "tests" / "python" / "support")]

import numpy as np

import gaident as ga
from drive_cases import command_for, draw_effect, random_plant, samples_of, two_masses
from drive_rig import Plant, rig, run_drive
from gaident.remedies.loops import Loops, frequencies_of
from gaident.remedies.plants import sampled_plants

HIDDEN = ("", "transport_delay", "torque_lag", "velocity_filter", "extra_resonance", "coulomb_friction")
STEP = 50.0  # rad/s
MORE_TORQUE = 2.0  # times that of the given gains
LENGTH = 1.2  # s of the step


def drawn(number: int, seed: int) -> tuple[Plant, dict[str, dict[str, float]], ga.Record]:
    """A drive, what is hidden in it, and its log."""
    rng = np.random.default_rng([seed, number])
    plant = two_masses(rng) if number % 3 == 2 else random_plant(rng)
    hidden = HIDDEN[number % len(HIDDEN)]
    effects = {hidden: draw_effect(hidden, 1.0, plant, samples_of("multi", plant), rng)} if hidden else {}
    command = command_for("multi", plant, rng)
    return plant, effects, rig(plant, command, effects, seed=number)


def truth(plant: Plant, effects: dict[str, dict[str, float]]) -> ga.Model:
    """The drive as a model."""
    mechanism = (
        ga.TwoMass(JM=plant.J, DM=plant.D, JL=plant.JL, DL=plant.DL, KG=plant.KG, DG=plant.DG)
        if plant.two_masses
        else ga.OneMass(plant.J, plant.D)
    )
    model = mechanism.model()
    for name, parameters in effects.items():
        model = model.with_effect(name, **parameters)
    return model


def of_the_rig(plant: Plant, effects: dict[str, dict[str, float]], controller: ga.PI) -> tuple[float, float]:
    """(settling time to 5 % [s], largest torque [N m]) of a step."""
    n = round(LENGTH / plant.dt)
    log = run_drive(replace(plant, kp=controller.kp, ki=controller.ki), np.full(n, STEP), effects)
    outside = np.flatnonzero(np.abs(log.truth / STEP - 1.0) > 0.05)
    settled = math.inf if len(outside) and outside[-1] == n - 1 else (outside[-1] + 1) * plant.dt if len(outside) else 0.0
    return settled, float(np.max(np.abs(log.torque)))


def measured(number: int, seed: int) -> dict[str, Any]:
    """One drive: what was promised and what it does."""
    plant, effects, rec = drawn(number, seed)
    given = ga.PI(plant.kp, plant.ki)
    started = time.process_time()
    found = ga.diagnose(rec, given, seed=seed)
    diagnosed = time.process_time()
    before = of_the_rig(plant, effects, given)
    limit = MORE_TORQUE * before[1]
    tuned = ga.retune(found, torque_limit=limit, step=STEP, seed=seed)
    done = time.process_time()
    proposal = tuned.controller
    assert isinstance(proposal, ga.PI)
    after = of_the_rig(plant, effects, proposal)
    plants = sampled_plants([truth(plant, effects).linear], plant.dt, 0.0, False)
    answers = plants.responses(frequencies_of(plants, 1500, 121))
    old, new = (Loops(plants, ga.Cascade(c), answers) for c in (given, proposal))
    return {
        "drive": plant.name, "hidden": list(effects), "verdict": found.verdict, "named": [f.effect for f in found.causes],
        "doubts": len(tuned.doubts), "rule": tuned.rule, "keeps": tuned.keeps, "holds": tuned.holds,
        "stable": bool(new.stable[0]), "phase": float(new.phase_margins[0]), "gain": float(new.gain_margins[0]),
        "asked": [tuned.phase_margin, tuned.gain_margin, limit],
        "before": [float(old.phase_margins[0]), float(old.gain_margins[0])],
        "stiffness": [float(old.stiffness[0]), float(new.stiffness[0])], "settling": [before[0], after[0]],
        "torque": [before[1], after[1]], "gains": [given.kp, given.ki, proposal.kp, proposal.ki],
        "seconds": [diagnosed - started, done - diagnosed],
    }  # fmt: skip


def summary(lines: list[dict[str, Any]]) -> str:
    """What holds in how many drives."""

    def share(name: str, kept: list[bool]) -> str:
        return f"{sum(kept):4d} of {len(kept)}  {name}"

    kept = [x["stable"] and x["phase"] >= x["asked"][0] and x["gain"] >= x["asked"][1] for x in lines]
    nearly = [x["stable"] and x["phase"] >= x["asked"][0] - 1.0 and x["gain"] >= x["asked"][1] - 0.5 for x in lines]
    better = [x["settling"][1] < x["settling"][0] or x["stiffness"][1] > x["stiffness"][0] for x in lines]
    ratios = np.array([[x[n][1] / x[n][0] for n in ("stiffness", "settling")] for x in lines if np.isfinite(x["settling"][1])])
    sure = [not x["doubts"] and x["keeps"] for x in lines]
    return "\n".join([
        share("stable", [x["stable"] for x in lines]),
        share("both margins of the true drive as asked for", kept),
        share("within 1 degree and 0.5 dB", nearly),
        share("as asked for, of those without a doubt and said to keep all", [k for k, s in zip(kept, sure, strict=True) if s]),
        share("settles sooner, or is stiffer", better),
        share("no more torque in the step than asked for", [x["torque"][1] <= x["asked"][2] * 1.001 for x in lines]),
        "median stiffness x {:.2f}, settling time x {:.2f}".format(*np.median(ratios, axis=0)),
        "median seconds: diagnosis {:.1f}, retuning {:.1f}".format(*np.median([x["seconds"] for x in lines], axis=0)),
    ])  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("build/retune.jsonl"))
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    there = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    for number in range(len(there), options.drives):
        line = measured(number, options.seed)
        there.append(line)
        with options.out.open("a") as file:
            file.write(json.dumps(line) + "\n")
    print(summary(there[: options.drives]))


if __name__ == "__main__":
    main()
