"""The page of a reproduction, and its main figures as text."""

from __future__ import annotations

import html
from collections.abc import Mapping

import numpy as np

from gaident.models.mechanics import Mechanics, OneMass, TwoMass
from gaident.paper import tables
from gaident.paper.conventional import AMPLITUDE, HOLD, REGISTER
from gaident.paper.experiment import FRICTION, NOISE, StepTest
from gaident.paper.facts import DT, LOOP_GAIN_FACTORS, SECONDS, SECONDS_PER_GENERATION, Mechanism
from gaident.paper.friction import FrictionTest
from gaident.paper.pictures import CAPTIONS
from gaident.paper.reproduction import Part, Reproduction
from gaident.paper.rig import SUBSTEPS
from gaident.paper.template import PAGE
from gaident.show.html import figure, number

__all__ = ["page", "summary"]


def page(result: Reproduction, pictures: Mapping[str, bytes]) -> str:
    """The whole HTML page, pictures (see `figures`) included."""
    parts = result.parts
    drawn = {name: figure(pictures[name], caption) for name, caption in CAPTIONS.items()}
    short = {"fig6": drawn["fig6_nominal"], "fig7": drawn["fig7_generations"], "fig8": drawn["fig8_identified"]}
    each: dict[str, str] = {}
    for part in parts:
        each |= {f"{name}_{part.mechanism.key}": text for name, text in _part_words(part, result.seeds).items()}
    return PAGE.substitute(
        drawn,
        **short,
        **each,
        **_paper_words(result),
        nominal_table=tables.nominal_table(parts),
        mechanics_table=tables.mechanics_table(parts),
        table_v=tables.table_v(parts),
        behind_table=tables.behind_table(parts),
        table_iv=tables.table_iv(parts),
        engines_table=tables.engines_table(parts),
        Tc=f"{FRICTION.coulomb:g}",
        Ts=f"{FRICTION.static:g}",
        vs=f"{FRICTION.stribeck_velocity:g}",
        noise=f"{NOISE:g}",
        dt=f"{1e3 * DT:g}",
        paper_generation=f"{1e3 * SECONDS_PER_GENERATION:g}",
        paper_seconds=f"{SECONDS:g}",
        substeps=str(SUBSTEPS),
        samples=str(HOLD * (2**REGISTER - 1)),
        amplitude=f"{AMPLITUDE:g}",
        version=html.escape(result.version),
        seed=str(result.seed),
        seeds=str(result.seeds),
        trials=str(result.trials),
        seconds=f"{result.seconds:.0f}",
        cpu_seconds=f"{result.cpu_seconds:.0f}",
        processors=str(result.processors),
    )


def _paper_words(result: Reproduction) -> dict[str, str]:
    """What the text says of the paper's own numbers."""
    one, two = result.parts
    ways = (two.identified.product, two.identified.pairwise, two.identified.least_squares)
    product, pairwise, least_squares = (_two(way) for way in ways)
    return {
        "nominal_percent": f"{100.0 * max(p.nominal.worst for p in result.parts):.1f}",
        "table_v_worst": number(max(p.table_v.worst for p in result.parts), 1),
        "apart_percent": f"{100.0 * max(p.table_v.conventional_apart for p in result.parts):.0f}",
        "KG_printed": two.mechanism.identified_mechanics["KG"],
        "KG_product": number(product.KG),
        "KG_pairwise": number(pairwise.KG),
        "gap_percent": f"{100.0 * (least_squares.inconsistency or 0.0):.0f}",
        "rig_gap_percent": f"{100.0 * (getattr(two.friction.linear_step, 'inconsistency', 0.0) or 0.0):.0f}",
        "J_proposed": number(_one(one.identified.product).J, 3),
        "J_conventional": number(_one(one.table_v.conventional).J, 3),
        "JL_proposed": number(product.JL, 3),
        "JL_conventional": number(_two(two.table_v.conventional).JL, 3),
        "KG_spread_refined": _spread(two, "refined", "KG"),
        "KG_spread_genetic": _spread(two, "genetic", "KG"),
    }


def _part_words(part: Part, seeds: int) -> dict[str, str]:
    """What the text says of one mechanism; the names get _one or _two."""
    m, f = part.mechanism, part.friction
    damping = "D" if m.key == "one" else "DM"
    return {
        "factor": str(LOOP_GAIN_FACTORS[m.key]),
        "nominal": f"{part.step.nominal_fitness:.1f}",
        "paper_nominal": str(m.fitness[0]),
        "paper_identified": str(m.fitness[1]),
        "bilinear": _bilinear(part.step),
        "scaled_nominal": f"{part.step.scaled_nominal:.1f}",
        "scaled_best": f"{min(part.step.scaled_final):.1f}",
        "scaled_mean": f"{np.mean(part.step.scaled_final):.1f}",
        "conventional": tables.conventional_table(part, seeds),
        "damping": _mean_deviation(part, damping),
        "friction_table": tables.friction_table(part),
        "friction_words": html.escape(_friction_words(f).replace("+-", "\N{PLUS-MINUS SIGN}")),
    }


def _friction_words(f: FrictionTest) -> str:
    before, after = f.diagnosis.before, f.diagnosis.after
    return (
        f"The step alone: {f.step_only.verdict}. With reversals: {named(f)}. "
        f"Free-run error on {f.diagnosis.held_out}: {before.rmse:.3f} rad/s with the linear model, {after.rmse:.3f} with the "
        f"extended one; the noise leaves {after.noise_floor:.3f}."
    )


def _bilinear(step: StepTest) -> str:
    return f"({step.bilinear.p}, {step.bilinear.q}) with fitness {step.bilinear.fitness:.1f}"


def _mean_deviation(part: Part, name: str) -> str:
    """Of one mechanical parameter by the genetic identification of the rig with friction, in percent."""
    comparison = part.comparisons[1]
    values = comparison.method("genetic").mechanics[:, part.mechanism.names.index(name)]
    known = values[np.isfinite(values)]
    return f"{100.0 * (known.mean() / getattr(part.mechanism.sheet, name) - 1.0):+.0f}" if len(known) else "?"


def _spread(part: Part, key: str, name: str) -> str:
    """Of one mechanical parameter over the noise seeds, by one method on the rig without friction, in percent of the truth."""
    values = part.comparisons[0].method(key).mechanics[:, part.mechanism.names.index(name)]
    known = values[np.isfinite(values)]
    return number(100.0 * float(known.std()) / getattr(part.mechanism.sheet, name), 2) if len(known) else "?"


def _one(mechanics: Mechanics | None) -> OneMass:
    assert isinstance(mechanics, OneMass)
    return mechanics


def _two(mechanics: Mechanics | None) -> TwoMass:
    assert isinstance(mechanics, TwoMass)
    return mechanics


def named(f: FrictionTest) -> str:
    """The diagnosis in one line."""
    told = []
    for finding in f.diagnosis.findings:
        values = ", ".join(f"{n.replace('_', ' ')} {e.value:.4g} +- {e.std:.1g} {e.unit}" for n, e in finding.parameters.items())
        others = "".join(f" or {a.replace('_', ' ')}" for a in finding.alternatives)
        told.append(f"{finding.effect.replace('_', ' ')}{others} ({values})")
    return f"{f.diagnosis.verdict}, {'; '.join(told) or 'nothing found'}"


def worst(mechanics: Mechanics | None, mechanism: Mechanism) -> str:
    """The mechanical parameter that is furthest from the sheet value, relatively."""
    if not isinstance(mechanics, type(mechanism.sheet)):
        return "another structure"
    off = {n: getattr(mechanics, n) / getattr(mechanism.sheet, n) - 1.0 for n in mechanism.names}
    name = max(off, key=lambda n: abs(off[n]))
    return f"{name} {100.0 * off[name]:+.1f} %"


def summary(result: Reproduction) -> str:
    """The page's main figures as text."""
    lines = []
    for part in result.parts:
        m, v, f = part.mechanism, part.table_v, part.friction
        paper, default = part.step.engine("paper"), part.step.engine("default")
        told = {
            "Table III -> Table IV": f"nominal column within {100.0 * part.nominal.worst:.2f} %",
            "Table IV -> Table V": f"within {v.worst:.1e} of the largest coefficient with the loop gain x "
            f"{LOOP_GAIN_FACTORS[m.key]}, {v.worst_with_printed_gains:.1e} with the printed gains",
            "fitness": f"nominal {part.step.nominal_fitness:.1f}, paper's GA {paper.best.fitness:.1f}, default engine "
            f"{default.best.fitness:.1f} (the paper's rig: {m.fitness[0]} and {m.fitness[1]})",
            "right structure": f"paper's GA {paper.right} of {paper.trials}, default engine {default.right} of {default.trials}",
            "time": f"paper's GA {1e6 * paper.seconds / paper.generations:.1f} us per generation, {1e3 * paper.seconds:.1f} ms "
            f"in all; default engine {1e3 * default.seconds:.1f} ms "
            f"(the paper: {1e3 * SECONDS_PER_GENERATION:g} ms, {SECONDS:g} s)",
            "diagnosis of the step": f.step_only.verdict,
            "with reversals": named(f),
            "worst parameter": f"linear {worst(f.linear, m)}, extended {worst(f.extended, m)}",
        }
        lines += [m.title, *(f"  {name:22} {text}" for name, text in told.items()), ""]
    return "\n".join(lines).rstrip()
