"""What a notebook shows of a result: the verdict and the main figures, without scripts, in the notebook's own colours."""

from __future__ import annotations

from gaident.axis import said
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import of_axis
from gaident.results.identification import Identification
from gaident.show.html import Html, Row, joined, number, table, tag, typeset
from gaident.show.report import diagnosis, identification
from gaident.show.report.parts import Head, estimate
from gaident.show.report.views import View
from gaident.show.summary import meaning_of
from gaident.show.wording import cause_words, free_run_words, structure_words, words

__all__ = ["diagnosis_html", "identification_html"]

FRAME = "border-left: 4px solid #0072b2; padding: 0.2em 1em; max-width: 60em;"
UNITS = "rmse in rad/s (m/s on a linear axis)"


def diagnosis_html(dia: Diagnosis) -> Html:
    """Verdict, causes with their parameters and evidence, error before and after."""
    rows: list[Row] = []
    for f in (f for f in dia.findings if not f.is_noise):
        name = " or ".join((cause_words(f, dia, dia.axis), *(words(effect, dia.axis) for effect in f.alternatives)))
        for i, parameter in enumerate(f.parameters):
            e = of_axis(parameter, f.parameters[parameter], dia.axis)
            cells = (words(parameter, dia.axis), estimate(e.value, e.std), typeset("" if e.unit == "1" else e.unit))
            rows.append((name if i == 0 else "", *cells))
    evidence = [
        tag("li", tag("b", cause_words(f, dia, dia.axis)), ": ", typeset(said(f.evidence, dia.axis)))
        for f in dia.findings
        if f.evidence
    ]
    causes = table(("cause", "parameter", "value", "unit"), [rows], left=(0, 1, 3)) if rows else Html("")
    if evidence:
        causes = joined((causes, tag("ul", *evidence)))
    errors: list[Row] = [("linear model", *free_run_words(dia.before, number))]
    if dia.model.effects:
        errors.append(("extended model", *free_run_words(dia.after, number)))
    errors.append(("noise of the velocity", number(dia.after.noise_floor), ""))
    where = f"{UNITS}; {dia.held_out}"
    return _framed(diagnosis.head(dia, View(axis=dia.axis)), causes, table(("", "rmse", "fit [%]"), [errors], left=(0,)), where)


def identification_html(idn: Identification) -> Html:
    """Verdict, mechanics or structure, fit."""
    m = idn.mechanics
    parts: Html | str = f"({idn.p},{idn.q}), {structure_words(idn.p, idn.q)}"
    if m is not None:
        rows: list[Row] = [
            (name, estimate(getattr(m, name), m.std.get(name)), typeset(u), meaning_of(name, hasattr(m, "KG"), "rotary"))
            for name, u in m.UNITS.items()
        ]
        parts = table(("", "value", "unit", ""), [rows], left=(0, 2, 3))
    errors: list[Row] = [
        ("model", number(idn.rmse), f"{idn.fit_percent:.2f}"),
        ("white part of it", number(idn.adequacy.noise_std), ""),
    ]
    return _framed(identification.head(idn), parts, table(("", "rmse", "fit [%]"), [errors], left=(0,)), f"{UNITS}; in-sample")


def _framed(head: Head, parts: str, errors: str, small: str) -> Html:
    listed = tag("ul", *(tag("li", typeset(note)) for note in head.notes)) if head.notes else ""
    return tag(
        "div",
        tag("p", tag("b", f"{head.sign} {head.word}. "), typeset(head.headline)),
        tag("div", parts),
        errors,
        tag("p", tag("small", small)),
        listed,
        style=FRAME,
    )
