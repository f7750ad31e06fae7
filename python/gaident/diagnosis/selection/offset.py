"""Is an offset of the torque a load, or the unequal friction of the two directions?

    even dry friction and a load:   -(Tc sign(w) + T)
    two levels, one viscous part:   -(Tp or Tn) sign(w)     the same torque: Tc = (Tp + Tn)/2, T = (Tp - Tn)/2
    two levels, two viscous parts:  -(Tp + bp w) or (Tn + bn |w|)     not the same

At either end of an elastic shaft; a constant torque is the same at both.
A load that is fitted to the last of these has the value of the mean of (bp - bn) |w| / 2 over the motion.
Where it leaves the model worse, there is no choice between the two, and the offset is mostly what it stood for.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaident.axis import Text, say
from gaident.diagnosis.library.equivalences import EQUIVALENT, Composition
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.objective import Fit
from gaident.models.effect_rows import effect_and_side, key_of

__all__ = ["Offset", "offset_of"]


@dataclass(frozen=True)
class Offset:
    """What an effect stands for that is the same torque as several others together but for some of its parameters.

    load: the constant torque [N m] that is fitted with the others in its place; behind: BIC units by which they are worse; left:
    the constant torque that its own parameters make [N m], of two levels (Tp - Tn)/2.
    """

    of: Composition
    effect: str  # key of the effect that is not the same as the others here
    load: float
    behind: float
    left: float

    @property
    def sentence(self) -> Text:
        """What looks like an offset, in words."""
        return say(self.of.different, self.load, self.behind, self.left)


def offset_of(space: Moves, fit: Fit) -> Offset | None:
    """The offset that an effect of the model stands for; None where there is none, or where a load is as good."""
    compositions = {e.of.whole: e.of for e in EQUIVALENT if e.of is not None}
    found = (_of(compositions[name_of(key)], key, space, fit) for key in fit.effects if name_of(key) in compositions)
    return next((offset for offset in found if offset is not None), None)


def _of(composition: Composition, whole: str, space: Moves, fit: Fit) -> Offset | None:
    """whole: the key of the effect in the model; the others are put where it is."""
    own = composition.parts(next(e for e in fit.parameters.model(fit.x).effects if e.key == whole).parameters)
    parts = {key_of(name, effect_and_side(whole)[1]): values for name, values in own.items()}
    constant = next(key for key in parts if LIBRARY[key].constant)
    if any(LIBRARY[key].constant for key in fit.effects):
        return None
    x, hypothesis = fit.parameters.removed(fit.x, whole), fit.hypothesis.without(whole)
    for key, values in parts.items():
        x = hypothesis.parameters.inserted(x, LIBRARY[key].coordinates(values))
        hypothesis = hypothesis.extended(LIBRARY[key])
    other = space.refitted(hypothesis, x)
    behind = other.bic - fit.bic
    if not behind > space.penalty:
        return None
    load = float(other.parameters.effect_values(other.x[None, :], constant)[0, 0])
    left = float(LIBRARY[constant].coordinates(parts[constant])[0])
    return Offset(composition, whole, load, behind, left)
