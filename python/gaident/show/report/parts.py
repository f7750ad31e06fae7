"""Parts that every report has: boxes, charts in the page, the records, how it was computed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gaident.axis import said, word
from gaident.policy.table import POLICY
from gaident.show.chart import Chart
from gaident.show.diagnosis_charts import missing_over_velocity, missing_reversals, residual_spectrum
from gaident.show.draw import picture
from gaident.show.html import Html, Row, joined, number, png_uri, table, tag, typeset
from gaident.show.report import charts
from gaident.show.report.views import RecordView, View
from gaident.show.response_plots import response_chart
from gaident.show.units import Scales, in_units
from gaident.show.wording import with_std

__all__ = [
    "Charts",
    "Head",
    "Section",
    "box",
    "estimate",
    "facts",
    "measured_section",
    "missing_section",
    "needs_record",
    "records_table",
    "response_part",
    "roots_table",
    "sentences",
    "tile",
]

SHOWN = 4  # no decision: records with a chart of their own; how many are drawn


@dataclass(frozen=True)
class Head:
    """What stands at the top of a page: title, verdict as (kind, sign, word) of its badge, headline, what to keep in mind."""

    title: str
    kind: str
    sign: str
    word: str
    headline: str
    notes: tuple[str, ...]


class Section:
    """A chapter of the page: key for links, title, what it contains."""

    def __init__(self, key: str, title: str, *parts: str) -> None:
        self.key, self.title, self.body = key, title, joined(p for p in parts if p)


class Charts:
    """The charts of a page, gathered as they are put in."""

    def __init__(self, scales: Scales | None = None, live: bool = True) -> None:
        """scales: to the user's units, in which the axes are drawn. live: False: pictures alone."""
        self.all: list[Chart] = []
        self.scales: Scales = scales or {}
        self.live = live

    def put(self, chart: Chart | None) -> Html:
        """The place of a chart: the live figure, and the picture for print and where no script runs."""
        if chart is None:
            return Html()
        chart = in_units(chart, self.scales)
        self.all.append(chart)
        live = tag("div", class_="live", data_chart=chart.key, role="img", aria_label=chart.caption)
        still = tag("img", class_="still", alt=chart.caption, src=png_uri(picture(chart)))
        return tag("figure", live if self.live else "", still, tag("figcaption", chart.caption), id=f"figure-{chart.key}")


def box(*inside: str, kind: str = "") -> Html:
    """A paragraph that stands out; kind: "warn" or "quiet"."""
    return tag("div", *inside, class_=f"box {kind}".strip())


def sentences(texts: Sequence[str], axis: str) -> Html:
    """A list of plain sentences of the library, in the axis' units."""
    return tag("ul", *(tag("li", typeset(said(t, axis))) for t in texts)) if texts else Html()


def estimate(value: float, std: float | None) -> Html:
    """Value with its standard deviation."""
    return typeset(with_std(value, std))


def tile(label: str, value: str, below: str = "") -> Html:
    """A figure that is seen first."""
    return tag("div", tag("span", label, class_="label"), tag("b", value), tag("span", below, class_="below"), class_="tile")


def facts(rows: Mapping[str, str | None]) -> Html:
    """Names and what they are; rows without anything are left out."""
    return tag("dl", *(joined((tag("dt", k), tag("dd", v))) for k, v in rows.items() if v))


def needs_record(view: View, what: str) -> Html:
    """Said instead of curves where a saved result comes without its record."""
    if view.runs:
        return Html()
    command = tag("code", "gaident report RESULT.json LOG --drive drive.toml --out report.html", class_="command")
    return box(
        tag("p", f"{what} A saved result contains no samples; with the record beside it this part is filled: ", command),
        kind="quiet",
    )


def measured_section(view: View, noise: float, drawn: Charts) -> Section:
    """Measured against simulated, one chart per record."""
    parts: list[str] = []
    for i, run in enumerate(view.runs[:SHOWN]):
        label = {"fitted": "parameters were fitted to it", "held out": "no parameter was fitted to it"}.get(
            run.used, "another record"
        )
        if run.held_out_from:
            label += "; for the comparison of before and after, to its first part only"
        parts.append(tag("h3", run.name or f"record {i + 1}", " ", tag("small", label)))
        if run.used == "new":
            text = "This is not a record of this result: its hash is another one. The curves show how the models do on it."
            parts.append(box(tag("p", text), kind="warn"))
        parts += [box(sentences(run.notes, view.axis), kind="warn")] if run.notes else []
        parts.append(drawn.put(charts.run_chart(run, noise, f"run-{i}", view.axis)))
    if len(view.runs) > SHOWN:
        parts.append(tag("p", f"Not drawn: {len(view.runs) - SHOWN} more records; their figures count all the same."))
    missing = needs_record(view, "The curves of measured and simulated velocity need the record.")
    return Section("measured", "Measured against simulated", missing, *parts)


def missing_section(view: View, noise: float, drawn: Charts, *before: str) -> Section:
    """What is wrong: the missing torque over velocity, place, reversals, time; the error over frequency."""
    run, axis = view.longest, view.axis
    if run is None:
        text = f"The missing {word('torque', axis)} over velocity, position and time needs the record."
        return Section("wrong", "What is wrong", *before, needs_record(view, text))
    parts: list[str] = list(before)
    if len(view.runs) > 1:
        alone = sum(len(r.time) == len(run.time) for r in view.fitted) == 1
        which = "the longest" if alone else "the first of the longest"
        parts.append(
            tag("p", "Shown for ", tag("b", run.name or f"record {view.runs.index(run) + 1}"), f", {which} of those fitted.")
        )
    if run.dhat is None:
        parts.append(box(tag("p", f"The missing {word('torque', axis)} could not be worked out, see above."), kind="quiet"))
    else:
        parts.append(tag("h3", "Against the velocity"))
        parts.append(drawn.put(missing_over_velocity(run.measured, run.dhat, run.dt, run.std, view.curve, axis)))
    if run.dhat is not None and float(np.abs(run.dhat).max()) <= POLICY.below_zero * run.std:
        text = f"None of the missing {word('torque', axis)} can be told from zero: there is no more to show."
        parts.append(tag("p", text))
    elif run.dhat is not None:
        if run.torque is not None:
            turning = missing_reversals(run.measured, run.dhat, run.torque, run.dt, axis)
            none = turning.panels[0].note
            parts += [tag("h3", "Around a reversal"), tag("p", f"{none.capitalize()}.") if none else drawn.put(turning)]
        place = charts.missing_over_place(run, run.dhat, axis)
        if place:
            parts += [tag("h3", "Against the position"), *(drawn.put(c) for c in place)]
        key = f"run-{view.runs.index(run)}"
        parts += [tag("h3", "Over time"), drawn.put(charts.missing_over_time(run, run.dhat, key, axis))]
    after = None if run.extended is None else run.measured - run.extended
    parts += [tag("h3", "Over frequency"), drawn.put(residual_spectrum(run.measured - run.linear, after, run.dt, noise, axis))]
    return Section("wrong", "What is wrong", *parts)


def response_part(view: View, drawn: Charts) -> Html:
    """The Bode diagram, or why there is none."""
    if view.response is not None:
        return drawn.put(response_chart(view.response, view.axis))
    if view.no_response:
        return box(tag("p", typeset(f"No frequency response is drawn: {said(view.no_response, view.axis)}.")), kind="quiet")
    return needs_record(view, "The frequency response needs the record.")


def records_table(runs: Sequence[RecordView], digests: Sequence[str], validation: Sequence[str]) -> Html:
    """Which data this is about: names where they are at hand, hashes always."""
    rows: list[Row] = [_record_row(r) for r in runs]
    known = {r.digest for r in runs}
    for used, listed in (("fitted", digests), ("held out", validation)):
        rows += [("not at hand", used, None, None, None, _hash(d)) for d in listed if d not in known]
    return table(("record", "used", "samples", "dt [ms]", "duration [s]", "SHA-256 of the data"), [rows])


def _record_row(run: RecordView) -> Row:
    n, dt = len(run.time), run.dt
    return (run.name or "unnamed", run.used, str(n), number(1e3 * dt), number(n * dt, 3), _hash(run.digest))


def _hash(digest: str) -> Html:
    return tag("code", digest, class_="hash")


def roots_table(roots: Sequence[tuple[str, complex, str]]) -> Html:
    """Poles and zeros without deviations: what, value, remark."""
    rows: list[Row] = []
    for what, root, remark in roots:
        size = abs(root)
        damping = number(-root.real / size, 3) if root.imag and size else None
        rows.append((what, complex(root.real, abs(root.imag)), number(size / math.tau), damping, remark))
    return table(("", "[rad/s]", "frequency [Hz]", "damping ratio", ""), [rows])


def title_of(runs: Sequence[RecordView]) -> str:
    """The names of the fitted records, as far as they fit."""
    names = [r.name for r in runs if r.name]
    # no decision: how many names are listed
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
