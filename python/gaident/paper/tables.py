"""The page's tables, each from what was computed."""

from __future__ import annotations

import numpy as np

from gaident.models.mechanics import Mechanics
from gaident.models.model import Model
from gaident.paper.conventional import METHODS
from gaident.paper.facts import LOOP_GAIN_FACTORS, Mechanism
from gaident.paper.reproduction import Part
from gaident.show.html import Cell, Row, table

__all__ = [
    "behind_table",
    "conventional_table",
    "engines_table",
    "friction_table",
    "mechanics_table",
    "nominal_table",
    "table_iv",
    "table_v",
]

Parts = tuple[Part, Part]


def nominal_table(parts: Parts) -> str:
    """Table III's sheet values as K, A, B beside the nominal column of Table IV."""
    blocks = [
        [
            (p.mechanism.words, name, *map(_printed, (ours, theirs)), f"{100.0 * off:.3f} %")
            for name, ours, theirs, off in p.nominal.rows
        ]
        for p in parts
    ]
    return table(("", "", "from Table III", "printed", "deviation"), blocks)


def mechanics_table(parts: Parts) -> str:
    """Mechanics of the identified column by every way there is."""
    blocks: list[list[Row]] = []
    for p in parts:
        found, m = p.identified, p.mechanism
        ways = (found.product, found.pairwise, found.least_squares, found.shaft)
        more = () if found.shaft is None else ("DG",)
        blocks.append([
            (m.words, _with_unit(name, m), m.identified_mechanics.get(name), *(_value(way, name) for way in ways))
            for name in (*m.names, *more)
        ])  # fmt: skip
    return table(("", "", "printed", "KG by product", "KG pairwise", "least squares", "DG free"), blocks)


def table_v(parts: Parts) -> str:
    """Both mechanisms: the proposed column as printed and from Table IV, and the conventional one."""
    blocks: list[list[Row]] = []
    for p in parts:
        v = p.table_v
        columns = (v.printed, v.scaled, v.with_printed_gains, v.printed_conventional)
        rows: list[Row] = [
            (p.mechanism.words, name, *(f"{x:.6f}" for x in values))
            for name, *values in zip(_coefficients(p.mechanism.order), *columns, strict=True)
        ]
        factor = f"loop gain x {LOOP_GAIN_FACTORS[p.mechanism.key]}"
        off = (v.worst, v.worst_with_printed_gains, v.conventional_apart)
        rows.append((factor, "largest deviation", "", *(f"{x:.1e}" for x in off)))
        blocks.append(rows)
    columns_ = ("", "", "proposed, printed", "from Table IV, gain scaled", "from Table IV, printed gain", "conventional, printed")
    return table(columns_, blocks)


def behind_table(parts: Parts) -> str:
    """Mechanics behind both methods of Table V."""
    blocks = [
        [
            (p.mechanism.words, _with_unit(name, p.mechanism),
             *(_value(way, name) for way in (p.mechanism.sheet, p.identified.product, p.table_v.conventional)))
            for name in p.mechanism.names
        ]
        for p in parts
    ]  # fmt: skip
    return table(("", "", "nominal", "behind the proposed column", "behind the conventional column"), blocks)


def table_iv(parts: Parts) -> str:
    """Table IV for the simulated rig."""
    blocks: list[list[Row]] = []
    for p in parts:
        m, step = p.mechanism, p.step
        paper, default = step.engine("paper").best, step.engine("default").best
        models = (m.sheet.model(), paper.model, default.model)
        rows: list[Row] = [("p, q", *(f"{x.p}, {x.q}" for x in models)), *_model_rows(models)]
        found = (m.sheet, paper.mechanics, default.mechanics)
        rows += [(_with_unit(name, m), *(_value(x, name) for x in found)) for name in m.names]
        rows.append(("fitness (6)", step.nominal_fitness, paper.fitness, default.fitness))
        blocks.append([(m.words, *row) for row in rows])
    return table(("", "", "nominal", "paper's GA", "default engine"), blocks)


def engines_table(parts: Parts) -> str:
    """Success and time of both engines."""
    blocks: list[list[Row]] = []
    for p in parts:
        rows: list[Row] = []
        for e in p.step.engines:
            each = f"{1e6 * e.seconds / e.generations:.1f} \N{MICRO SIGN}s" if e.key == "paper" else None
            right, optimal = f"{e.right} of {e.trials}", f"{e.optimal} of {e.trials}"
            mean = float(np.mean(e.final))
            rows.append((p.mechanism.words, e.title, right, optimal, mean, e.generations, each, f"{1e3 * e.seconds:.1f} ms"))
        blocks.append(rows)
    heads = ("", "", "right structure", "at the optimum", "mean fitness", "generations", "per generation", "in all")
    return table((*heads,), blocks)


def conventional_table(part: Part, seeds: int) -> str:
    """Table V's form for the rig: bias and spread of every coefficient, without and with friction."""
    m = part.mechanism
    blocks: list[list[Row]] = []
    for c, words in zip(part.comparisons, ("no friction", "friction"), strict=True):
        columns = [(x.bias(c.truth), x.spread) for x in c.methods]
        rows: list[Row] = []
        for i, name in enumerate(_coefficients(m.order)):
            rows.append(
                (
                    words,
                    name,
                    f"{c.truth[i]:.6f}",
                    *(_fixed(value[i], k == 0) for pair in columns for k, value in enumerate(pair)),
                )
            )
        counts = [text for x in c.methods for text in (f"{x.right} of {seeds}", "")]
        blocks.append([*rows, (words, "mechanism found", "", *counts)])
    groups = [("", 3), *((METHODS[x.key], 2) for x in part.comparisons[0].methods)]
    return table(("rig with", "", "true", *["bias", "spread"] * 3), blocks, groups)


def friction_table(part: Part) -> str:
    """Nominal, linear identification, extended identification."""
    f, m = part.friction, part.mechanism
    rows: list[Row] = []
    for name in m.names:
        row: list[Cell] = [_with_unit(name, m), _value(m.sheet, name)]
        for found in (f.linear_step, f.linear, f.extended):
            value = _value(found, name)
            row += [value, None if value is None else f"{100.0 * (value / getattr(m.sheet, name) - 1.0):+.1f} %"]
        rows.append(row)
    groups = [("", 2), ("linear, the step", 2), ("linear, with reversals", 2), ("extended, with reversals", 2)]
    return table(("", "nominal", *["value", "off by"] * 3), [rows], groups)


def _with_unit(name: str, mechanism: Mechanism) -> str:
    return f"{name} [{mechanism.sheet.UNITS[name].replace('^2', chr(0xB2))}]"


def _printed(value: complex) -> Cell:
    """K with the paper's six digits, roots with four."""
    return f"{value.real:.2f}" if abs(value) >= 1e3 else value


def _value(mechanics: Mechanics | None, name: str) -> float | None:
    value: float | None = getattr(mechanics, name, None)
    return value


def _fixed(value: float, signed: bool) -> str | None:
    return None if np.isnan(value) else f"{value:+.6f}" if signed else f"{value:.6f}"


def _coefficients(order: int) -> list[str]:
    return [*(f"\N{GREEK SMALL LETTER ALPHA}{i}" for i in range(order + 1)),
            *(f"\N{GREEK SMALL LETTER BETA}{i}" for i in range(1, order + 1))]  # fmt: skip


def _model_rows(models: tuple[Model, ...]) -> list[Row]:
    """K, A, B of models side by side; where one has more roots of a kind, the others have a dash."""
    rows: list[Row] = [("K", *(m.gain for m in models))]
    for letter in "AB":
        listed = [[-r.conjugate() for r in (m.poles if letter == "A" else m.zeros) if r.imag >= 0.0] for m in models]
        for is_pair in (False, True):
            kind = [[r for r in roots if (r.imag != 0.0) == is_pair] for roots in listed]
            for i in range(max(map(len, kind))):
                rows.append((f"{letter} [rad/s]", *(roots[i] if i < len(roots) else None for roots in kind)))
    return rows
