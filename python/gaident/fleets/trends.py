"""trends(): the course of every parameter of every axis, what changed, which axis differs from its siblings, what is too poor."""

from __future__ import annotations

import os
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from gaident.checks import checked_path, yes_or_no
from gaident.errors import SettingsError
from gaident.fleets.changes import MAD, Scale, levels_of, shifts_of
from gaident.fleets.courses import AxisTables, Quantity, RawCourse, axes_of, courses_of, logs_a_year
from gaident.fleets.found import AxisState, Change, Course, Sibling, Trends
from gaident.fleets.page import write_page
from gaident.policy.table import POLICY

__all__ = ["trends"]

Vector = NDArray[np.float64]


def trends(
    fleet: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    reports: bool = True,
) -> Trends:
    """Show what changed on which axis of a fleet, and which axis differs from the others.

    The course of each parameter of each axis is followed log by log; a change is one beyond the scatter of the logs before it.
    The rule compares the last 3 to 34 logs with those before, 20 at least, whose scatter is the scale.
    Its bound is set for 0.0025 false alarms of a course in a year at most, one in 40 years of an axis with ten courses, where the
    scatter of its logs is independent; the measured rates of false alarms, recall and delay stand in docs/how-to/fleets.md.
    Where logs of a course have a temperature, its line through the logarithm of the parameter is taken out.

    Parameters
    ----------
    fleet : str or path-like
        The folder that `fleet` wrote.
    out : str or path-like, optional
        Where to write it as one HTML page that needs no network: the fleet as a table, the courses, the changes.
    reports : bool
        With `out`, write the report of the last log of each axis, and of the first behind each change, beside the page, which
        opens them.

    Returns
    -------
    Trends
        The courses with their changes, and the axes that differ.

    Raises
    ------
    GaidentError
        Where the folder contains no fleet.
    OSError
        Where the page cannot be written.

    Examples
    --------
    >>> import numpy as np
    >>> import os
    >>> import gaident as ga
    >>> os.makedirs("logs/press", exist_ok=True)
    >>> torque = np.repeat([1.0, -1.0, 0.5, -0.5], 60)
    >>> still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    >>> velocity = ga.simulate(ga.OneMass(J=0.01, D=0.05), still) + 0.01 * np.random.default_rng(1).standard_normal(240)
    >>> table = np.column_stack([still.time, torque, velocity])
    >>> np.savetxt("logs/press/2026-03-01.csv", table, delimiter=",", header="time,torque,velocity", comments="")
    >>> found = ga.fleet("logs/press/*.csv", out="fleet", method="identify", executor=map)
    >>> shown = ga.trends("fleet")
    >>> len(shown.axes), shown.changes
    (1, ())
    >>> shown.poor[0].poor
    'only 1 usable log; a change shows from 23 on'
    """
    folder = checked_path(fleet, "fleet", SettingsError)
    yes_or_no(reports, "reports", SettingsError)
    target = None if out is None else checked_path(out, "out", SettingsError)
    states: list[AxisState] = []
    courses: list[Course] = []
    levels: dict[Quantity, list[tuple[str, float, str]]] = {}
    for tables in axes_of(folder):
        states.append(_state(tables))
        for quantity, raw in courses_of(tables.parameters).items():
            course, level = _followed(tables.axis, quantity, raw)
            courses.append(course)
            if level is not None:
                levels.setdefault(quantity, []).append((tables.axis, level, raw.unit))
    found = Trends(tuple(states), tuple(courses), _siblings(levels))
    if target is not None:
        write_page(found, folder, target, reports)
    return found


def _state(tables: AxisTables) -> AxisState:
    done = [row for row in tables.logs if row["status"] == "done"]
    last: Mapping[str, object] = done[-1] if done else {}
    said = [str(last.get(name) or "") for name in ("time", "verdict", "causes", "log", "result")]
    return AxisState(tables.axis, len(tables.logs), len(tables.logs) - len(done), *said)


def _followed(axis: str, quantity: Quantity, raw: RawCourse) -> tuple[Course, float | None]:
    """(the course with its changes, the level of its last stretch, None where no log shows one)."""
    count, needed = len(raw.values), POLICY.course_before + POLICY.course_after
    poor = "" if count >= needed else f"only {count} usable log{'' if count == 1 else 's'}; a change shows from {needed} on"
    if raw.unusable:
        poor += f"; {raw.unusable} at a bound or undetermined" if poor else ""
    changes: tuple[Change, ...] = ()
    level = None
    if count:
        scale = Scale.of_course(raw.values)
        y, s = scale(raw.values, raw.deviations)
        shifts = shifts_of(y, s, raw.temperatures, logs_a_year(raw.times)) if not poor else []
        level = levels_of(raw.values, shifts)[-1][2]
        # What is said of a change rests on the logs up to that which showed it, and stays.
        changes = tuple(
            Change(
                *(axis, str(quantity), raw.times[shift.first], raw.times[shift.found], raw.logs[shift.first]),
                *(_median(raw.values[begin : shift.first]), _median(raw.values[shift.first : shift.found + 1]), raw.unit),
                *scale.share(shift.size, shift.std),
            )
            for begin, shift in zip((0, *(s.first for s in shifts)), shifts, strict=False)
        )
    return Course(
        *(axis, str(quantity), raw.unit, raw.times, raw.values, raw.deviations, raw.logs),
        *(raw.temperatures is not None, changes, poor),
    ), level


def _median(values: Vector) -> float:
    return float(np.median(values))


def _siblings(levels: Mapping[Quantity, list[tuple[str, float, str]]]) -> tuple[Sibling, ...]:
    """The axes whose level is off the median of all by more than their spread explains.

    The level is that of the logarithm where all are positive; the bound holds for all axes of one quantity together.
    """
    found = []
    for quantity, listed in levels.items():
        if len(listed) < POLICY.siblings:
            continue
        values = np.array([value for _, value, _ in listed])
        y, _ = Scale.of(values)(values, np.zeros(len(values)))
        middle = float(np.median(y))
        spread = max(MAD * float(np.median(np.abs(y - middle))), POLICY.course_scatter)
        bound = float(norm.isf(0.5 * POLICY.sibling_level / len(listed)))
        # The spread of few axes is itself uncertain, by 1.17/sqrt(2 n) of it for the median deviation.
        bound *= 1.0 + bound / np.sqrt(len(listed))
        for (axis, value, unit), own in zip(listed, y, strict=True):
            away = (float(own) - middle) / spread
            if abs(away) > bound and abs(own - middle) > POLICY.course_material:
                found.append(Sibling(axis, str(quantity), value, float(np.median(values)), unit, away))
    return tuple(sorted(found, key=lambda s: -abs(s.spreads)))
