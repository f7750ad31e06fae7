"""What the trends of a fleet are: courses of parameters, changes, axes that differ from their siblings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gaident.show.wording import table

__all__ = ["AxisState", "Change", "Course", "Sibling", "Trends", "day_of"]

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Change:
    """A change of a parameter.

    Attributes
    ----------
    axis : str
        The axis.
    quantity : str
        What changed, in words.
    began : str
        Time of the first log behind the change.
    found : str
        Time of the log that showed it.
    log : str
        That first log.
    before, after : float
        Median before and behind the change, in `unit`.
    unit : str
        The unit.
    share : float
        The change as a fraction of the value before [1], without what the temperature explains.
    std : float
        Its standard deviation [1].

    See Also
    --------
    gaident.trends : Makes it, with an example.
    """

    axis: str
    quantity: str
    began: str
    found: str
    log: str
    before: float
    after: float
    unit: str
    share: float
    std: float


@dataclass(frozen=True)
class Course:
    """The course of a parameter of one axis.

    Attributes
    ----------
    axis : str
        The axis.
    quantity : str
        What it is, in words.
    unit : str
        The unit.
    times : tuple of str
        Times of the logs with a usable value, in their order, shape (n,).
    values, deviations : ndarray, shape (n,)
        Values and their standard deviations, in `unit`.
    logs : tuple of str
        The logs, shape (n,).
    with_temperature : bool
        Whether the temperature is known of all of them, so that its line is taken out.
    changes : tuple of Change
        The changes, in the order of time.
    poor : str
        Why the course says nothing of changes; empty where it does.

    See Also
    --------
    gaident.trends : Makes it, with an example.
    """

    axis: str
    quantity: str
    unit: str
    times: tuple[str, ...]
    values: Vector = field(hash=False, compare=False)
    deviations: Vector = field(hash=False, compare=False)
    logs: tuple[str, ...]
    with_temperature: bool
    changes: tuple[Change, ...]
    poor: str


@dataclass(frozen=True)
class Sibling:
    """An axis whose parameter differs from those of its siblings.

    Attributes
    ----------
    axis : str
        The axis.
    quantity : str
        What differs, in words.
    value : float
        Its last level, in `unit`.
    middle : float
        Median of all axes, in `unit`.
    unit : str
        The unit.
    spreads : float
        The distance from the median, in standard deviations of the spread between units.

    See Also
    --------
    gaident.trends : Makes it, with an example.
    """

    axis: str
    quantity: str
    value: float
    middle: float
    unit: str
    spreads: float


@dataclass(frozen=True)
class AxisState:
    """What the last log of an axis says, and how many of its logs say nothing.

    Attributes
    ----------
    axis : str
        The axis.
    logs : int
        Its logs.
    failed : int
        Those that could not be read or diagnosed.
    last : str
        Time of the last log with a result; empty where there is none.
    verdict : str
        Its verdict.
    causes : str
        Its causes.
    log : str
        That log.
    result : str
        Where its JSON is, from the folder of the fleet.

    See Also
    --------
    gaident.trends : Makes it, with an example.
    """

    axis: str
    logs: int
    failed: int
    last: str
    verdict: str
    causes: str
    log: str
    result: str


@dataclass(frozen=True)
class Trends:
    """What `trends` found.

    Attributes
    ----------
    axes : tuple of AxisState
        The axes, by their names.
    courses : tuple of Course
        The courses of their parameters.
    siblings : tuple of Sibling
        Axes that differ from their siblings, the most different first.

    See Also
    --------
    gaident.trends : Makes it, with an example.
    """

    axes: tuple[AxisState, ...]
    courses: tuple[Course, ...]
    siblings: tuple[Sibling, ...]

    @property
    def changes(self) -> tuple[Change, ...]:
        """All changes, in the order in which they were found."""
        return tuple(sorted((c for course in self.courses for c in course.changes), key=lambda c: (c.found, c.axis, c.quantity)))

    @property
    def poor(self) -> tuple[Course, ...]:
        """The courses that say nothing of changes, each with why."""
        return tuple(course for course in self.courses if course.poor)

    @property
    def nothing_to_say(self) -> str:
        """A sentence where no course says anything of changes, with the first reason; else ""."""
        none = bool(self.courses) and len(self.poor) == len(self.courses)
        return f"Nothing can be said of changes yet: {self.poor[0].poor}." if none else ""

    def summary(self) -> str:
        """Return the changes, the axes that differ from their siblings, and what is too poor to say."""
        failed = sum(a.failed for a in self.axes)
        lines = [f"{len(self.axes)} axes, {sum(a.logs for a in self.axes)} logs, {failed} of them without a result", ""]
        if self.changes:
            rows: list[tuple[str, ...]] = [("axis", "what changed", "since", "seen on", "from", "to", "", "change")]
            rows += [_change_row(c) for c in self.changes]
            lines += ["Changes", *table(rows, "  ")]
        else:
            lines.append(self.nothing_to_say or "No changes.")
        if self.siblings:
            apart: list[tuple[str, ...]] = [("axis", "what differs", "value", "middle of all axes", "", "spreads away")]
            apart += [
                (s.axis, s.quantity, f"{s.value:.4g}", f"{s.middle:.4g}", s.unit, f"{s.spreads:+.1f}") for s in self.siblings
            ]
            lines += ["", "Axes that differ from their siblings", *table(apart, "  ")]
        if self.poor:
            lines += ["", f"Too poor to say: {len(self.poor)} of {len(self.courses)} courses ({self.poor[0].poor})"]
        return "\n".join(lines)


def day_of(time: str) -> str:
    """The day of a time: 2026-03-31."""
    return time.partition("T")[0]


def _change_row(c: Change) -> tuple[str, ...]:
    change = f"{c.share:+.0%} +- {c.std:.0%}"
    return c.axis, c.quantity, day_of(c.began), day_of(c.found), f"{c.before:.4g}", f"{c.after:.4g}", c.unit, change


def _sibling_row(s: Sibling) -> tuple[str, ...]:
    return s.axis, s.quantity, f"{s.value:.4g}", f"{s.middle:.4g}", s.unit, f"{s.spreads:+.1f}"
