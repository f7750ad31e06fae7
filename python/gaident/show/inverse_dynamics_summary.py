"""The result of an inverse-dynamics regression as text."""

from __future__ import annotations

import textwrap

from gaident.axis import identifier_words, said, velocity_unit, word
from gaident.results.inverse_dynamics import InverseDynamics
from gaident.show.wording import WIDTH, number, table, with_std

__all__ = ["inverse_dynamics_summary"]


def inverse_dynamics_summary(found: InverseDynamics) -> str:
    """Parameters, errors, filter, rivals and what was not tried."""
    sections = [_parameters(found), _errors(found), _method(found), _choice(found)]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _wrapped(text: str, axis: str) -> list[str]:
    return textwrap.wrap(said(text, axis), WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)


def _parameters(found: InverseDynamics) -> list[str]:
    rows = [
        (
            identifier_words(name, found.axis),
            with_std(e.value, e.std),
            e.unit,
            "" if e.identifiable else "not determined",
        )
        for name, e in found.parameters.items()
    ]
    return ["Inverse-dynamics regression", *table(rows)]


def _errors(found: InverseDynamics) -> list[str]:
    rows = [("in-sample", f"{number(100.0 * found.force_error, 3)} %")]
    held_out = number(100.0 * found.force_error_held_out, 3)
    rows.append((f"on {found.held_out}", "" if held_out == "-" else f"{held_out} %"))
    return [f"Relative {word('torque', found.axis)} error", *table(rows)]


def _method(found: InverseDynamics) -> list[str]:
    slowest = f"{number(found.slowest, 2)} {velocity_unit(found.axis)}"
    still = (
        f"Samples up to {slowest} are standstill and left out." if found.slowest > 0.0 else "No sample is left out as standstill."
    )
    text = (
        f"All channels through a Butterworth filter of order {found.order} at {found.cutoff_hz:g} Hz, forward and backward, "
        f"one row for {found.decimation} samples: {found.samples} rows, worth {found.effective_samples:.0f} independent ones. "
        f"{still} Noise makes up {number(100.0 * found.noise_share, 1)} % of the acceleration's power."
    )
    return ["How", *_wrapped(text, found.axis)]


def _choice(found: InverseDynamics) -> list[str]:
    lines = []
    for terms, worse in found.rivals:
        listed = ", ".join(identifier_words(name, found.axis) for name in terms)
        which = "worse" if worse > 0.0 else "better"
        lines += _wrapped(f"{listed}: {number(abs(worse), 2)} BIC units {which}", found.axis)
    lines = ["Other sets of terms within 10 BIC units", *lines] if lines else []
    if found.not_tried:
        lines += ["Not tried"]
        for text in found.not_tried:
            lines += _wrapped(text, found.axis)
    return lines
