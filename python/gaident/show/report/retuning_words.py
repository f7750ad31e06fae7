"""What is said of other gains, alike in a summary and in a page: rows of tables and sentences."""

from __future__ import annotations

from gaident.axis import said, say, unit, word
from gaident.control.controller import Controller
from gaident.control.filters import LowPass
from gaident.results.retuning import Retuning
from gaident.show.units import Scales, beside
from gaident.show.wording import number

__all__ = ["added_filters", "asked_words", "figure_rows", "gain_rows"]

FIGURES = {
    "stable": "stability",
    "phase_margin": "phase margin",
    "gain_margin": "gain margin",
    "sensitivity": "largest sensitivity",
    "bandwidth": "bandwidth",
    "overshoot": "overshoot of a step",
    "settling_time": "settling time of a step",
    "stiffness": "stiffness against disturbances",
    "step_torque": "largest {torque} of the step",
    "torque_noise": "{torque} noise, rms",
    "position_phase_margin": "phase margin, position loop",
    "position_gain_margin": "gain margin, position loop",
}
"""Figure of a loop -> what it is called."""


def gain_rows(result: Retuning, axis: str, scales: Scales) -> list[tuple[str, ...]]:
    """(gain, before, proposed, unit, both in the user's unit) of each; the integral gain as a time, too."""

    def row(name: str, old: float, new: float, si: str) -> tuple[str, ...]:
        return name, number(old), number(new), si, *(beside(scales, "", value, None, si) for value in (old, new))

    before, after = result.given.gains, result.controller.gains
    rows = [
        row("kp", before.kp, after.kp, unit("N m s/rad", axis)),
        row("ki", before.ki, after.ki, unit("N m/rad", axis)),
    ]
    if min(before.ki, after.ki) > 0.0:
        rows.append(row("tn = kp/ki", 1e3 * before.kp / before.ki, 1e3 * after.kp / after.ki, "ms"))
    if "position." in dict(result.given.parts):
        old, new = (float(c.to_dict()["position_gain"]) for c in (result.given, result.controller))
        rows.append(row("position gain", old, new, "1/s"))
    return rows


def asked_words(result: Retuning, axis: str) -> str:
    """What was asked for, whether the proposal keeps it, and how surely."""
    asked = [f"phase margin {number(result.phase_margin)} deg", f"gain margin {number(result.gain_margin)} dB"]
    if result.torque_limit is not None:
        step = f"{number(result.step)} {unit('rad/s', axis)}"
        asked.append(f"{number(result.torque_limit)} {unit('N m', axis)} for a step of {step}")
    if result.torque_noise is not None:
        asked.append(f"{number(result.torque_noise)} {unit('N m', axis)} of {word('torque', axis)} noise")
    if result.after.position_phase_margin is not None:
        asked.append("the same margins of the position loop")
    kept = "keeps" if result.keeps else "does not keep"
    text = f"The proposal {kept} what was asked for: {', '.join(asked)}."
    if result.missed:
        text += f" Missed: {', '.join(said(say(FIGURES[name]), axis) for name in result.missed)}."
    if result.drives:
        share = f"{100.0 * result.holds:.0f} %"
        text += f" The margins hold in {share} of {result.drives} drives that the records leave possible."
    return text


def added_filters(result: Retuning) -> list[str]:
    """Each filter that the proposal has and the given controller has not."""
    return _filters(result.controller)[len(_filters(result.given)) :]


def _filters(controller: Controller) -> list[str]:
    shown = []
    for one in (part for name, part in controller.parts if name.startswith("torque_filters")):
        if isinstance(one, LowPass):
            shown.append(f"low pass of {number(1e3 * one.time_constant)} ms")
        else:
            numbers = (one.frequency, one.numerator_damping, one.denominator_damping)  # type: ignore[attr-defined]
            shown.append("notch at {} Hz, dampings {} and {}".format(*map(number, numbers)))
    return shown


def figure_rows(result: Retuning, axis: str) -> list[tuple[str, ...]]:
    """(figure, before, 95 % of the drives, after, 95 % of the drives, unit) of the loop."""
    rows: list[tuple[str, ...]] = []
    for name, words in FIGURES.items():
        if name == "stable":
            continue
        before, after = getattr(result.before, name), getattr(result.after, name)
        if after is not None and before is not None:
            (old, old_spread), (new, new_spread) = (
                (number(s.value), f"{number(s.low)} .. {number(s.high)}") for s in (before, after)
            )
            rows.append((said(say(words), axis), old, old_spread, new, new_spread, unit(after.unit, axis).removeprefix("1")))
    return rows
