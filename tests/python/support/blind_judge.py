"""What a diagnosis said about a blind case, judged: pure functions of the result and the truth.

A finding with no alternatives *names* its effect; one with alternatives *abstains* between them.
Findings that only describe the record's noise do not count, unless that is what was hidden.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import gaident as ga
from drive_cases import NOISE_EFFECTS
from drive_rig import AT_LOAD, OUTSIDE, Plant
from gaident.models.effect_rows import wave_of

# Truth -> what no record of command, velocity and torque can tell from it: always reported together.
EQUIVALENT = {"torque_lag": "velocity_filter", "velocity_filter": "torque_lag"}
# Members of structural classes: reported, but an exact name is not asked for.
# A load and dry friction of two levels are the same torque as long as the shaft turns;
# a load alone, or unequal viscous parts, may be told apart.
CLASSES = (*EQUIVALENT, "load_torque", "asymmetric_friction")
# What `driver` may say about an effect outside the library, and what such an effect really contains of the library.
DRIVERS = {
    "random_walk_friction": ("time",),
    "thermal_gain": ("time", "torque"),
    "resolver_error_of_speed": ("position", "velocity"),
    "contact": ("position",),
    "growing_inertia": ("time", "torque"),
}
PARTS = {"random_walk_friction": ("coulomb_friction",)}
ANGLES = ("phase",)


@dataclass
class Judgement:
    """Outcome of one diagnosis."""

    truth: tuple[str, ...]
    named: list[str] = field(default_factory=list)  # without alternatives
    sets: list[list[str]] = field(default_factory=list)  # of every finding that counts
    verdict: str = ""
    driver: str | None = None
    exact: bool = False  # every hidden effect named, nothing else found
    in_set: bool = False  # every hidden effect in some finding's set
    wrong: list[str] = field(default_factory=list)  # named, and not there
    parts: list[str] = field(default_factory=list)  # named, and a true part of something outside the library
    equivalents_together: bool | None = None
    extra: int = 0  # findings in which no hidden effect occurs
    parameter_errors: dict[str, float] = field(default_factory=dict)  # "effect.parameter" -> relative error
    column: str = ""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def counted(findings: Iterable[Any], truth: tuple[str, ...]) -> list[Any]:
    """The findings that count: those about the drive, and those about noise where noise was hidden."""
    return [f for f in findings if not f.is_noise or f.effect in truth]


def judge(dia: Any, effects: dict[str, dict[str, float]]) -> Judgement:
    """Compare a diagnosis with the hidden effects ({} for a clean record)."""
    truth = tuple(effects)
    findings = counted(dia.findings, truth)
    sets = [[f.effect, *f.alternatives] for f in findings]
    named = [f.effect for f in findings if not f.alternatives]
    parts = {part for name in truth for part in PARTS.get(name, ())}
    judged = Judgement(truth=truth, named=named, sets=sets, verdict=dia.verdict, driver=dia.driver)
    judged.wrong = [name for name in named if name not in truth and name not in parts]
    judged.parts = [name for name in named if name in parts]
    judged.in_set = all(any(name in each for each in sets) for name in truth)
    judged.exact = sorted(named) == sorted(truth) and len(findings) == len(truth)
    judged.extra = sum(not set(each) & (set(truth) | parts) for each in sets)
    if len(truth) == 1 and truth[0] in EQUIVALENT:
        judged.equivalents_together = any({truth[0], EQUIVALENT[truth[0]]} <= set(each) for each in sets)
    judged.parameter_errors = parameter_errors(findings, effects)
    judged.column = column(judged)
    return judged


def ends_of(dia: Any, truth: tuple[str, ...]) -> list[str]:
    """At which ends of the shaft the finding with a hidden effect in its set is said to be; empty where there is none."""
    found = (f for f in counted(dia.findings, truth) if set(truth) & {f.effect, *f.alternatives})
    return next((list(f.sides) for f in found), [])


def with_ends(dia: Any) -> Any:
    """The diagnosis with the end in the name of what is at the load alone, "name@load", as hidden effects have it."""
    findings = tuple(replace(f, effect=f.effect + AT_LOAD) if f.sides == ("load",) else f for f in dia.findings)
    return SimpleNamespace(findings=findings, verdict=dia.verdict, driver=dia.driver)


def parameter_errors(findings: list[Any], effects: dict[str, dict[str, float]]) -> dict[str, float]:
    """Relative errors of the parameters of what was rightly found first in its set; phases and zeros have none."""
    errors = {}
    for finding in findings:
        for name, true in effects.get(finding.effect, {}).items():
            if wave_of(name)[0] in ANGLES or not true or name not in finding.parameters:
                continue
            value = float(finding.parameters[name].value)
            errors[f"{finding.effect}.{name}"] = abs((abs(value) if name == "amplitude" else value) - true) / abs(true)
    return errors


def column(judged: Judgement) -> str:
    """The column of the confusion matrix: a name (a wrong one first), else abstained, unexplained or none."""
    if judged.wrong:
        return judged.wrong[0]
    if judged.named:
        return next((name for name in judged.named if name in judged.truth), judged.named[0])
    if judged.sets:
        return "abstained" if judged.in_set or not judged.truth else "abstained without it"
    return "unexplained" if judged.verdict in ("unexplained", "partly explained") else "none"


def driver_right(judged: Judgement) -> bool:
    return any(judged.driver in DRIVERS[name] for name in judged.truth if name in OUTSIDE)


def describes_noise(truth: tuple[str, ...]) -> bool:
    return bool(set(truth) & set(NOISE_EFFECTS))


def mechanics_of(plant: Plant) -> dict[str, float]:
    """Name -> value, as a diagnosis names them."""
    found = {"inertia": plant.J + plant.JL, "viscous_friction": plant.D + plant.DL}
    if not plant.two_masses:
        return found
    model = ga.TwoMass(plant.J, plant.D, plant.JL, plant.DL, plant.KG, plant.DG).model()
    found |= {"motor_inertia": plant.J, "load_inertia": plant.JL, "stiffness": plant.KG}
    for name, roots in (("resonance", model.poles), ("antiresonance", model.zeros)):
        root = max(roots, key=lambda s: s.imag)
        found |= {name: abs(root) / (2.0 * math.pi), f"{name}_damping": -root.real / abs(root)}
    return found


def deviations(dia: Any, effects: dict[str, dict[str, float]], plant: Plant) -> dict[str, float]:
    """ "name" or "effect.parameter" -> (value - truth) over its standard deviation, of mechanics and of effects that are there.

    Left out is what the diagnosis calls not determined, and the mechanics of a shaft where the found drive is of one mass.
    An amplitude counts by its size, whose sign is half a turn of the phase.
    Of an effect at both ends of the shaft each end counts by itself, with its end in the name.
    What is found to a millionth of its value is right: rounding is no deviation.
    """
    pairs = [(name, dia.mechanics[name], true, "") for name, true in mechanics_of(plant).items() if name in dia.mechanics]
    hidden = {key.removesuffix(AT_LOAD): values for key, values in effects.items()}
    if len(hidden) < len(effects):
        dia, hidden = with_ends(dia), effects
    for finding in counted(dia.findings, tuple(hidden)):
        true = hidden.get(finding.effect, {})
        turned = "amplitude" in finding.parameters and finding.parameters["amplitude"].value < 0.0
        pairs += [(f"{finding.effect}.{n}", e, true[n], n + "!" * turned) for n, e in finding.parameters.items() if n in true]
    found = {}
    for name, estimate, true, kind in pairs:
        if not (estimate.identifiable and 0.0 < estimate.std < math.inf):
            continue
        error = estimate.value - true
        if kind == "amplitude!":
            error = -estimate.value - true
        if wave_of(kind.rstrip("!"))[0] in ANGLES:
            error = math.remainder(error + math.pi * kind.endswith("!"), 2.0 * math.pi)
        found[name] = error / max(estimate.std, 1e-6 * abs(true))
    return found
