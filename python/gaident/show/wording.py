"""How numbers, structures, tables and the names of causes are written."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from gaident.axis import identifier_words, unit, word
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding, where
from gaident.results.fitness import Fitness
from gaident.results.what_if import Stability, Variation

__all__ = [
    *(
        "cause_words",
        "certainty",
        "controller_lines",
        "either",
        "free_run_words",
        "missing_words",
        "number",
        "size_words",
        "stability_summary",
    ),
    *("NOT_AS_GIVEN", "SPREAD", "WIDTH", "diverges", "not_as_given", "step_words", "structure_words", "table", "with_std"),
    "words",
]

WIDTH = 100  # no decision: printed: letters of a line
GAINS = {"kp", "ki"}
SPREAD = "is what noise makes and the record leaves open; what the model gets wrong may come on top."
"""Of a standard deviation; stands behind its sign."""
NOT_AS_GIVEN = {
    "integration_rule": "the controller has another integration rule than the one given or assumed",
    "other_gains": "the controller has other gains than the given ones",
}
"""Finding -> what differs in the controller itself: the model of the axis lacks nothing by it."""
_ANGULAR = ("frequency", "zero_frequency", "bandwidth")  # where they are in rad/s: they are read in Hz


def certainty(bic: float, doubted: bool = False) -> str:
    """What a difference of so many BIC units means: 2 ln of the odds.

    doubted: whether the model leaves more than noise, or ends at a bound: odds are of models one of which is right.
    """
    words = ((math.inf if doubted else 50.0, "beyond doubt"), (20.0, "very likely"), (-math.inf, "likely"))
    return next(word for least, word in words if bic >= least)


def structure_words(p: int, q: int) -> str:
    """What a structure (p, q) means mechanically."""
    known = {(1, 0): "one mass", (1, 2): "two masses on a shaft", (1, 4): "three masses in a row"}
    return known.get((p, q), "neither one mass nor two")


def number(value: float, digits: int = 4) -> str:  # no decision: printed: a number
    """`value` with so many significant digits; a dash where there is none."""
    return f"{value + 0.0:.{digits}g}" if math.isfinite(value) else "-" if math.isnan(value) else f"{value}"


def diverges(run: Fitness) -> bool:
    """Whether the error of a free run is `diverged` times the motion: no figure of a model."""
    return run.fit_percent < 100.0 * (1.0 - POLICY.diverged)  # no decision: a unit: percent


def free_run_words(run: Fitness, written: Callable[[float], str] = number) -> tuple[str, str]:
    """(rmse, fit in percent) of a free run; one that diverges has no figures."""
    if diverges(run):
        return "diverges", ""
    return written(run.rmse), f"{run.fit_percent:.2f}"


def step_words(gain: float) -> str:
    """The error of the free run with an effect against that before it: "-83 %"."""
    if not gain > -1e6:  # no number where one run diverges after another  # no decision: printed: a number
        return "the free run diverges"
    if gain < -10.0:  # no decision: printed: a number
        return "more than ten times larger"
    share = round(-100.0 * gain)
    return f"{share:+d} %" if share else "0 %"


def with_std(value: float, std: float | None) -> str:
    """`value +- std`, the standard deviation with two significant digits and the value as far as it goes."""
    if std is None or math.isnan(std) or std == 0.0 or not math.isfinite(value):
        return number(value, 5)
    if math.isinf(std):
        return f"{number(value, 5)} +- inf"
    size = math.floor(math.log10(max(abs(value), std)))
    decimals = 1 - math.floor(math.log10(std))
    if -3 <= size < 6:  # no decision: printed: a number
        shift, digits = 0, max(decimals, 0)
    else:
        shift, digits = size, decimals + size
    if digits > 9:  # next to no noise: the deviation needs an exponent of its own  # no decision: printed: a number
        return f"{value:.9g} +- {std:.1e}"
    scale = 10.0**-shift
    text = f"{round(value * scale, digits) + 0.0:.{digits}f} +- {std * scale:.{digits}f}"
    return text if shift == 0 else f"({text})e{shift:+03d}"


def table(rows: Sequence[Sequence[str]], indent: str = "  ") -> list[str]:
    """Lines with the cells in left-aligned columns two spaces apart; empty columns are left out."""
    columns = list(zip(*rows, strict=True))
    kept = [column for column in columns if any(column)]
    widths = [max(map(len, column)) for column in kept]
    lines = zip(*kept, strict=True)
    return [(indent + "  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True))).rstrip() for line in lines]


def controller_lines(numbers: Mapping[str, Estimate], axis: str) -> list[str]:
    """What was not known of the controller and follows from the logged torque; empty where all was given."""
    rows = [(name, with_std(e.value, e.std), "" if e.unit == "1" else unit(e.unit, axis)) for name, e in numbers.items()]
    return ["Of the controller, from the logged " + word("torque", axis), *table(rows)] if rows else []


def words(effect: str, axis: str = "rotary") -> str:
    """The name of an effect as a reader of the axis reads it: torque saturation, of a linear axis force saturation."""
    return identifier_words(effect, axis)


def cause_words(finding: Finding, dia: Diagnosis, axis: str, sized: bool = False) -> str:
    """What a finding found, and at which end of the shaft: coulomb friction at the load.

    sized: with its size behind the name where it is determined: coulomb friction (0.05 N m) at the load.
    """
    size = size_words(finding, axis) if sized else ""
    return " ".join(filter(None, (words(finding.effect, axis), size and f"({size})", where(finding, dia.model))))


def either(finding: Finding, dia: Diagnosis, axis: str) -> str:
    """ "a, b or c" of a finding and what these data cannot tell from it."""
    names = [cause_words(finding, dia, axis), *(words(name, axis) for name in finding.alternatives)]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def size_words(finding: Finding, axis: str) -> str:
    """How large it is, by its first parameter: "0.12 N m"; "" where that is not determined or has no unit.

    Gains of a controller are shown together: "kp 0.52 N m s/rad, ki 20.7 N m/rad".
    """
    if finding.parameters and set(finding.parameters) <= GAINS:
        shown = {n: e for n, e in sorted(finding.parameters.items(), reverse=True) if math.isfinite(e.value)}
        return ", ".join(f"{n} {number(e.value, 3)} {unit(e.unit, axis)}" for n, e in shown.items())
    name, e = next(iter(finding.parameters.items()), ("", None))
    if e is None or not e.identifiable or not math.isfinite(e.value) or e.unit == "1":
        return ""
    if name in _ANGULAR and e.unit == "rad/s":
        return f"{number(e.value / math.tau, 3)} Hz"
    value, u = (1e3 * e.value, "ms") if e.unit == "s" else (e.value, unit(e.unit, axis))
    still = finding.parameters.get("static_torque")  # what the axis breaks away with
    at_rest = f", {number(still.value, 3)} {u} at standstill" if still is not None and math.isfinite(still.value) else ""
    return f"{number(value, 3)} {u}{at_rest}"


def not_as_given(finding: Finding, axis: str) -> str:
    """What a finding of `NOT_AS_GIVEN` says of the controller, with its numbers where it has some."""
    size = size_words(finding, axis)
    return NOT_AS_GIVEN[finding.effect] + (f" ({size})" if size else "")


def missing_words(finding: Finding, dia: Diagnosis, axis: str) -> str:
    """One of several explanations; where all are kinds of one thing, that with its size: friction, 0.119 N m; its kind is open.

    Kinds of one thing have the last word of the first one's name in theirs. The end of the shaft is that of the first.
    """
    names = [words(name, axis).split() for name in (finding.effect, *finding.alternatives)]
    thing, size = names[0][-1], size_words(finding, axis)
    if not size or not all(thing in name for name in names) or min(map(len, names)) == 1:
        return ""
    kinds = [" ".join(word for word in name if word != thing) for name in names]
    first = f"{kinds[0]} {where(finding, dia.model)}".rstrip()
    return f"{thing}, {size}; its kind is open ({', '.join((first, *kinds[1:-1]))} or {kinds[-1]})"


def stability_summary(found: Stability) -> str:
    """How often causes are named again: a sentence for each, then a row for each variation."""
    rows = [(v.what, v.verdict or "not diagnosed", v.refused or variation_words(v, found.axis)) for v in found.variations]
    return "\n".join([*found.sentences, "", *table([("variation", "verdict", "causes"), *rows])])


def variation_words(v: Variation, axis: str) -> str:
    """The causes of a variation, each with its size."""
    causes = []
    for names in v.causes:
        e = v.sizes.get(names[0])
        size = "" if e is None else f" {with_std(e.value, e.std)} {'' if e.unit == '1' else unit(e.unit, axis)}".rstrip()
        causes.append(" or ".join(names) + size)
    return ", ".join(causes) or "none"
