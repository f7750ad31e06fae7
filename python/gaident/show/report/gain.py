"""The chapter "Before and after": free runs and force errors on held-out data, the regression, what the rest depends on."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.axis import said, velocity_unit, word
from gaident.results.diagnosis import Diagnosis
from gaident.results.fitness import Fitness
from gaident.show.diagnosis_summary import DRIVERS, driver_counts, left_words
from gaident.show.gain_words import (
    alone_words,
    comparison_rows,
    fall_words,
    force_rows,
    force_words,
    method_words,
    noise_rows,
    noise_words,
    not_the_loop_words,
)
from gaident.show.html import Html, Row, filled_table, number, table, tag, typeset
from gaident.show.report import charts
from gaident.show.report.parts import Charts, Section, box, needs_record
from gaident.show.report.views import View
from gaident.show.units import with_column
from gaident.show.wording import free_run_words

__all__ = ["gain_section"]


def _free_run(run: Fitness) -> tuple[str, Html]:
    rmse, fit = free_run_words(run, number)
    return rmse, typeset(fit)


def _in_units(rows: Sequence[tuple[str, ...]], what: str, sizes: Sequence[float], si: str, view: View) -> Html:
    """A table, the first of the rows its head, with the sizes [si] in the user's unit too."""
    head, *body = with_column(rows, what, sizes, si, view.scales)
    return table(head, [body])


def gain_section(dia: Diagnosis, view: View, drawn: Charts) -> Section:
    """The chapter."""
    axis = view.axis
    v = velocity_unit(axis)
    extended = bool(dia.model.effects)
    rows: list[tuple[str, ...]] = [("linear model", *_free_run(dia.before))]
    if extended:
        rows.append(("extended model", *_free_run(dia.after)))
    rows += [(what, number(size), "") for what, size in noise_rows(dia)]
    parts: list[str] = []
    if dia.in_sample:
        text = (
            "In-sample: there were too few data, or too little motion, to hold any out. Parameters were fitted to the same "
            "samples: this flatters them."
        )
        parts.append(box(tag("p", text), kind="warn"))
    else:
        parts.append(tag("p", "Free-run simulation on ", dia.held_out, "."))
    sizes = [run.rmse for run in (dia.before, dia.after)[: 1 + extended]] + [size for _, size in noise_rows(dia)]
    parts.append(_in_units([("", f"rmse [{v}]", "fit [%]"), *rows], "rmse", sizes, v, view))
    if noise := noise_words(dia):
        parts.append(tag("p", typeset(said(noise, axis))))
    if not dia.loop_follows:
        parts.append(box(tag("p", typeset(said(not_the_loop_words(dia), axis))), kind="warn"))
    if extended and dia.before.rmse > 0.0:
        parts.append(tag("p", typeset(" ".join(filter(None, (said(fall_words(dia), axis), alone_words(dia)))))))
    parts += _force(dia, view)
    validation = next((r for r in view.runs if r.used == "held out"), None) or next(
        (r for r in view.runs if r.held_out_from is not None), None
    )
    if validation is not None:
        if validation.used == "held out":
            parts.append(tag("h3", validation.name or "validation record"))
        parts.append(drawn.put(charts.held_out_chart(validation, dia.after.noise_floor, "record", axis)))
    elif view.runs and dia.validation_digests:
        parts.append(box(tag("p", "The validation record is not at hand, so its curves are not drawn."), kind="quiet"))
    else:
        parts.append(needs_record(view, "The curves of what was held out need the record."))
    parts += _left(dia, axis) if dia.left else []
    return Section("gain", "Before and after", *parts)


def _left(dia: Diagnosis, axis: str) -> list[str]:
    """What each signal explains of the rest; first what gains most, or where none counts, what takes most of the error away."""
    counts, shares = driver_counts(dia), {} if dia.relevance is None else dia.relevance.shares
    gained = dia.left if counts or dia.driver is None or not shares else shares
    mark = "most" if counts else "closest"
    lines: list[Row] = [
        (
            said(DRIVERS.get(k, k), axis),
            typeset(f"{dia.left[k]:.0f}"),
            mark if k == dia.driver else "",
            typeset(f"{100.0 * shares[k]:.2g}") if k in shares else "",
        )
        for k in sorted(dia.left, key=lambda k: (-gained.get(k, 0.0), -dia.left[k]))
    ]
    verdict = "Nothing of it is significant." if dia.driver is None else typeset(left_words(dia, axis))
    parts: list[str] = [tag("h3", "What the rest depends on")]
    parts.append(tag("p", verdict, " BIC units gained by a free function of each; below 0 it is not worth its parameters."))
    needed = f"A signal counts above {dia.left_needed:.0f} units."
    if dia.driver is None and dia.left_needed > 0.0:
        parts.append(tag("p", needed))
    if dia.driver is not None and not counts:
        parts.append(tag("p", needed, " None does; the closest takes most of the squared error away."))
    parts.append(table(("", "BIC units", "", "of the squared error [%]" if shares else ""), [lines]))
    return parts


def _force(dia: Diagnosis, view: View) -> list[str]:
    """The force error on the same data, and the check by the regression."""
    axis = view.axis
    parts: list[str] = []
    rows = force_rows(dia, axis, view.scales)
    if rows:
        parts += [tag("h3", f"{word('Torque', axis)} error"), tag("p", typeset(force_words(dia, axis)))]
        parts.append(table(rows[0], [[(row[0], *map(typeset, row[1:])) for row in rows[1:]]]))
    both: list[Row] = [tuple(map(typeset, row)) for row in comparison_rows(dia, axis, view.scales)]
    if both:
        parts += [tag("h3", "Check by inverse-dynamics regression"), tag("p", typeset(method_words(dia, axis)))]
        parts.append(filled_table(("", "diagnosis", "regression", "unit", "diagnosis", "regression", ""), both))
    return parts
