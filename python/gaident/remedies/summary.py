"""A retuning as text."""

from __future__ import annotations

import textwrap

from gaident.axis import called, said, say, unit, unit_text
from gaident.control.controller import Controller
from gaident.control.filters import LowPass
from gaident.results.retuning import Retuning, Spread
from gaident.show.wording import WIDTH, number, table

__all__ = ["retuning_summary"]

ROWS = {
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


def retuning_summary(result: Retuning, axis: str = "rotary") -> str:
    """Doubts first, then the gains, the loop before and after, what a simulation found, and notes."""
    sections = [
        [line for doubt in result.doubts for line in textwrap.wrap(f"Warning: {said(doubt, axis)}", WIDTH)],
        _gains(result, axis),
        _figures(result, axis),
        _starts(result, axis),
        [line for s in result.simulated for line in textwrap.wrap(said(s, axis), WIDTH)],
        _mended(result, axis),
        [line for note in result.notes for line in textwrap.wrap(said(note, axis), WIDTH)],
    ]
    return "\n\n".join("\n".join(lines) for lines in sections if lines)


def _gains(result: Retuning, axis: str) -> list[str]:
    rows: list[tuple[str, ...]] = [("", "before", "proposed", "")]
    before, after = result.given.gains, result.controller.gains
    rows.append(("kp", number(before.kp), number(after.kp), unit("N m s/rad", axis)))
    rows.append(("ki", number(before.ki), number(after.ki), unit("N m/rad", axis)))
    if "position." in dict(result.given.parts):
        gains = [_position(c) for c in (result.given, result.controller)]
        rows.append(("position gain", *map(number, gains), "1/s"))
    added = _filters(result.controller)[len(_filters(result.given)) :]
    kept = "keeps" if result.keeps else "does not keep"
    limit = (
        ""
        if result.torque_limit is None
        else f", {number(result.torque_limit)} {unit('N m', axis)} for a step of "
        + (f"{number(result.step)} {unit('rad/s', axis)}")
    )
    asked = f"phase margin {number(result.phase_margin)} deg, gain margin {number(result.gain_margin)} dB{limit}"
    drives = f" The margins hold in {100.0 * result.holds:.0f} % of {result.drives} drives that the records leave possible."
    text = f"The proposal {kept} what was asked for: {asked}.{drives if result.drives else ''}"
    return ["Gains", *table(rows), *(f"  added: {one}" for one in added), *textwrap.wrap(text, WIDTH)]


def _position(controller: Controller) -> float:
    return float(controller.to_dict()["position_gain"])


def _filters(controller: Controller) -> list[str]:
    shown = []
    for one in (part for name, part in controller.parts if name.startswith("torque_filters")):
        if isinstance(one, LowPass):
            shown.append(f"low pass of {number(1e3 * one.time_constant)} ms")
        else:
            numbers = (one.frequency, one.numerator_damping, one.denominator_damping)  # type: ignore[attr-defined]
            shown.append("notch at {} Hz, dampings {} and {}".format(*map(number, numbers)))
    return shown


def _figures(result: Retuning, axis: str) -> list[str]:
    rows = [("", "before", "95 % of the drives", "after", "95 % of the drives", "")]
    for name, words in ROWS.items():
        before, after = getattr(result.before, name), getattr(result.after, name)
        if after is not None and before is not None:
            rows.append((said(say(words), axis), *_shown(before), *_shown(after), unit(after.unit, axis).removeprefix("1")))
    head = "The loop" if result.before.stable.value == 1.0 else "The loop, which is NOT STABLE under the given gains"
    return [head, *table(rows)]


def _shown(spread: Spread) -> tuple[str, str]:
    return number(spread.value), f"{number(spread.low)} .. {number(spread.high)}"


def _starts(result: Retuning, axis: str) -> list[str]:
    head = ("rule", "kp", "ki", "stiffness", said(unit_text("N m/rad"), axis) if axis == "rotary" else unit("N m/rad", axis))
    rows = [head]
    for s in result.starts:
        rows.append((s.name, number(s.kp), number(s.ki), number(s.stiffness), "" if s.keeps else "does not keep what was asked"))
    return [f"Classical rules; the search began from: {result.rule}", *table(rows)]


def _mended(result: Retuning, axis: str) -> list[str]:
    if not result.mended:
        return []
    rows = [("if mended", "error now", "then", unit("rad/s", axis))]
    rows += [(str(said(called(name), axis)), number(now), number(then), "") for name, now, then in result.mended]
    return ["If a cause is mended, the error of the velocity under the proposal, rms of a step and a slow speed", *table(rows)]
