"""What effects that every axis has, and that a model lacks, would change in its numbers: dry friction, and a delay beside a lag.

Every axis has dry friction, and a record of few speeds shows its sum with viscous friction far better than the parts.
So dry friction is added to a model that has none, and all is fitted again:

    std^2 = std_alone^2 + (value - value beside dry friction)^2

Where the data exclude dry friction the second part is nothing.
Whether it is named is another matter, which the criterion decides.
Of delays and lags see `late_together.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gaident.axis import Text, called, say
from gaident.diagnosis.explain.late_together import fitted_beside, late_together
from gaident.diagnosis.mechanics import moved
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.term import Term
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["beside"]


def beside(
    objective: Objective,
    fit: Fit,
    allowed: Sequence[Term],
    mechanics: Mapping[str, Estimate],
    effects: Mapping[str, dict[str, Estimate]],
) -> tuple[dict[str, Estimate], dict[str, dict[str, Estimate]], list[Text]]:
    """(mechanics, estimates of effects, notes), with what such an effect would change; given: those of the model alone."""
    estimates, notes = late_together(objective, fit, allowed, effects)
    numbers, more = _friction(objective, fit, allowed, mechanics)
    return numbers, estimates, [*notes, *more]


def _friction(
    objective: Objective, fit: Fit, allowed: Sequence[Term], mechanics: Mapping[str, Estimate]
) -> tuple[dict[str, Estimate], list[Text]]:
    found = dict(mechanics)
    friction = next((t for t in allowed if t.levels and t.simplest and not t.at_load), None)
    if friction is None or any(t.levels or t.family == friction.family for t in fit.parameters.terms):
        return found, []
    other = fitted_beside(objective, fit, friction)
    if other is None:
        return found, []
    changed = {name: pair for name, pair in moved(fit, other).items() if name in found}
    for name, (alone, together) in changed.items():
        found[name] = replace(found[name], std=float(np.hypot(found[name].std, together - alone)))
    name = "viscous_friction"
    if name not in changed or not found[name].std > POLICY.contradiction * mechanics[name].std:
        return found, []
    level = float(friction.natural(other.x[other.parameters.slot(friction.name)][None, :])[0, 0])
    text = (
        "These data do not exclude {}: beside one of {:.3g} {N m} the viscous friction would be {:.3g} {N m s/rad}. "
        "Its deviation contains that."
    )
    return found, [say(text, called(friction.name), level, changed[name][1])]
