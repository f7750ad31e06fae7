"""Other effects in a finding's place: what the record cannot tell from it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from gaident.diagnosis.candidates import CANDIDATES
from gaident.diagnosis.problem import Fit
from gaident.diagnosis.stepwise import Search

__all__ = ["Rival", "rivals_of"]

HINT = 8.0
"""Fall of N ln V from which a generalisation is no longer ruled out by the simpler effect it contains."""


@dataclass(frozen=True)
class Rival:
    """Another effect in the place of one: how much worse (BIC units) the whole model is with it."""

    effect: str
    behind: float
    fit: Fit


def rivals_of(search: Search, final: Fit, effect: str, twins: Collection[str] = ()) -> tuple[float, list[Rival]]:
    """(gain of `effect` in the final model, other effects in its place that come within reach, or are its twins here)."""
    less = search.without(final, effect)
    gain = (search.fitter.in_loop(less) if final.layout.looped else less).bic - final.bic
    found = []
    for f in search.extensions(less):
        name = f.effects[-1]
        if name == effect or name in final.effects:
            continue
        behind = f.bic - final.bic
        if name in twins:
            found.append(Rival(name, behind, f))
            continue
        if effect in CANDIDATES[name].parents:
            # A generalisation is never worse by more than its parameters: only a hint of what it adds counts.
            more = CANDIDATES[name].size - CANDIDATES[effect].size
            if behind - more * np.log(search.problem.count) > -(HINT + 3.0 * (more - 1)):
                continue
            if behind < -search.threshold and not search.in_both_views(final, f):
                continue
        if behind < search.margin:
            found.append(Rival(name, behind, f))
    return gain, found
