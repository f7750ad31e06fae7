"""What the result says of frequency responses: of their path, and of what they show beside a model."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gaident.axis import Text, say
from gaident.data.frequency.response import FrequencyResponse
from gaident.identification.response.path import Path
from gaident.identification.structure_search import PERCENT
from gaident.models.model import Model
from gaident.policy.table import POLICY
from gaident.results.estimate import Estimate

__all__ = ["GIVES_POWER", "NO_STD", "compared_notes", "path_note", "tail_notes"]

MS = 1e3  # no decision: a unit: s to ms
STANDS_OUT = 2.0  # no decision: which peak a sentence speaks of: one of twice the median
GIVES_POWER = (
    "The model gives power at some frequencies, which no chain of masses does that is driven and measured at the motor: take no "
    "mechanics from it. A sensor at the load would do that."
)
NO_STD = (
    "A response without standard deviations (std): how large its errors are is taken from what the model leaves, and "
    "whether they are as large as they should be cannot be tested."
)


def path_note(path: dict[str, Estimate], rival: Path | None) -> Text:
    """That the axis lies behind a path; rival: another one that explains the responses as well."""
    late = "the controller's computing, its bus"
    causes = {"delay": late, "lag": "the current loop, or a filter of the {torque}"}
    there = [f"a {name} of {MS * e.value:.4g} +- {MS * e.std:.2g} ms ({causes[name]})" for name, e in path.items()]
    text = f"The response is that of the axis behind {' and '.join(there)}, which you did not state."
    if rival is not None:
        other = " and ".join(f"a {name} of {MS * getattr(rival, name):.4g} ms" for name in rival.unknowns)
        text += f" It does not tell this apart from {other}."
    return say(text)


def tail_notes(model: Model, highest: float) -> list[str]:
    """A sentence on resonances above the highest frequency [rad/s] of the responses."""
    above = sorted({abs(r) / math.tau for r in model.poles if r.imag > 0.0 and abs(r) > highest})
    if not above:
        return []
    listed = " and ".join(f"{f:.3g} Hz" for f in above)
    return [
        f"A resonance of {listed} lies above the highest frequency of the responses, {highest / math.tau:.3g} Hz: only what it "
        "does below shows it. Measure up to it to be sure of its numbers."
    ]


def compared_notes(responses: Sequence[FrequencyResponse]) -> list[Text]:
    """What responses of one axis at several amplitudes say about its linearity: a hint, and no name.

    The smallest amplitude is set beside the largest: |G| omega in the lowest third of the band that both have, and the
    frequency of its peak.
    """
    told = sorted((r for r in responses if r.amplitude is not None), key=lambda r: r.amplitude or 0.0)
    if len(told) < 2:
        return []
    small, large = told[0], told[-1]
    low, high = max(small.omega[0], large.omega[0]), min(small.omega[-1], large.omega[-1])
    if not high > low:
        return []
    curves = []
    for r in (small, large):
        inside = (r.omega >= low) & (r.omega <= high)
        curves.append((r.omega[inside], (np.abs(r.velocity_response) * r.omega)[inside], r.relative_std[inside]))
    if min(len(omega) for omega, _, _ in curves) < 3:  # no decision: a formula: a third of them is one at least
        return []
    gains, errors, peaks, spacing = [], [], [], []
    for (omega, size, off), r in zip(curves, (small, large), strict=True):
        part = len(omega) // 3  # no decision: which part the sentence speaks of
        gains.append(float(np.median(size[:part])))
        # A median's deviation is sqrt(pi/2) that of a mean.
        stated = float(np.median(off[:part])) if r.std is not None else float(np.std(np.log(size[:part])))
        errors.append(math.sqrt(0.5 * math.pi / part) * stated)
        at = int(np.argmax(size))
        # A resonance stands out of |G| omega, which is flat for a rigid axis, and inside the band.
        if 0 < at < len(size) - 1 and size[at] > STANDS_OUT * float(np.median(size)):
            peaks.append(float(omega[at]) / math.tau)
            spacing.append(float(np.ptp(omega[at - 1 : at + 2])) / math.tau)
    change, off_by = gains[1] / gains[0] - 1.0, POLICY.contradiction * math.hypot(*errors)
    between = f"Not linear: with {{torque}} of {large.amplitude:.3g} instead of {small.amplitude:.3g} N m"
    last = "Record a motion and diagnose it to know the cause."
    found = []
    if abs(change) > off_by:
        larger, smaller = "dry friction or a dead band", "a limit of the {torque}, or a gap that less {torque} does not cross,"
        way, why = ("larger", larger) if change > 0.0 else ("smaller", smaller)
        gain = f"the gain at low frequencies is {PERCENT * abs(change):.2g} % {way}"
        found.append(say(f"{between} {gain}; {why} would do that. {last}"))
    if len(peaks) == len(curves) and abs(peaks[1] - peaks[0]) > max(spacing):
        why = "a gap or a hardening coupling" if peaks[1] > peaks[0] else "friction in the coupling or a softening one"
        moved = f"the peak moves from {peaks[0]:.4g} to {peaks[1]:.4g} Hz"
        found.append(say(f"{between} {moved}; {why} would do that. {last}"))
    return found
