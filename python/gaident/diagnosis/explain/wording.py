"""Findings, and the errors that decided, in one plain sentence each."""

from __future__ import annotations

from collections.abc import Sequence

from gaident.diagnosis.library.terms import TWO_LEVELS
from gaident.diagnosis.selection.offset import Offset
from gaident.diagnosis.selection.select import Selection
from gaident.models.effects import table

__all__ = ["basis_of", "evidence_of"]


def evidence_of(effect: str, gain: float, alternatives: Sequence[str], offset: Offset | None = None) -> str:
    """What speaks for a finding: what it does, how sure that is, what these data cannot tell from it."""
    from gaident.show.wording import certainty

    meaning = next(row.meaning for row in table() if row.name == effect).split(";")[0].replace(" (Dahl)", "")
    what, units = f"{meaning[0].upper()}{meaning[1:]}", f"(the model without it is {gain:.0f} BIC units worse)"
    if alternatives:
        others = " or ".join(a.replace("_", " ") for a in alternatives)
        return f"{what}, or {others}: one of these is there, {certainty(gain)} {units}; these data do not say which."
    if effect == TWO_LEVELS.name and offset is not None:
        return f"{what}: {certainty(gain)} {units}. {offset.sentence}"
    return f"{what}: {certainty(gain)} {units}."


def basis_of(found: Selection) -> list[str]:
    """Which errors the parameters rest on, where these are not whitened ones or the specification test speaks against them."""
    test = found.specification
    if test is None:  # a measured torque, as the user says
        return []
    if test.contradicts:
        figures = f"specification test {test.statistic:.0f}, bound {test.bound:.0f}"
        finding = f"What the model leaves is no stationary noise ({figures})"
        if found.space.whitens:
            return [f"{finding}: the standard deviations of the parameters are too small."]
        return [f"{finding}: the parameters are those that miss the velocity least, not those that leave white noise."]
    if found.space.whitens:
        return []
    return ["A noise model would take a cause for noise here: the parameters are those that miss the velocity least."]
