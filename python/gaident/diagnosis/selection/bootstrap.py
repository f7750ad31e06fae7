"""Parametric bootstrap of the whole first step: how large does the best gain become where there is no effect?

Records are made from the fitted linear mechanism and the noise that the extended model leaves (a filter, driven by the whitened
residual drawn anew); screening, fits and filters run as on the real record.
The filter is the model's own or, where output errors count, an autoregression of what it leaves:
these errors are slow, and white ones would contain more information than they do.
Candidates, searches over orders and starts, bounds and colour are thereby all accounted for.

    p = (1 + number of gains as large as the observed one) / (B + 1)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.least_squares import fit, reestimated
from gaident.estimation.noise_model import WHITE, NoiseFilter, stationary_autoregression
from gaident.estimation.objective import Fit, Innovations, Objective
from gaident.results.diagnosis import Diagnosis

__all__ = ["largest_gains", "with_p_value"]

Vector = NDArray[np.float64]


def largest_gains(space: Moves, base: Fit, final: Fit, draws: int, seed: int, note: Callable[[str], None]) -> Vector:
    """The best first gain on each of `draws` records without an effect (BIC units; -inf where nothing was worth a fit)."""
    rng = np.random.default_rng(seed)
    objective = space.objective
    clean = base.predictor.velocities(base.parameters, base.x[None, :])[0]
    left = _noise_of(objective, final)
    v = left.of(objective.bridged(objective.error(final)[None, :]), objective.lengths)[0]
    pool = v[objective.counted > 0.0]
    gains = np.empty(draws)
    for k in range(draws):
        note(f"bootstrap {k + 1} of {draws}")
        # The filter's own start dies out in the samples in front.
        noise = [left.coloured(rng.choice(pool, 2 * n))[-n:] for n in objective.lengths]
        drawn = Objective(objective.data, objective.weight, objective.family, clean + np.concatenate(noise))
        start = reestimated(drawn, fit(drawn, base.hypothesis, base.x, WHITE, space.policy.usual))
        found = replace(space, objective=drawn, note=lambda _: None).add(start)
        gains[k] = start.bic - min(f.bic for f in found) if found else -np.inf
    return gains


def _noise_of(objective: Objective, final: Fit) -> NoiseFilter:
    """The colour of what a model leaves, to draw noise from."""
    if isinstance(objective.family, Innovations):
        return final.noise
    return WHITE.then(stationary_autoregression(objective.parts(objective.bridged(objective.error(final)[None, :])[0])))


def with_p_value(
    result: Diagnosis, space: Moves, base: Fit, final: Fit, draws: int, seed: int, note: Callable[[str], None]
) -> Diagnosis:
    """The result with the p-value of its first finding of the plant."""
    causes = [i for i, f in enumerate(result.findings) if f.effect in {name_of(e) for e in final.effects}]
    if not causes:
        return result
    gains = largest_gains(space, base, final, draws, seed, note)
    first = result.findings[causes[0]]
    p = float((1 + np.count_nonzero(gains >= first.delta_bic)) / (draws + 1))
    findings = list(result.findings)
    findings[causes[0]] = replace(first, p_value=p)
    return replace(result, findings=tuple(findings))
