"""Which form of controller a diagnosis finds, where only a bare PI is given and the drive's loop is another.

    python bench/loops/loop_forms.py --out forms.jsonl [--cases 1] [--seed 1] [--loops NAME ...] [--every 1 2 4 8]
        [--effects NAME ...] [--drives servo] [--jumps] [--no-torque] [--bits 17 24]
    python bench/loops/loop_forms.py --out forms.jsonl --report

Drives as in industry (tests/python/support/loop_cases.py): 60 to 500 Hz, inertia ratio 0.3 to 10, a current loop of 0.1 to
0.5 ms, an encoder of 17 to 24 bits, a torque limit reached in a third.
With --drives servo those of the group `loops` of bench/blind.py: small servo axes of one and two masses without a current loop,
white noise and an encoder in turn; --jumps: under a command that jumps at any of the controller's samples.
The log has a line for every 1, 2, 4 and 8 samples of the controller.
The controller that is given is PI(kp, ki), in a Cascade of the right period where the log is slower.
--bare gives the PI alone there too; --unknown gives None for both gains; --no-torque leaves the torque out of the log.
"""

from __future__ import annotations

import argparse
import os
import time
import zlib
from dataclasses import dataclass
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
from drive_cases import ANYWHERE, random_case
from drive_rig import COUPLING
from loop_cases import EVERY, INDUSTRY_BITS, LOOPS, industrial_case, loop_kind, loop_noise, loop_plant

FORMS = {
    "integration_rule", "other_gains", "command_weight", "torque_filter", "velocity_feedback_filter", "command_filter",
    "acceleration_feedforward", "friction_feedforward", "anti_windup", "integrator_clamp", "torque_saturation",
}  # fmt: skip
"""Findings about the controller; a plateau of the logged torque is called torque_saturation."""
EXPECTED: dict[str, set[str]] = {
    "bare": set(),
    "backward": {"integration_rule"},
    "ip": {"command_weight"},
    "torque low pass": {"torque_filter"},
    "notch": {"torque_filter"},
    "hold": {"torque_saturation", "anti_windup"},
    "tracking": {"torque_saturation", "anti_windup"},
    "command filter": {"command_filter"},
    "velocity filter": {"velocity_feedback_filter"},
    "computing delay": set(),
    "together": {"integration_rule", "command_weight", "torque_filter", "velocity_feedback_filter", "command_filter",
                 "torque_saturation", "anti_windup"},
}  # fmt: skip
LAGS = {"torque_lag", "velocity_filter", "transport_delay"}
"""What a current loop, a differenced angle and a computing delay are called; an industrial drive always has one."""
DRIVES = ("industry", "servo")


@dataclass(frozen=True)
class Case:
    """One case, complete: the same case is the same record. given: "period" (a PI in a Cascade where the log is slower), "bare",
    "unknown" or "whole"."""

    loop: str
    every: int
    effect: str
    number: int
    given: str = "period"
    drives: str = DRIVES[0]
    torque: bool = True
    jumps: bool = False  # of the command, at any of the controller's samples
    bits: tuple[int, int] = INDUSTRY_BITS  # of an industrial drive's encoder, from the first up to below the second

    @property
    def key(self) -> str:
        """Its name in the file; what is as always is left out."""
        more = [*([self.drives] if self.drives != DRIVES[0] else []), *(["jumps"] if self.jumps else [])]
        more += [] if self.torque else ["no torque"]
        more += [f"{self.bits[0]} to {self.bits[1] - 1} bits"] if self.bits != INDUSTRY_BITS else []
        return "/".join([self.loop, str(self.every), self.effect, str(self.number), self.given, *more])

    @property
    def lags(self) -> set[str]:
        """Names of lags that are no wrong ones."""
        return LAGS if self.drives == "industry" or self.loop == "computing delay" else set()

    def drawn(self) -> tuple[Any, ...]:
        """What `random_case` gives. Raises RuntimeError where no drive is stable or the effect does not act."""
        loop, every, effect, number = self.loop, self.every, self.effect, self.number
        rng = np.random.default_rng([number, zlib.crc32(f"{loop} {every} {effect}".encode())])
        if self.drives == "servo":
            two = True if {effect} & {*COUPLING, "extra_resonance"} else None
            kind, encoder = (ANYWHERE[-1], "differenced") if self.jumps else (loop_kind(loop), "encoder")
            plant = loop_plant(loop, every, rng, two, kind if self.jumps else None)
            noise = loop_noise("white" if rng.integers(2) else encoder, number)
            return random_case(number, (effect,) if effect else (), kind, noise, self.torque, plant=plant)
        return industrial_case(loop, every, effect, number, self.bits, self.torque)


def run(case: Case) -> dict[str, Any]:
    """One diagnosis, judged."""
    loop, every, given = case.loop, case.every, case.given
    line: dict[str, Any] = {"key": case.key, "loop": loop, "every": every, "effect": case.effect}
    try:
        record, validation, whole, truth = case.drawn()
    except RuntimeError as none:
        return line | {"impossible": str(none)}
    plant = truth.plant
    pi = ga.PI(plant.kp, plant.ki)
    if given == "unknown":
        pi = ga.PI(kp=None, ki=None)
    assert isinstance(whole, ga.Cascade)
    controller = pi if every == 1 or given == "bare" else ga.Cascade(pi, period=plant.dt / every)
    controller = whole if given == "whole" else controller
    expected = (
        set()
        if given == "whole"
        else EXPECTED[loop] | ({"torque_saturation"} if whole.velocity.torque_limit is not None else set())
    )
    started = time.perf_counter()
    try:
        dia = ga.diagnose(record, controller=controller, validation=validation)
    except Exception as failure:
        return line | {"crash": f"{type(failure).__name__}: {failure}", "seconds": time.perf_counter() - started}
    real = [f for f in dia.findings if not f.is_noise]
    form = sorted({f.effect for f in real if f.effect in FORMS})
    named = [f.effect for f in real if f.effect not in FORMS and not f.alternatives]
    sets = [[f.effect, *f.alternatives] for f in real if f.effect not in FORMS]
    true = {*truth.effects}
    total = truth.plant.J + truth.plant.JL
    found = dia.mechanics.get("inertia") or dia.mechanics.get("total_inertia")
    motor, load = dia.mechanics.get("motor_inertia"), dia.mechanics.get("load_inertia")
    inertia = found.value if found is not None else motor.value + load.value if motor and load else np.nan
    deviation = found.std if found is not None else np.hypot(motor.std, load.std) if motor and load else np.nan
    return line | {
        "limit": whole.velocity.torque_limit is not None,
        "expected": sorted(expected),
        "form": form,
        "form_right": set(form) - {"anti_windup"} == expected - {"anti_windup"},
        "false_form": sorted(set(form) - expected),
        "mechanical": named,
        "sets": sets,
        "wrong": [name for name in named if name not in true | case.lags],
        "missing": [name for name in true - case.lags if not any(name in s for s in sets)],
        "verdict": dia.verdict,
        "inertia_off": inertia / total - 1.0,
        "inertia_deviations": (inertia - total) / deviation,
        "before": dia.before.rmse,
        "after": dia.after.rmse,
        "seconds": time.perf_counter() - started,
        "notes": [str(n)[:300] for n in dia.notes],
    }


def report(lines: list[dict[str, Any]]) -> str:
    """Shares of each log clock, and each case that is not right."""
    said = []
    judged = [x for x in lines if "verdict" in x]
    for every in EVERY:
        part = [x for x in judged if x["every"] == every]
        if part:
            n = len(part)
            counts = {
                "form right": sum(x["form_right"] for x in part),
                "false form": sum(bool(x["false_form"]) for x in part),
                "wrong mechanical name": sum(bool(x["wrong"]) for x in part),
                "exact": sum(x["form_right"] and not x["wrong"] and not x["missing"] for x in part),
            }
            said.append(f"every {every}: {n} cases, " + ", ".join(f"{k} {v}" for k, v in counts.items()))
    for x in judged:
        if not x["form_right"] or x["wrong"] or x["missing"]:
            said.append(
                f"  {x['key']}: {x['verdict']}, form {x['form']} of {x['expected']}, mechanics {x['sets']}, "
                f"inertia {100 * x['inertia_off']:+.1f} % ({x.get('inertia_deviations', np.nan):+.1f} deviations)"
            )
    said += [f"  {x['key']}: {x.get('crash') or x.get('impossible')}" for x in lines if "verdict" not in x]
    return "\n".join(said)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/loop_forms.jsonl"))
    parser.add_argument("--cases", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--loops", nargs="+", choices=list(EXPECTED), default=list(EXPECTED))
    parser.add_argument("--every", nargs="+", type=int, choices=EVERY, default=list(EVERY))
    parser.add_argument("--effects", nargs="+", default=[""], help="hidden beside the current loop; default: none")
    parser.add_argument("--drives", choices=DRIVES, default=DRIVES[0])
    parser.add_argument("--jumps", action="store_true", help="of the command, with --drives servo")
    parser.add_argument("--no-torque", action="store_true", help="leave the torque out of the log")
    parser.add_argument("--bare", action="store_true", help="give the PI alone where the log is slower, too")
    parser.add_argument("--unknown", action="store_true", help="give PI(kp=None, ki=None)")
    parser.add_argument("--whole", action="store_true", help="give all of the controller")
    parser.add_argument("--bits", nargs=2, type=int, default=(17, 24), metavar=("LEAST", "MOST"), help="of the encoder's turn")
    parser.add_argument("--report", action="store_true")
    options = parser.parse_args()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    given = "whole" if options.whole else "unknown" if options.unknown else "bare" if options.bare else "period"
    bits = options.bits[0], options.bits[1] + 1
    if not options.report:
        there = read(options.out)
        cases = [
            Case(loop, every, effect, options.seed * 1000 + k, given, options.drives, not options.no_torque, options.jumps, bits)
            for k in range(options.cases)
            for loop in options.loops
            for every in options.every
            for effect in options.effects
        ]
        jobs = [(run, case) for case in cases if case.key not in there]
        work(options.out, jobs, options.workers)
    print(report(list(read(options.out).values())))


if __name__ == "__main__":
    assert set(EXPECTED) | {"position"} == set(LOOPS)
    main()
