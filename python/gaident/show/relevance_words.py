"""What is left, in size, in words: in the user's units, beside the noise and the accuracy that was asked for."""

from __future__ import annotations

import math

from gaident.axis import unit, velocity_unit, word
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding
from gaident.show.units import Scales
from gaident.show.wording import number

__all__ = ["bent_of", "part_words", "relevance_words", "remark_words"]


def relevance_words(dia: Diagnosis, axis: str, scales: Scales) -> str:
    """How large what is left is, and whether that matters; empty where nothing significant is left and no accuracy was asked."""
    r = dia.relevance
    if r is None or (dia.driver is None and not r.asked):
        return ""
    v, u = velocity_unit(axis), unit("N m", axis)
    torque = word("torque", axis)
    size = f"{_shown(r.velocity, v, scales)} rms in the velocity" if r.velocity else "nothing in the velocity"
    if r.torque is not None:
        size += f" and {_shown(r.torque, u, scales)} rms in the {torque}" if r.torque else f" and nothing in the {torque}"
    asked = [
        f"{_shown(value, si, scales)} of the {name}"
        for value, si, name in ((r.velocity_accuracy, v, "velocity"), (r.torque_accuracy, u, torque))
        if value is not None
    ]
    it = "it is" if dia.driver is not None else "what is left is"
    begun = f"Beyond what noise leaves, {it} {size}"
    noise = f"noise alone leaves {_shown(r.noise, v, scales)} of a free run"
    if r.torque_noise is not None:
        noise += f", noise and filter {_shown(r.torque_noise, u, scales)} of the {torque}"
    if asked and r.negligible:
        return f"{begun}: negligible, as the accuracy that was asked for is {' and '.join(asked)}."
    if asked:
        surely = "" if dia.driver is not None else ", though nothing of it is significant"
        return f"{begun}: the accuracy that was asked for, {' and '.join(asked)}, is not met{surely}."
    if not r.velocity and not r.torque:
        return f"In size it is negligible: {noise}, and the model leaves no more. Significant means that chance does not make it."
    if r.negligible:
        return f"{begun}. In size that is negligible: {noise}. Significant means that chance does not make it."
    return f"{begun}; {noise}."


def part_words(dia: Diagnosis, finding: Finding, axis: str, scales: Scales) -> str:
    """How much of the velocity's error a finding takes away, beside the accuracy that was asked for; empty where none was."""
    wanted = None if dia.relevance is None else dia.relevance.velocity_accuracy
    if wanted is None:
        return ""
    before = dia.before.rmse
    for f in dia.findings:
        after = before * (1.0 - f.gain)
        if f is finding:
            part = math.sqrt(max(before**2 - after**2, 0.0))
            beside = "less" if part < wanted else "more"
            size = _shown(part, velocity_unit(axis), scales)
            return f"In the velocity it makes {size} rms, {beside} than the accuracy that was asked for."
        before = after
    return ""


def bent_of(dia: Diagnosis) -> tuple[str, ...]:
    """Names of the mechanical values that what is left can have bent; all of them in results that do not say which."""
    if dia.driver is None:
        return ()
    return tuple(dia.mechanics) if dia.relevance is None else dia.relevance.bent


def remark_words(dia: Diagnosis, name: str, e: Estimate) -> str:
    """What stands behind a mechanical value: what was expected, not determined, or bent by what is left, where not all are."""
    bent = bent_of(dia)
    marked = name in bent and len(bent) < len(dia.mechanics)
    low, high = dia.expected.get(name, (None, None))
    expected = "" if low is None or high is None else f"expected {number(low)} to {number(high)}"
    said = ("not determined", not e.identifiable), ("may be biased by what is left", marked)
    return ", ".join(filter(None, (expected, *(text for text, there in said if there))))


def _shown(value: float, si: str, scales: Scales) -> str:
    """A size in the user's unit, with SI behind it where that is another."""
    if si not in scales:
        return f"{number(value, 2)} {si}"
    shown, size = scales[si]
    return f"{number(size * value, 2)} {shown} ({number(value, 2)} {si})"
