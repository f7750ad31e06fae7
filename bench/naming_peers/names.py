"""From columns of a regression to names, the same for every method that regresses: which effects they are, with parameters."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from case import Case, Values
from in_the_loop import prepared
from library import Candidate, Library, differences, filtered

SHARED = {"sgn": "coulomb_friction", "one": "load_torque"}
"""Columns that several effects have -> the effect that has this column alone."""
CONTAINS = {
    "stribeck_friction": ("coulomb_friction",),
    "asymmetric_friction": ("coulomb_friction", "load_torque"),
    "presliding_friction": ("coulomb_friction",),
    "lugre_friction": ("coulomb_friction",),
    "friction_drift": ("coulomb_friction",),
    "position_friction": ("coulomb_friction",),
}
MOTIONS = {"filter": filtered, "differences": differences}


def library_of(case: Case, kind: str) -> Library:
    """The candidates over the record's motion, made once: behind gaident's "filter", or from plain "differences"."""
    assert case.identified
    return case.shared(f"library {kind}", lambda: Library(case, MOTIONS[kind](case.record)))


def own_columns(candidate: Candidate) -> list[str]:
    """The columns by which an effect is told from others: all but shared ones, unless it has nothing else."""
    return [name for name in candidate.atoms if SHARED.get(name, candidate.effect) == candidate.effect]


def without_contained(effects: Collection[str]) -> list[str]:
    """The effects without those that another one of them contains."""
    inside = {simple for effect in effects for simple in CONTAINS.get(effect, ())}
    return [effect for effect in effects if effect not in inside]


def with_parameters(case: Case, library: Library, effects: Collection[str]) -> Values:
    """Named effects with the parameters that least squares of their columns give, and what the replay shows."""
    chosen = [c for c in library.candidates if c.effect in without_contained(list(dict.fromkeys(effects)))]
    atoms = {name: x for c in chosen for name, x in c.atoms.items()}
    replayed = prepared(case).replayed
    if not atoms:
        return dict(replayed)
    X = np.column_stack([library.base, *atoms.values()])
    solved = np.linalg.lstsq(X, library.u, rcond=None)[0][library.base.shape[1] :]
    coefficients = {name: float(value) for name, value in zip(atoms, solved, strict=True)}
    return replayed | {c.effect: {k: float(v) for k, v in c.own(coefficients).items()} for c in chosen}
