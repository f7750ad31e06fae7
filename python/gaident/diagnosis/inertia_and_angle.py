"""Inertia and a torque of the angle in one motion: where acceleration and angle go together, the inertia rests on one of them.

On one sine a = -omega^2 (theta - theta_0): J a and a spring K (theta - theta_0) are the same torque, and gravity is nearly so.
A model without gravity then gives a deviation of J that presumes its absence. The regression with gravity left open has

    s_open = s(J | gravity, spring: open),   said where  s_open > opened s(J)  and  s_open > check_share J.
"""

from __future__ import annotations

from collections.abc import Sequence

from gaident.axis import Text, say, unit_text
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate
from gaident.results.inverse_dynamics import InverseDynamics
from gaident.show.wording import with_std

__all__ = ["inertia_rests_on"]

OF_ANGLE = ("gravity", "spring")


def inertia_rests_on(found: InverseDynamics, records: Sequence[Record]) -> tuple[Text, ...]:
    """A note where the inertia is known only as long as no torque depends on the angle; () elsewhere.

    found: the regression of these records, without gravity and spring; one that has either left them open already.
    """
    alone = found.parameters["inertia"]
    if any(term in found.terms for term in OF_ANGLE) or alone.std is None:
        return ()
    possible = [term for term in OF_ANGLE if term not in found.terms_not_tried]
    if not possible or (beside := _beside(possible[0], found, records)) is None or beside.std is None:
        return ()
    if beside.std <= max(POLICY.opened * alone.std, POLICY.check_share * abs(alone.value)):
        return ()
    text = (
        "The acceleration and the {angle} go together in these records. With {} left open the inverse-dynamics regression "
        "finds the {inertia} as {}, without as {} {}: the value found holds where no {torque} depends on the {angle}. "
        "Moves of several lengths and speeds would tell the two apart."
    )
    term, unit = Text("gravity" if possible[0] == "gravity" else "a spring to ground"), unit_text("kg m^2")
    return (say(text, term, with_std(beside.value, beside.std), with_std(alone.value, alone.std), unit),)


def _beside(term: str, found: InverseDynamics, records: Sequence[Record]) -> Estimate | None:
    """The inertia with one more term; None where the regression cannot have it."""
    try:
        terms = (*found.terms, term)
        more = inverse_dynamics(list(records), terms=terms, cutoff_hz=found.cutoff_hz, order=found.order, axis=found.axis)
    except GaidentError:
        return None
    return more.parameters["inertia"]
