"""The frequency response that a record shows, and that of a model beside it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say

__all__ = ["AveragedResponse", "Responses"]

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class AveragedResponse:
    """An estimate over frequency [Hz], arrays (n,): value [rad/s/(N m)] complex, its standard deviation, coherence 0..1.

    std (n,): root of the mean |error|^2 of the complex value; magnitude, and phase times magnitude, deviate by std/sqrt(2) each.
    threshold (n,): the coherence that unrelated signals pass once in twenty. instrument: whether the command was used (joint
    input-output); False: torque to velocity directly (H1). windows: how many; resolution [Hz].
    given: whether it was given as a response, without a record; then windows and threshold mean nothing.
    torque_measured: whether the torque has noise of its own, which no model of the drive answers.
    """

    frequency: Vector
    value: Complex
    std: Vector
    coherence: Vector
    threshold: Vector
    instrument: bool
    windows: int
    resolution: float
    given: bool = False
    torque_measured: bool = False

    @property
    def sentence(self) -> Text:
        """How it was estimated and what to doubt."""
        if self.given:
            return Text("The response as it was measured.")
        how = f"{self.windows} half-overlapping windows, resolution {self.resolution:.2g} Hz"
        if self.instrument:
            return Text(f"Joint input-output estimate: cross spectra with the command, free of the loop's bias by noise; {how}.")
        if self.torque_measured:
            return say(
                "H1 estimate from {torque} to velocity; {}. The {torque} was measured: where little of it moves the axis, its "
                "noise makes the estimate too small.",
                how,
            )
        return say(
            "H1 estimate from {torque} to velocity; {}. If a controller made this {torque} out of the noisy velocity, the "
            "estimate is biased towards minus the inverse of the controller where the coherence is low.",
            how,
        )


@dataclass(frozen=True, eq=False)
class Responses:
    """A record's response, that of a model simulated on it, and the linear part's own over `fine` [Hz], (m,)."""

    measured: AveragedResponse
    simulated: AveragedResponse | None
    fine: Vector
    model: Complex
