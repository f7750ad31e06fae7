"""What every method gets of a blind case, and what it gives back.

Each method sees the same record (command, velocity, torque), the controller, and what everybody is told for nothing:
the linear model that `ga.identify` finds, and what a replay of the controller shows of its limits.
The held-out record is for the free run alone: no method may look at it before it has decided.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import SimpleNamespace
from typing import Any, TypeVar

import blind_refit
import numpy as np
from blind import Cell, case_of
from numpy.typing import NDArray

import gaident as ga
from blind_judge import judge
from drive_cases import Truth
from drive_rig import OUTSIDE

T = TypeVar("T")
Vector = NDArray[np.float64]
Values = dict[str, dict[str, float]]
"""Effect -> parameter -> value, SI units."""


@dataclass(frozen=True)
class Answer:
    """What a method says of one record at one threshold.

    effects: each named effect with the parameters that the method gives it, {} where it gives none.
    sets: of each finding the names that the method cannot tell apart; empty: each name is a set of its own.
    rmse: of the free run over the held-out record [rad/s]; None where the method has none.
    """

    effects: Values
    sets: tuple[tuple[str, ...], ...] = ()
    rmse: float | None = None
    findings: tuple[Any, ...] | None = None
    verdict: str = ""
    driver: str | None = None

    def judged(self, truth: Values) -> dict[str, Any]:
        """The judgement of the blind tests, the same code for every method."""
        findings = self.findings
        if findings is None:
            findings = tuple(
                SimpleNamespace(
                    effect=name,
                    alternatives=(),
                    is_noise=False,
                    parameters={parameter: SimpleNamespace(value=value) for parameter, value in values.items()},
                )
                for name, values in self.effects.items()
            )
        said = SimpleNamespace(findings=findings, verdict=self.verdict or ("explained" if findings else "adequate"))
        said.driver = self.driver
        return judge(said, truth).as_dict()


@dataclass(frozen=True, eq=False)
class Case:
    """One blind case with what everybody is told of it."""

    cell: Cell
    record: ga.Record
    validation: ga.Record | None
    controller: ga.PI | ga.Cascade | None
    truth: Truth
    memory: dict[str, Any] = field(default_factory=dict)  # what the methods that share a computation share,
    costs: dict[str, float] = field(default_factory=dict)  # and the seconds that each of it took
    used: set[str] = field(default_factory=set)  # of it, what the method that runs has used

    def shared(self, key: str, make: Callable[[], T]) -> T:
        """What several methods compute alike: made once, its seconds counted for each of them (`timed`)."""
        if key not in self.memory:
            began = time.perf_counter()
            self.memory[key] = make()
            self.costs[key] = time.perf_counter() - began
        else:
            self.used.add(key)
        found: T = self.memory[key]
        return found

    def timed(self, method: Callable[[Case], T]) -> tuple[T, float]:
        """(what a method answers, its seconds with those of what an earlier method has computed for it)."""
        there = set(self.memory)
        self.used.clear()
        began = time.perf_counter()
        answer = method(self)
        seconds = time.perf_counter() - began
        return answer, seconds + sum(self.costs[key] for key in self.used & there)

    @cached_property
    def digest(self) -> str:
        """Of every number that a method sees."""
        both = (self.record, self.validation)
        parts = [x.tobytes() for r in both if r is not None for x in (r.command, r.velocity, r.torque) if x is not None]
        return hashlib.sha256(b"".join(parts)).hexdigest()[:16]

    @property
    def identified(self) -> ga.Identification:
        """The linear model of the record."""
        pi = self.controller if isinstance(self.controller, ga.PI) else None
        return self.shared("identified", lambda: ga.identify(self.record, pi, workers=1))

    @cached_property
    def before(self) -> float:
        """rmse of the linear model's free run over the held-out record [rad/s]."""
        return self.free_run(self.identified.model)

    def free_run(self, model: ga.Model) -> float:
        """rmse of a model's free run over the held-out record, in the controller's loop [rad/s]; nan without such a record."""
        if self.validation is None:
            return float("nan")
        try:
            run = ga.simulate(model, self.validation, self.controller)
        except ga.GaidentError:
            return float("inf")
        error = self.validation.velocity - run
        return float(np.sqrt(np.mean(error**2))) if np.all(np.isfinite(error)) else float("inf")

    @cached_property
    def oracle(self) -> float | None:
        """The same of the true structure, refitted to the record by the simulated drive itself; None where nothing is to fit."""
        effects = self.cell.effects
        inside = effects and not set(effects) & set(OUTSIDE) and not self.cell.loop
        if not inside or self.validation is None:
            return None
        return blind_refit.oracle(self.truth, self.record.velocity, self.validation.velocity)


@lru_cache(maxsize=2)
def drawn(cell: Cell) -> Case:
    """The case of a cell; of the last two cells it is kept, for the methods that follow. Raises RuntimeError as `case_of`."""
    return Case(cell, *case_of(cell))
