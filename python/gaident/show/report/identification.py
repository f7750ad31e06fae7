"""The chapters of an identification's report."""

from __future__ import annotations

import math
from collections.abc import Mapping

from gaident.axis import unit, velocity_unit, word
from gaident.models.mechanics import TwoMass
from gaident.results.estimate import Estimate
from gaident.results.identification import Identification
from gaident.show.html import Html, Row, joined, number, table, tag, typeset
from gaident.show.report.controller_words import controller_words
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
    tile,
)
from gaident.show.report.views import View
from gaident.show.response_plots import response_chart
from gaident.show.search_charts import convergence_chart, roots_chart, structures_chart
from gaident.show.summary import flags_of, inconsistency_words, meaning_of, stem_of, unseen_words
from gaident.show.wording import number as plain_number
from gaident.show.wording import structure_words

__all__ = ["chapters", "headline", "mark", "tiles"]


def head(idn: Identification) -> Head:
    """What stands at the top of the page."""
    return Head("Identification", *mark(idn), headline(idn), tuple(w for w in idn.warnings if w != idn.adequacy.sentence))


def headline(idn: Identification) -> str:
    """The verdict in one sentence."""
    what = f"{structure_words(idn.p, idn.q)}, (p,q) = ({idn.p},{idn.q})"
    if idn.falsified:
        return f"The closest linear model is {what}, but the data contradict it: do not trust its mechanical parameters."
    if idn.adequacy.undecided:
        return f"The closest linear model is {what}; whether a linear model holds, this record cannot tell."
    return f"A linear model explains the {'frequency response' if idn.of_responses else 'record'}: {what}."


def mark(idn: Identification) -> tuple[str, str, str]:
    """(class, sign, word) of the verdict."""
    if idn.falsified:
        return "bad", "✗", "falsified"
    return ("half", "◐", "undecided") if idn.adequacy.undecided else ("good", "✓", "linear model stands")


def tiles(idn: Identification, view: View) -> Html:
    """The figures seen first."""
    v = velocity_unit(view.axis)
    if idn.of_responses:
        return joined((
            tile("fit, weighed by the deviations (in-sample)", typeset(f"{idn.fit_percent:.2f} %")),
            tile("rms of the relative error (in-sample)", typeset(f"{plain_number(100.0 * idn.rmse)} %")),
            tile("frequencies", str(idn.frequencies)),
        ))  # fmt: skip
    return joined((
        tile("fit of the free run (in-sample)", typeset(f"{idn.fit_percent:.2f} %")),
        tile("error (in-sample)", number(idn.rmse), v),
        tile("white part of the error", number(idn.adequacy.noise_std), v),
    ))  # fmt: skip


def chapters(idn: Identification, view: View, drawn: Charts) -> list[Section]:
    """All of them."""
    noise, sentence = idn.adequacy.noise_std, tag("p", typeset(idn.adequacy.sentence))
    if idn.of_responses:
        again = "The diagram needs the frequency response: a saved result does not contain it. Identify it again with --report."
        shown = drawn.put(response_chart(view.response, view.axis)) if view.response else box(tag("p", again), kind="quiet")
        first = [Section("measured", "Measured against the model", shown), Section("wrong", "What is wrong", sentence)]
    else:
        first = [measured_section(view, noise, drawn), missing_section(view, noise, drawn, sentence)]
    return [
        *first,
        _cause(idn),
        _parameters(idn, view, drawn),
        _structures(idn, view, drawn),
        _how(idn, view),
    ]


def _cause(idn: Identification) -> Section:
    said = "The linear model is contradicted." if idn.falsified else "An identification fits linear models only."
    text = (
        f"{said} Causes beyond it (friction, backlash, saturation, delay, cogging, ...), the gain on held-out data, what could "
        "not be tested and the next experiment are the work of "
    )
    return Section(
        "cause",
        "Cause and evidence",
        tag("p", text, tag("code", "gaident diagnose LOG --drive drive.toml --report report.html", class_="command")),
    )


def _parameters(idn: Identification, view: View, drawn: Charts) -> Section:
    axis, m = view.axis, idn.mechanics
    parts: list[str] = []
    if m is None:
        parts.append(tag("p", f"No mechanics: ({idn.p},{idn.q}) is {structure_words(idn.p, idn.q)}."))
    else:
        parts.append(tag("h3", "The mechanism"))
        if idn.falsified or idn.adequacy.undecided:
            doubt = (
                "falsified: these are biased by what the model lacks" if idn.falsified else "undecided: take these with reserve"
            )
            parts.append(box(tag("p", f"The linear model is {doubt}."), kind="warn"))
        damped = m.with_shaft_damping if isinstance(m, TwoMass) else None
        rows: list[Row] = []
        for name, rotary in m.UNITS.items():
            value = getattr(m, name)
            cell = "0 (set)" if name == "DG" and value == 0.0 else estimate(value, m.std.get(name))
            beside = () if damped is None else (estimate(getattr(damped, name), damped.std.get(name)),)
            rows.append((name, cell, *beside, typeset(unit(rotary, axis)), meaning_of(name, isinstance(m, TwoMass), axis)))
        head: tuple[str, ...] = (
            ("", "value", "unit", "") if damped is None else ("", "no shaft damping", "with shaft damping", "unit", "")
        )
        parts.append(table(head, [rows]))
        if isinstance(m, TwoMass):
            high, low = (plain_number(x / math.tau) for x in (m.resonance, m.antiresonance))
            words = (f"Resonance {high} Hz, antiresonance {low} Hz (undamped)", inconsistency_words(m))
            parts.append(tag("p", typeset("; ".join(filter(None, words)) + ".")))
    gain = idn.parameters["gain"]
    parts.append(tag("h3", f"{word('Torque', axis)} to velocity"))
    parts.append(
        tag("p", "Gain K = ", estimate(gain.value, gain.std), " ", typeset(unit(gain.unit, axis)), ". ", flags_of([gain]))
    )
    stems = dict.fromkeys(stem_of(name) for name in idn.parameters if name != "gain")
    columns = ("", "real part [rad/s]", "imaginary part [rad/s]", "frequency [Hz]", "damping ratio", "")
    parts.append(table(columns, [[_root(idn.parameters, stem) for stem in stems]]))
    late = [[(name, estimate(e.value, e.std), e.unit, flags_of([e])) for name, e in idn.path.items()]]
    parts.append(table((f"Path of the {word('torque', axis)}", "value", "unit", ""), late) if idn.path else "")
    parts.append(tag("p", typeset(unseen_words(idn))) if idn.unseen_above is not None else "")
    parts.append(tag("p", tag("small", "± is one standard deviation, the colour of the noise taken into account.")))
    parts.append(drawn.put(roots_chart(idn)))
    parts.append("" if idn.of_responses else response_part(view, drawn))
    return Section("parameters", "Parameters", *parts)


def _root(parameters: Mapping[str, Estimate], stem: str) -> Row:
    name = stem.replace("_", " ")
    if stem in parameters:
        e = parameters[stem]
        shown = estimate(abs(e.value) / math.tau, e.std / math.tau) if e.value else None
        return (name, estimate(e.value, e.std), None, shown, None, flags_of([e], e.value))
    estimates = [parameters[f"{stem}_{what}"] for what in ("real", "imaginary", "frequency", "damping")]
    real, imaginary, frequency, damping = estimates
    cells = (estimate(real.value, real.std), estimate(imaginary.value, imaginary.std))
    hz = estimate(frequency.value / math.tau, frequency.std / math.tau)
    return (name, *cells, hz, estimate(damping.value, damping.std), flags_of(estimates, real.value))


def _structures(idn: Identification, view: View, drawn: Charts) -> Section:
    parts: list[str] = []
    others = [f"({r.p},{r.q})" for r in idn.rivals]
    text = f"Reported: ({idn.p},{idn.q}). "
    text += (
        f"Within 10 BIC units of the best, so not told apart from it: {', '.join(others)}."
        if others
        else "No other is within 10 BIC units."
    )
    parts.append(tag("p", text))
    parts.append(drawn.put(structures_chart(idn)) if idn.structures else "")
    parts.append(drawn.put(convergence_chart(idn)) if idn.trials else "")
    return Section("structure", "How sure the structure is", *parts)


def _low_high(pair: tuple[float, float]) -> str:
    return f"{plain_number(pair[0])} to {plain_number(pair[1])}"


def _how(idn: Identification, view: View) -> Section:
    s, space, axis = idn.settings, idn.space, view.axis
    rows: dict[str, str | None] = {
        "controller": typeset(controller_words(idn.controller, axis)),
        "searched": typeset(
            f"K {_low_high(space.gain)} {unit('rad/s^2/(N m)', axis)}, real parts {_low_high((-space.real[1], -space.real[0]))} "
            f"rad/s, imaginary parts {_low_high(space.imaginary)} rad/s, "
            f"p {space.p[0]} to {space.p[1]}, q {space.q[0]} to {space.q[1]}, "
            f"{space.bits} bits a number"
        ),
        "ranges from": space.source,
        "engine": f"{s.engine}, population {s.population}, {s.code} code, {s.scale} scale",
        "seed": str(idn.seed),
        "work": f"{len(idn.trials)} trial{'s' * (len(idn.trials) > 1)}, {sum(t.generations for t in idn.trials)} generations, "
        f"{sum(t.evaluations for t in idn.trials)} candidates, {idn.seconds:.2f} s",
        "made with": f"gaident {idn.version or 'of unknown version'}",
        "page made with": ", ".join(f"{k} {v}" for k, v in view.made_with.items()),
    }
    if idn.response_digests:
        rows["frequency responses"] = joined(tag("code", d, class_="hash") for d in idn.response_digests)
    return Section("how", "How this was computed", facts(rows), records_table(view.runs, idn.digests, ()) if idn.digests else "")
