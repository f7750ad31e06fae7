"""Why the model of a result is not to be trusted with gains, and why there are none."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.data.record import Record
from gaident.errors import GaidentError
from gaident.identification.response.averaged import measured_response
from gaident.models.model import Model
from gaident.results.diagnosis import Diagnosis
from gaident.results.identification import Identification

__all__ = ["beyond_the_records", "doubts_of", "no_gains", "shown_up_to"]

Vector = NDArray[np.float64]

FALSIFIED = "The data contradict this model: the linear model is falsified. What is designed on it may be wrong; diagnose first."
LEFT = (
    "The data contradict this model: the verdict of the diagnosis is {}, and something that the model lacks is left. "
    "What is designed on it may be wrong."
)
NOT_FOLLOWED = (
    "The logged {torque} does not follow from the controller: the loop that is simulated is not the drive's, and other parts of "
    "the controller may act beside what is proposed."
)
NO_GAINS = "No gains were found with which every drive that the records leave possible is stable in the velocity loop: {}"
STAY = "the given ones stay."
SPRUNG = (
    "the model has a zero at 0, as of an axis on a spring or one that hangs. A constant velocity then takes a {torque} that "
    "grows with the {angle}, and what the controller adds up comes to rest nowhere, whatever its gains. The given ones stay."
)
HALF = 0.5  # no decision: a formula: an octave below a frequency, and the most of its points
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


def shown_up_to(records: Sequence[Record]) -> float | None:
    """The highest frequency [Hz] that records show, by the coherence of torque and velocity; None: none is known.

    Most points of the octave below it are more coherent than by chance.
    """
    found = []
    for rec in records:
        try:
            measured = measured_response(rec)
        except GaidentError:
            continue
        f, sure = measured.frequency, measured.coherence > measured.threshold
        ends = [hertz for hertz in f[sure] if np.mean(sure[(f >= HALF * hertz) & (f <= hertz)]) > HALF]
        found += ends[-1:]
    return float(max(found)) if found else None


def beyond_the_records(records: Sequence[Record], frequencies: Vector, loop: NDArray[np.complex128]) -> tuple[Text, ...]:
    """A doubt about a broken loop (n,) over frequencies (n,) [Hz] whose size is 1 where the records do not show the drive."""
    shown, large = shown_up_to(records), frequencies[np.abs(loop) >= 1.0]
    if shown is None or not len(large) or large[-1] <= shown:
        return ()
    text = (
        "The size of the proposed loop is 1 up to {:.3g} Hz, but these records show the drive up to {:.3g} Hz only: another "
        "resonance or a delay above that would not have shown. Raise the gains in steps, or log a motion with faster parts first."
    )
    return (say(text, float(large[-1]), shown),)
