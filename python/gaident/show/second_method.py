"""What stands beside a diagnosis by a second method: force errors on held-out data, and the inverse-dynamics regression."""

from __future__ import annotations

from gaident.axis import Text, identifier_words, said, say, unit
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.fitness import Comparison
from gaident.show.units import Scales, with_column
from gaident.show.wording import number, with_std

__all__ = ["comparison_rows", "force_rows", "force_words", "method_words"]


def force_rows(dia: Diagnosis, axis: str, scales: Scales) -> list[tuple[str, ...]]:
    """Head and (what, force error, percentage of the torque's rms), the error in the user's unit too; empty without a torque."""
    before, after = dia.before, dia.after
    fits = [("mechanism without effects", before.force_error, before.torque_rms)]
    if dia.model.effects:
        fits.append(("extended model", after.force_error, after.torque_rms))
    fits.append(("inverse-dynamics regression", dia.regression_force_error, after.torque_rms or before.torque_rms))
    known = [(what, error, size) for what, error, size in fits if error is not None and size]
    rows = [(what, number(error), f"{100.0 * error / size:.1f}") for what, error, size in known]
    sizes: list[float | None] = [error for _, error, _ in known]
    if not rows:
        return []
    if dia.model.effects and before.force_error is None and after.force_error is not None:
        rows.insert(0, (fits[0][0], "diverges", ""))
        sizes.insert(0, None)
    if after.force_floor is not None:
        rows.append(("what noise and filter leave", number(after.force_floor), ""))
        sizes.append(after.force_floor)
    si = unit("N m", axis)
    return with_column([("", f"rms [{si}]", said(say("of the {torque} [%]"), axis)), *rows], "rms", sizes, si, scales)


def force_words(dia: Diagnosis, axis: str) -> str:
    """What the force error is, and where it is the figure to go by."""
    which = "logged {torque}" if dia.torque_logged else "{torque} that the controller makes of the logged signals"
    text = say("The " + which + " minus the {torque} that the model needs for the measured motion.")
    if growth := _growth_words(dia):
        text = say("{} {}", text, growth)
    if dia.force_reason:
        text = say("{} It is the figure to go by here: {}.", text, dia.force_reason)
    return said(text, axis)


def _growth_words(dia: Diagnosis) -> Text:
    """What is said where the extended model misses more of the torque than the mechanism without effects; empty elsewhere."""
    before, after, floor = dia.before.force_error, dia.after.force_error, dia.after.force_floor
    if not dia.model.effects or before is None or after is None or after - before < POLICY.check_share * after:
        return Text("")
    text = say("The extended model misses more of it than the mechanism without effects")
    if floor is not None and after < POLICY.loses * floor:
        why = "so would a right model: the filter takes from the motion what is fast at reversals and impacts"
        return say("{}; {}.", text, why)
    return say("{}: what it names is not all that there is.", text)


def comparison_rows(dia: Diagnosis, axis: str) -> list[tuple[str, str, str, str, str]]:
    """(what, by the diagnosis, by the regression, unit, remark)."""
    rows = []
    for c in dia.comparisons:
        remark = "they disagree" if c.differs else _remark(c)
        values = with_std(c.diagnosis.value, c.diagnosis.std), with_std(c.regression.value, c.regression.std)
        rows.append((identifier_words(c.name.replace(" ", "_"), axis), *values, unit(c.regression.unit, axis), remark))
    return rows


def _remark(c: Comparison) -> str:
    """What is said beside two values that are far apart, and yet no contradiction."""
    a, b, own = c.diagnosis.value, c.regression.value, c.of_model
    if own is None or not abs(a - b) > POLICY.check_share * max(abs(a), abs(b)):
        return ""
    return f"of this model it would say {own.value:.4g}"


def method_words(dia: Diagnosis, axis: str) -> str:
    """How the regression was made; empty where there is none."""
    found = dia.regression
    if found is None:
        return ""
    text = (
        "Least squares of the {torque} on {}, without simulation: all channels through a Butterworth filter of order {} at "
        "{:.3g} Hz, forward and backward; {} rows."
    )
    terms = ", ".join(identifier_words(name, axis) for name in found.terms)
    return said(say(text, terms, found.order, found.cutoff_hz, found.samples), axis)
