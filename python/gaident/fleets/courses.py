"""The courses of an axis: a parameter over time, out of the tables of a fleet."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.terms import LIBRARY
from gaident.fleets.dataset import parts_of, read_part
from gaident.policy.table import POLICY
from gaident.results.estimate import ANGULAR

__all__ = ["AxisTables", "Quantity", "RawCourse", "axes_of", "courses_of", "logs_a_year"]

Vector = NDArray[np.float64]

HOUR = 3600.0  # no decision: a unit: seconds
YEAR = 365.25 * 24.0 * HOUR  # no decision: a unit: seconds

FOLLOWED = ("mechanics", "friction", "cause", "linear model")
"""What of the table of parameters has a course; a regression says the same as mechanics and friction, less exactly."""
PLACES_OF_PHASE = frozenset({"order"}) | ANGULAR - {"frequency", "zero_frequency", "bandwidth"}
"""Parameters that say where something is, not how large."""


class Quantity(NamedTuple):
    """What is followed: a parameter of an effect, of one order where it has one, or of the axis (effect "")."""

    of: str
    effect: str
    side: str
    order: int | None
    parameter: str

    def __str__(self) -> str:
        words = [self.parameter.replace("_", " ")]
        if self.effect:
            words.append(f"of {self.effect.replace('_', ' ')}")
        if self.order is not None:
            words.append(f"(order {self.order})")
        if self.side in ("motor", "load"):
            words.append(f"at the {self.side}")
        return " ".join(words)


@dataclass(frozen=True)
class RawCourse:
    """The values of a quantity with their deviations, times, temperatures (nan: not logged) where a log has one, and logs."""

    unit: str
    times: tuple[str, ...]
    values: Vector
    deviations: Vector
    temperatures: Vector | None
    logs: tuple[str, ...]
    unusable: int  # values at a bound, or that their logs do not determine


@dataclass(frozen=True)
class AxisTables:
    """All rows of an axis, in the order of time."""

    axis: str
    logs: list[dict[str, Any]]
    parameters: list[dict[str, Any]]


def axes_of(folder: Path) -> Iterator[AxisTables]:
    """The axes of a fleet, one after the other: no more than one is in memory. Raises ReadError."""
    parameters = {(axis, month): file for axis, month, file in parts_of(folder, "parameters")}
    logs = [(axis, month, file) for axis, month, file in parts_of(folder, "logs")]
    for name in sorted({axis for axis, _, _ in logs}):
        own = [(month, file) for axis, month, file in logs if axis == name]
        rows = [row for _, file in own for row in read_part(file, "logs")]
        found = [p for month, _ in own if (name, month) in parameters for p in read_part(parameters[name, month], "parameters")]
        yield AxisTables(name, sorted(rows, key=_when), sorted(found, key=_when))


def _when(row: Mapping[str, Any]) -> tuple[str, str]:
    return str(row["time"]), str(row["log"])


def courses_of(parameters: Iterable[Mapping[str, Any]]) -> dict[Quantity, RawCourse]:
    """The courses of an axis, those of its mechanics first."""
    rows: dict[Quantity, list[Mapping[str, Any]]] = {}
    for row in parameters:
        if row["of"] in FOLLOWED and row["parameter"] not in PLACES_OF_PHASE and not _is_level(row):
            side = "" if "|" in (row["side"] or "") else row["side"] or ""
            quantity = Quantity(row["of"], row["effect"] or "", side, row["order"], row["parameter"])
            rows.setdefault(quantity, []).append(row)
    order = sorted(rows, key=lambda q: (FOLLOWED.index(q.of), q.effect, q.side, q.order or 0, q.parameter))
    return {quantity: _course(rows[quantity]) for quantity in order}


def logs_a_year(times: Sequence[str]) -> float:
    """How many logs a year a course has, of the median step of its first logs, so that no later one changes it.

    Logs whose times are less than an hour apart count as hourly: names with a day alone say no more of several logs in one.
    """
    first = [datetime.fromisoformat(time) for time in times[: POLICY.course_before]]
    steps = [(b - a).total_seconds() for a, b in pairwise(first)]
    return YEAR / max(float(np.median(steps)), HOUR)


def _is_level(row: Mapping[str, Any]) -> bool:
    """Whether it is the level of dry friction, which is followed whichever of its forms was named."""
    term = LIBRARY.get(row["effect"] or "")
    return term is not None and term.levels and row["parameter"] == "torque"


def _course(rows: list[Mapping[str, Any]]) -> RawCourse:
    usable = [r for r in rows if _usable(r)]
    heat = np.array([math.nan if r["temperature"] is None else r["temperature"] for r in usable], dtype=np.float64)
    return RawCourse(
        rows[0]["unit"],
        tuple(r["time"] for r in usable),
        np.array([r["value"] for r in usable], dtype=np.float64),
        np.array([r["std"] for r in usable], dtype=np.float64),
        heat if np.any(np.isfinite(heat)) else None,
        tuple(r["log"] for r in usable),
        len(rows) - len(usable),
    )


def _usable(row: Mapping[str, Any]) -> bool:
    value, std = row["value"], row["std"]
    if value is None or std is None or not (math.isfinite(value) and math.isfinite(std) and value != 0.0):
        return False
    return not row["at_bound"] and std < POLICY.course_unsure * abs(value)
