"""What may be in the place of a cause that was found."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.diagnosis.library.equivalences import equivalents
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.selection.offset import Offset
from gaident.diagnosis.selection.other_gains import OTHER_GAINS
from gaident.diagnosis.selection.rivals import Replacement

__all__ = ["alternatives_of"]

OF_THE_CONTROLLER = (OTHER_GAINS, "torque_filter")
"""What a controller that is not the drive's may lack, in words of the findings."""


def alternatives_of(
    effect: str, rivals: Sequence[Replacement], here: Sequence[str], shown: bool, offset: Offset | None, follows: bool
) -> list[str]:
    """Names of what these records cannot tell from an effect.

    here: what they cannot tell from it for lack of reversals or of sizes of steps. shown: whether the records show the torque's
    jump by themselves; then nothing without such a jump stands for it, nor does a controller. offset: what an effect is not the
    same as. follows: whether the logged torque is what the controller makes, where the whole loop is simulated; what a wrong loop
    leaves looks like mechanics.
    """
    names = [r.effect for r in rivals if not shown or LIBRARY[r.effect].levels]
    names += here
    if offset is None or effect != offset.effect:
        names += equivalents(name_of(effect))
    if not follows and not shown:
        names += OF_THE_CONTROLLER
    return list(dict.fromkeys(names))
