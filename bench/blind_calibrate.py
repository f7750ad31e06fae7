"""Calibrated numbers of the policy: what records that hide nothing show, and the values that follow from it.

`python bench/blind.py --calibrate` diagnoses records of the group `clean`, takes four statistics of each, and writes
`python/gaident/policy/calibrated.json`, which the policy reads:

    effect_penalty    the penalty per effect [BIC units] at which the best of all effects would just be added to the linear model:
                      its fall of BIC, 2 ln(orders) taken off, over the effects that it counts as
    dependence_gain   the largest gain of a free function of one signal beside the selected model [BIC units]
    noise_ratio       rms of the selected model's whitened errors over the noise of the velocity
    free_run_ratio    rms of the free run's errors over that noise

The first two are divided by 1 + short_record/N, by which the policy multiplies what it asks for.
The logged and the replayed torque of such a record are the same: it is taken once, in turn with and without a logged torque.

With x_1 >= x_2 >= ... the n values of a statistic, the level that a share p of all records exceeds follows from an exponential
tail through the upper tenth of them (peaks over a threshold; Pickands 1975, shape 0):

    level = x_m + b ln(m/(n p)),   m = n/10,   b = mean(x_1 .. x_m) - x_m

with p the `noise_level` of the policy. The value is the level to two digits.
"""

from __future__ import annotations

import importlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

import gaident as ga
from drive_cases import random_case
from gaident.diagnosis.selection.select import Selection
from gaident.estimation.objective import Objective
from gaident.policy.table import POLICY

STATISTICS = ("effect_penalty", "dependence_gain", "noise_ratio", "free_run_ratio")
TAIL = 0.1  # share of the values that the tail is fitted to
OUT = Path(__file__).resolve().parents[1] / "python" / "gaident" / "policy" / "calibrated.json"


def wanted(cell: Any) -> bool:
    """Whether a cell is measured: with and without a logged torque in turn."""
    return bool(cell.torque == bool(cell.seed % 2))


def measure(cell: Any) -> dict[str, Any]:
    """The statistics of one record without effects, as a line of the file."""
    record, validation, controller, _ = random_case(cell.seed, (), cell.kind, cell.noise, cell.torque)
    found: list[Selection] = []
    diagnosis = importlib.import_module("gaident.diagnosis.work")
    selected = diagnosis.selected

    def kept(*arguments: Any, **named: Any) -> Selection:
        found.append(selected(*arguments, **named))
        return found[-1]

    with mock.patch.object(diagnosis, "selected", kept):
        dia = ga.diagnose(record, controller=controller, validation=validation)
    space, final = found[-1].space, found[-1].final
    count = space.objective.count
    short = 1.0 + POLICY.short_record / count
    line: dict[str, Any] = {"key": key_of(cell), "seed": cell.seed, "samples": int(count), "whitened": space.whitens}
    if not space.whitens:  # its penalty is another one
        return line
    return line | {
        "effect_penalty": _penalty(found[-1]),
        "dependence_gain": max(dia.left.values()) / short,
        "noise_ratio": space.ratio(final),
        "free_run_ratio": dia.after.rmse / dia.after.noise_floor,
    }


def key_of(cell: Any) -> str:
    return f"calibrate/{cell.key}"


def _penalty(selection: Selection) -> float | None:
    """The penalty per effect at which the best one would just be added to the linear model; None: none was worth a fit."""
    space, base = selection.space, selection.base
    objective = space.objective
    fresh = Objective(objective.data, objective.weight, objective.family, objective.measured)  # that remembers no growth
    one, two = (
        replace(space, objective=fresh, policy=replace(POLICY, effect_penalty=p, hope=-1e9), note=lambda _: None)
        for p in (1.0, 2.0)
    )
    with np.errstate(over="ignore", invalid="ignore"):
        fits = one.add(base)
    penalties = []
    for fit in fits:
        simpler = one.under_predictor_of(base, fit)
        fall, less = (space.score(simpler) - space.score(fit) for space in (one, two))
        if fall > less:  # it is not where only the masses' resonance moves
            penalties.append(1.0 + fall / (fall - less))
    return max(penalties, default=None)


def level(values: Sequence[float], p: float = POLICY.noise_level) -> float:
    """What a share p of all records exceeds, by an exponential tail.

    >>> values = -np.log((np.arange(1000) + 0.5) / 1000)  # exponential: P(x > a) = exp(-a)
    >>> bool(abs(level(values, 1e-4) + math.log(1e-4)) < 0.2)
    True
    """
    x = np.sort(np.asarray(values, dtype=float))[::-1]
    m = max(round(TAIL * len(x)), 2)
    b = float(x[:m].mean() - x[m - 1])
    return float(x[m - 1] + b * math.log(m / (len(x) * p)))


def calibrated(lines: Mapping[str, Mapping[str, Any]], cases: int, seed: int) -> dict[str, Any]:
    """What the file says: command, count of records, and for each statistic its largest values and the value that follows."""
    numbers = {}
    for name in STATISTICS:
        values = [float(line[name]) for line in lines.values() if line.get(name) is not None]
        numbers[name] = {"value": float(f"{level(values):.2g}"), "largest": round(max(values), 3), "records": len(values)}
    return {
        "command": f"python bench/blind.py --calibrate --cases {cases} --seed {seed}",
        "records": len(lines),
        "seed": seed,
        "level": POLICY.noise_level,
        "numbers": numbers,
    }


def write(path: Path, content: Mapping[str, Any]) -> None:
    """Writes the file of calibrated numbers."""
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
