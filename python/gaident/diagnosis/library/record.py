"""Effects that describe the record rather than the drive."""

from __future__ import annotations

import numpy as np

from gaident.axis import say
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

__all__ = ["findings_of_the_record"]


def findings_of_the_record(spoiled: int, total: int, step: float) -> list[Finding]:
    """Effects that are found without a fit, which moves none of them.

    spoiled: samples of `total` that are left out; step: of the lattice of all velocities [rad/s], 0 where there is none.
    """
    found = []
    if spoiled:
        samples = "{} of {} samples leave the signal and come back; they are left out of every fit."
        fraction = Estimate(spoiled / total, float(np.sqrt(spoiled) / total), "1")
        found.append(
            Finding("outliers", {"fraction": fraction}, evidence=say(samples, spoiled, total), is_noise=True, place="record")
        )
    if step > 0.0:
        text = say("All velocities lie on a lattice of {:.4g} {rad/s}: the resolution of the encoder or of the log.", step)
        size = Estimate(step, 0.0, "rad/s")
        found.append(Finding("velocity_quantisation", {"step": size}, evidence=text, is_noise=True, place="sensor"))
    return found
