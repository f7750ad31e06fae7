"""The chapters of a diagnosis' report, in the order in which a drive engineer asks."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping

from gaident.axis import said, unit, velocity_unit, word
from gaident.models.factors import gain_unit
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding, where
from gaident.show.diagnosis_summary import (
    NOT_THERE,
    TESTED_UP_TO,
    bound_rows,
    chance_words,
    cleared_words,
    left_words,
    mechanical_name,
    moved_words,
    next_words,
    no_experiment_words,
    parameter_row,
)
from gaident.show.gain_words import digits_apart
from gaident.show.html import Html, Row, filled_table, joined, number, table, tag, typeset
from gaident.show.relevance_words import bent_of, part_words, relevance_words, remark_words
from gaident.show.report import charts
from gaident.show.report.command import proposal_csv
from gaident.show.report.controller_words import controller_words
from gaident.show.report.gain import gain_section
from gaident.show.report.parts import (
    Charts,
    Head,
    Section,
    box,
    estimate,
    facts,
    measured_section,
    missing_section,
    records_table,
    response_part,
    roots_table,
    tile,
)
from gaident.show.report.remedies import remedies_section
from gaident.show.report.stability import stability_section
from gaident.show.report.views import View
from gaident.show.units import beside
from gaident.show.wording import (
    NOT_AS_GIVEN,
    SPREAD,
    cause_words,
    diverges,
    either,
    missing_words,
    not_as_given,
    step_words,
    words,
)

__all__ = ["chapters", "headline", "mark", "tiles"]

CANNOT_TELL = (
    "Each of these explanations, its parameters and the mechanism fitted anew, reproduces this record about as well as the "
    "others: within 10 BIC units, odds of 150 to 1, or they act alike by their nature wherever this record went. One of them is "
    "there; which, this record does not show. Taking the first for granted may give a model that fails in another motion. The "
    "values in the table are those of the first."
)
GOOD, HALF, BAD = ("good", "✓"), ("half", "◐"), ("bad", "✗")
MARKS = {"adequate": GOOD, "explained": GOOD, "partly explained": HALF, "unexplained": BAD}


def head(dia: Diagnosis, view: View) -> Head:
    """What stands at the top of the page."""
    text = " ".join(filter(None, (headline(dia, view.axis), relevance_words(dia, view.axis, view.scales))))
    return Head("Diagnosis", *mark(dia), text, dia.notes)


def headline(dia: Diagnosis, axis: str) -> str:
    """The verdict in one sentence, with the size of each cause."""
    if dia.verdict == "adequate":
        return "The linear model is adequate: nothing significant is left that could be blamed on the drive."
    causes = [f for f in dia.findings if not f.is_noise]
    if not causes:
        return "The model is wrong, and no effect of the library fits what is left."
    given = [f for f in causes if not f.alternatives and f.effect in NOT_AS_GIVEN]
    named = list(dict.fromkeys(cause_words(f, dia, axis, sized=True) for f in causes if not f.alternatives and f not in given))
    listed = " and ".join(filter(None, (", ".join(named[:-1]), *named[-1:])))
    lacks = [listed] if named else []
    lacks += list(dict.fromkeys(_open(f, dia, axis) for f in causes if f.alternatives))
    parts = [f"the model lacks {'; and '.join(lacks)}"] if lacks else []
    parts += [not_as_given(f, axis) for f in given]
    text = "; ".join(parts)
    text = f"{text[0].upper()}{text[1:]}"
    if dia.verdict == "partly explained":
        return f"{text}; this explains a part of what it gets wrong, and something significant is left."
    return f"{text}; with {'it' if len(causes) == 1 else 'them'} nothing significant is left."


def _open(f: Finding, dia: Diagnosis, axis: str) -> str:
    return missing_words(f, dia, axis) or f"one of {either(f, dia, axis)}, which these data do not tell apart"


def mark(dia: Diagnosis) -> tuple[str, str, str]:
    """(class, sign, word) of the verdict."""
    return (*MARKS.get(dia.verdict, HALF), dia.verdict)


def tiles(dia: Diagnosis, view: View) -> Html:
    """The figures seen first."""
    v = velocity_unit(view.axis)
    _, size = view.scales.get(v, (v, 1.0))
    where = "in-sample" if dia.in_sample else "held-out data"
    shown = [tile(f"error, linear model ({where})", number(size * dia.before.rmse), _unit_of(dia.before.rmse, v, view))]
    if dia.model.effects:
        shown.append(tile(f"error, extended model ({where})", number(size * dia.after.rmse), _unit_of(dia.after.rmse, v, view)))
    shown.append(
        tile(
            "noise of the measured velocity",
            number(size * dia.after.noise_floor),
            _unit_of(dia.after.noise_floor, v, view),
        )
    )
    if dia.model.effects and dia.before.rmse > 0.0 and not (diverges(dia.before) or diverges(dia.after)):
        low, high = (100.0 * x + 0.0 for x in dia.gain_interval)
        digits = digits_apart(low, high)
        interval = typeset(f"95 % interval of the fall: {low:.{digits or 0}f} to {high:.{digits or 0}f} %")
        fall = 1.0 - dia.after.rmse / dia.before.rmse
        worse = fall < -0.005  # no decision: printed: as 0 %
        label = "worse in free run: the error grows by" if worse else "the error falls by"
        shown.append(tile(label, typeset(f"{100.0 * abs(fall):.{digits or 0}f} %"), interval if math.isfinite(low) else ""))
    return joined(shown)


def _unit_of(value: float, si: str, view: View) -> Html:
    """The unit in which a value is shown, with the value in SI behind where that is another."""
    return joined((typeset(view.scales[si][0]), " (", number(value), " ", typeset(si), ")")) if si in view.scales else typeset(si)


def chapters(dia: Diagnosis, view: View, drawn: Charts) -> list[Section]:
    """All of them."""
    noise = dia.after.noise_floor
    left = typeset(left_words(dia, view.axis))
    return [
        measured_section(view, noise, drawn),
        missing_section(view, noise, drawn, tag("p", left) if left else ""),
        _causes(dia, view),
        *stability_section(view),
        _parameters(dia, view, drawn),
        gain_section(dia, view, drawn),
        *([remedies_section(view, drawn)] if view.to_do else []),
        _untested(dia, view),
        _next(dia, view, drawn),
        _how(dia, view),
    ]


def _causes(dia: Diagnosis, view: View) -> Section:
    axis = view.axis
    parts: list[str] = []
    causes = [f for f in dia.findings if not f.is_noise]
    if not causes:
        text = (
            "None is needed: what the linear model leaves is noise."
            if dia.verdict == "adequate"
            else "None is named. Something significant is left, but no effect of the library fits it; naming the closest one "
            "would be a guess."
        )
        parts.append(tag("p", text))
    for f in causes:
        others = (words(a, axis) for a in f.alternatives)
        name = joined((tag("b", cause_words(f, dia, axis)), *(joined((" or ", tag("b", other))) for other in others)))
        rows: list[Row] = [(n, *map(typeset, cells), remark) for n, *cells, remark in map(_row(view), f.parameters.items())]
        kind = "in-sample" if dia.in_sample else "held-out"
        place = f"Place: {f.place}{f', {ends}' if (ends := where(f, dia.model)) else ''}. " if f.place else ""
        figures = f"{place}{f.delta_bic:.0f} BIC units; {kind} error against that before it: {step_words(f.gain)}."
        parts.append(
            box(
                tag("h3", name, " ", tag("small", "cannot be told apart" if f.alternatives else "named")),
                tag("p", typeset(" ".join(filter(None, (said(f.evidence, axis), part_words(dia, f, axis, view.scales)))))),
                table(("parameter", "value", "unit", "", ""), [rows]) if rows else "",
                tag("p", tag("small", typeset(figures))),
                tag("p", tag("small", typeset(chance_words(f, dia.bootstrap)))) if f.p_value is not None else "",
                kind="cause" if not f.alternatives else "cause warn",
            )
        )
    if causes and (told := cleared_words(dia, axis)):
        parts.append(tag("p", told))
    if any(f.alternatives for f in causes):
        parts.append(box(tag("p", tag("b", "What “cannot be told apart” means. "), CANNOT_TELL), kind="quiet"))
    noise = [f for f in dia.findings if f.is_noise]
    if noise:
        parts.append(tag("h3", "About the record"))
        parts.append(
            tag("ul", *(tag("li", tag("b", words(f.effect, axis)), ": ", typeset(said(f.evidence, axis))) for f in noise))
        )
    return Section("cause", "Cause and evidence", *parts)


def _row(view: View) -> Callable[[tuple[str, Estimate]], tuple[str, str, str, str, str]]:
    return lambda item: parameter_row(item[0], item[1], view.axis, view.scales)


def _parameters(dia: Diagnosis, view: View, drawn: Charts) -> Section:
    axis = view.axis
    parts: list[str] = []
    rows: list[Row] = []
    for name, e in dia.mechanics.items():
        u = "" if e.unit == "1" else unit(e.unit, axis)
        old, new = dia.base_shift.get(name, (math.nan, math.nan))
        moved = typeset(moved_words(old, new, e.std)) if dia.model.effects else ""
        remark = remark_words(dia, name, e)
        was = number(old) if dia.model.effects else ""
        users = typeset(beside(view.scales, name, e.value, e.std, u))
        rows.append((mechanical_name(name, axis).strip(), estimate(e.value, e.std), typeset(u), users, was, moved, remark))
    if rows:
        head = "The mechanism" + (", fitted together with the effects" if dia.model.effects else "")
        parts.append(tag("h3", head))
        bent = bent_of(dia)
        if bent and len(bent) == len(dia.mechanics):
            parts.append(
                box(tag("p", "Biased by what is left: do not trust these beyond what the figures below show."), kind="warn")
            )
        parts.append(filled_table(("", "value", "unit", "", "linear fit alone", "moved", ""), rows))
        parts.append(tag("p", tag("small", f"± {SPREAD} The colour of the noise is taken into account.")))
    if dia.load_sensor:
        sensor = [
            (name, estimate(e.value, e.std), typeset("" if e.unit == "1" else unit(e.unit, axis)))
            for name, e in dia.load_sensor.items()
        ]
        parts += [tag("h3", "Load sensor: its signal over the motion of the load"), filled_table(("", "value", "unit"), sensor)]
    if any(not f.is_noise for f in dia.findings):
        parts.append(tag("p", "The parameters of the effects stand with their cause above."))
    parts += [tag("h3", f"{word('Torque', axis)} to velocity, linear part")]
    roots = [(kind, r, "unstable" if r.real > 0.0 and kind == "pole" else "") for kind, group in
             (("pole", dia.model.poles), ("zero", dia.model.zeros)) for r in group if r.imag >= 0.0]  # fmt: skip
    parts.append(tag("p", "Gain K = ", number(dia.model.gain, 5), " ", typeset(unit(gain_unit(dia.model.p), axis)), "."))
    parts.append(roots_table(roots))
    parts.append(response_part(view, drawn))
    return Section("parameters", "Parameters", *parts)


def _untested(dia: Diagnosis, view: View) -> Section:
    parts = []
    if dia.not_testable:
        text = "Of these the record says nothing, neither for nor against; why stands beside each."
        parts += [tag("p", text), _reasons(dia.not_testable, "why", view.axis)]
    else:
        parts.append(tag("p", "Every effect of the library could have shown itself in this record."))
    if rows := bound_rows(dia, view.axis, view.scales):
        text = "These were tested and not found. At most is the size estimated for each, and two of its deviations."
        shown: list[Row] = [(name, size, most, typeset(u), typeset(more)) for name, size, most, u, more in rows]
        parts += [tag("h3", NOT_THERE), tag("p", text), table(("effect", "its size", "at most", "", ""), [shown])]
    if dia.one_sided:
        text = "These were looked for and not found, but of some sizes they would not have shown."
        parts += [tag("h3", TESTED_UP_TO), tag("p", text), _reasons(dia.one_sided, "what would not have shown", view.axis)]
    return Section("untested", "What could not be tested", *parts)


def _reasons(why: Mapping[str, str], head: str, axis: str) -> Html:
    """A table of effects with a sentence on each."""
    rows: list[Row] = [(words(effect, axis), typeset(said(reason, axis))) for effect, reason in why.items()]
    return tag("div", table(("effect", head), [rows]), class_="text")


def _next(dia: Diagnosis, view: View, drawn: Charts) -> Section:
    title = "Next experiment"
    p = dia.next_experiment
    axis = view.axis
    if p is None:
        return Section("next", title, tag("p", no_experiment_words(dia, axis)))
    low, high = p.reach
    v, place = velocity_unit(axis), unit("rad", axis)
    size = {
        "length": f"{len(p.command)} samples of {1e3 * p.dt:.4g} ms, {len(p.command) * p.dt:.3g} s",
        "highest speed": typeset(f"{float(abs(p.command).max()):.4g} {v}"),
        "travel": typeset(f"{low:.3g} to {high:.3g} {place} from the start, if the drive follows"),
    }
    text = base64.b64encode(proposal_csv(p, axis).encode()).decode("ascii")
    link = tag(
        "a", "Download the command (CSV)", class_="button", download="next_experiment.csv", href=f"data:text/csv;base64,{text}"
    )
    return Section(
        "next",
        title,
        tag("p", typeset(said(next_words(dia, p), axis))),
        facts(size),
        tag("p", link),
        tag("p", tag("small", "Check speed and travel against the axis' limits before it runs.")),
        drawn.put(charts.command_chart(p.command, p.dt, axis)),
    )


def _how(dia: Diagnosis, view: View) -> Section:
    idn = dia.identification
    rows: dict[str, str | None] = {
        "controller": typeset(controller_words(dia.controller, view.axis)),
        "held out": dia.held_out,
        "linear model": f"begun with {idn.p} poles and {idn.q} zeros ({idn.settings.engine} search, seed {idn.seed}), "
        f"reported with {dia.model.p} and {dia.model.q}",
        "noise": "from the record" if dia.noise is None else typeset(f"given: {dia.noise:.4g} {velocity_unit(view.axis)}"),
        "bootstrap": f"{dia.bootstrap} simulated records" if dia.bootstrap else "none asked for",
        "seed": str(dia.seed),
        "work": f"{dia.samples} samples, {dia.simulations} simulations, {dia.seconds:.2f} s",
        "made with": ", ".join(f"{k} {v}" for k, v in {"gaident": dia.version or "of unknown version"}.items()),
        "page made with": ", ".join(f"{k} {v}" for k, v in view.made_with.items()),
    }
    return Section("how", "How this was computed", facts(rows), records_table(view.runs, dia.digests, dia.validation_digests))
