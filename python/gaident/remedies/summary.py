"""A retuning as text."""

from __future__ import annotations

import textwrap

from gaident.axis import called, said, unit, unit_text
from gaident.results.retuning import Retuning
from gaident.show.report.retuning_words import added_filters, asked_words, figure_rows, gain_rows
from gaident.show.wording import WIDTH, number, table

__all__ = ["retuning_summary"]

GAINS = ("", "before", "proposed", "")  # head of the table of gains


def retuning_summary(result: Retuning, axis: str = "rotary") -> str:
    """Doubts first, then the gains, the loop before and after, what a simulation found, and notes."""
    sections = [
        [line for doubt in result.doubts for line in textwrap.wrap(f"Warning: {said(doubt, axis)}", WIDTH)],
        _gains(result, axis),
        _figures(result, axis),
        _starts(result, axis),
        [line for s in result.simulated for line in textwrap.wrap(said(s, axis), WIDTH)],
        _mended(result, axis),
        [line for note in result.notes for line in textwrap.wrap(said(note, axis), WIDTH)],
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _gains(result: Retuning, axis: str) -> list[str]:
    rows: list[tuple[str, ...]] = [GAINS, *(row[: len(GAINS)] for row in gain_rows(result, axis, {}))]
    added = [f"  added: {one}" for one in added_filters(result)]
    return ["Gains", *table(rows), *added, *textwrap.wrap(asked_words(result, axis), WIDTH)]


def _figures(result: Retuning, axis: str) -> list[str]:
    rows: list[tuple[str, ...]] = [("", "before", "95 % of the drives", "after", "95 % of the drives", "")]
    head = "The loop" if result.before.stable.value == 1.0 else "The loop, which is NOT STABLE under the given gains"
    return [head, *table([*rows, *figure_rows(result, axis)])]


def _starts(result: Retuning, axis: str) -> list[str]:
    head = ("rule", "kp", "ki", "stiffness", said(unit_text("N m/rad"), axis) if axis == "rotary" else unit("N m/rad", axis))
    rows = [head]
    for s in result.starts:
        rows.append((s.name, number(s.kp), number(s.ki), number(s.stiffness), "" if s.keeps else "does not keep what was asked"))
    return [f"Classical rules; the search began from: {result.rule}", *table(rows)]


def _mended(result: Retuning, axis: str) -> list[str]:
    if not result.mended:
        return []
    rows = [("if mended", "error now", "then", unit("rad/s", axis))]
    rows += [(str(said(called(name), axis)), number(now), number(then), "") for name, now, then in result.mended]
    return [
        "If a cause is mended, the error of the velocity under the proposal, rms once a step has settled, and at a slow speed",
        *table(rows),
    ]
