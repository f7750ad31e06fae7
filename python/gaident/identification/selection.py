"""Choosing between structures, after every one of them has been fitted: an information criterion on whitened residuals.

    BIC = N ln(RSS_w / N) + k ln N,   k = 1 + p + 2 q and the start states

RSS_w is the least sum of squares of the whitened simulation error. One filter serves all structures, estimated on the residual of
the one that fits best, so that no structure is whitened with its own mistakes. The *smallest* structure within 10 units of the
best wins
(METHOD.md section 3). A pole and a zero closer than 2 % to each other fit noise and are charged 10 units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.identification.noise import Autoregression, fit_autoregression
from gaident.models.model import Model

__all__ = ["MARGIN", "Candidate", "choose", "smallest_mechanism"]

MARGIN = 10.0
CANCELLATION = 0.02


@dataclass(frozen=True)
class Candidate:
    """One structure's fit: `cost` is the plain error sum, `bic` the whitened criterion."""

    model: Model
    starts: NDArray[np.float64]
    cost: float
    at_bound: tuple[bool, ...]
    bic: float = float("nan")

    @property
    def size(self) -> int:
        """1 + p + 2 q."""
        return 1 + self.model.p + 2 * self.model.q


def from_core(fit: Any) -> Candidate:
    """A Candidate of the core's Refined."""
    return Candidate(Model(fit.gain, fit.poles, fit.zeros), fit.starts, fit.cost, tuple(fit.at_bound))


def cancellations(model: Model) -> int:
    """Zeros with a pole closer than 2 % of their magnitude (each pole counts once)."""
    free = list(model.poles)
    count = 0
    for zero in model.zeros:
        near = [pole for pole in free if abs(pole - zero) < CANCELLATION * max(abs(zero), 1e-12)]
        if near:
            free.remove(min(near, key=lambda pole: abs(pole - zero)))
            count += 1
    return count


def choose(
    experiment: Any, candidates: Sequence[Candidate], residuals_of: Any, lengths: Sequence[int], ranges: Any, workers: int
) -> tuple[list[Candidate], int, Autoregression]:
    """(candidates with their BIC, index of the winner, the common noise model).

    residuals_of(candidate) -> one residual array per record.
    """
    fitted = min(candidates, key=lambda c: c.cost)
    noise = fit_autoregression(residuals_of(fitted))
    costs = [c.cost for c in candidates]
    count = sum(lengths)
    if noise.order > 0:
        models = [
            (c.model.gain, np.array(c.model.poles, complex), np.array(c.model.zeros, complex), c.starts) for c in candidates
        ]
        whitened = experiment.refine(models=models, ranges=ranges, whitening=list(noise.phi), max_iterations=8, workers=workers)
        costs = [w.cost for w in whitened]
        count -= noise.order * len(lengths)  # the first samples of each record, whose past is missing
    scored = []
    for c, cost in zip(candidates, costs, strict=True):
        bic = count * np.log(max(cost, 1e-300) / count) + (c.size + len(c.starts)) * np.log(count)
        scored.append(replace(c, bic=float(bic + MARGIN * cancellations(c.model))))
    best = min(c.bic for c in scored)
    close = [i for i, c in enumerate(scored) if c.bic <= best + MARGIN]
    winner = min(close, key=lambda i: (scored[i].size, scored[i].bic))
    return scored, winner, noise


def smallest_mechanism(scored: Sequence[Candidate], samples: int) -> int | None:
    """What to report where the data contradict every linear structure: index of the smallest mechanism, None where there is none.

    An information criterion supposes that one of the models is true. Where none is, every module more absorbs a little of what
    is missing, and the largest structure wins without meaning anything. Then only chains of masses (p = 1, q = 0, 2, 4, ...) are
    considered, and a mass more has to halve the whitened error sum, which noise-like misfit does not let it do.
    """
    chains = {c.model.q: i for i, c in enumerate(scored) if c.model.p == 1 and c.model.q % 2 == 0}
    if not chains:
        return None
    chosen = chains[min(chains)]
    for q in sorted(chains):
        if scored[chains[q]].bic < scored[chosen].bic - samples * np.log(2.0):
            chosen = chains[q]
    return chosen
