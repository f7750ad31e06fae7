"""Blind tests of ga.diagnose: hidden effects on simulated drives that share no code with the library.

    python bench/blind.py --out results.jsonl [--cases 20] [--workers 2] [--seed 1] [--only GROUP ...] [--effects NAME ...]
    python bench/blind.py --out results.jsonl --report          # tables only, from what is there
    python bench/blind.py --out results.jsonl --limits          # separability limits (slow; once, they keep)
    python bench/blind.py --calibrate [FILE] [--cases 20]       # writes the calibrated numbers of the policy (blind_calibrate.py)

Every finished case is a line of the file: stop at will, start again and it goes on. Groups for --only:

    clean    nothing hidden; every record, noise, with and without logged torque (--cases of each combination)
    effects  one effect at 0.5..2 times its typical size
    sizes    the same at 0.1..4 times, multi-level records with white noise: the detection curves
    pairs    two effects at once, multi-level
    outside  effects that the library does not know, multi-level
    encoder  an encoder that is really differenced: half a sample of delay is there, and nothing else
    settled  a load that the integrator carries before the record starts, torque logged
    loops    loops of servo drives, wholly known, at 125 us with the log every 1, 2, 4, 8 samples: clean, and the effects in turn
             (--loops, --every: only these; --effects none: only clean ones)
    ramps    the same loops under ramps that begin and end between the lines of the log, trapezoids and S-shapes in turn
    jumps    the same loops under a command that jumps between the lines of the log
    sides    two masses, inertia ratio 0.3 to 10, multi-level, torque logged: clean, every effect of the shaft at either
             end, and every effect of the coupling; with a sensor at the load where one is asked for (--load-sensor)
    ends     the same drives, dry friction of one kind at both ends at once
    orders   cogging or encoder ripple of two or three orders at once, the strongest at 0.5..2 times its typical size, multi-level
    measured no controller: a torque that was measured, with white noise of 5 and 10 % of its rms; clean, and effects at the shaft
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

# One core per diagnosis, also in the linear algebra.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "python" / "support"))

import blind_calibrate
import blind_refit
import numpy as np
from blind_tables import limits_of, report
from json_lines import read, work

import gaident as ga
from blind_judge import describes_noise, deviations, ends_of, judge, with_ends
from drive_cases import (
    ANYWHERE,
    EFFECTS,
    KINDS,
    NOISE_EFFECTS,
    PAIRS,
    WAVE_ORDERS,
    Truth,
    nominal_plants,
    random_case,
    random_plant,
    tuned,
    two_masses,
)
from drive_rig import AT_LOAD, COUPLING, OUTSIDE, SHAFT, LoadSensor
from loop_cases import EVERY, LOOPS, loop_effects, loop_kind, loop_noise, loop_plant, ramp_kind

NOISE_KINDS = ("white", "encoder", "coloured")
GROUPS = (
    *("clean", "effects", "sizes", "pairs", "outside", "encoder", "settled"),
    *("loops", "ramps", "jumps", "sides", "ends", "orders", "measured"),
)
OTHER_SENSORS = {
    "encoder": {"velocity_quantisation"},
    "differenced": {"velocity_quantisation", "velocity_filter", "velocity_ripple"},  # a differenced angle knows no such velocity
}  # encoder -> what hides in another sensor than it
TORQUE_NOISE = (0.05, 0.1)  # of the rms of a measured torque
LOAD_NOISE = {"load_position": 1e-5, "load_velocity": 5e-3}  # rad, rad/s behind a gear of 10
LEVELS = ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "presliding_friction", "lugre_friction")
AT_THE_SHAFT = ("coulomb_friction", "stribeck_friction", "asymmetric_friction", "quadratic_drag", "unbalance", "cogging")


@dataclass(frozen=True)
class Cell:
    """One case, complete: the same cell is the same record."""

    group: str
    effects: tuple[str, ...]
    kind: str
    noise: str
    torque: bool
    seed: int
    factor: float | None = None
    settle: int = 0
    plant: str | None = None
    loop: str = ""  # of LOOPS; "": a bare PI at the log's clock
    every: int = 1  # controller samples to a line of the log
    torque_noise: float = 0.0  # of the torque's rms: a measured torque drives the axis; 0: the controller's, as logged
    waves: int = 1  # of each effect that may have several
    load: str = ""  # channel of a sensor at the load

    @property
    def key(self) -> str:
        factor = "" if self.factor is None else f"{self.factor:.4g}"
        loop = [self.loop, str(self.every)] if self.loop else []
        loop += [f"torque {self.torque_noise:g}"] if self.torque_noise else []
        loop += [f"waves {self.waves}"] if self.waves > 1 else []
        loop += [self.load] if self.load else []
        parts = [self.group, *loop, "+".join(self.effects), self.kind, self.noise, f"u{self.torque:d}", factor, str(self.seed)]
        return "/".join(parts)


def cells(group: str, cases: int, seed: int, limits: dict[tuple[str, str], float] | None = None) -> Iterator[Cell]:
    """The cases of a group, `cases` of each combination, in an order that is balanced when it is interrupted.

    `limits`: (effect, plant) -> factor at the separability limit; with them half of the sizes are drawn around the limit.
    """
    for number in range(seed * 1_000_000, seed * 1_000_000 + cases):
        # Effects and pairs take the noises and the torque in turn; clean records take all of them.
        turn = [(noise, torque) for torque in (True, False) for noise in NOISE_KINDS]
        if group == "clean":
            for kind in KINDS:
                for noise, torque in turn:
                    yield Cell(group, (), kind, noise, torque, number)
        elif group == "effects":
            for kind in KINDS:
                for effect in EFFECTS:
                    noise, torque = turn[(number + zlib.crc32(effect.encode())) % len(turn)]
                    if effect == "velocity_quantisation" and noise == "encoder":
                        noise = "white"  # one lattice is enough
                    yield Cell(group, (effect,), kind, noise, torque, number)
        elif group == "sizes":
            for effect in [e for e in EFFECTS if e not in NOISE_EFFECTS]:
                rng = np.random.default_rng([number, zlib.crc32(effect.encode())])
                # One mass with an extra resonance is a drive of two masses: nothing would be hidden.
                two = {*COUPLING, "extra_resonance"}
                plant = str(rng.choice([p.name for p in nominal_plants() if p.two_masses or effect not in two]))
                factor = 10 ** rng.uniform(-1, np.log10(4))
                limit = (limits or {}).get((effect, plant))
                if limit is not None and number % 2:
                    factor = limit * 2 ** rng.uniform(-2, 3)
                yield Cell(group, (effect,), "multi", "white", bool(number // 2 % 2), number, float(factor), plant=plant)
        elif group == "pairs":
            pair = PAIRS[int(np.random.default_rng(number).integers(len(PAIRS)))]
            yield Cell(group, pair, "multi", turn[number % 6][0], turn[number % 6][1], number)
        elif group == "outside":
            for effect in OUTSIDE:
                yield Cell(group, (effect,), "multi", turn[number % 6][0], turn[number % 6][1], number)
        elif group == "encoder":
            yield Cell(group, (), "multi", "differenced", bool(number % 2), number)
        elif group == "settled":
            yield Cell(group, ("load_torque",), "multi", NOISE_KINDS[number % 3], True, number, settle=1500)
        elif group in ("loops", "ramps", "jumps"):
            yield from loop_cells(number, group)
        elif group == "sides":
            for effect in ("", *(e for e in EFFECTS if e in {*SHAFT, *COUPLING})):
                for key in (effect, effect + AT_LOAD) if effect in SHAFT else (effect,):
                    noise = NOISE_KINDS[(number + zlib.crc32(effect.encode())) % len(NOISE_KINDS)]
                    yield Cell(group, (key,) if key else (), "multi", noise, True, number)
        elif group == "ends":
            for effect in LEVELS:
                noise = NOISE_KINDS[(number + zlib.crc32(effect.encode())) % len(NOISE_KINDS)]
                yield Cell(group, (effect, effect + AT_LOAD), "multi", noise, True, number)
        elif group == "orders":
            for effect in WAVE_ORDERS:
                noise, torque = turn[(number + zlib.crc32(effect.encode())) % len(turn)]
                yield Cell(group, (effect,), "multi", noise, torque, number, waves=2 + number % 2)
        elif group == "measured":
            for share in TORQUE_NOISE:
                for effect in ("", *AT_THE_SHAFT):
                    yield Cell(group, (effect,) if effect else (), "multi", "white", True, number, torque_noise=share)


def loop_cells(number: int, group: str) -> Iterator[Cell]:
    """Each loop at each clock of the log: once clean, once with an effect, which the numbers take in turn."""
    for loop in LOOPS:
        for every in EVERY:
            turn = number + zlib.crc32(f"{loop} {every}".encode())
            possible = loop_effects(loop)
            for effects in ((), (possible[turn % len(possible)],)):
                kind, encoder = (loop_kind(loop), "encoder") if group == "loops" else (ANYWHERE[-1], "differenced")
                kind = ramp_kind(turn) if group == "ramps" else kind
                noise = "white" if turn % 2 or {*effects} & OTHER_SENSORS[encoder] else encoder
                yield Cell(group, effects, kind, noise, True, number, loop=loop, every=every)


def case_of(cell: Cell) -> tuple[ga.Record, ga.Record | None, ga.PI | ga.Cascade | None, Truth]:
    """Record, validation record, controller and truth of a cell. Raises RuntimeError where its effect does not act there."""
    rng = np.random.default_rng(cell.seed)
    if cell.loop:
        rng = np.random.default_rng([cell.seed, zlib.crc32(" ".join((cell.loop, str(cell.every), *cell.effects)).encode())])
        two = True if {*cell.effects} & {*COUPLING, "extra_resonance"} else None
        own = cell.kind in ANYWHERE  # then each case has a command and an encoder of its own
        number = zlib.crc32(cell.key.encode()) if own else cell.seed
        plant, noise = loop_plant(cell.loop, cell.every, rng, two, cell.kind if own else None), loop_noise(cell.noise, number)
        return random_case(number, cell.effects, cell.kind, noise, cell.torque, cell.factor, plant, plant.placed)
    if cell.group in ("sides", "ends"):  # either end of one effect, and both, on the same drive
        rng = np.random.default_rng([cell.seed, zlib.crc32("".join(cell.effects[:1]).removesuffix(AT_LOAD).encode())])
        sensor = LoadSensor(cell.load, LOAD_NOISE[cell.load], scale=0.1) if cell.load else None
        drawn = cell.seed, cell.effects, cell.kind, cell.noise, cell.torque, cell.factor, two_masses(rng)
        return random_case(*drawn, load_sensor=sensor)
    plant = next(p for p in iter(lambda: random_plant(rng), None) if p.name == cell.plant) if cell.plant else None
    drawn = (cell.seed, cell.effects, cell.kind, cell.noise, cell.torque, cell.factor, plant)
    case = random_case(*drawn, settle=cell.settle, waves=cell.waves)
    if not cell.torque_noise:
        return case
    record, validation, _, truth = case
    assert validation is not None
    return measured(record, cell, 0), measured(validation, cell, 1), None, truth


def measured(record: ga.Record, cell: Cell, number: int) -> ga.Record:
    """The record with a torque that was measured, not commanded, and with the noise of such a measurement."""
    torque = np.asarray(record.torque)
    noise = np.random.default_rng([cell.seed, number]).standard_normal(len(torque))
    torque = torque + cell.torque_noise * float(np.sqrt(np.mean(torque**2))) * noise
    return ga.Record(record.dt, velocity=record.velocity, torque=torque, torque_is="measured", name=record.name)


def run(cell: Cell, with_oracle: bool) -> dict[str, Any]:
    """One diagnosis and its judgement as a line of the file."""
    line: dict[str, Any] = {"key": cell.key, "cell": asdict(cell)}
    try:
        record, validation, controller, truth = case_of(cell)
    except RuntimeError as none:  # this effect does not act there
        return line | {"impossible": str(none)}
    line |= {"plant": truth.plant.name, "factor": truth.factor, "effects": truth.effects}
    started, processor = time.perf_counter(), time.process_time()
    try:
        dia = ga.diagnose(record, controller=controller, validation=validation)  # type: ignore[attr-defined]
    except Exception as failure:  # a crash is a result, too
        return line | {"crash": f"{type(failure).__name__}: {failure}", "seconds": time.perf_counter() - started}
    both = cell.group == "ends"
    hidden = dict(truth.effects) if both else {key.removesuffix(AT_LOAD): values for key, values in truth.effects.items()}
    line |= {"seconds": time.perf_counter() - started, "judged": judge(with_ends(dia) if both else dia, hidden).as_dict()}
    line |= {"ends": ends_of(dia, tuple(hidden))} if cell.group == "sides" else {}
    line |= {"processor": time.process_time() - processor, "simulations": dia.simulations}
    line |= {"before": dia.before.rmse, "after": dia.after.rmse, "deviations": deviations(dia, truth.effects, truth.plant)}
    if cell.torque_noise:
        line |= inertia_of(dia, truth.plant.J + truth.plant.JL)
    of_library = not set(cell.effects) & set(OUTSIDE) and not describes_noise(cell.effects)
    inside = cell.effects and cell.group not in ("sides", "ends", "orders") and of_library
    if with_oracle and validation is not None and inside and not cell.settle and not cell.loop:
        line["oracle"] = blind_refit.oracle(truth, record.velocity, validation.velocity)
    return line


def inertia_of(dia: Any, truth: float) -> dict[str, float]:
    """Relative error of the whole inertia, and how many of its deviations that is."""
    found = dia.mechanics["inertia"]
    error = found.value - truth
    return {"inertia_error": error / truth, "inertia_deviations": error / found.std}


def limit_cells(plants: list[str]) -> Iterator[tuple[str, int]]:
    for index, plant in enumerate(nominal_plants()):
        if plant.name not in plants:
            continue
        for effect in blind_refit.NEAR:
            if plant.two_masses or effect not in COUPLING:
                yield effect, index


def run_limit(effect: str, index: int, method: str) -> dict[str, Any]:
    """The separability limit of an effect on a nominal drive, tuned as a random one is.

    `method` is "module:function"; the function takes factor -> Truth and returns a blind_refit.Limit.
    """
    module, function = method.split(":")
    rng = np.random.default_rng(index)
    plant = nominal_plants()[index]
    plant = plant if plant.kp else tuned(plant, rng)

    def case(factor: float) -> Truth:
        return random_case(7, effect, noise="none", factor=factor, plant=plant)[3]

    line: dict[str, Any] = {"key": f"limit/{effect}/{plant.name}", "effect": effect, "plant": plant.name}
    try:
        return line | {"limit": asdict(getattr(importlib.import_module(module), function)(case))}
    except RuntimeError as none:
        return line | {"impossible": str(none)}


def calibrate(path: Path, out: Path, cases: int, seed: int, workers: int) -> None:
    """Measures records that hide nothing and writes the numbers of the policy that follow."""
    chosen = {blind_calibrate.key_of(cell): cell for cell in cells("clean", cases, seed) if blind_calibrate.wanted(cell)}
    there = read(out)
    work(out, [(blind_calibrate.measure, cell) for key, cell in chosen.items() if key not in there], workers)
    content = blind_calibrate.calibrated({k: line for k, line in read(out).items() if k in chosen}, cases, seed)
    blind_calibrate.write(path, content)
    print(json.dumps(content, indent=2))


def main() -> None:
    parser = argparse.ArgumentParser(description="blind tests of gaident.diagnose", epilog=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("build/blind.jsonl"), help="JSON lines; what is in it is not run again")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", nargs="+", choices=GROUPS, default=list(GROUPS))
    parser.add_argument(
        "--effects", nargs="+", default=None, help="of the groups, only cases that hide one of these; none: clean"
    )
    parser.add_argument("--kinds", nargs="+", choices=[*KINDS, *ANYWHERE], default=[*KINDS, *ANYWHERE])
    parser.add_argument("--loops", nargs="+", choices=list(LOOPS), default=["", *LOOPS], help="of the groups loops and ramps")
    parser.add_argument("--every", nargs="+", type=int, choices=EVERY, default=list(EVERY), help="of the groups loops and ramps")
    parser.add_argument("--load-sensor", choices=list(LOAD_NOISE), help="a channel of the load in the groups sides and ends")
    names = [plant.name for plant in nominal_plants()]
    parser.add_argument("--plants", nargs="+", choices=names, default=names, help="of --limits")
    parser.add_argument("--limit-with", default="blind_refit:limit", metavar="MODULE:FUNCTION")
    parser.add_argument("--no-oracle", action="store_true")
    parser.add_argument("--limits", action="store_true")
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--calibrate", nargs="?", type=Path, const=blind_calibrate.OUT, metavar="FILE",
                        help="write the numbers that records without effects calibrate")  # fmt: skip
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    there = read(options.out)
    jobs: list[tuple[Any, ...]] = []
    if options.calibrate:
        return calibrate(options.calibrate, options.out, options.cases, options.seed, options.workers)
    if options.limits:
        keys = {
            f"limit/{effect}/{nominal_plants()[index].name}": (effect, index) for effect, index in limit_cells(options.plants)
        }
        jobs = [(run_limit, *arguments, options.limit_with) for key, arguments in keys.items() if key not in there]
    elif not options.report:
        if not hasattr(ga, "diagnose"):
            sys.exit("this gaident has no diagnose()")
        limits = limits_of(list(there.values()))
        chosen = [cell for group in options.only for cell in cells(group, options.cases, options.seed, limits)]
        chosen = [c for c in chosen if c.kind in options.kinds and c.key not in there]
        chosen = [c for c in chosen if not options.effects or set(c.effects or ["none"]) & set(options.effects)]
        chosen = [c for c in chosen if c.loop in options.loops and c.every in options.every]
        if options.load_sensor:
            chosen = [replace(c, load=options.load_sensor) for c in chosen if c.group in ("sides", "ends")]
            chosen = [c for c in chosen if c.key not in there]
        jobs = [(run, cell, not options.no_oracle) for cell in chosen]
    work(options.out, jobs, options.workers)
    print(report(list(read(options.out).values())))


if __name__ == "__main__":
    main()
