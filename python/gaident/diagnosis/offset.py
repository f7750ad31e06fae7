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

from gaident.diagnosis.noise_filter import WHITE
from gaident.diagnosis.problem import Fit
from gaident.diagnosis.stepwise import Search

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
    def sentence(self) -> str:
        """What looks like an offset, in words."""
        return (
            f"Even dry friction with a constant load of {self.load:.3g} N m in its place would leave the model "
            f"{self.behind:.0f} BIC units worse: what looks like an offset is mostly viscous friction that depends on the "
            f"direction, {self.left:.2g} N m of it is left."
        )


def offset_of(search: Search, fit: Fit) -> Offset | None:
    """The offset that asymmetric friction stands for; None where it is not in the model, or a load is as good."""
    name = "asymmetric_friction"
    if name not in fit.effects or "load_torque" in fit.effects:
        return None
    problem = search.problem
    positive, negative = (float(v) for v in fit.layout.effect_values(fit.x[None, :], name)[0][:2])
    x, layout = fit.layout.removed(fit.x, name), fit.layout.without(name)
    for effect, value in (("coulomb_friction", 0.5 * (positive + negative)), ("load_torque", 0.5 * (positive - negative))):
        layout, x = layout.extended(effect), layout.inserted(x, np.array([value]))
    other = problem.settled(problem.fit(layout, x, WHITE, 12))
    behind = other.bic - fit.bic
    if not behind > search.threshold:
        return None
    return Offset(float(layout.effect_values(other.x[None, :], "load_torque")[0, 0]), behind, 0.5 * (positive - negative))
