"""Why the model of a result is not to be trusted with gains, and why there are none."""

from __future__ import annotations

import math
from collections.abc import Sequence

from gaident.axis import Text, say
from gaident.models.model import Model
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification

__all__ = ["doubts_of", "no_gains"]

FALSIFIED = (
    "The data contradict this model: the linear model is falsified. Gains that are designed on it may be wrong; diagnose first."
)
LEFT = (
    "The data contradict this model: the verdict of the diagnosis is {}, and something that the model lacks is left. "
    "Gains that are designed on it may be wrong."
)
NOT_FOLLOWED = (
    "The logged {torque} does not follow from the controller: what is called the loop before is not the drive's, and other "
    "parts of the controller may act beside these gains."
)
NO_GAINS = "No gains were found with which every drive that the records leave possible is stable in the velocity loop: {}"
STAY = "the given ones stay."
SPRUNG = (
    "the model has a zero at 0, as of an axis on a spring or one that hangs. A constant velocity then takes a {torque} that "
    "grows with the {angle}, and what the controller adds up comes to rest nowhere, whatever its gains. The given ones stay."
)
AT_ZERO = 1e-9  # no decision: rounding: of the fastest pole, a zero that is at 0


def doubts_of(result: Identification | Diagnosis) -> tuple[Text, ...]:
    """In plain sentences; none where the data stand behind the model."""
    if isinstance(result, Identification):
        return (say(FALSIFIED),) if result.falsified else ()
    found = []
    if result.driver is not None or result.verdict not in ("adequate", "explained"):
        found.append(say(LEFT, result.verdict))
    if not result.loop_follows:
        found.append(say(NOT_FOLLOWED))
    return tuple(found)


def no_gains(models: Sequence[Model]) -> Text:
    """Why no gains were found with which the velocity loop is stable around all of these drives, the identified one first."""
    fastest = max(map(abs, models[0].mechanism.poles), default=1.0)
    slow = [min((z.real for z in m.mechanism.zeros if z.imag == 0.0), key=abs, default=math.inf) for m in models]
    sprung = abs(slow[0]) <= AT_ZERO * fastest or (min(slow) < 0.0 < max(slow) < math.inf)
    return say(NO_GAINS, say(SPRUNG if sprung else STAY))
