"""A single step or move, which hardly tells effects apart: with an effect that the library does not know, or with one of a class.

What is not in the library has to stay without a name: a finding that only describes it is wrong, also where it is a choice of
several names.
"""

from __future__ import annotations

import blind
from rows.case import Case, Result, digest

import gaident as ga
from blind_judge import judge
from drive_rig import OUTSIDE

__all__ = ["described", "short_moves"]

OF_A_CLASS = ("coulomb_friction", "load_torque", "lugre_friction", "torque_lag")


def short_moves(count: int, seed: int) -> list[Case]:
    made = [(effect, kind, noise) for effect in OUTSIDE + OF_A_CLASS for kind in ("step", "move")
            for noise in (("none", "white", "encoder") if effect in OUTSIDE else ("none",))]  # fmt: skip
    cells = [blind.Cell("short moves", (effect,), kind, noise, noise != "encoder", seed * 1_000_000 + n)
             for n in range(count) for effect, kind, noise in made]  # fmt: skip
    return [Case("short_moves", c.key, c) for c in cells]


def described(case: Case) -> Result:
    cell: blind.Cell = case.what
    try:
        record, validation, controller, truth = blind.case_of(cell)
    except RuntimeError as none:  # this effect does not act there
        return Result("refused", "impossible", digest(str(none)))
    dia = ga.diagnose(record, controller=controller, validation=validation)
    judged = judge(dia, truth.effects)
    called = "wrong" if judged.extra or judged.wrong else "missed"
    if called == "missed" and set(cell.effects) & set(OUTSIDE):
        called = "right" if dia.verdict != "adequate" else called
    elif called == "missed":
        called = "right" if judged.exact else "in set" if judged.in_set else called
    said = f"{dia.verdict}: {', '.join(' or '.join(each) for each in judged.sets)}; {dia.driver}"
    return Result(called, said, digest([dia.notes, f"{dia.after.rmse:.3g}"]))
