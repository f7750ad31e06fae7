"""What a controller makes of a log, from rest or from a load that was there already, as on a vertical axis.

The integrator has stored the torque of that load before the record.

From rest, the controller makes u_0 of command and velocity.
Its integral before the record adds a constant, behind filters too: they stood in it.
So it is the mean of u - u_0, where that stands out of what else the two are off by:

    I(-1) = mean(u - u_0)   where   |I(-1)| > 6 std(u - u_0) and is not to be neglected beside the largest torque

What the velocity did between the lines of a slower log, and the steps of an encoder, add up in the integral of u_0.
So d = u - u_0 is a level, that before the record, plus a random walk from 0, of steps with the variance q,
plus white noise of the variance r (local level model; Muth 1960).
The mean that knows the level at the first line best has weights that fall from there:

    weight of line k ~ (1 - K)^k,   K = (sqrt(s^2 + 4 s) - s)/2,   s = q/r

    mean((d(k+m) - d(k))^2) = m q + 2 r   for m = 1 and for a twentieth of the lines

From the first line on at which either is at a limit, u_0 of a controller other than a bare PI is not that of the drive.
These lines are left out.
Of too few lines nothing is said.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.control import core
from gaident.control.between import at_lines
from gaident.control.controller import Controller
from gaident.control.pi import bare_pi
from gaident.control.pi_torque import pi_torque
from gaident.control.ticks import pushed_between
from gaident.data.record import Record
from gaident.data.torque_kind import MEAN
from gaident.models.starts import constant_beside
from gaident.policy.table import POLICY

__all__ = ["late", "load_before", "made_at_its_clock", "stored_beside", "stored_torque"]

Vector = NDArray[np.float64]

CUT = 2.0  # no decision: a formula: lines, the one that was cut and the first one
PARTS = 20  # no decision: of a record, the longer of the two spans; from 5 to 80, a level is off by as much


def stored_torque(rec: Record, controller: Controller, driven: bool = True, at_clock: Vector | None = None) -> float:
    """What the integrator stored before a record [N m], for a load; 0 where nothing shows it.

    driven: whether the torque is as `driven_by` makes it, the mean over each line; else it is the controller's as the log has it.
    at_clock: what `made_at_its_clock` makes from rest, where it is known.
    """
    made = _from_rest(rec, controller, driven, at_clock)
    return 0.0 if rec.torque is None or made is None else stored_beside(rec.torque, made, controller)


def load_before(rec: Record, controller: Controller | None) -> float:
    """What the integrator stored before a record for a load that stood there [N m]; 0 where nothing shows one.

    What the first error alone makes within two lines is no load: the record was cut behind a step of the command, and which
    torque acted before it is not known.
    """
    stored = 0.0 if controller is None else stored_torque(rec, controller)
    if controller is None or stored == 0.0 or not controller.replayable(rec):
        return stored
    error = float(abs(controller.asked(rec)[0] - rec.velocity[0]))
    return stored if abs(stored) > CUT * controller.gains.ki * rec.dt * error else 0.0


def stored_beside(torque: Vector, made: Vector, controller: Controller) -> float:
    """The same of a torque, beside the one that is made from rest [N m] (n,)."""
    # From rest the controller may reach the limit where under the load it does not.
    at_limit = np.flatnonzero(np.maximum(np.abs(torque), np.abs(made)) >= POLICY.at_limit * controller.limits[0])
    free = len(torque) if bare_pi(controller) is not None or not len(at_limit) else int(at_limit[0])
    off = torque[:free] - made[:free]
    return _first_level(off) if constant_beside(off, float(np.abs(torque).max())) else 0.0


def _first_level(off: Vector) -> float:
    """The level of (n,) before a random walk begins, beside white noise."""
    far = max(len(off) // PARTS, 2)
    near, wide = (float(np.mean((off[m:] - off[:-m]) ** 2)) for m in (1, far))
    walk = max((wide - near) / (far - 1), 0.0)
    white = max((near - walk) / 2.0, 0.0)  # no decision: a formula: a difference of two
    if walk == 0.0:
        return float(np.mean(off))
    ratio = walk / white if white > 0.0 else np.inf
    kept = 0.0 if not np.isfinite(ratio) else 1.0 - 0.5 * (np.sqrt(ratio**2 + 4.0 * ratio) - ratio)
    return float(np.average(off, weights=kept ** np.arange(len(off))))


def _from_rest(rec: Record, controller: Controller, driven: bool, at_clock: Vector | None) -> Vector | None:
    """What the controller makes of the record from rest [N m] (n,); None where the record lacks what it reads."""
    pi = bare_pi(controller)
    if pi is not None:
        return None if rec.command is None else pi_torque(rec.command, rec.velocity, rec.dt, pi)
    made = made_at_its_clock(rec, controller) if at_clock is None else at_clock
    if made is None:
        return None
    if not driven:
        return at_lines(made, len(made) // len(rec), rec.torque_log == MEAN)
    return late(made.reshape(len(rec), -1).mean(axis=1), controller.delay / rec.dt, 0.0)


def made_at_its_clock(rec: Record, controller: Controller, stored: float = 0.0) -> Vector | None:
    """The torque that a controller makes at all its samples [N m] (n every,), of command and velocity, see `pushed_between`.

    stored: what its integrator holds before the record [N m]. None where the record lacks what it reads.
    """
    source = controller.source_of(rec)
    if source is None or any(getattr(rec, channel) is None for channel in controller.reads):
        return None
    ticks = controller.ticks(rec.dt, source, rec.position if controller.driven_by == "position_command" else None)
    loop = controller.core_loop(rec.dt)

    def made(velocity: Vector) -> Vector:
        return core.servo_torque(rec.dt, ticks, velocity, loop, stored)

    return made(pushed_between(rec.velocity, controller.log_every(rec.dt), made, controller.steps_at(source)))


def late(torque: Vector, delay: float, before: float) -> Vector:
    """The mean over each line of a torque (n,) that is held over each line and acts `delay` lines later; `before` the record.

    With delay = m + f, m whole: f u(n - m - 1) + (1 - f) u(n - m), exact in its mean and, for f = 0, everywhere.
    A delay below 0, down to -1/2, is of a torque that the log has now and then: it is on its way to that of the next line.
    """
    if delay < 0.0:
        return np.append((1.0 + delay) * torque[:-1] - delay * torque[1:], torque[-1])
    m = int(delay)
    f = delay - m
    padded = np.concatenate([np.full(m + 1, before), torque])
    return f * padded[: len(torque)] + (1.0 - f) * padded[1 : 1 + len(torque)] if delay > 0.0 else torque
