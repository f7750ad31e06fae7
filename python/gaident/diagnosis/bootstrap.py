"""Parametric bootstrap of the whole first step: how large does the best gain become where there is no effect?

Records are made from the fitted linear mechanism and the noise that the extended model leaves (its filter, driven by its whitened
residual drawn anew); screening, fits and filters run as on the real record. Candidates, searches over orders and starts, bounds
and colour are thereby all accounted for.

    p = (1 + number of gains as large as the observed one) / (B + 1)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import Fit, Problem
from gaident.diagnosis.stepwise import Search
from gaident.results.diagnosis import Diagnosis

if TYPE_CHECKING:
    from gaident.diagnosis.driven import Driven

__all__ = ["largest_gains", "with_p_value"]

Vector = NDArray[np.float64]


def largest_gains(
    problem: Problem,
    driven: Driven,
    allowed: tuple[str, ...],
    base: Fit,
    final: Fit,
    draws: int,
    seed: int,
    note: Callable[[str], None],
) -> Vector:
    """The best first gain on each of `draws` records without an effect (BIC units; -inf where nothing was worth a fit)."""
    rng = np.random.default_rng(seed)
    clean = problem.predict(base.layout, base.x[None, :])[0]
    v = problem.whitened(problem.errors(final.layout, final.x[None, :]), final.noise)[0]
    pool = v[problem.counted > 0.0]
    gains = np.empty(draws)
    for k in range(draws):
        note(f"bootstrap {k + 1} of {draws}")
        # The filter's own start dies out in the samples in front.
        noise = [final.noise.coloured(rng.choice(pool, 2 * n))[-n:] for n in problem.lengths]
        drawn_problem = replace(problem, measured=clean + np.concatenate(noise), simulations=0)
        search = Search(drawn_problem, driven, allowed, lambda _: None)
        start = drawn_problem.settled(drawn_problem.fit(base.layout, base.x, WHITE))
        gains[k] = search.best_gain(start)
    return gains


def with_p_value(
    result: Diagnosis, search: Search, base: Fit, final: Fit, draws: int, seed: int, note: Callable[[str], None]
) -> Diagnosis:
    """The result with the p-value of its first finding of the plant."""
    causes = [i for i, f in enumerate(result.findings) if f.effect in final.layout.effects]
    if not causes:
        return result
    gains = largest_gains(search.problem, search.driven, search.allowed, base, final, draws, seed, note)
    first = result.findings[causes[0]]
    p = float((1 + np.count_nonzero(gains >= first.delta_bic)) / (draws + 1))
    findings = list(result.findings)
    findings[causes[0]] = replace(first, p_value=p)
    return replace(result, findings=tuple(findings))
