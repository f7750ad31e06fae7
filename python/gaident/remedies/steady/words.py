"""What is said of held speeds and of their law: notes, and the tables of a summary."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np

from gaident.axis import Text, called, joined, percent, said, say, unit, word
from gaident.data.record import Record
from gaident.policy.table import POLICY
from gaident.remedies.steady.laws import Fitted, FrictionLaw, missing_of, speeds_of
from gaident.remedies.steady.plateaus import LeftOut, Plateau
from gaident.results.estimate import Estimate
from gaident.show.wording import WIDTH, number, table, with_std

__all__ = ["held_lines", "notes_of"]

SPEEDS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)  # no decision: a grid: speeds that are proposed, of the highest


def notes_of(
    records: Sequence[Record], plateaus: Sequence[Plateau], left: Sequence[LeftOut], fitted: Fitted, inertia: float
) -> list[Text]:
    """What the held speeds cannot tell, and which speeds would."""
    found = []
    top = max(float(np.max(np.abs(rec.velocity))) for rec in records)
    speeds, ways = speeds_of(plateaus), {float(np.sign(p.velocity)) for p in plateaus}
    if not plateaus:
        text = "No speed is held, for {} lines at least, so that no law of friction is told. Hold speeds, both ways: {} {rad/s}."
        found.append(say(text, POLICY.held_samples, _proposed(top)))
    elif len(speeds) < 2:
        text = "The one speed that is held, {} {rad/s}, tells no law of friction. Hold others too, both ways: {} {rad/s}."
        found.append(say(text, number(speeds[0]), _proposed(max(top, speeds[0]))))
    if sum(p.torque * np.sign(p.velocity) for p in plateaus) < 0.0:
        found.append(say("At held speeds the {torque} is against the motion, which no friction asks for: check its sign."))
    if len(ways) == 1:
        text = (
            "Speeds are held in one direction: dry friction and a constant {torque}, as of a load or gravity, are one there. "
            "Hold the same speeds in the other."
        )
        found.append(say(text))
    if fitted.laws:
        missing = missing_of(len(speeds))
        if missing:
            text = "{} speeds are held, too few for {}: hold {} at least, both ways."
            names = joined(", ", [called(row.name) for row in missing])
            found.append(say(text, len(speeds), names, max(1 + row.size for row in missing)))
        if speeds[0] > POLICY.slow * speeds[-1]:
            text = (
                "What friction does below {} {rad/s}, the slowest speed that is held, is not told. Hold slower ones: {} {rad/s}."
            )
            slower = [s * speeds[-1] for s in SPEEDS if s * speeds[-1] < (1.0 - POLICY.apart) * speeds[0]]
            found.append(say(text, number(speeds[0]), ", ".join(number(s, 2) for s in slower)))
        if fitted.laws[0].alike:
            text = "At held speeds {} would be the same: `gaident.diagnose` tells which, from a log of the motion between them."
            found.append(say(text, joined(" or ", [called(name) for name in fitted.laws[0].alike])))
    if fitted.beyond > float(np.median([p.std for p in plateaus] or [np.inf])):
        text = (
            "The {torques} of held speeds scatter by {} {N m} beyond their deviations: friction differs from one to the next, by "
            "{angle}, time or temperature, or the law is not in the library."
        )
        found.append(say(text, number(fitted.beyond, 2)))
    sticking, accelerating = (sum(getattr(one, name) for one in left) for name in LeftOut._fields)
    if sticking:
        found.append(say("{} stretch{} left out, in which the axis stands in between.", sticking, _are(sticking)))
    if accelerating:
        text = "{} stretch{} left out, in which the {torque} of the acceleration is more than {} of the whole."
        found.append(say(text, accelerating, _are(accelerating), percent(POLICY.check_torque)))
    if np.isnan(inertia):
        text = "The records show no {inertia}, and none was given: held speeds alone tell the friction here."
        found.append(say(text))
    return found


def _are(count: int) -> str:
    return " is" if count == 1 else "es are"


def _proposed(top: float) -> str:
    return ", ".join(number(s * top, 2) for s in SPEEDS)


def held_lines(
    plateaus: Sequence[Plateau], laws: Sequence[FrictionLaw], slope: Estimate | None, notes: Sequence[str], axis: str
) -> list[list[str]]:
    """The parts of a summary: the table of held speeds, the law with its rivals, the notes; lines each."""
    return [part for part in (_speeds(plateaus, laws, axis), _law(laws, slope, axis), _wrapped(notes, axis)) if part]


def _wrapped(notes: Sequence[str], axis: str) -> list[str]:
    return [line for note in notes for line in textwrap.wrap(said(note, axis), WIDTH)]


def _speeds(plateaus: Sequence[Plateau], laws: Sequence[FrictionLaw], axis: str) -> list[str]:
    """A row for each speed and direction; plateaus of one speed together, weighted by their deviations."""
    if not plateaus:
        return []
    torque = unit("N m", axis)
    head = f"{word('torque', axis)} [{torque}]"
    rows: list[tuple[str, ...]] = [(f"velocity [{unit('rad/s', axis)}]", head, "plateaus", f"law [{torque}]" if laws else "")]
    for group in _groups(plateaus):
        least = np.finfo(float).eps * max(abs(p.torque) for p in group) or 1.0  # of a torque without any noise
        weights = 1.0 / np.maximum([p.std for p in group], least) ** 2
        weights /= np.sum(weights)
        velocity, mean = (float(weights @ [getattr(p, name) for p in group]) for name in ("velocity", "torque"))
        std = float(np.sqrt(np.sum((weights * [p.std for p in group]) ** 2)))
        law = number(float(laws[0].torque(velocity))) if laws else ""
        rows.append((number(velocity), with_std(mean, std), str(len(group)), law))
    return [f"Held speeds, positive for a motion forwards ({len(plateaus)} plateau{'s' * (len(plateaus) > 1)})", *table(rows)]


def _groups(plateaus: Sequence[Plateau]) -> list[list[Plateau]]:
    """Plateaus of one speed and direction, by ascending velocity."""
    found: list[list[Plateau]] = []
    for way in (-1.0, 1.0):
        own = [p for p in plateaus if way * p.velocity > 0.0]
        speeds = np.array(speeds_of(own))
        places = [int(np.searchsorted(speeds, abs(p.velocity), side="right")) for p in own]
        groups = [[p for p, at in zip(own, places, strict=True) if at == place] for place in sorted(set(places))]
        found += groups[::-1] if way < 0.0 else groups
    return found


def _law(laws: Sequence[FrictionLaw], slope: Estimate | None, axis: str) -> list[str]:
    if not laws:
        return []
    best = laws[0]
    lines = textwrap.wrap(f"Law: {said(best.name, axis)}; what it leaves is {number(best.misfit, 2)} deviations (rms)", WIDTH)
    rows: list[tuple[str, ...]] = [("viscous friction", "", _value(best.viscous, axis))]
    for effect, parameters in best.effects.items():
        shown = said(called(effect), axis)
        for name, e in parameters.items():
            rows.append((shown, said(called(name), axis), _value(e, axis)))
            shown = ""
    if slope is not None:
        rows.append(
            ("temperature", "", f"{with_std(slope.value, slope.std)} {unit(slope.unit, axis)} per degree, {_shown(slope)}")
        )
    lines += [" ".join(line.split(" ")) for line in table(rows)]
    for rival in laws[1:]:
        more = number(rival.bic - best.bic, 2)
        lines += textwrap.wrap(f"  Not told from it: {said(rival.name, axis)} (BIC {more} higher)", WIDTH)
    return lines


def _shown(slope: Estimate) -> str:
    return "a change" if abs(slope.value) > POLICY.check_deviations * slope.std else "no change that shows"


def _value(e: Estimate, axis: str) -> str:
    at = " (at the end of its range)" if e.at_bound else ""
    return f"{with_std(e.value, e.std)} {unit(e.unit, axis)}{at}"
