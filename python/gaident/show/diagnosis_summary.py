"""The result of a diagnosis as text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping

from gaident.axis import Text, called, identifier_words, joined, said, say, unit, velocity_unit, word
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate, of_axis
from gaident.results.experiment import Proposal
from gaident.results.finding import Finding
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
from gaident.show.relevance_words import bent_of, part_words, relevance_words, remark_words
from gaident.show.units import Scales, beside, scales_of, with_column
from gaident.show.wording import (
    NOT_AS_GIVEN,
    SPREAD,
    WIDTH,
    cause_words,
    certainty,
    controller_lines,
    either,
    free_run_words,
    missing_words,
    not_as_given,
    number,
    step_words,
    table,
    with_std,
    words,
)

__all__ = [
    "NOT_THERE",
    "TESTED_UP_TO",
    "bound_rows",
    "chance_words",
    "cleared_words",
    "diagnosis_summary",
    "driver_counts",
    "left_words",
    "mechanical_name",
    "moved_words",
    "next_words",
    "no_experiment_words",
    "parameter_row",
    "verdict_words",
]

NOT_THERE = "Not found, and at most (estimate and two deviations)"
TESTED_UP_TO = "Tested up to what these records asked for"
DRIVERS = {
    "velocity": "on the velocity",
    "position": "on the position",
    "torque": say("on the {torque}"),
    "command": "on the command",
    "time": "on time",
    "past": "on the path before (hysteresis, play, elasticity)",
}


MOTIONS = {
    "velocity": "Held speeds, slow ones and fast ones in both directions, show the {torque} over the speed",
    "position": "One slow held speed over the whole travel, there and back, shows the {torque} over the {angle}",
    "torque": "The same moves with other accelerations, or with another load, show what grows with the {torque}",
    "command": "The same moves with other command ramps show what the controller adds",
    "time": "The same moves repeated, after a pause and warm, show what returns with the motion and what moves with time",
    "past": "Slow reversals after long and short ways, at one place, show what depends on the path before",
}
"""Driver of what is left -> the motion that shows it."""


def diagnosis_summary(dia: Diagnosis, axis: str = "rotary", units: Mapping[str, str | float] | None = None) -> str:
    """What is wrong, why, the gain, what could not be tested, what to measure next; no line break at the end.

    dia: a Diagnosis, or anything with its attributes. axis: "rotary", or "linear" for words and units of m and N.
    units: of the user, shown beside SI in the tables, as `scales_of` takes them.
    """
    scales = scales_of(units, axis)
    sections = [
        _verdict(dia, axis, scales),
        _causes(dia, axis, scales),
        _gain(dia, axis, scales),
        _force(dia, axis, scales),
        _second_method(dia, axis, scales),
        _next(dia, axis),
        _mechanics(dia, axis, scales),
        _load_sensor(dia, axis),
        controller_lines(dia.controller_numbers, axis),
        _base(dia, axis),
        _record(dia, axis),
        _not_there(dia, axis, scales),
        _untested(dia, axis),
        _tested_up_to(dia, axis),
        _how(dia),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _wrapped(text: str, indent: str = "", hanging: str = "") -> list[str]:
    lines = textwrap.wrap(text, WIDTH, initial_indent=indent, subsequent_indent=indent + hanging, break_on_hyphens=False)
    return lines or [""]


def _verdict(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    head = " ".join(filter(None, (verdict_words(dia, axis), left_words(dia, axis), relevance_words(dia, axis, scales))))
    lines = [f"Verdict: {dia.verdict}", *_wrapped(head)]
    for note in dia.notes:
        lines += _wrapped(said(note, axis))
    return lines


def left_words(dia: Diagnosis, axis: str) -> str:
    """What the error that is left depends on; empty where nothing significant is left."""
    if dia.driver is None:
        return ""
    like: Text | str = ""
    if dia.line is not None:
        frequency, amplitude = dia.line
        like = say(": like a {torque} of {} Hz and {} {N m} at the motor", number(frequency, 3), number(amplitude, 2))
    if driver_counts(dia):
        return said(say("What is left depends {}{}.", DRIVERS[dia.driver], like), axis)
    text = said(say("No single signal explains what is left; what comes closest depends {}{}.", DRIVERS[dia.driver], like), axis)
    share = None if dia.relevance is None else dia.relevance.shares.get(dia.driver)
    return text if share is None else f"{text} A free function of it takes {100.0 * share:.2g} % of the squared error away."


def driver_counts(dia: Diagnosis) -> bool:
    """Whether a free function of the driver gains enough to be said to drive what is left."""
    return dia.driver is not None and dia.left.get(dia.driver, 0.0) > dia.left_needed


def verdict_words(dia: Diagnosis, axis: str) -> str:
    """The verdict in words, with the names."""
    if dia.verdict == "adequate":
        return "The linear model is adequate: nothing significant is left that could be blamed on the drive."
    if dia.verdict == "unexplained":
        return "The model is wrong, and no effect of the library fits what is left."
    causes = [f for f in dia.findings if not f.is_noise]
    given = [f for f in causes if not f.alternatives and f.effect in NOT_AS_GIVEN]
    named = list(dict.fromkeys(cause_words(f, dia, axis) for f in causes if not f.alternatives and f not in given))
    kinds = dict.fromkeys(filter(None, (missing_words(f, dia, axis) for f in causes if f.alternatives)))
    open_ = dict.fromkeys(either(f, dia, axis) for f in causes if f.alternatives and not missing_words(f, dia, axis))
    parts = [f"{'Cause' if len(named) == 1 else 'Causes'}: {', '.join(named)}."] if named else []
    parts += [f"{Text(not_as_given(f, axis)).begun()}." for f in given]
    parts += [f"{text[0].upper()}{text[1:]}." for text in kinds]
    parts += [
        f"What is {'also ' if named else ''}missing is one of: {names}. These data do not tell them apart." for names in open_
    ]
    if dia.verdict == "partly explained":
        return " ".join(["Part of what the model gets wrong is explained; something significant is left.", *parts])
    if open_:
        return " ".join(["The model was wrong.", *parts, "With that nothing significant is left."])
    found = "the cause is found, and with it" if len(named) + len(given) == 1 else "the causes are found, and with them"
    return " ".join([f"The model was wrong, {found} nothing significant is left.", *parts])


def _causes(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    lines: list[str] = []
    for f in dia.findings:
        if f.is_noise:
            continue
        place = ", in the controller" if f.place == "controller" else ""
        lines.append(cause_words(f, dia, axis) + place + "".join(f", or {words(a, axis)}" for a in f.alternatives))
        lines += table([parameter_row(n, e, axis, scales) for n, e in f.parameters.items()], "    ")
        lines += _wrapped(" ".join(filter(None, (said(f.evidence, axis), part_words(dia, f, axis, scales)))), "    ")
        if f.p_value is not None:
            lines += _wrapped(chance_words(f, dia.bootstrap), "    ")
    found = [line if line.startswith(" ") else f"  {line}" for line in lines]
    return ["What was found", *found, *(_wrapped(told, "  ") if (told := cleared_words(dia, axis)) else [])] if lines else []


def cleared_words(dia: Diagnosis, axis: str) -> str:
    """That the controller is as it was given, where the logged torque says so; empty elsewhere."""
    if dia.controller is None or not (dia.torque_logged and dia.loop_follows):
        return ""
    if dia.controller_numbers or any(f.place == "controller" for f in dia.findings):
        return ""
    return said(say("The logged {torque} follows from the controller as given: what is missing is not in it."), axis)


def chance_words(finding: Finding, bootstrap: int) -> str:
    """The p-value of the bootstrap in words."""
    if finding.p_value is None:
        return ""
    most = "at most " if finding.p_value * (bootstrap + 1) <= 1.0 + 1e-9 else ""  # none of the draws came as far
    return f"Chance of such a finding where there is no effect at all (bootstrap): {most}{finding.p_value:.2g}."


def parameter_row(name: str, e: Estimate, axis: str, scales: Scales) -> tuple[str, str, str, str, str]:
    """Name, value with its standard deviation, unit, the same in the user's unit, remark."""
    shown = of_axis(name, e, axis)
    value, std, u = shown.value, shown.std, shown.unit
    doubt = "at a bound" if e.at_bound else "" if e.identifiable else "not determined"
    every = f"every {number(1e3 / value)} mm" if u == "1/m" and value > 0.0 else ""
    remark = ", ".join(part for part in (every, doubt) if part)
    return identifier_words(name, axis), with_std(value, std), "" if u == "1" else u, beside(scales, name, value, std, u), remark


def _gain(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    v = velocity_unit(axis)
    extended = bool(dia.model.effects)
    rows: list[tuple[str, ...]] = [
        ("", f"rmse [{v}]", "fit [%]"),
        ("linear model", *free_run_words(dia.before)),
        ("extended model", *free_run_words(dia.after)),
        *((what, number(size), "") for what, size in noise_rows(dia)),
    ]
    sizes = (dia.before.rmse, dia.after.rmse, *(size for _, size in noise_rows(dia)))
    rows = with_column(rows, "rmse", sizes, v, scales)
    where = "IN-SAMPLE: too little data, or too little motion, to hold any out" if dia.in_sample else f"on {dia.held_out}"
    lines = [f"Free-run simulation, {where}", *table(rows if extended else rows[:2] + rows[3:])]
    if noise := noise_words(dia):
        lines += _wrapped(said(noise, axis), "  ")
    if not dia.loop_follows:
        lines += _wrapped(said(not_the_loop_words(dia), axis), "  ")
    if extended and dia.before.rmse > 0.0:
        lines += _wrapped(said(fall_words(dia), axis), "  ")
        steps = [f"{cause_words(f, dia, axis)} {step_words(f.gain)}" for f in dia.findings if not f.is_noise]
        if len(steps) > 1:
            lines += _wrapped(f"The error with one after the other, against that before it: {', '.join(steps)}.", "  ")
        if alone := alone_words(dia):
            lines += _wrapped(alone, "  ")
    return lines


def _force(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    """The force error on the held-out data."""
    rows = force_rows(dia, axis, scales)
    if not rows:
        return []
    where = "IN-SAMPLE" if dia.in_sample else f"on {dia.held_out}"
    return [f"{word('Torque', axis)} error, {where}", *table(rows), *_wrapped(force_words(dia, axis), "  ")]


def _second_method(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    """The regression beside the diagnosis."""
    rows = comparison_rows(dia, axis, scales)
    if not rows:
        return []
    shown = any(row[4] or row[5] for row in rows)
    head = ("", "diagnosis", "regression", "", *(("diagnosis", "regression") if shown else ("", "")), "")
    return ["Check by inverse-dynamics regression", *table([head, *rows]), *_wrapped(method_words(dia, axis), "  ")]


def _mechanics(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    """The linear part of the reported model, by its mechanical parameters."""
    if not dia.mechanics:
        return []
    bent = bent_of(dia)
    head = "Mechanics, biased by what is left" if bent and len(bent) == len(dia.mechanics) else "Mechanics"
    head += ", fitted together with the effects" if dia.model.effects else ""
    rows = []
    for name, e in dia.mechanics.items():
        u = "" if e.unit == "1" else unit(e.unit, axis)
        users = beside(scales, name, e.value, e.std, u)
        rows.append((mechanical_name(name, axis), with_std(e.value, e.std), u, users, remark_words(dia, name, e)))
    lines = [head, *table(rows)]
    if any(e.std is not None and e.std > 0.0 for e in dia.mechanics.values()):
        lines.append(f"  +- {SPREAD}")
    if not {"resonance", "ground_resonance"} & dia.mechanics.keys() and len(dia.model.poles) > 1:
        lines.append(f"  {_other_pair(dia.model)}")
    return lines


def _load_sensor(dia: Diagnosis, axis: str) -> list[str]:
    """How a sensor at the load reads it."""
    rows = [(name, with_std(e.value, e.std), "" if e.unit == "1" else unit(e.unit, axis)) for name, e in dia.load_sensor.items()]
    return ["Load sensor: its signal over the motion of the load", *table(rows)] if rows else []


def _other_pair(model: Model) -> str:
    """What the poles beside the slowest are where no shaft is reported."""
    swinging = [abs(p) / math.tau for p in model.poles if p.imag > 0.0 and -p.real < POLICY.swing_damping * abs(p)]
    if not swinging:
        return "a second pair of poles that does not swing: no resonance of a shaft"
    return f"a pair of poles at {number(min(swinging), 3)} Hz that is no shaft's: it stands for something else"


def mechanical_name(name: str, axis: str) -> str:
    """A parameter of the mechanism as it is written; what belongs to the row above is indented."""
    return "  its damping ratio" if name.endswith("_damping") else identifier_words(name, axis)


def _base(dia: Diagnosis, axis: str) -> list[str]:
    rows = [("", "linear fit", "with the effects", "moved", "")]
    for name, e in dia.mechanics.items():
        if name in dia.base_shift:
            old, new = dia.base_shift[name]
            change = moved_words(old, new, e.std)
            u = "" if e.unit == "1" else unit(e.unit, axis)
            rows.append((mechanical_name(name, axis), number(old, 5), number(new, 5), change, u))
    return ["How far the effects had biased the linear model", *table(rows)] if len(rows) > 1 and dia.model.effects else []


def moved_words(old: float, new: float, std: float | None) -> str:
    """By how much a parameter moved; empty where it was 0 within its deviation, for no share of that means anything."""
    if not math.isfinite(old) or abs(old) <= POLICY.below_zero * (std or 0.0):
        return ""
    if old * new <= 0.0:
        return "other sign"
    if new / old >= 10.0:  # no decision: printed: a number
        return f"{number(new / old, 3)} times as large"
    return f"{round(100.0 * (new / old - 1.0), 1) + 0.0:+.1f} %"


def _record(dia: Diagnosis, axis: str) -> list[str]:
    lines = []
    for f in dia.findings:
        if f.is_noise:
            lines += _wrapped(f"{words(f.effect, axis)}: {said(f.evidence, axis)}", "  ", "  ")
    return ["About the record", *lines] if lines else []


def _untested(dia: Diagnosis, axis: str) -> list[str]:
    lines = []
    for effect, reason in dia.not_testable.items():
        lines += _wrapped(f"{words(effect, axis)}: {said(reason, axis)}", "  ", "  ")
    return ["Not testable with this record", *lines] if lines else []


def bound_rows(dia: Diagnosis, axis: str, scales: Scales) -> list[tuple[str, ...]]:
    """(effect, its size at most, unit, the same in the user's unit) of what was tested and not found."""
    rows: list[tuple[str, ...]] = []
    for effect, bound in dia.not_there.items():
        size = of_axis(bound.parameter, Estimate(bound.at_most, 0.0, bound.unit), axis)
        u, more = "" if size.unit == "1" else size.unit, beside(scales, bound.parameter, size.value, None, size.unit)
        rows.append((words(effect, axis), identifier_words(bound.parameter, axis), number(size.value, 2), u, more))
    return rows


def _not_there(dia: Diagnosis, axis: str, scales: Scales) -> list[str]:
    rows = bound_rows(dia, axis, scales)
    return [NOT_THERE, *table([(name, size, *most) for name, size, *most in rows])] if rows else []


def _tested_up_to(dia: Diagnosis, axis: str) -> list[str]:
    lines = []
    for effect, sizes in dia.one_sided.items():
        lines += _wrapped(f"{words(effect, axis)}: {said(sizes, axis)}", "  ", "  ")
    return [TESTED_UP_TO, *lines] if lines else []


def _next(dia: Diagnosis, axis: str) -> list[str]:
    p = dia.next_experiment
    if p is None:
        return ["Next experiment", *_wrapped(no_experiment_words(dia, axis), "  ")]
    driving = "command" if p.position_command is None else "position command"
    size = f"The {driving}: {len(p.command)} samples of {1e3 * p.dt:.4g} ms, {len(p.command) * p.dt:.3g} s."
    return ["Next experiment", *_wrapped(said(next_words(dia, p), axis), "  "), f"  {size}"]


def no_experiment_words(dia: Diagnosis, axis: str) -> str:
    """Why no command is proposed, and which motion would show what is left."""
    if any(f.alternatives for f in dia.findings):
        return "None is proposed: see the notes under the verdict."
    if dia.verdict in ("adequate", "explained"):
        needed = "to explain this record" if dia.verdict == "adequate" else "to name the cause"
        more = "; what could not be tested needs motions that this record has not" if dia.not_testable or dia.one_sided else ""
        return f"None is needed {needed}{more}."
    why = "None of the menu is proposed: its commands tell two causes of the library apart, and none are open here."
    if dia.driver is None:
        return why
    return said(say("{} {}.", why, say(MOTIONS[dia.driver])), axis)


def next_words(dia: Diagnosis, p: Proposal) -> Text:
    """Why the experiment p comes next, what it tells apart and how surely."""
    margin = f", {certainty(p.margin)} ({p.margin:.0f} BIC units, 10 are enough)" if math.isfinite(p.margin) else ""
    told = [(name, *p.alike.get(name, ())) for name in p.separates]
    text = say("{} It tells {}{}.", p.reason, joined(" from ", (joined(" or ", map(called, names)) for names in told)), margin)
    rest = dict.fromkeys(a for f in dia.findings for a in f.alternatives if not any(a in names for names in told))
    return say("{} It was not chosen for {}.", text, joined(" or ", map(called, rest))) if rest else text


def _how(dia: Diagnosis) -> list[str]:
    data = ", ".join(digest[:12] for digest in dia.digests)  # no decision: printed: of a digest
    version = dia.version or "of unknown version"
    work = f"{dia.samples} samples, {dia.simulations} simulations, {dia.seconds:.2f} s"
    return _wrapped(f"{work}; seed {dia.seed}, gaident {version}, data {data}")
