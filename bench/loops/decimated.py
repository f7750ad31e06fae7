"""Clean records that are decimated: is anything named that only the low-pass and the new lines make?

    python bench/loops/decimated.py [--cases 6] [--seed 1] [--by 2 5] [--noise 0.1 0.01]

Each case is a drive of `tests/python/support/drive_cases.py` without an effect on a multi-level record, with this white noise of
the velocity [rad/s]; the torque is commanded and held over each sample, no controller is given.
Each row says the verdict, what is named, and the error of the inertia.
It fails where an inertia is more than 1 % off.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

# ruff: noqa: E402
sys.path[:0] = [str(Path(__file__).resolve().parents[2] / "tests" / "python" / "support")]

import gaident as ga
from drive_cases import NOISES, random_case

MOST_OFF = 0.01


def main() -> int:
    parser = argparse.ArgumentParser(description="clean records that are decimated")
    parser.add_argument("--cases", type=int, default=6)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--by", type=int, nargs="+", default=[2, 5])
    parser.add_argument("--noise", type=float, nargs="+", default=[0.1, 0.01])
    options = parser.parse_args()
    verdicts, furthest = Counter[str](), 0.0
    print("| seed | dt [ms] | noise [rad/s] | by | verdict | named | inertia off by | s |\n|---|---|---|---|---|---|---|---|")
    for seed in range(options.seed, options.seed + options.cases):
        for noise in options.noise:
            record, _, _, truth = random_case(seed, (), "multi", replace(NOISES["white"], white=noise))
            for factor in options.by:
                began = time.process_time()
                dia = ga.diagnose(record.decimate(factor))
                off = dia.mechanics["inertia"].value / (truth.plant.J + truth.plant.JL) - 1.0
                named = ", ".join(f.effect for f in dia.findings if not f.is_noise)
                took = time.process_time() - began
                case = f"{seed} | {1e3 * record.dt:.3g} | {noise:g} | {factor}"
                print(f"| {case} | {dia.verdict} | {named} | {off:.3%} | {took:.1f} |")
                verdicts[dia.verdict] += 1
                furthest = max(furthest, abs(off))
    print(f"\n{dict(verdicts)}; the furthest inertia is {furthest:.3%} off")
    return 0 if furthest < MOST_OFF else 1


if __name__ == "__main__":
    sys.exit(main())
