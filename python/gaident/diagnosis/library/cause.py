"""An effect as a diagnosis sees it: a term of the estimation, and what records have to contain for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from gaident.axis import Text
from gaident.diagnosis.library.triggers import Motions
from gaident.estimation.term import Term

__all__ = ["AT_THE_SHAFT", "NO_REVERSAL", "OF_THE_TORQUE", "ONE_SIZE", "ONE_SIZE_UNLOGGED", "Cause"]

NO_REVERSAL, ONE_SIZE, ONE_SIZE_UNLOGGED = "no reversal", "one size of step", "one size of step, no torque logged"
"""What records may lack, so that effects of one kind are the same in them."""

AT_THE_SHAFT = frozenset({"velocity", "position", "past", "time"})
"""Signals whose free function imitates what happens at the shaft of a moving axis: they are functions of one another there."""

OF_THE_TORQUE = frozenset({"torque"})
"""Signals whose free function imitates a static change of the torque."""


@dataclass(frozen=True, eq=False)
class Cause(Term):
    """One effect that a diagnosis can name: its row of the library.

    needs: conditions of the records, most general first; each says why it is not met, or None.
    Without one of them the records say nothing about the effect.
    unseen: which sizes of the effect could not have shown in the records; None where every size would.
    excited_by: names of the commands of the menu of experiments that excite it and tell it from others.
    alike: what records may lack -> the kinds that the effect then belongs to; effects of one kind are the same there.
    constant: whether its torque changes neither with the motion nor in time.
    regressed: parameters of an inverse-dynamics regression -> its own, None where the regression does not contain the effect.
    """

    needs: tuple[Callable[[Motions], Text | None], ...] = ()
    unseen: Callable[[Motions], Text | None] | None = None
    excited_by: tuple[str, ...] = ()
    alike: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    constant: bool = False
    regressed: Callable[[Mapping[str, float]], dict[str, float] | None] | None = None

    def why_not_testable(self, motions: Motions) -> Text | None:
        """The first condition that the records do not meet, in words; None where they meet all."""
        return next((why for need in self.needs if (why := need(motions)) is not None), None)
