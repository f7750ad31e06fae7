"""Do the records say how large an effect is?

With x_i +- s_i its parameters that are torques, those at a bound left out,

    n s_i < max |x_k|  for all i,   and   n s_j < |x_j|  for one of all its parameters,

n = `not_there`: an effect that was not found is at most its estimate and n deviations, and one that was found is more than n.
Of two levels one may be 0: what counts is the size of the larger one.
Levels of 0.04 +- 0.16 and 0.00 +- 0.16 N m are none, whatever is known of the slopes beside them.
"""

from __future__ import annotations

from collections.abc import Mapping

from gaident.axis import Text, say
from gaident.diagnosis.library.sides import called_of
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["determined", "not_determined"]

TORQUE = "N m"


def determined(parameters: Mapping[str, Estimate]) -> bool:
    """Whether these parameters of an effect say how large it is."""
    free = [e for e in parameters.values() if not e.at_bound]
    torques = [e for e in free if e.unit == TORQUE]
    size = max((abs(e.value) for e in torques), default=0.0)
    known = any(e.identifiable and POLICY.not_there * e.std < abs(e.value) for e in free)
    return known and all(POLICY.not_there * e.std < size for e in torques)


def not_determined(effect: str) -> Text:
    """What is said of an effect whose size the records do not tell."""
    text = "{} comes closer to these records, but they do not say how large it is, nor that it is there: it is not named."
    return say(text, called_of(effect).begun())
