"""Which effects a search may take, and why not the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.data.record import Record
from gaident.diagnosis.controller.controller_place import AtController
from gaident.diagnosis.experiments.excitation import Excitation, decided_by_the_angle
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.folded import FOLDED, folded
from gaident.estimation.dataset import DataSet
from gaident.estimation.term import Term
from gaident.policy.table import POLICY

__all__ = ["IN_MOTION", "candidates", "loop_notes", "unresolved"]

Vector = NDArray[np.float64]

IN_MOTION = say(
    "A record starts in motion, and the loop of this controller is simulated from rest only: the logged {torque} drives the "
    "models, between the lines as this controller makes it. What that misses can look like a short lag or delay; give a record "
    "that starts at rest."
)
"""Of a log with fewer lines than the controller samples."""
NOT_THE_LOOP = say(
    "So no loop is closed over this controller: the logged {torque}, put right at the lines of the log, drives the models, and "
    "the verdict rests on that. Effects inside the controller are not looked for."
)
"""The same of a log whose torque does not follow from the controller."""


def loop_notes(data: DataSet) -> list[Text]:
    """Why no loop is closed for records with fewer lines than their controller samples; empty where it is."""
    if not data.slower:
        return []
    return [NOT_THE_LOOP] if not data.loop_follows else [IN_MOTION] * any(data.moving)


def candidates(
    records: Sequence[Record], clean: Sequence[Record], data: DataSet, excited: Excitation, at: AtController
) -> tuple[list[Term], dict[str, Text]]:
    """(effects, name of an effect -> why the records say nothing about it); clean: the records without outliers."""
    why: dict[str, Text] = dict(excited.not_testable)
    if any(folded(r) for r in records):
        why = dict.fromkeys(LIBRARY, FOLDED)
    if data.torque_measured:
        behind = say("the {torque} was measured behind the actuator, which it does not show")
        why |= {t.name: behind for t in LIBRARY.values() if t.place == "actuator"}
    inside = [t.name for t in LIBRARY.values() if t.in_controller]
    outside = data.controller is None or data.told_by_torque  # what the controller did stands in its torque: the replay decides
    if outside:
        why = {name: reason for name, reason in why.items() if name not in at.decided}
    elif data.slower and not data.fits_in_loop:
        still = Text("a record starts in motion, and the loop of this controller is simulated from rest only")
        if not data.loop_follows:
            still = say("the logged {torque} does not follow from this controller, so that no loop is simulated")
        why |= dict.fromkeys(inside, still)
    not_replayed = [name for name in inside if not LIBRARY[name].replayable]
    if not_replayed and (reason := _not_in_loop(data, at)) is not None:
        why = dict.fromkeys(not_replayed, reason) | why
    replayed = [name for name in inside if LIBRARY[name].replayable]
    out = {*why, *at.decided, *decided_by_the_angle(clean), *(replayed if outside else ())}
    return [t for t in LIBRARY.values() if t.name not in out], why


def unresolved(data: DataSet) -> dict[str, Text]:
    """Effect that acts at the largest torques only -> why lines between which the torque goes on are too far apart for it.

    How high a torque rises between two lines is not known: a jump of the command is over before the next one.
    """
    if data.age >= 0.0 or not data.torque_logged:
        return {}
    longest = max(_at_the_top(r.torque) for r in data.driven if r.torque is not None)
    if longest >= POLICY.peak_lines:
        return {}
    text = (
        "the {torque} goes on between the lines of the log, and its peaks last {} of them: how high they are is not known; log "
        "every sample of the controller"
    )
    why = say(text, f"{longest} line{'s' * (longest != 1)}")
    return {t.name: why for t in LIBRARY.values() if t.at_peaks}


def _at_the_top(torque: Vector) -> int:
    """Lines in a row that a torque [N m] (n,) is above half of its largest value, on one side; the most of them."""
    size = np.abs(torque)
    high = size >= 0.5 * np.max(size)  # no decision: a formula: the width of a peak at half its height
    ends = np.flatnonzero(np.diff(np.concatenate([[0], np.sign(torque) * high, [0]])))
    return int(np.max(np.diff(ends)[high[ends[:-1]]], initial=0))


def _not_in_loop(data: DataSet, at: AtController) -> Text | None:
    """Why a user-defined effect in the controller, which acts in the simulated loop alone, is no candidate; None where it is."""
    if at.decided and at.follows:
        return say("the logged {torque} follows from command and velocity without it")
    if at.decided:
        return say("the logged {torque} tells what the controller did, and its replay asks no function of your own")
    return None if data.fits_in_loop else Text("it acts in the simulated loop alone, and no loop is simulated here")
