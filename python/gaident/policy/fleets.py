"""What the course of a parameter over months shows: changes, and axes that differ; with unit, source and command."""

from __future__ import annotations

from dataclasses import dataclass

from gaident.policy.declared import course

__all__ = ["Courses"]


@dataclass(frozen=True)
class Courses:
    """See the module; `gaident.policy.table.rows()` lists these rows among the others."""

    course_alarms: float = course(0.0025, "1/year", "false alarms of one course by chance at most; an axis has some ten courses")
    course_before: int = course(20, "logs", "before a change at least: their scatter is the scale of everything behind them")
    course_after: int = course(3, "logs", "behind a change at least: one or two may be a damaged log")
    course_clip: float = course(3.5, "1", "standard deviations at most by which one log counts for a change")
    course_apart: float = course(
        1.5, "1", "standard deviations, by which a log counts further than those behind a change agree: their own scatter"
    )
    course_known: float = course(
        0.9, "1", "of the logs before a change, that the scale of their scatter knows: what was left out may have been scatter"
    )
    course_material: float = course(0.05, "1", "of the value: a change that is less is none of the axis that matters")
    course_unsure: float = course(0.5, "1", "of a value: one whose deviation is more has no place in a course")
    course_scatter: float = course(0.005, "1", "of the value, that logs of one axis scatter at least, whatever they show")
    sibling_level: float = course(0.01, "probability", "that one of all axes differs from its siblings by chance")
    siblings: int = course(5, "axes", "of which one may differ: fewer say nothing about the spread between units")
