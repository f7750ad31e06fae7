"""What the logs say of the controller that an identification takes as given: whether their torque follows from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaident.axis import Text, joined, say, unit_text
from gaident.control.between import jumps_between
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.data.record import Record
from gaident.identification.replay.replay import Replay, replay
from gaident.identification.replay.timed_record import TimedRecord
from gaident.policy.table import POLICY

__all__ = ["jump_notes", "replay_notes"]

UNITS = {"kp": "N m s/rad", "ki": "N m/rad", "torque_limit": "N m"}


def replay_notes(records: Sequence[Record], controller: Controller | None) -> list[Text]:
    """A sentence on each record, long ones by their start, whose torque does not follow from this loop.

    Of any controller but a bare PI with all its numbers, `identify` says itself whether the torque follows.
    """
    loop = bare_pi(controller)
    if loop is None or loop.unknown:
        return []
    found = []
    for rec in records:
        part = rec[: POLICY.replayed_samples] if len(rec) > POLICY.replayed_samples else rec
        if rec.torque is not None and (said := replay(part, loop)).follows is False:
            found.append(say("{}{}{}", f"{rec.name}: " if len(records) > 1 else "", said.sentence, _instead(said, loop)))
    return found


def _instead(said: Replay, loop: Controller) -> Text:
    """The numbers of the controller that the log shows, where a PI with a trapezoidal integral has what differs."""
    found, given = said.controller, bare_pi(loop)
    if found is None or given is None or said.cause == "scale":  # a wrong unit is not to be mended by gains
        return Text("")
    shown = [(name, getattr(found, name), getattr(given, name)) for name in UNITS]
    parts = [say("{} = {:.6g} {}", name, value, unit_text(UNITS[name])) for name, value, old in shown if value not in (None, old)]
    return say(" Give {}.", joined(", ", parts)) if parts else Text("")


def jump_notes(records: Sequence[Record]) -> list[Text]:
    """How many jumps of the velocity command came between the lines of the log, as its torque tells; none where none did."""
    early = count = 0
    for rec in records:
        command, between = rec.command, rec.command_between if isinstance(rec, TimedRecord) else None
        if command is None or between is None:
            continue
        jumps = jumps_between(command)
        rise = command[jumps + 1] - command[jumps]
        count += len(jumps)
        early += int(np.sum(np.abs(between[jumps, -1] - command[jumps]) > 0.5 * np.abs(rise)))  # no decision: a formula: rounding
    if not early:
        return []
    text = (
        "Of {} jumps of the velocity command {} came before the line that shows them, as the logged {torque} tells; the "
        "simulation has them there."
    )
    return [say(text, count, early)]
