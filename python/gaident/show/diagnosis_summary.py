"""The result of a diagnosis as text."""

from __future__ import annotations

import math
import textwrap
from typing import Any

from gaident.show.wording import number, table, unit, velocity_unit, with_std

__all__ = ["diagnosis_summary"]

WIDTH = 100
VERDICTS = {
    "adequate": "The linear model is adequate: nothing significant is left that could be blamed on the drive.",
    "explained": "The model was wrong, the cause is found, and with it nothing significant is left.",
    "partly explained": "Part of what the model gets wrong is explained; something significant is left.",
    "unexplained": "The model is wrong, and no effect of the library fits what is left.",
}
DRIVERS = {
    "velocity": "on the velocity",
    "position": "on the position",
    "torque": "on the torque",
    "command": "on the command",
    "time": "on time",
    "past": "on the path before (hysteresis, play, elasticity)",
}


def diagnosis_summary(dia: Any, axis: str = "rotary") -> str:
    """What is wrong, why, the gain, what could not be tested, what to measure next; no line break at the end.

    dia: a Diagnosis, or anything with its attributes. axis: "rotary", or "linear" for units of m and N.
    """
    sections = [
        _verdict(dia, axis),
        _causes(dia, axis),
        _gain(dia, axis),
        _base(dia, axis),
        _noise(dia),
        _untested(dia),
        _next(dia),
        _how(dia),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _words(effect: str) -> str:
    return effect.replace("_", " ")


def _verdict(dia: Any, axis: str) -> list[str]:
    causes = [f for f in dia.findings if not f.is_noise]
    named = [_words(f.effect) for f in causes if not f.alternatives]
    open_ = [" or ".join(map(_words, (f.effect, *f.alternatives))) for f in causes if f.alternatives]
    head = VERDICTS[dia.verdict]
    if named:
        head += f" Cause{'s' if len(named) > 1 else ''}: {', '.join(named)}."
    if open_:
        head += f" Not told apart by these data: {'; '.join(open_)}."
    if dia.driver is not None:
        head += f" What is left depends {DRIVERS[dia.driver]}."
    lines = [f"Verdict: {dia.verdict}", *textwrap.wrap(head, WIDTH)]
    for note in dia.notes:
        lines += textwrap.wrap(note, WIDTH)
    return lines


def _causes(dia: Any, axis: str) -> list[str]:
    lines: list[str] = []
    for f in dia.findings:
        if f.is_noise:
            continue
        status = "named" if not f.alternatives else "one of " + ", ".join(map(_words, (f.effect, *f.alternatives)))
        lines.append(f"{_words(f.effect)} ({status})")
        rows = [
            (_words(n), with_std(e.value, e.std), unit(e.unit, axis) if e.unit != "1" else "", _flag(e))
            for n, e in f.parameters.items()
        ]
        lines += table(rows)
        lines += [f"  {line}" for line in textwrap.wrap(f.evidence, WIDTH - 2)]
        if f.p_value is not None:
            lines.append(f"  false-alarm probability of the whole procedure (bootstrap): {f.p_value:.2g}")
    return ["What was found", *(f"  {line}" for line in lines)] if lines else []


def _flag(e: Any) -> str:
    return "at a bound" if e.at_bound else "" if e.identifiable else "not determined"


def _gain(dia: Any, axis: str) -> list[str]:
    v = velocity_unit(axis)
    rows = [
        ("", f"rmse [{v}]", "fit [%]"),
        ("linear model", number(dia.before.rmse), number(dia.before.fit_percent)),
        ("extended model", number(dia.after.rmse), number(dia.after.fit_percent)),
        ("noise of the measured velocity", number(dia.after.noise_floor), ""),
    ]
    where = {"in-sample": "IN-SAMPLE: the record is too short to hold anything out"}.get(dia.held_out, f"on {dia.held_out}")
    lines = [f"Free-run simulation, {where}", *table(rows if dia.model.effects else [rows[0], rows[1], rows[3]])]
    if dia.model.effects and dia.before.rmse > 0.0:
        low, high = dia.gain_interval
        fall = 100.0 * (1.0 - dia.after.rmse / dia.before.rmse)
        interval = f" (95 % interval {100.0 * low:.0f} to {100.0 * high:.0f} %)" if math.isfinite(low) else ""
        lines.append(f"  the error falls by {fall:.0f} %{interval}")
        steps = [f"{_words(f.effect)} {100.0 * f.gain:.0f} %" for f in dia.findings if not f.is_noise]
        if len(steps) > 1:
            lines.append(f"  each step's share: {', '.join(steps)}")
    return lines


def _base(dia: Any, axis: str) -> list[str]:
    if not dia.base_shift or not dia.model.effects:
        return []
    rows = [("", "linear fit", "with the effects", "moved")]
    for name, (before, after) in dia.base_shift.items():
        moved = f"{100.0 * (after / before - 1.0):+.1f} %" if before else ""
        rows.append((_words(name), number(before, 5), number(after, 5), moved))
    return ["How far the effects had bent the linear model", *table(rows)]


def _noise(dia: Any) -> list[str]:
    lines = []
    for f in dia.findings:
        if f.is_noise:
            lines += textwrap.wrap(f"{_words(f.effect)}: {f.evidence}", WIDTH, initial_indent="  ", subsequent_indent="  ")
    return ["About the record", *lines] if lines else []


def _untested(dia: Any) -> list[str]:
    lines = []
    for effect, reason in dia.not_testable.items():
        lines += textwrap.wrap(f"{_words(effect)}: {reason}", WIDTH, initial_indent="  ", subsequent_indent="    ")
    return ["Not testable with this record", *lines] if lines else []


def _next(dia: Any) -> list[str]:
    p = dia.next_experiment
    if p is None:
        return []
    text = f"{p.reason} Separates {' from '.join(map(_words, p.separates))}; expected margin {p.margin:.0f} BIC units."
    lines = textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="  ")
    return [
        "Next experiment",
        *lines,
        f"  command: {len(p.command)} samples of {1e3 * p.dt:.4g} ms, {len(p.command) * p.dt:.3g} s",
    ]


def _how(dia: Any) -> list[str]:
    return [
        f"Computed with seed {dia.seed}, gaident {dia.version or 'of unknown version'}, "
        f"{dia.simulations} simulations, {dia.seconds:.2f} s; "
        f"data {', '.join(d[:12] for d in dia.digests)}"
    ]
