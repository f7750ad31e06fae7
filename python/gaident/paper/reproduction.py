"""Everything that can be re-created of the paper, in one run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaident.errors import SettingsError
from gaident.models.mechanics import Mechanics
from gaident.paper.checks import IdentifiedMechanics, NominalCheck, TableV, identified_mechanics, nominal_check, table_v
from gaident.paper.conventional import MethodComparison, both
from gaident.paper.experiment import FRICTION, Engine, StepTest, step_test
from gaident.paper.facts import MECHANISMS, TRIALS, Mechanism
from gaident.paper.friction import FrictionTest, friction_test
from gaident.version import version

__all__ = ["Reproduction", "reproduce"]

SEEDS = 100
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Part:
    """All that concerns one of the paper's two mechanisms. comparisons: the rig without and with friction."""

    mechanism: Mechanism
    nominal: NominalCheck
    identified: IdentifiedMechanics
    table_v: TableV
    step: StepTest
    comparisons: tuple[MethodComparison, MethodComparison]
    friction: FrictionTest


@dataclass(frozen=True)
class Reproduction:
    """What `reproduce` computed. seconds: wall clock; cpu_seconds: of this process, all threads."""

    parts: tuple[Part, Part]
    trials: int
    seeds: int
    seed: int
    seconds: float
    cpu_seconds: float
    processors: int
    version: str

    def to_dict(self) -> dict[str, Any]:
        """The numbers for JSON, without the records."""
        return {
            "schema": "gaident/reproduction",
            "schema_version": 1,
            "gaident_version": self.version,
            "trials": self.trials,
            "seeds": self.seeds,
            "seed": self.seed,
            "seconds": self.seconds,
            "mechanisms": {part.mechanism.key: _part_dict(part) for part in self.parts},
        }


def reproduce(
    trials: int = TRIALS, seeds: int = SEEDS, seed: int = 0, workers: int | None = None, progress: Progress | None = None
) -> Reproduction:
    """Tables III to V and Figs. 6 to 8 of the paper, the conventional method, and the friction that the paper suspects.

    trials   genetic runs per engine and mechanism (Fig. 7: 20)
    seeds    noise seeds of the comparison with least squares
    seed     the first seed of everything random; the same seed gives the same result, times apart
    workers  threads; None: all processors
    progress called now and then with (fraction done, message)

    Raises SettingsError.
    """
    for name, value, lowest in (("trials", trials, 1), ("seeds", seeds, 2), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < lowest:
            raise SettingsError(f"{name} is {value!r}: give a whole number, {lowest} or more")
    began, cpu = time.perf_counter(), time.process_time()
    done = 0.0

    def say(message: str, share: float) -> None:
        nonlocal done
        if progress is not None:
            progress(min(done, 1.0), message)
        done += share

    parts = []
    for mechanism in MECHANISMS:
        step = step_test(mechanism, trials, seed, workers, lambda message: say(message, 0.02))
        say(f"{mechanism.title}: least squares and genetic identification, {seeds} noise seeds", 0.34)
        comparisons = both(mechanism, FRICTION, seeds, seed, workers)
        say(f"{mechanism.title}: diagnosis", 0.1)
        parts.append(
            Part(
                mechanism,
                nominal_check(mechanism),
                identified_mechanics(mechanism),
                table_v(mechanism),
                step,
                comparisons,
                friction_test(mechanism, step.record, seed),
            )
        )
    return Reproduction(
        (parts[0], parts[1]),
        trials,
        seeds,
        seed,
        time.perf_counter() - began,
        time.process_time() - cpu,
        os.cpu_count() or 1,
        version(),
    )


def _part_dict(part: Part) -> dict[str, Any]:
    names = part.mechanism.names
    friction = part.friction

    def values(mechanics: Mechanics | None) -> dict[str, float] | None:
        return None if mechanics is None or not hasattr(mechanics, names[0]) else {n: getattr(mechanics, n) for n in names}

    return {
        "table_3_to_4": {"worst_relative_deviation": part.nominal.worst},
        "table_4_mechanics": {
            key: None if found is None else found.to_dict() for key, found in vars(part.identified).items()
        },
        "table_5": {
            "from_table_4": part.table_v.scaled.tolist(),
            "printed": part.table_v.printed.tolist(),
            "worst_relative_deviation": part.table_v.worst,
            "with_printed_gains": part.table_v.worst_with_printed_gains,
            "conventional_column_apart": part.table_v.conventional_apart,
            "conventional_mechanics": values(part.table_v.conventional),
        },
        "rig": {
            "nominal_fitness": part.step.nominal_fitness,
            "engines": {e.key: _engine_dict(e) for e in part.step.engines},
            "with_the_loop_gain_of_table_5": {
                "nominal_fitness": part.step.scaled_nominal,
                "mean_fitness": float(np.mean(part.step.scaled_final)),
                "best_fitness": min(part.step.scaled_final),
            },
        },
        "conventional": [
            {
                "friction": c.friction.coulomb > 0.0,
                "truth": c.truth.tolist(),
                "methods": {
                    m.key: {"bias": m.bias(c.truth).tolist(), "spread": m.spread.tolist(), "right": m.right} for m in c.methods
                },
            }
            for c in part.comparisons
        ],
        "friction": {
            "step_only": friction.step_only.verdict,
            "verdict": friction.diagnosis.verdict,
            "findings": [
                {
                    "effect": f.effect,
                    "alternatives": list(f.alternatives),
                    "parameters": {n: e.value for n, e in f.parameters.items()},
                }
                for f in friction.diagnosis.findings
            ],
            "held_out": friction.diagnosis.held_out,
            "rmse": [friction.diagnosis.before.rmse, friction.diagnosis.after.rmse],
            "nominal": values(part.mechanism.sheet),
            "linear_on_the_step": values(friction.linear_step),
            "linear": values(friction.linear),
            "extended": values(friction.extended),
        },
    }  # fmt: skip


def _engine_dict(engine: Engine) -> dict[str, Any]:
    return {
        "trials": engine.trials,
        "right_structure": engine.right,
        "at_the_optimum": engine.optimal,
        "mean_fitness": float(np.mean(engine.final)),
        "best_fitness": engine.best.fitness,
        "seconds": engine.seconds,
        "generations": engine.generations,
    }
