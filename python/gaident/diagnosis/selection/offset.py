"""Is an offset of the torque a load, or the unequal friction of the two directions?

    even dry friction and a load:   -(Tc sign(w) + T)
    two levels, one viscous part:   -(Tp or Tn) sign(w)     the same torque: Tc = (Tp + Tn)/2, T = (Tp - Tn)/2
    two levels, two viscous parts:  -(Tp + bp w) or (Tn + bn |w|)     not the same

A load that is fitted to the last of these stands for the mean of (bp - bn) |w| / 2 over the motion. Where it leaves the model
worse, there is no choice between the two, and the offset is mostly what it stood for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaident.axis import Text, say
from gaident.diagnosis.library.terms import EVEN_FRICTION, LOAD, TWO_LEVELS
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.objective import Fit

__all__ = ["Offset", "offset_of"]


@dataclass(frozen=True)
class Offset:
    """load: of even friction and a load in the place of asymmetric friction [N m]; behind: BIC units by which that is worse.

    left: (Tp - Tn)/2, what the directions' levels leave of it [N m].
    """

    load: float
    behind: float
    left: float

    @property
    def sentence(self) -> Text:
        """What looks like an offset, in words."""
        return say(
            "Even dry friction with a constant load of {:.3g} {N m} in its place would leave the model {:.0f} BIC units worse: "
            "what looks like an offset is mostly viscous friction that depends on the direction, {:.2g} {N m} of it is left.",
            self.load,
            self.behind,
            self.left,
        )


def offset_of(space: Moves, fit: Fit) -> Offset | None:
    """The offset that friction of two levels stands for; None where it is not in the model, or a load is as good."""
    name = TWO_LEVELS.name
    if name not in fit.effects or LOAD.name in fit.effects:
        return None
    positive, negative = (float(v) for v in fit.parameters.effect_values(fit.x[None, :], name)[0][:2])
    x, hypothesis = fit.parameters.removed(fit.x, name), fit.hypothesis.without(name)
    for term, value in ((EVEN_FRICTION, 0.5 * (positive + negative)), (LOAD, 0.5 * (positive - negative))):
        x = hypothesis.parameters.inserted(x, np.array([value]))
        hypothesis = hypothesis.extended(term)
    other = space.refitted(hypothesis, x)
    behind = other.bic - fit.bic
    if not behind > space.penalty:
        return None
    return Offset(float(other.parameters.effect_values(other.x[None, :], LOAD.name)[0, 0]), behind, 0.5 * (positive - negative))
