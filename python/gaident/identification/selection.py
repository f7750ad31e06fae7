"""Choosing between structures, after every one of them has been fitted: an information criterion on whitened residuals.

    BIC = N ln(RSS_w / N) + k ln N,   k = 1 + p + 2 q and the start states

RSS_w is the least sum of squares of the whitened simulation error.
One filter serves all structures, estimated on the residual of the one that fits best,
so that no structure is whitened with its own mistakes. The *smallest* structure within 10 units of the best wins.
A pole and a zero closer than 2 % to each other fit noise and are charged 10 units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gaident import _core
from gaident.estimation.criterion import bic
from gaident.identification.noise import Autoregression, autoregression_of, highest_order
from gaident.models.model import Model
from gaident.policy.table import POLICY

__all__ = ["Candidate", "charged", "is_chain", "noise_of", "scored", "smallest_close", "smallest_mechanism", "tolerance"]


@dataclass(frozen=True)
class Candidate:
    """One structure's fit: `bic` is the whitened criterion."""

    fit: _core.Refined
    bic: float = float("nan")

    @property
    def p(self) -> int:
        """Poles in excess of zeros."""
        return self.fit.p

    @property
    def q(self) -> int:
        """Zeros."""
        return self.fit.q

    @property
    def cost(self) -> float:
        """Plain error sum."""
        return self.fit.cost

    @property
    def starts(self) -> NDArray[np.float64]:
        """Start states of the records that do not begin at rest, one after the other."""
        return self.fit.starts

    @property
    def at_bound(self) -> tuple[bool, ...]:
        """Per parameter of the model, in the core's order."""
        return tuple(self.fit.at_bound)

    @property
    def size(self) -> int:
        """1 + p + 2 q."""
        return 1 + self.p + 2 * self.q

    @cached_property
    def model(self) -> Model:
        """The model, its roots in the order of Model."""
        return Model(self.fit.gain, self.fit.poles, self.fit.zeros)

    def as_start(self) -> tuple[float, NDArray[np.complex128], NDArray[np.complex128], NDArray[np.float64]]:
        """What `_core.Experiment.refine` takes."""
        return self.model.gain, np.array(self.model.poles, complex), np.array(self.model.zeros, complex), self.starts


def cancellations(poles: Sequence[complex], zeros: Sequence[complex]) -> int:
    """Zeros with a pole closer than 2 % of their magnitude (each pole counts once)."""
    free = list(poles)
    count = 0
    for zero in zeros:
        near = [pole for pole in free if abs(pole - zero) < POLICY.cancellation * max(abs(zero), 1e-12)]
        if near:
            free.remove(min(near, key=lambda pole: abs(pole - zero)))
            count += 1
    return count


def noise_of(experiment: _core.Experiment, c: Candidate, lengths: Sequence[int]) -> Autoregression:
    """The noise model of a candidate's residual."""
    products, _ = experiment.residual_sums(c.fit, highest_order(lengths))
    return autoregression_of(products, sum(lengths))


def scored(
    experiment: _core.Experiment,
    candidates: Sequence[Candidate],
    noise: Autoregression,
    lengths: Sequence[int],
    ranges: _core.SearchRanges,
    workers: int,
    beside: int = 0,
) -> list[Candidate]:
    """The candidates with their BIC under a common noise model; beside: numbers of frequency responses, which are white."""
    costs = [c.cost for c in candidates]
    count = sum(lengths) + beside
    if noise.order > 0:
        fits = [c.fit for c in candidates]
        whitened = experiment.go_on(fits, ranges, noise.phi, POLICY.whitened_again, tolerance(count), workers)
        costs = [w.cost for w in whitened]
        count -= noise.order * len(lengths)  # the first samples of each record, whose past is missing
    found = []
    for c, cost in zip(candidates, costs, strict=True):
        found.append(charged(c, bic(cost / count, count, c.size + len(c.starts))))
    return found


def charged(c: Candidate, own: float) -> Candidate:
    """The candidate with its BIC: its own, and what the poles and zeros cost that cancel each other."""
    return replace(c, bic=own + POLICY.rival_margin * cancellations(c.fit.poles.tolist(), c.fit.zeros.tolist()))


def tolerance(samples: int) -> float:
    """Relative fall of an error sum that is worth 0.01 units of BIC: less is no progress where structures are compared."""
    return 0.01 / samples


def smallest_close(scores: Sequence[Candidate]) -> int:
    """Index of the winner: the smallest structure within 10 units of the best."""
    best = min(c.bic for c in scores)
    close = [i for i, c in enumerate(scores) if c.bic <= best + POLICY.rival_margin]
    return min(close, key=lambda i: (scores[i].size, scores[i].bic))


def is_chain(c: Candidate) -> bool:
    """Whether the structure is a chain of masses: p = 1, q = 0, 2, 4, ..."""
    return c.p == 1 and c.q % 2 == 0


def smallest_mechanism(scores: Sequence[Candidate], samples: int) -> int | None:
    """What to report where the data contradict every linear structure: index of the smallest mechanism, None where there is none.

    An information criterion supposes that one of the models is true.
    Where none is, every module more absorbs a little of what is missing, and the largest structure wins without meaning anything.
    Then only chains of masses (p = 1, q = 0, 2, 4, ...) are considered, and a mass more has to halve the whitened
    error sum (`another_mass`), which noise-like misfit does not let it do.
    """
    chains = {c.q: i for i, c in enumerate(scores) if is_chain(c)}
    if not chains:
        return None
    chosen = chains[min(chains)]
    for q in sorted(chains):
        if scores[chains[q]].bic < scores[chosen].bic - samples * math.log(POLICY.another_mass):
            chosen = chains[q]
    return chosen
