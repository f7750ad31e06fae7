"""What a diagnosis gains on held-out data, in words: noise, by how much errors fall, or why they grow; the regression."""

from __future__ import annotations

import math

from gaident.axis import Text, identifier_words, said, say, unit
from gaident.policy.table import POLICY
from gaident.results.diagnosis import Diagnosis
from gaident.results.estimate import Estimate
from gaident.results.fitness import Comparison
from gaident.show.units import Scales, beside, with_column
from gaident.show.wording import diverges, number, with_std

__all__ = [
    "alone_words",
    "comparison_rows",
    "digits_apart",
    "fall_words",
    "force_rows",
    "force_words",
    "method_words",
    "noise_rows",
    "noise_words",
    "not_the_loop_words",
]

COMPARED = {"dry friction": "coulomb", "gravity": "gravity_amplitude", "ground stiffness": "spring"}
"""What a comparison is called -> the regression's parameter."""
OF_MODEL = (
    "Last in a row stands what it says of a record that the diagnosed model itself made: as far as it says the same of both, the "
    "two methods agree, and the rest is what the regression has no term for, or what its filter takes away."
)


def noise_rows(dia: Diagnosis) -> list[tuple[str, float]]:
    """What a right model leaves of a free run: the noise of the velocity, and with that of a measured torque, if it is more."""
    own = dia.after.noise_floor
    rows = [("noise of the measured velocity", own)]
    if dia.relevance is not None and number(dia.relevance.noise, 2) != number(own, 2):
        rows.append(("with that of the torque", dia.relevance.noise))
    return rows


def alone_words(dia: Diagnosis) -> str:
    """What it means that the error grew with one cause and fell with the next; empty where no cause made it grow."""
    gains = [f.gain for f in dia.findings if not f.is_noise]
    if len(gains) < 2 or min(gains) >= -0.005 or dia.after.rmse >= dia.before.rmse:  # no decision: printed: as 0 %
        return ""
    return "One cause alone may make the error of a free run larger, as long as another one is missing: judge by all together."


def noise_words(dia: Diagnosis) -> Text:
    """What an encoder's steps make of the noise, where a free run leaves less than what was estimated; empty elsewhere."""
    found = (f.parameters["step"] for f in dia.findings if f.is_noise and "step" in f.parameters)
    step = next((e.value for e in found if e.unit == "rad/s"), None)
    if step is None or dia.noise is not None or not dia.after.rmse < dia.after.noise_floor:
        return Text("")
    text = (
        "The free run leaves less than this noise, which is estimated from third differences as if it were white. Steps of {} "
        "{rad/s} make {} {rad/s} rms where the velocity itself is rounded, and {} {rad/s} where it is the difference of two "
        "rounded {angles}: that noise is not white."
    )
    return say(text, number(step), number(step / math.sqrt(12.0), 3), number(step / math.sqrt(6.0), 3))


def not_the_loop_words(dia: Diagnosis) -> Text:
    """What the free runs are, where the given controller is not the drive's."""
    if dia.torque_logged:
        text = "The logged {torque} does not follow from this controller (see above): it drives these models, no loop is closed."
        return say(text)
    return Text("The simulated controller is not the drive's (see above): these figures include its errors.")


def fall_words(dia: Diagnosis) -> str:
    """By how much the error falls, in words."""
    if diverges(dia.after):
        linear = "so does the linear one" if diverges(dia.before) else "the linear one does not"
        return Text(f"In free run the extended model diverges, {linear}.")
    if diverges(dia.before):
        return Text("In free run the linear model diverges, the extended one does not.")
    fall = 100.0 * (1.0 - dia.after.rmse / dia.before.rmse)  # no decision: a unit: percent
    low, high = (100.0 * x for x in dia.gain_interval)
    if fall < -1.0:
        return _growth_words(dia, -fall)
    if fall < 1.0:
        if dia.before.rmse < POLICY.noise_ratio * dia.before.noise_floor:
            hidden = Text(": it is at the noise with and without")
        elif dia.controller is None or not dia.controller.one_equation:
            hidden = Text("")
        elif dia.torque_logged:
            hidden = say(": the loop's integrator hides this effect in the velocity, the {torque} shows it")
        else:
            hidden = Text(": the loop's integrator hides this effect in the velocity")
        return say("The error of the velocity hardly changes ({:+.1f} %){}.", -fall, hidden)
    digits = digits_apart(low, high)
    interval = f" (95 % interval {low:.{digits}f} to {high:.{digits}f} %)" if digits is not None else ""
    return say("The error falls by {:.{}f} %{}.", fall, digits or 0, interval)


def digits_apart(low: float, high: float) -> int | None:
    """The fewest decimals with which two numbers print differently; None of what is not finite, or the same to three."""
    return next((d for d in range(4) if f"{low:.{d}f}" != f"{high:.{d}f}"), None) if math.isfinite(low) else None


def _growth_words(dia: Diagnosis, growth: float) -> Text:
    """Why the error of the velocity grows, by so many percent, and what the names rest on then."""
    if not dia.loop_follows:
        text = (
            "In free run the extended model is worse than the linear one (the error of the velocity grows by {:.0f} %): the "
            "simulated controller is not the drive's."
        )
        return say(text, growth)
    varies = "beyond" if dia.gain_interval[1] < 0.0 else "within"
    grows = say(
        "In free run the extended model is worse than the linear one: the error of the velocity grows by {:.0f} %, {} its "
        "variation over the record",
        growth,
        varies,
    )
    before, after = dia.before.force_error, dia.after.force_error
    if after is not None and (before is None or after < before):
        was = "diverges without the effects" if before is None else f"was {number(before)}"
        stands = ", and what is named stands by that" if any(not f.is_noise for f in dia.findings) else ""
        return say("{}; that of the {torque} falls ({}, is {} {N m}){}: see the next table.", grows, was, number(after), stands)
    if dia.controller is None:
        return say("{}: the effects, as fitted, do not hold on these data.", grows)
    text = (
        "{}: the effects were found on the error of the model driven by the {torque}; closed over this controller (its gains, "
        "rule and limits) or over other records they do not hold."
    )
    return say(text, grows)


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
    text = say(
        "The " + which + " minus the {torque} that the model needs for the measured motion; samples at standstill are left out."
    )
    if dia.model.effects and dia.before.force_error is None and dia.after.force_error is not None:
        text = say("{} The mechanism without effects diverges: without them what swings in it needs ever more.", text)
    if growth := _force_growth_words(dia):
        text = say("{} {}", text, growth)
    if dia.force_reason:
        text = say("{} It is the figure to go by here: {}.", text, dia.force_reason)
    return said(text, axis)


def _force_growth_words(dia: Diagnosis) -> Text:
    """What is said where the extended model misses more of the torque than the mechanism without effects; empty elsewhere."""
    before, after, floor = dia.before.force_error, dia.after.force_error, dia.after.force_floor
    if not dia.model.effects or before is None or after is None or after - before < POLICY.check_share * after:
        return Text("")
    text = say("The extended model misses more of it than the mechanism without effects")
    if floor is not None and after < POLICY.loses * floor:
        why = "so would a right model: the filter takes from the motion what is fast at reversals and impacts"
        return say("{}; {}.", text, why)
    return say("{}: what it names is not all that there is.", text)


def comparison_rows(dia: Diagnosis, axis: str, scales: Scales) -> list[tuple[str, ...]]:
    """(what, by the diagnosis, by the regression, unit, both in the user's unit, remark); then what else the regression has."""

    def both(one: Estimate | None, other: Estimate) -> tuple[str, ...]:
        si = unit(other.unit, axis)
        users = ("" if e is None else beside(scales, "", e.value, e.std, si) for e in (one, other))
        return "" if one is None else with_std(one.value, one.std), with_std(other.value, other.std), si, *users

    rows: list[tuple[str, ...]] = []
    for c in dia.comparisons:
        remark = "they disagree" if c.differs else _remark(c)
        rows.append((identifier_words(c.name.replace(" ", "_"), axis), *both(c.diagnosis, c.regression), remark))
    compared = {COMPARED.get(c.name, c.name) for c in dia.comparisons}
    for name, e in dia.regression.parameters.items() if rows and dia.regression is not None else ():
        if name not in compared:
            own = dia.mechanics.get("viscous_friction") if name == "viscous" else None
            rows.append((identifier_words(name, axis), *both(own, e), ""))
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
    text = say(text, terms, found.order, found.cutoff_hz, found.samples)
    if any(_remark(c) and not c.differs for c in dia.comparisons):
        text = say("{} {}", text, OF_MODEL)
    return said(text, axis)
