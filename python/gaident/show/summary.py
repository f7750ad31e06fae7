"""The result of an identification as text."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping

from gaident.axis import identifier_words, said, unit, velocity_unit, word
from gaident.control.controller import Controller
from gaident.models.mechanics import Mechanics, TwoMass
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.identification import Identification
from gaident.show.units import Scales, beside, scales_of
from gaident.show.wording import WIDTH, controller_lines, number, structure_words, table, with_std

__all__ = [
    "flags_of",
    "identification_summary",
    "inconsistency_words",
    "meaning_of",
    "mechanics_comparison",
    "stem_of",
    "unseen_words",
]

SHOWN_STRUCTURES = 5  # no decision: how many are listed


def identification_summary(idn: Identification, axis: str = "rotary", units: Mapping[str, str | float] | None = None) -> str:
    """What was found and what it is worth; plain text, verdict first, no line break at the end.

    idn: an Identification, or anything with its attributes. axis: "rotary", or "linear" for units of m and N.
    units: of the user, shown beside SI, as `scales_of` takes them.
    """
    scales = scales_of(units, axis)
    sections = [
        _verdict(idn, axis, scales),
        _warnings(idn, axis),
        _mechanics(idn, axis),
        controller_lines(idn.controller_numbers, axis),
        _model(idn, axis),
        _structures(idn),
        _search(idn, axis),
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def mechanics_comparison(found: Mechanics, truth: Mechanics, axis: str = "rotary") -> str:
    """A table of identified against true mechanics; both OneMass or both TwoMass."""
    rows = [("", "true", "identified", "deviation", "")]
    for name in (n for n in found.UNITS if hasattr(truth, n)):
        true, value, std = getattr(truth, name), getattr(found, name), found.std.get(name, math.nan)
        if true == value == 0.0:
            continue
        relative = f"{round(100.0 * (value / true - 1.0), 1) + 0.0:+.1f} %" if true else ""
        in_stds = f" ({abs(value - true) / std:.1f} std)" if std > 0.0 else ""
        rows.append((name, number(true), with_std(value, std), relative + in_stds, unit(found.UNITS[name], axis)))
    return "\n".join(table(rows))


def _verdict(idn: Identification, axis: str, scales: Scales) -> list[str]:
    stands = "the linear model stands"
    if idn.falsified:
        stands = "the linear model is FALSIFIED"
    elif idn.adequacy.undecided:
        stands = "whether a linear model holds is UNDECIDED"
    records, v = len(idn.digests), velocity_unit(axis)
    given = len(idn.response_digests)
    of = [f"{idn.samples} samples of {records} record{'s' if records != 1 else ''}"] if records else []
    of += [f"{idn.frequencies} frequencies of {given} response{'s' if given != 1 else ''}"] if given else []
    if idn.of_responses:
        off = f"rms of the relative error {number(100.0 * idn.rmse)} %"
        figures: tuple[str, ...] = (f"fit {number(idn.fit_percent)} %", off, *of)
    else:
        figures = _of_velocity(idn, scales, v, of)
    return [
        f"(p,q) = ({idn.p},{idn.q}), {structure_words(idn.p, idn.q)}; {stands}",
        *textwrap.wrap(idn.adequacy.sentence, WIDTH),
        ", ".join(figures),
    ]


def _of_velocity(idn: Identification, scales: Scales, v: str, of: list[str]) -> tuple[str, ...]:
    return (
        f"fit {number(idn.fit_percent)} %",
        ", ".join(filter(None, (f"rmse {number(idn.rmse)} {v}", beside(scales, "", idn.rmse, None, v)))),
        f"white part of it {number(idn.adequacy.noise_std)} {v}",
        *of,
    )


def _loop(controller: Controller | None, axis: str) -> str:
    torque = unit("N m", axis)
    if controller is None:
        return f"open loop, {word('torque', axis)} [{torque}] to velocity [{velocity_unit(axis)}]"
    gains = controller.gains
    parts = [
        f"{controller.loop} loop, PI with kp {number(gains.kp)} {unit('N m s/rad', axis)}",
        f"ki {number(gains.ki)} {unit('N m/rad', axis)}",
    ]
    period = controller.to_dict().get("period")
    if period is not None:
        parts.append(f"in a cascade every {number(1e6 * period)} us")
    for name, limit in zip(("torque_limit", "integrator_limit"), controller.limits, strict=True):
        if math.isfinite(limit):
            parts.append(f"{identifier_words(name, axis)} {number(limit)} {torque}")
    return ", ".join(parts)


def _model(idn: Identification, axis: str) -> list[str]:
    gain = idn.parameters["gain"]
    rows: list[tuple[str, ...]] = [("", "real part [rad/s]", "imaginary part [rad/s]", "frequency [Hz]", "damping", "")]
    stems = dict.fromkeys(stem_of(name) for name in idn.parameters if name != "gain")
    rows += [_root(idn.parameters, stem) for stem in stems]
    head = f"Model: gain K = {_estimate(gain)} {unit(gain.unit, axis)} {flags_of([gain])}".rstrip()
    late = ", ".join(f"{name} {_estimate(e)} {e.unit} {flags_of([e])}".rstrip() for name, e in idn.path.items())
    beside = [f"  Path of the {word('torque', axis)}: {late}"] if late else []
    unseen = [f"  {line}" for line in textwrap.wrap(unseen_words(idn), WIDTH - 2)]
    return [head, *(table(rows) if len(rows) > 1 else []), *beside, *unseen]


def unseen_words(idn: Identification) -> str:
    """That a resonance above what log or responses reach would not have shown; nothing where that is not known."""
    if idn.unseen_above is None:
        return ""
    why = "the log has too few lines"
    if idn.response_digests:
        why = "the responses end there" if idn.of_responses else "log and responses end there"
    above = idn.of_responses and any(r.imag > 0.0 and abs(r) > math.tau * idn.unseen_above for r in idn.model.poles)
    but = ", but by what it does below" if above else ""
    return f"A resonance above {number(idn.unseen_above)} Hz would not have shown{but}: {why}."


def stem_of(name: str) -> str:
    """ "pole_pair_1" of "pole_pair_1_frequency", "pole_1" of itself."""
    return name.rsplit("_", 1)[0] if "_pair_" in name else name


def _root(parameters: Mapping[str, Estimate], stem: str) -> tuple[str, ...]:
    """One real root or one pair as a row."""
    name = stem.replace("_", " ")
    if stem in parameters:
        e = parameters[stem]
        shown = with_std(abs(e.value) / math.tau, e.std / math.tau) if e.value else ""
        return (name, _estimate(e), "", shown, "", flags_of([e], e.value))
    estimates = [parameters[f"{stem}_{what}"] for what in ("real", "imaginary", "frequency", "damping")]
    real, imaginary, frequency, damping = estimates
    in_hz = with_std(frequency.value / math.tau, frequency.std / math.tau)
    return name, _estimate(real), _estimate(imaginary), in_hz, _estimate(damping), flags_of(estimates, real.value)


def _estimate(e: Estimate) -> str:
    return with_std(e.value, e.std)


def flags_of(estimates: list[Estimate], real_part: float = -1.0) -> str:
    """What to doubt in a root or a parameter."""
    flags = []
    if any(e.at_bound for e in estimates):
        flags.append("at bound")
    elif any(not e.identifiable for e in estimates):
        flags.append("not identifiable")
    if real_part > 0.0:
        flags.append("unstable")
    return ", ".join(flags)


def _mechanics(idn: Identification, axis: str) -> list[str]:
    m = idn.mechanics
    if m is None:
        if (idn.p, idn.q) in ((1, 0), (1, 2)):
            return ["Mechanics: no such mechanism has these poles and zeros"]
        return [f"Mechanics: none, ({idn.p},{idn.q}) is {structure_words(idn.p, idn.q)}"]
    head = "Mechanics"
    if idn.falsified:
        head += ", NOT TO BE TRUSTED (the linear model is falsified)"
    elif idn.adequacy.undecided:
        head += ", with reserve (the linear model is undecided)"
    damped = m.with_shaft_damping if isinstance(m, TwoMass) else None
    rows = [("", "no shaft damping", "with shaft damping", "", "")] if damped is not None else []
    for name, rotary in m.UNITS.items():
        value = getattr(m, name)
        cell = "0 (set)" if name == "DG" and value == 0.0 else with_std(value, m.std.get(name))
        beside = "" if damped is None else with_std(getattr(damped, name), damped.std.get(name))
        rows.append((name, cell, beside, unit(rotary, axis), meaning_of(name, isinstance(m, TwoMass), axis)))
    lines = [head, *table(rows)]
    if isinstance(m, TwoMass):
        lines.append(
            f"  resonance {number(m.resonance / math.tau)} Hz, antiresonance {number(m.antiresonance / math.tau)} Hz (undamped)"
        )
        lines += [f"  {line}" for line in textwrap.wrap(inconsistency_words(m), WIDTH - 2)]
    if damped is not None:
        lines += [f"  with shaft damping: {said(note, axis)}" for note in damped.notes]
    return lines


def meaning_of(name: str, two_masses: bool, axis: str) -> str:
    """What a letter of the mechanics table stands for."""
    mass = word("inertia", axis)
    words = {
        "JM": f"{mass} of the motor's side",
        "DM": "viscous damping of the motor's side",
        "JL": f"{mass} of the load",
        "DL": "viscous damping of the load",
        "KG": "stiffness of the shaft" if axis == "rotary" else "stiffness between them",
        "DG": "damping in the shaft" if axis == "rotary" else "damping between them",
        "J": f"total {mass}" if two_masses else mass,
        "D": "total viscous damping" if two_masses else "viscous damping",
    }
    return words.get(name, "")


def inconsistency_words(m: Mechanics) -> str:
    """How far the two equations of a stiffness without shaft damping are apart."""
    if m.inconsistency is None:
        return ""
    std = m.std.get("inconsistency", math.nan)
    text = f"inconsistency without shaft damping {with_std(100.0 * m.inconsistency, 100.0 * std)} %"  # no decision: printed
    if not std > 0.0:
        return text
    if m.inconsistency <= POLICY.contradiction * std:
        return f"{text}: within three standard deviations, no shaft damping needed"
    return f"{text}: significant; a hint at shaft damping, or at an effect that the model lacks"


def _structures(idn: Identification) -> list[str]:
    if not idn.structures:
        return []
    rivals = {(r.p, r.q) for r in idn.rivals}
    ordered = sorted(idn.structures, key=lambda s: (s.delta_bic, s.p + 2 * s.q))
    shown = [s for i, s in enumerate(ordered) if i < SHOWN_STRUCTURES or (s.p, s.q) == (idn.p, idn.q)]
    rows = [("(p,q)", "delta BIC", "error sum", "")]
    for s in shown:
        mark = "reported" if (s.p, s.q) == (idn.p, idn.q) else "rival" if (s.p, s.q) in rivals else ""
        rows.append((f"({s.p},{s.q})", f"{s.delta_bic:.1f}", number(s.error_sum), mark))
    return [f"Structures, the best {len(shown)} of {len(ordered)}", *table(rows)]


def _search(idn: Identification, axis: str) -> list[str]:
    space, s = idn.space, idn.settings
    generations = sum(t.generations for t in idn.trials)
    evaluations = sum(t.evaluations for t in idn.trials)
    gain_unit = unit("rad/s^2/(N m)", axis)
    trials = len(idn.trials)
    return [
        f"Searched in {idn.seconds:.2f} s ({space.source})",
        f"  {_loop(idn.controller, axis)}",
        f"  K {_span(*space.gain)} {gain_unit}, real parts {_span(-space.real[1], -space.real[0])} rad/s, "
        f"imaginary parts {_span(*space.imaginary)} rad/s,",
        f"  p {space.p[0]}..{space.p[1]}, q {space.q[0]}..{space.q[1]}, {space.bits} bits a number",
        f"  engine {s.engine}, population {s.population}, {s.code} code, {s.scale} scale; seed {idn.seed}, "
        f"{trials} trial{'s' if trials != 1 else ''},",
        f"  {generations} generations, {evaluations} candidates; fitness (6) of the result "
        f"{number(idn.fitness)}; gaident {idn.version or 'of unknown version'}",
    ]


def _span(low: float, high: float) -> str:
    return f"{number(low)}..{number(high)}"


def _warnings(idn: Identification, axis: str) -> list[str]:
    # What falsifies the model stands at the top already.
    notes = [w for w in idn.warnings if w != idn.adequacy.sentence]
    lines = []
    for note in notes:
        lines += textwrap.wrap(said(note, axis), WIDTH, initial_indent="  - ", subsequent_indent="    ")
    return ["Keep in mind", *lines] if lines else []
