"""Why the model of a result is not to be trusted with gains."""

from __future__ import annotations

from gaident.axis import Text, say
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification

__all__ = ["doubts_of"]

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
