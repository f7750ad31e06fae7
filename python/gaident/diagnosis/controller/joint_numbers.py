"""Numbers of the controller that its torque showed, moved by what the model of the axis shows of them.

A filter that the logged torque shows to a few per cent is exact to no model: what it is off by looks like a resonance, or a lag.
So each model, and that without each of its effects, is fitted together with these numbers (`gaident.estimation.found_numbers`).
What it costs to move them is part of the criterion: their distance from what the torque showed, in its deviations squared, and
ln N for each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gaident.control.controller import Controller
from gaident.control.found import FoundNumbers
from gaident.diagnosis.selection.moves import Moves
from gaident.diagnosis.selection.select import Selection
from gaident.estimation import least_squares as ls
from gaident.estimation.found_numbers import refined, under_other, worth
from gaident.estimation.objective import Fit
from gaident.policy.table import POLICY

__all__ = ["better_under", "joint_numbers"]


@dataclass(frozen=True, eq=False)
class _Joint:
    """Models of one space, with the numbers of the controller."""

    space: Moves

    def fitted(self, fit: Fit) -> Fit:
        """A model with these numbers, under a noise model of its own."""
        objective = replace(self.space.objective)  # with a memory of its own: every controller tried makes a data set
        found = refined(objective, ls.scored(objective, refined(objective, fit)))
        return ls.scored(objective, found)

    def score(self, fit: Fit) -> float:
        """The criterion, with what it costs to move the numbers."""
        return self.space.score(fit) + worth(self.space.objective, fit)

    def best(self, fit: Fit) -> Fit:
        """The model with these numbers, without the effects that then are needed no more."""
        best = self.fitted(fit)
        while best.effects:
            here = replace(self.space, objective=replace(self.space.objective, data=best.predictor.data))
            shorter = min((self.fitted(here.without(best, e)) for e in best.effects), key=self.score)
            if self.score(shorter) >= self.score(best):
                break
            best = shorter
        return best


def better_under(found: Selection, controller: Controller, numbers: FoundNumbers | None) -> bool:
    """Whether the model that was selected explains the records better under another controller, fitted there from where it is."""
    space, final = found.space, found.final
    data = final.predictor.data
    assert data.controller is not None
    other = under_other(data, data.controller, controller, numbers)
    here = replace(space, objective=replace(space.objective, data=other))
    fit = here.refitted(final.hypothesis.over(other), final.x, POLICY.long)
    return here.score(fit) < space.score(final) - space.margin


def joint_numbers(
    found: Selection, compared: Callable[[Selection, Fit], Selection] = lambda found, final: found
) -> Selection | None:
    """What was selected, with the numbers of the controller where model and torque have them; None where that gains nothing.

    compared: a selection with another model in the place of its own, and its rivals; else there are no rivals.
    """
    data = found.final.predictor.data.found
    if data is None or not len(data.directions):
        return None
    joint = _Joint(found.space)
    best = found.space.objective.once(("joint numbers", found.final.key, found.space.allowed), lambda: joint.best(found.final))
    if not joint.score(best) < found.space.score(found.final) - found.space.policy.swap:
        return None
    moved = best.predictor.data
    here = replace(found.space, objective=replace(found.space.objective, data=moved))
    base = here.refitted(found.base.hypothesis.over(moved), found.base.x)
    return compared(replace(found, space=here, base=base, final=best, rivals={}, whitened=None), best)
