"""How true a drive's arithmetic is: the tables of docs/dsp.md.

    python bench/fidelity.py [--drives 100] [--runs 20] [--write docs/dsp.md]

Velocity: largest deviation from double, relative to the response's peak, over 250 samples of a 43.6 rad/s step; the paper's two
drives (Table IV, loop gains as Table V needs them) and random ones from the paper's search ranges whose loop is stable.
Fitness: relative deviation of the error sum against a record with 0.3 rad/s of noise.
Both in delta form and in powers of z, whose coefficients are computed in double and rounded once.
Runs: Settings.paper() with the same seeds in every arithmetic.
--write puts the tables between the marks `<!-- fidelity -->` and `<!-- end of fidelity -->` of a file.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import gaident as ga
from gaident import _core
from gaident.control.core import clock, core_controller

ARITHMETICS = {
    "drive_double": "double",
    "drive_float": "float",
    "c30": "C30",
    "fixed": "fixed, 2 bits of headroom",
    "fixed_tight": "fixed, none",
    "fixed_wide": "fixed, 6 bits",
}
DT, COMMAND, NOISE = 0.444e-3, np.full(250, 43.6), 0.3
SPACE = ga.SearchSpace(gain=(1e3, 2e4), real=(0.0, 60.0), imaginary=(0.0, 250.0))
ONE_MASS = ga.Model(6278.26, poles=(-34.13,))
TWO_MASSES = ga.Model(6545.29, poles=(-15.41, -10.3 + 150.9j, -10.3 - 150.9j), zeros=(-4.26 + 93.98j, -4.26 - 93.98j))


@dataclass(frozen=True)
class Drive:
    """A plant and the loop around it."""

    model: ga.Model
    loop: ga.PI

    def velocity(self, arithmetic: str, in_z: bool = False) -> tuple[NDArray[np.float64], bool]:
        """(response to the step, whether it left the arithmetic's range)"""
        m = self.model
        poles, zeros = np.array(m.poles, complex), np.array(m.zeros, complex)
        return _core.mirrored(arithmetic, in_z, m.gain, poles, zeros, clock(DT), COMMAND, core_controller(self.loop))

    def record(self, seed: int) -> ga.Record:
        """The step's response with noise."""
        noise = NOISE * np.random.default_rng(seed).standard_normal(len(COMMAND))
        return ga.Record(dt=DT, velocity=self.velocity("drive_double")[0] + noise, command=COMMAND)


def paper(scale: float) -> ga.PI:
    """The paper's controller with its loop gain scaled."""
    return ga.PI(0.0232 * scale, 1.367 * scale, loop="continuous")


PAPER = {"one mass": Drive(ONE_MASS, paper(1.6744)), "two masses": Drive(TWO_MASSES, paper(5.5637))}


def random_drives(count: int, seed: int = 0) -> Iterator[Drive]:
    """Drives of random structure from the paper's ranges whose loop stays below four times the command."""
    rng = np.random.default_rng(seed)

    def roots(n: int) -> list[complex]:
        found: list[complex] = []
        while len(found) + 1 < n:
            re, im = rng.uniform(0.0, 60.0), rng.uniform(0.0, 250.0)
            found += [complex(-re, im), complex(-re, -im)] if rng.random() < 0.5 else [-re, -rng.uniform(0.0, 60.0)]
        return found if len(found) == n else [*found, -rng.uniform(0.0, 60.0)]

    while count > 0:
        p, q = int(rng.integers(0, 4)), int(rng.integers(0, 4))
        model = ga.Model(float(np.exp(rng.uniform(np.log(1e3), np.log(2e4)))), poles=roots(p + q), zeros=roots(q))
        drive = Drive(model, paper(5.5637))
        if np.max(np.abs(drive.velocity("drive_double")[0])) < 4.0 * COMMAND[0]:
            count -= 1
            yield drive


def deviations(drives: list[Drive], arithmetic: str, in_z: bool) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """(of the velocity, of the error sum, how many left the range), per drive; left ones are infinitely wrong."""
    velocity, fitness, overflows = [], [], 0
    for seed, drive in enumerate(drives):
        exact, measured = drive.velocity("drive_double")[0], drive.record(seed).velocity
        found, left = drive.velocity(arithmetic, in_z)
        overflows += left
        velocity.append(np.inf if left else np.max(np.abs(found - exact)) / np.max(np.abs(exact)))
        sums = [float(np.sum((measured - w) ** 2)) for w in (exact, found)]
        fitness.append(np.inf if left else abs(sums[1] / sums[0] - 1.0))
    return np.array(velocity), np.array(fitness), overflows


def response_table(drives: list[Drive]) -> str:
    """Deviations of velocity and fitness in every arithmetic, in delta and in z."""
    lines = [
        f"| arithmetic | form | velocity: one mass | two masses | {len(drives)} random, median | worst | fitness: two masses | "
        "random, median | worst | left the range |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for arithmetic, name in ARITHMETICS.items():
        for in_z in (False, True):
            (one, two), (_, cost), _ = deviations(list(PAPER.values()), arithmetic, in_z)
            velocity, fitness, overflows = deviations(drives, arithmetic, in_z)
            figures = [one, two, np.median(velocity), np.max(velocity), cost, np.median(fitness), np.max(fitness)]
            cells = ["(is the measure)" if arithmetic == "drive_double" and not in_z else f"{x:.1e}" for x in figures]
            lines.append(f"| {name} | {'z' if in_z else 'delta'} | {' | '.join(cells)} | {overflows} |")
    return "\n".join(lines)


def run_table(runs: int, generations: int = 1000) -> str:
    """Whole runs: how often they end in double's structure, and in the true one; candidates that left the range."""
    lines = [
        "| arithmetic | one mass: structure as in double | right | two masses: as in double | right | candidates worst |",
        "|---|---|---|---|---|---|",
    ]
    reference: dict[str, list[tuple[int, int]]] = {}
    for arithmetic, name in ARITHMETICS.items():
        cells, worst, all_candidates = [], 0, 0
        for what, drive in PAPER.items():
            settings = replace(ga.Settings.paper(), arithmetic=arithmetic, generations=generations)
            found = ga.identify(drive.record(17), drive.loop, SPACE, settings, trials=runs, workers=1)
            structures = [(t.p, t.q) for t in found.trials]
            same = sum(a == b for a, b in zip(structures, reference.setdefault(what, structures), strict=True))
            right = structures.count((drive.model.p, drive.model.q))
            cells += [f"{same} of {runs}", f"{right} of {runs}"]
            worst += next((int(w.split(" of ")[0].split()[-1]) for w in found.warnings if "left its range" in w), 0)
            all_candidates += sum(t.evaluations for t in found.trials)
        lines.append(f"| {name} | {' | '.join(cells)} | {100.0 * worst / all_candidates:.2f} % |")
    return "\n".join(lines)


def tables(drives: int, runs: int, generations: int = 1000) -> str:
    """Both, as Markdown."""
    return f"{response_table(list(random_drives(drives)))}\n\n{run_table(runs, generations)}\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=100)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    text = tables(options.drives, options.runs)
    print(text)
    if options.write:
        page = options.write.read_text()
        begin, end = page.index("<!-- fidelity -->\n"), page.index("<!-- end of fidelity -->")
        options.write.write_text(f"{page[:begin]}<!-- fidelity -->\n{text}{page[end:]}")


if __name__ == "__main__":
    main()
