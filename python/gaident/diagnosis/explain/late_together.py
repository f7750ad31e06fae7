"""How much of what is late a delay and a lag of the torque make each, where a model has one of them alone.

Every drive has some of either, and a log shows their sum far better than the parts.
So the other one is added, and all is fitted again:

    std^2 = std_alone^2 + (value - value beside the other)^2

Where the data exclude the other one the second part is nothing.
The name is another matter: the criterion decides it, and what no record tells apart is among the alternatives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gaident.axis import Text, called, say
from gaident.diagnosis.explain.late_inside import is_late
from gaident.diagnosis.library.equivalences import equivalents
from gaident.estimation import least_squares as ls
from gaident.estimation.objective import Fit, Objective
from gaident.estimation.term import Term
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["fitted_beside", "late_together"]


def late_together(
    objective: Objective, fit: Fit, allowed: Sequence[Term], found: Mapping[str, dict[str, Estimate]]
) -> tuple[dict[str, dict[str, Estimate]], list[Text]]:
    """(estimates of effects with what another late one would change, notes); found: those of the model alone."""
    late = [t for t in fit.parameters.terms if is_late(t) and t.name in found]
    if len(late) != 1 or fit.impacts or late[0].size != 1:
        return dict(found), []
    alone = late[0]
    other = next((t for t in allowed if is_late(t) and t.place == "actuator" and t.name not in _same(alone.name)), None)
    beside = None if other is None else fitted_beside(objective, fit, other)
    if other is None or beside is None:
        return dict(found), []
    ((name, value),) = found[alone.name].items()
    moved = float(alone.natural(beside.x[beside.parameters.slot(alone.name)][None, :])[0, 0])
    wider = replace(value, std=float(np.hypot(value.std, moved - value.value)))
    estimates = {**found, alone.name: {name: wider}}
    if abs(moved - value.value) <= POLICY.contradiction * value.std or value.unit != "s":
        return estimates, []
    text = (
        "What is late here is one number, {:.3g} ms: beside a {} the {} would be {:.3g} ms, and these data do not tell how much "
        "each of them is. Its deviation contains that."
    )
    return estimates, [say(text, 1e3 * value.value, called(other.name), called(alone.name), 1e3 * moved)]


def _same(effect: str) -> set[str]:
    return {effect, *equivalents(effect)}


def fitted_beside(objective: Objective, fit: Fit, term: Term) -> Fit | None:
    """The model with one effect more, fitted again; None where that is no better, and the data exclude the effect."""
    longer = fit.hypothesis.extended(term)
    rows = term.starts(longer.parameters.scales)
    X = np.array([fit.parameters.inserted(fit.x, np.array(row)) for row in rows])
    start = X[int(np.argmin(objective.costs(longer, X, fit.noise)))]
    beside = ls.fit(objective, longer, start, fit.noise, POLICY.usual)
    return beside if beside.cost < fit.cost else None
