"""At which end of an elastic shaft an effect acts, and how much worse the model is with it at the other one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from gaident.diagnosis.library.sides import sides_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.moves import Moves
from gaident.estimation.objective import Fit
from gaident.models.effect_rows import SIDES, effect_and_side

__all__ = ["NO_ENDS", "Ends", "ends_of"]


class Ends(NamedTuple):
    """sides: where the data allow the effect; () where it has none. apart: whether the ends are two places in the model.

    other: the end that the data exclude, and by how much the model is worse with the effect there [BIC units]; 0: not asked.
    """

    sides: tuple[str, ...]
    apart: bool = False
    other: str = ""
    worse: float = 0.0


NO_ENDS = Ends(())


def ends_of(space: Moves, final: Fit, effect: str, rivals: Sequence[str]) -> Ends:
    """Of an effect of the selected model; rivals: keys of what the data cannot tell from it."""
    term, apart = LIBRARY[effect], final.parameters.masses > 1
    one_place = not apart or any(t.resonates for t in final.parameters.terms)  # beside those nothing is at the load
    steady = term.constant and any(space.data.stored)  # a torque that twists the shaft all the time
    sides = sides_of(effect, rivals, one_place or steady)
    turned = space.at_other_side(final, final.parameters.term(effect)) if apart and len(sides) == 1 and not one_place else None
    if turned is None:
        return Ends(sides, apart and bool(sides))
    here = effect_and_side(effect)[1]
    return Ends(sides, True, next(side for side in SIDES if side != here), float(turned.bic - final.bic))
