"""Measured drives: what ga.diagnose names, and whether its model beats what a careful engineer fits.

    python bench/real.py --out real.jsonl [--workers 2] [--only TEXT ...] [--skip-diagnosis | --skip-plain]
    python bench/real.py --out real.jsonl --report          # tables only, from what is there
    python bench/real.py --out real.jsonl --evidence        # those of docs/evidence.md
    python bench/real.py --out new.jsonl --check            # fails where an answer is worse than in real_expected.py

Every finished part of a case is a line of the file: stop at will, start again and it goes on.
A case has two parts: the plain figures, and the diagnosis of the same training data.
The recorded data are in the folder that GAIDENT_DATA names.
--only takes the cases whose key ("joint 6/decimated 2") contains one of the texts. The published answers are asserted at the end.
With --check (`make real`), cases whose data are not here are left out and named.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
import time
from pathlib import Path
from typing import Any

# One core per case, also in the linear algebra.
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# ruff: noqa: E402
BENCH = Path(__file__).resolve().parent
sys.path[:0] = [str(BENCH / "measured"), str(BENCH.parent / "tests" / "python" / "support")]

import numpy as np
import real_fits as fits
import real_models as models
from json_lines import read, work
from real_expected import worse
from real_judge import judge, said
from real_records import Case, Drive, Parts, cases, missing, parts_of
from real_tables import assert_published, evidence, report

import gaident as ga

NO_NARX = "sysidentpy is not installed"


def run_plain(case: Case) -> dict[str, Any]:
    """The figures of all methods but the diagnosis."""
    started = time.perf_counter()
    parts = parts_of(case)
    methods = {**linear(parts), **regression(parts, case.row), **output_errors(parts, case.row), **black_boxes(parts)}
    spread = float(np.sqrt(np.mean(np.concatenate([r.velocity for r in parts.held_out]) ** 2)))
    line = {"key": f"{case.key}/plain", "case": case.key, "part": "plain", "held": parts.held, "rms_held_out": spread}
    return line | {"methods": methods, "seconds": time.perf_counter() - started}


def run_diagnosis(case: Case) -> dict[str, Any]:
    """The names, and the figures of the diagnosed model; it sees the training data only."""
    started = time.perf_counter()
    parts = parts_of(case)
    line: dict[str, Any] = {"key": f"{case.key}/diagnosis", "case": case.key, "part": "diagnosis", "version": ga.__version__}
    training = parts.training if len(parts.training) > 1 else parts.training[0]
    try:
        dia = ga.diagnose(training, controller=case.row.controller, axis=case.row.axis)
    except Exception as failure:  # a crash is a result, too
        return line | {"crash": f"{type(failure).__name__}: {failure}", "seconds": time.perf_counter() - started}
    what = said(dia)
    line |= {"said": what, "judged": judge(case.row, what), "seconds": time.perf_counter() - started}
    return line | {"methods": {"extended": of_model(dia.model, parts)}}


def of_model(model: ga.Model, parts: Parts) -> dict[str, Any]:
    """Free run and force error of a model of the library."""
    return {
        "velocity": fits.rmse(parts.held_out, lambda r: models.free_run(model, r)),
        "force": fits.force_error(parts.held_out, model),
        "training": fits.rmse(parts.training, lambda r: models.free_run(model, r)),
        "blocks": fits.blocks(parts.held_out, lambda r: models.free_run(model, r)),
    }


def linear(parts: Parts) -> dict[str, Any]:
    """What ga.identify finds in the open loop."""
    try:
        idn = ga.identify([models.open_loop(r) for r in parts.training], seed=0, workers=1)
    except ga.GaidentError as failure:
        return {"linear": {"skipped": str(failure)}}
    return {"linear": of_model(idn.model, parts) | {"order": [idn.p, idn.q]}}


def regression(parts: Parts, row: Drive) -> dict[str, Any]:
    """ga.inverse_dynamics, and the free run of the rigid axis that it gives."""
    if not hasattr(ga, "inverse_dynamics"):
        return {"regression": {"skipped": "this gaident has no inverse_dynamics()"}}
    try:
        found = ga.inverse_dynamics(parts.training, validation=parts.held_out, axis=row.axis)
    except ga.GaidentError as failure:
        return {"regression": {"skipped": str(failure)}}
    p = {name: e.value for name, e in found.parameters.items()}
    eight = np.zeros(8)
    eight[fits.J] = p["inertia"]
    for name, one, places in (("viscous", 1.0, (fits.BP, fits.BN)), ("coulomb", 1.0, (fits.CP, fits.CN))):
        for place, direction in zip(places, ("positive", "negative"), strict=True):
            eight[place] = one * p.get(name, p.get(f"{name}_{direction}", 0.0))
    eight[fits.T] = p.get("offset", 0.0)
    amplitude, phase = p.get("gravity_amplitude", 0.0), p.get("gravity_phase", 0.0)
    eight[fits.AS], eight[fits.AC] = amplitude * np.cos(phase), amplitude * np.sin(phase)
    figures: dict[str, Any] = {"parameters": p, "terms": list(found.terms), "own_force": found.force_error_held_out}
    if "spring" in found.terms:
        return {"regression": figures | {"skipped": "no free run with a spring"}}
    return {"regression": figures | of_rigid(eight, parts)}


def of_rigid(eight: np.ndarray, parts: Parts) -> dict[str, Any]:
    return {
        "velocity": fits.rmse(parts.held_out, lambda r: fits.simulated(eight, r)),
        "force": fits.force_error(parts.held_out, lambda r: fits.rigid_torque(eight, r)),
        "training": fits.rmse(parts.training, lambda r: fits.simulated(eight, r)),
        "blocks": fits.blocks(parts.held_out, lambda r: fits.simulated(eight, r)),
    }


def output_errors(parts: Parts, row: Drive) -> dict[str, Any]:
    found = {}
    for name, axis in fits.variants(parts.training, row.axis).items():
        eight = fits.output_error(parts.training, axis)
        found[name] = {"parameters": eight.tolist()} | of_rigid(eight, parts)
    return found


def black_boxes(parts: Parts) -> dict[str, Any]:
    theta, order = fits.arx(parts.training)
    velocity = fits.rmse(parts.held_out, lambda r: fits.arx_simulated(theta, order, r))
    found: dict[str, Any] = {"ARX": {"velocity": velocity, "order": order}}
    if importlib.util.find_spec("sysidentpy") is None:
        return found | {"NARX": {"skipped": NO_NARX}}
    from real_narx import narx_rmse

    return found | {"NARX": {"velocity": narx_rmse(parts.training, parts.held_out)}}


def main() -> None:
    parser = argparse.ArgumentParser(description="gaident.diagnose on measured drives", epilog=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("build/real.jsonl"), help="JSON lines; what is in it is not run again")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--only", nargs="+", default=[""], help="cases whose key contains one of these")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--skip-diagnosis", action="store_true")
    which.add_argument("--skip-plain", action="store_true")
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--evidence", action="store_true", help="the tables of docs/evidence.md, from what is there")
    parser.add_argument("--check", action="store_true", help="exit code 1 where an answer is worse than in real_expected.py")
    options = parser.parse_args()
    if options.check and options.skip_diagnosis:
        parser.error("--check asserts what the diagnosis says: leave --skip-diagnosis out")
    options.out.parent.mkdir(parents=True, exist_ok=True)
    there = read(options.out)
    if options.evidence:
        return print(evidence(there))
    chosen = [case for case in cases() if any(text in case.key for text in options.only)]
    absent: dict[str, list[str]] = {}
    for case in chosen if options.check else []:
        if reason := missing(case):
            absent.setdefault(reason, []).append(case.key)
    for reason, keys in absent.items():
        print(f"left out, {reason}: {', '.join(keys)}")
    chosen = [case for case in chosen if not any(case.key in keys for keys in absent.values())]
    if not chosen:
        return
    runs = {"plain": run_plain, "diagnosis": run_diagnosis}
    if options.skip_diagnosis or options.skip_plain:
        del runs["diagnosis" if options.skip_diagnosis else "plain"]
    if not options.report:
        jobs = [(run, case) for case in chosen for part, run in runs.items() if f"{case.key}/{part}" not in there]
        work(options.out, jobs, options.workers)
    lines = read(options.out)
    print(report(lines))
    assert_published(lines)
    if options.check:
        found = worse(lines, chosen, whole=chosen == cases() and not options.skip_plain)
        print("", *(f"worse: {text}" for text in found), f"{len(chosen)} cases, {len(found)} worse than expected", sep="\n")
        sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
