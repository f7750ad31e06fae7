"""What the integrator of a controller held before a record: the torque of a load that was there already, as on a vertical axis.

From rest, the controller makes u_0 of command and velocity. Its integral before the record adds a constant, behind filters too:
they stood in it. So it is the mean of u - u_0, where that stands out of what else the two are off by:

    I(-1) = mean(u - u_0)   where   |I(-1)| > 6 std(u - u_0) and is not to be neglected beside the largest torque

From the first line at a limit on, u_0 of a controller other than a bare PI is not that of the drive: these lines are left out.
Of too few lines nothing is said.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.control.pi_torque import pi_torque
from gaident.data.record import Record
from gaident.models.drive_torque import late, made_at_its_clock
from gaident.models.starts import constant_beside
from gaident.policy.table import POLICY

__all__ = ["stored_torque"]

Vector = NDArray[np.float64]


def stored_torque(rec: Record, controller: Controller) -> float:
    """What the integrator held before a record [N m], for a load; 0 where nothing shows it.

    The torque of a log that is slower than its controller is the mean over each line, as `driven_by` makes it.
    """
    made = _from_rest(rec, controller)
    if rec.torque is None or made is None:
        return 0.0
    limit = controller.limits[0]
    at_limit = np.flatnonzero(np.abs(rec.torque) >= POLICY.at_limit * limit)
    free = len(rec) if bare_pi(controller) is not None or not len(at_limit) else int(at_limit[0])
    return constant_beside(rec.torque[:free] - made[:free], float(np.abs(rec.torque).max()))


def _from_rest(rec: Record, controller: Controller) -> Vector | None:
    """What the controller makes of the record from rest [N m] (n,); None where the record lacks what it reads."""
    pi = bare_pi(controller)
    if pi is not None:
        return None if rec.command is None else pi_torque(rec.command, rec.velocity, rec.dt, pi)
    every = controller.log_every(rec.dt)
    if every == 1:
        return controller.torque_of(rec) if controller.replayable(rec) else None
    made = made_at_its_clock(rec, controller)
    return None if made is None else late(made.reshape(len(rec), every).mean(axis=1), controller.delay / rec.dt, 0.0)
