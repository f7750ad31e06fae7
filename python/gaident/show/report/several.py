"""A page of several results: before and after a repair, the axes of a machine. What each says, and what differs between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from gaident.axis import identifier_words, unit, velocity_unit
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate, of_axis
from gaident.results.identification import Identification
from gaident.show.chart import Chart
from gaident.show.diagnosis_charts import missing_over_velocity
from gaident.show.html import Html, Row, joined, number, table, tag, typeset
from gaident.show.report import diagnosis, identification
from gaident.show.report.charts import run_chart
from gaident.show.report.parts import Charts, Section, box, estimate, records_table, sentences
from gaident.show.report.views import View
from gaident.show.units import beside
from gaident.show.wording import cause_words, either

__all__ = ["Shown", "several"]

Shown = tuple[str, Diagnosis | Identification, View]
"""A result with its name in the page, and what the page knows beside it."""


def several(results: Sequence[Shown], drawn: Charts) -> list[Section]:
    """An overview, what differs, then a chapter for each result."""
    own = [_own(i, *shown, drawn) for i, shown in enumerate(results)]
    return [_overview(results), _differences(results), *own, _how(results)]


def _overview(results: Sequence[Shown]) -> Section:
    """A row for each result."""
    rows: list[Row] = []
    for i, (name, result, view) in enumerate(results):
        _, sign, verdict = diagnosis.mark(result) if isinstance(result, Diagnosis) else identification.mark(result)
        v, size = view.scales.get(velocity_unit(view.axis), (velocity_unit(view.axis), 1.0))
        sizes = (
            (result.before.rmse, result.after.rmse, result.after.noise_floor)
            if isinstance(result, Diagnosis)
            else (result.rmse, None, result.adequacy.noise_std)
        )
        errors = [None if e is None else number(size * e) for e in sizes]
        link = tag("a", name, href=f"#result-{i}")
        rows.append((link, f"{sign} {verdict}", typeset(_causes(result, view.axis)), *errors, typeset(v)))
    head = (
        "",
        "verdict",
        "cause",
        "error, linear model",
        "with the effects",
        "noise (of a linear model alone: white part of its error)",
        "",
    )
    return Section("overview", "Overview", tag("div", table(head, [rows]), class_="overview"))


def _causes(result: Diagnosis | Identification, axis: str) -> str:
    if isinstance(result, Identification):
        return "not asked: a linear model alone"
    named = (either(f, result, axis) if f.alternatives else cause_words(f, result, axis, sized=True) for f in result.causes)
    return ", ".join(named) or "none"


def _differences(results: Sequence[Shown]) -> Section:
    """Every number that two of them have, side by side; beside the first one, which of them differ beyond their deviations."""
    tables = [_numbers(result, view.axis) for _, result, view in results]
    names = list(dict.fromkeys(key for numbers in tables for key in numbers))
    rows: list[Row] = []
    for what, si in names:
        found = [numbers.get((what, si)) for numbers in tables]
        first = found[0]
        cells: list[str | Html | None] = []
        for e, (_, _, view) in zip(found, results, strict=True):
            more = "" if e is None else beside(view.scales, what, e.value, e.std, si)
            shown = None if e is None else estimate(e.value, e.std)
            cells.append(shown if shown is None or not more else joined((shown, tag("br"), tag("small", typeset(more)))))
        changes = [change_words(first, e) for e in found[1:] if first is not None and e is not None]
        rows.append((what, *cells, typeset(si), "; ".join(changes)))
    head = ("", *(name for name, _, _ in results), "", f"against {results[0][0]}")
    text = (
        "± is one standard deviation. A value counts as changed where it moved by more than "
        f"{POLICY.check_deviations:.0f} deviations of both together; an effect without a value was not found there."
    )
    return Section("differences", "What differs", table(head, [rows]), tag("p", tag("small", text)))


def _numbers(result: Diagnosis | Identification, axis: str) -> dict[tuple[str, str], Estimate]:
    """(name, unit) -> value: of the mechanism, then of what was found."""
    found: dict[tuple[str, str], Estimate] = {}
    if isinstance(result, Diagnosis):
        rows = [(identifier_words(name, axis), name, e) for name, e in result.mechanics.items()]
        for f in result.causes:
            words = cause_words(f, result, axis)
            rows += [(f"{words}: {identifier_words(name, axis)}", name, e) for name, e in f.parameters.items()]
        for words, name, e in rows:
            shown = of_axis(name, e, axis)
            found[words, "" if shown.unit == "1" else shown.unit] = shown
    elif result.mechanics is not None:
        m = result.mechanics
        for words, name, si in (("inertia", "J", "kg m^2"), ("viscous friction", "D", "N m s/rad")):
            value = getattr(m, name)
            std = m.std.get(name, math.inf)
            found[identifier_words(words.replace(" ", "_"), axis), unit(si, axis)] = Estimate(value, std, si)
    return found


def change_words(old: Estimate, new: Estimate) -> str:
    """By how much a value changed, and whether that is more than both deviations."""
    if old.value == new.value:
        return "the same"
    apart = abs(new.value - old.value) > POLICY.check_deviations * math.hypot(old.std, new.std)
    share = f"{100.0 * (new.value / old.value - 1.0):+.1f} %" if old.value else ""
    return f"changed {share}".strip() if apart else "within the deviations"


def _own(i: int, name: str, result: Diagnosis | Identification, view: View, drawn: Charts) -> Section:
    """What one result says, with the two figures that show most of it."""
    if isinstance(result, Diagnosis):
        head, tiles, noise = diagnosis.head(result, view), diagnosis.tiles(result, view), result.after.noise_floor
    else:
        head, tiles, noise = identification.head(result), identification.tiles(result, view), result.adequacy.noise_std
    verdict = tag(
        "div",
        tag("p", tag("span", f"{head.sign} {head.word}", class_="badge"), class_="badges"),
        tag("p", typeset(head.headline), class_="headline"),
        tag("div", tiles, class_="tiles"),
        box(tag("b", "Keep in mind"), sentences(head.notes, view.axis), kind="quiet") if head.notes else "",
        class_=f"verdict {head.kind}",
    )
    run = view.longest
    if run is None:
        return Section(f"result-{i}", name, verdict, box(tag("p", "Its curves need its log beside it."), kind="quiet"))
    charts: list[Chart] = [run_chart(run, noise, "run", view.axis)]
    if run.dhat is not None:
        charts.append(missing_over_velocity(run.measured, run.dhat, run.dt, run.std, view.curve, view.axis))
    figures = (drawn.put(replace(c, key=f"result-{i}-{c.key}", link=f"result-{i}" if c.link else "")) for c in charts)
    return Section(f"result-{i}", name, verdict, *figures)


def _how(results: Sequence[Shown]) -> Section:
    """Which data each result is of."""
    parts: list[str] = []
    for name, result, view in results:
        validation = result.validation_digests if isinstance(result, Diagnosis) else ()
        parts += [tag("h3", name), records_table(view.runs, result.digests, validation)]
        parts.append(tag("p", f"Made with gaident {result.version or 'of unknown version'}, seed {result.seed}."))
    command = tag("code", "gaident report RESULT.json LOG --drive drive.toml --out report.html", class_="command")
    parts.append(
        tag("p", "The page of one result alone has all of it, parameters, evidence and what could not be tested: ", command)
    )
    return Section("how", "How this was computed", *parts)
