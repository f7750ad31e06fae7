"""Records as they are driven: in a bare PI's loop, or by the torque that another controller made, with doubts about it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaident.axis import Text, say
from gaident.control.beside import beside_pi
from gaident.control.controller import Controller
from gaident.control.pi import PI, bare_pi
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN
from gaident.models.drive_torque import driven_by
from gaident.models.made_torque import stored_torque
from gaident.policy.table import POLICY

MEAN_OF_ONE = say(
    "Each {torque} of the log is a mean over samples of the controller, which by its sample time has one for each line: the "
    "mean is taken for a sample. Give the controller's sample time: Cascade(PI(...), period=...)."
)

__all__ = ["Driven", "follows_not", "torque_driven"]


class Driven(NamedTuple):
    """Records as an estimation takes them under their controller; notes on that.

    doubts: notes on logged torques that do not follow from the controller. slower: whether the log has fewer lines than the
    controller samples.
    """

    records: tuple[Record, ...]
    controller: Controller | None
    notes: tuple[Text, ...] = ()
    doubts: tuple[Text, ...] = ()
    slower: bool = False

    @property
    def loop(self) -> PI | None:
        """What an identification closes the loop over; None: the torque drives the model."""
        return bare_pi(self.controller)


def torque_driven(records: Sequence[Record], controller: Controller | None) -> Driven:
    """The records as they are under a bare PI or in the open loop; under any other controller as driven by their torque."""
    if controller is None:
        return Driven(tuple(records), None)
    means = (MEAN_OF_ONE,) * any(r.torque_log == MEAN and controller.log_every(r.dt) == 1 for r in records)
    if controller.one_equation:
        return Driven(tuple(records), controller, means)
    every = max(controller.log_every(r.dt) for r in records)
    if every == 1:
        has = beside_pi(controller)
        text = "Your controller has {}; so the linear model is identified from its {torque}, not in a simulated loop."
        note = say(text, f"{has} beside kp and ki" if has else "a sample time of its own")
    else:
        text = (
            "The controller samples {} times for each line of the log. The linear model is identified from the logged "
            "{torque}, between the lines as this controller makes it; what it answered to noise there is lost."
        )
        note = say(text, every)
    doubts = []
    for rec in records:
        if rec.torque is None or not controller.replayable(rec):
            continue
        known = len(rec) - controller.ahead(rec.dt)
        left = (rec.torque - controller.torque_of(rec, stored=stored_torque(rec, controller, driven=False)))[:known]
        off = float(np.sqrt(np.mean(left**2)))
        size = float(np.sqrt(np.mean(rec.torque**2)))
        if off > POLICY.negligible * size:
            doubts.append(follows_not(rec.name if len(records) > 1 else "", off, size))
    return Driven(tuple(driven_by(r, controller) for r in records), controller, (note, *means), tuple(doubts), every > 1)


def follows_not(name: str, off: float, size: float) -> Text:
    """What is said of a logged torque that a controller does not make; name: of the record, off, size: rms [N m]."""
    text = (
        "{}The logged {torque} does not follow from command and velocity through this controller: by {:.2g} {N m} rms, "
        "of {:.2g} {N m} rms. Is this the controller, and are these the signals it saw?"
    )
    return say(text, f"{name}: " if name else "", off, size)
