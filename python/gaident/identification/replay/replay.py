"""Controller replay: run again on the measured velocity; does the logged torque follow from it?

No plant is needed: what the controller does is decided before any mechanism is considered.
Where the logged torque does not follow from a bare PI, `causes` looks for the simple reasons.

A diagnosis asks for the replay of a record in several places: each is kept for as long as its record is.
"""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import TORQUE
from gaident.axis import Text, say
from gaident.control.cascade import cascade_of
from gaident.control.controller import Controller, VelocityGains
from gaident.control.pi import PI, bare_pi
from gaident.data.record import Record
from gaident.data.signals.lattice import digits_step, lattice_step, place_step, rounding_step
from gaident.errors import RecordError
from gaident.identification.replay.causes import (
    Explanation,
    beside_spikes,
    control_error,
    explain,
    rounded_command,
    under_load,
    white_noise,
)
from gaident.models.made_torque import stored_torque
from gaident.policy.table import POLICY

__all__ = ["Allowed", "Replay", "replay", "rounding_of", "tolerance_of", "velocity_steps"]

Vector = NDArray[np.float64]

SINGLE_PRECISION = 1e-6  # no decision: of the largest torque, what a controller in single precision is exact to


@dataclass(frozen=True, eq=False)
class Replay:
    """What the controller must have issued, and how the log compares.

    torque      the best torque there is [N m], shape (n,): the logged one, or the replayed one where none is logged
    replayed    what the controller as configured makes of command and velocity [N m], shape (n,); None without a controller
    rms, maximum  of logged minus replayed [N m]; nan where there is nothing to compare
    resolution  lattice of the logged torque [N m]; 0: none
    follows     the logged torque follows from command and velocity as configured, to its resolution or within white noise,
                with a free start of the integrator; None: nothing to compare
    cause       what makes it follow: "" (nothing found, or nothing needed), "initial_integral" (the record starts under load),
                or, where it does not follow as configured, "scale", "gains", "integration_rule", "shift", "torque_limit",
                "integrator_limit", "anti_windup" (a torque limit at which the integrator does not wind up),
                "command_rate"
    value       the number of the cause: initial integral [N m], factor, samples of shift, limit [N m], rate [rad/s^2]; nan for
                the others
    departs     first sample at which the configured controller departs from the log; None: it does not
    sentence    all this in words
    controller  as the log shows it, where a PI has what differs: gains and limits; else None
    velocity_noise  standard deviation of the white noise [rad/s] by which a velocity from which the torque of a PI follows is off
                the logged one; 0: none tells so
    """

    torque: Vector
    replayed: Vector | None
    rms: float
    maximum: float
    resolution: float
    follows: bool | None
    cause: str
    value: float
    departs: int | None
    sentence: Text
    controller: PI | None = None
    velocity_noise: float = 0.0


_KEPT: MutableMapping[Record, dict[Controller | None, Replay]] = WeakKeyDictionary()


def replay(rec: Record, controller: Controller | None) -> Replay:
    """Runs the controller again on the measured velocity and compares with the logged torque.

    controller: None for the open loop, where the record's torque is returned as it is.
    Raises RecordError where neither a torque nor what makes one is there.
    """
    kept = _KEPT.setdefault(rec, {})
    if controller not in kept:
        made = kept[controller] = _replayed(rec, controller)
        for shared in (made.torque, made.replayed):
            if shared is not None:
                shared.flags.writeable = False
    return kept[controller]


def _replayed(rec: Record, controller: Controller | None) -> Replay:
    logged = rec.torque
    if controller is None or not controller.replayable(rec):
        if logged is None:
            raise RecordError(f"the record has no torque and nothing to make it from: give {TORQUE}, or a command and PI(...)")
        why = "open loop, there is no controller" if controller is None else "the record lacks a signal that it read"
        return _unchecked(logged, None, say("The logged {torque} cannot be checked: {}.", why))
    replayed = controller.torque_of(rec)
    if logged is None:
        text = say("No {torque} is logged: it is replayed from command and velocity, unchecked.")
        return _unchecked(replayed, replayed, text)
    return _compared(rec, controller.asked(rec), controller, logged, replayed)


def _unchecked(torque: Vector, replayed: Vector | None, sentence: Text) -> Replay:
    resolution = 0.0 if torque is replayed else lattice_step(torque)
    return Replay(torque, replayed, np.nan, np.nan, resolution, None, "", np.nan, None, sentence)


def _compared(rec: Record, command: Vector, controller: Controller, logged: Vector, replayed: Vector) -> Replay:
    resolution = lattice_step(logged)
    off = (logged - replayed)[: len(rec) - controller.ahead(rec.dt)]
    pi = bare_pi(controller)
    rms, maximum = float(np.sqrt(np.mean(off**2))), float(np.abs(off).max())
    figures = (logged, replayed, rms, maximum, resolution)
    head = say("The logged {torque} follows from command and velocity through this controller")
    found, placed = None, _of_positions(rec, controller, replayed)
    limits = None if cascade_of(controller).torque_filters else controller.gains.limits
    for (step,) in velocity_steps([rec]):
        allowed = Allowed.of(rec, command, controller.gains, logged, step, placed)
        if allowed(off, limits):
            known = say(" (its resolution is {:.2g} {N m})", resolution) if resolution > 0.0 else ""
            return Replay(*figures, True, "", np.nan, None, say("{}, to {:.1g} {N m}{}.", head, maximum, known))
        if pi is not None and rounded_command(off, command, rec.dt, pi):
            text = say("{}, to {:.1g} {N m}, which is the rounding of the log.", head, maximum)
            return Replay(*figures, True, "", np.nan, None, text)
        if noise := white_noise(off, logged[: len(off)]):
            measured = "{} up to white noise of {:.2g} {N m} rms: it is a measured {torque}, or a coarsely rounded one."
            text = say(measured, head, noise)
            return Replay(*figures, True, "", np.nan, None, text)
        if pi is None:
            found = _under_load(rec, controller, logged, allowed, limits)
        else:
            found = explain(command, rec.velocity, rec.dt, pi, logged, allowed)
        if found is not None:
            break
    if found is not None and found.cause == "initial_integral":
        return Replay(*figures, True, found.cause, found.value, None, say("{}, {}", head, found.sentence))
    if found is None and (noise := beside_spikes(off, logged[: len(off)])):
        text = say("{} up to white noise of {:.2g} {N m} rms and a few spikes: it is a measured {torque}.", head, noise)
        return Replay(*figures, True, "", np.nan, None, text)
    departs = int(np.argmax(np.abs(off) > min(allowed.torque, maximum / 2)))  # no decision: printed: where it departs
    head = say(
        "The logged {torque} does not follow from command and velocity through this controller: it departs first at sample "
        "{} ({:.4g} s), by {:.2g} {N m} rms and {:.2g} {N m} at most",
        departs,
        departs * rec.dt,
        rms,
        maximum,
    )
    if found is not None:
        return Replay(*figures, False, found.cause, found.value, departs, say("{}. {}", head, found.sentence), found.controller)
    if pi is None:
        text = say("{}. Is this the controller, and are these the signals it saw?", head)
        return Replay(*figures, False, "", np.nan, departs, text)
    reached = float(np.abs(logged).max()) >= POLICY.at_limit * pi.limits[0]
    error = control_error(off, pi if reached else replace(pi, torque_limit=None), rec.dt)
    if error is not None and (noise := white_noise(error, rec.velocity)):
        text = say("{}. It does from a velocity that is off the logged one by white noise of {:.2g} {rad/s} rms.", head, noise)
        return Replay(*figures, False, "", np.nan, departs, text, velocity_noise=noise)
    text = say(
        "{}, and none of the simple reasons explains it (start of the integrator, gains, scale, sign, rule of integration, "
        "shift by samples, limits). Is this the controller, and are these the signals it saw? Of one that samples faster than "
        "the log give its period.",
        head,
    )
    return Replay(*figures, False, "", np.nan, departs, text)


def velocity_steps(records: Sequence[Record]) -> tuple[tuple[float, ...], ...]:
    """Steps [rad/s] that the velocities of each record may be rounded to by the log, one tuple an assumption, the finest first.

    The digits of a text log are its rounding.
    A lattice beside them is the log's too (16 bits of a reference speed), or it is the encoder's,
    and then the controller read the same numbers. A torque that follows to the digits shows which.
    """
    ranges = [POLICY.negligible * float(np.ptp(r.velocity)) for r in records]
    fine, coarse = (
        tuple(q if q < most else 0.0 for q, most in zip((step(r.velocity) for r in records), ranges, strict=True))
        for step in (digits_step, rounding_step)
    )
    return (fine,) if np.allclose(fine, coarse, rtol=SINGLE_PRECISION, atol=0.0) else (fine, coarse)


def tolerance_of(rec: Record, command: Vector, controller: VelocityGains, logged: Vector, step: float) -> float:
    """By how much a torque that follows may be off [N m]: see `Allowed`."""
    return Allowed.of(rec, command, controller, logged, step).torque


@dataclass(frozen=True)
class Allowed:
    """What a log's rounding makes of a replay, at most.

    step: that the log rounds velocities to [rad/s]; it does not round a command more coarsely.
    torque: steps of the torque's rounding, and what rounded velocity, command and positions do to P part and integral [N m].
    Each of N velocities is rounded by itself, a command once for all the samples that it is held;
    the integrator adds up what is off, evenly within +-q/2:

        sum of the squares = ki^2 dt^2 (N q_w^2 + sum L_i^2 q_r^2)/12        L_i: samples for which a command is held

    jump: by how much what is off may change from one sample to the next [N m], where no limit acts: P part and integral of one
    sample, and the torque's own rounding twice. A drift is slow; what another controller makes is not.
    """

    logged: Vector
    at_once: Vector
    torque: float
    jump: float

    @classmethod
    def of(
        cls, rec: Record, command: Vector, controller: VelocityGains, logged: Vector, step: float, placed: float = 0.0
    ) -> Allowed:
        own = POLICY.replay_steps * rounding_step(logged) + SINGLE_PRECISION * float(np.abs(logged).max())
        at_once, drift = _of_signals(rec, command, controller, step)
        sample = controller.ki * rec.dt * (step + _of_command(command, step))
        error = controller.kp * (command - rec.velocity)
        placed *= POLICY.sum_of_roundings
        most = own + at_once + POLICY.sum_of_roundings * drift
        return cls(logged, error, most + placed, 2.0 * own + at_once + sample + placed)

    def __call__(self, off: Vector, limits: tuple[float, float] | None, edge: int = 0) -> bool:
        """Whether a replay that is off by so much [N m] (n,), from sample `edge` on, is the logged torque, rounded.

        limits: of torque and integrator [N m]; None: behind a filter they do not show.
        """
        if not float(np.abs(off).max()) <= self.torque:
            return False
        if limits is None:
            return True
        torque, integral = limits
        here = slice(edge, edge + len(off))
        logged, stored = self.logged[here], self.logged[here] - self.at_once[here]
        limited = (np.abs(logged) >= POLICY.at_limit * torque) | (np.abs(stored) >= POLICY.at_limit * integral)
        free = ~(limited[1:] | limited[:-1])
        return float(np.abs(np.diff(off))[free].max(initial=0.0)) <= self.jump


def _under_load(
    rec: Record, controller: Controller, logged: Vector, allowed: Allowed, limits: tuple[float, float] | None
) -> Explanation | None:
    """A record that begins under load: the same of a controller that is no bare PI; None where the torque does not follow so.

    What stood in filters before the record, beside the load, is not known: the lines that remember it are left out.
    """
    start = stored_torque(rec, controller, driven=False)
    if start == 0.0:
        return None
    cascade, known = cascade_of(controller), len(rec) - controller.ahead(rec.dt)
    filtered = cascade.torque_filters or cascade.velocity_filters or cascade.command_filters
    edge = min(POLICY.filter_memory, known // 4) if filtered else 0  # no decision: a quarter of the record is left out at most.
    made = controller.torque_of(rec, stored=start)
    if filtered:
        start += float(np.median((logged - made)[edge:known]))
        made = controller.torque_of(rec, stored=start)
    return under_load(made, start) if allowed((logged - made)[edge:known], limits, edge) else None


def _of_positions(rec: Record, controller: Controller, replayed: Vector) -> float:
    """What rounded positions make of a replayed torque [N m], at most: it is made once more of positions that are off by as much.

    A feedforward takes their differences.
    """
    if controller.driven_by != "position_command":
        return 0.0
    rng, moved = np.random.default_rng(0), {}
    for name in ("position_command", "position"):
        values = getattr(rec, name)
        if values is not None and (step := place_step(values)) > 0.0:
            moved[name] = values + step * rng.uniform(-0.5, 0.5, len(values))
    return float(np.abs(controller.torque_of(rec.with_channels(**moved)) - replayed).max()) if moved else 0.0


def _of_command(command: Vector, step: float) -> float:
    """Step of the command's rounding [rad/s], where velocities are rounded to `step`."""
    return min(step, rounding_step(command))


def _of_signals(rec: Record, command: Vector, controller: VelocityGains, q_w: float) -> tuple[float, float]:
    """What rounded decimals make of P part, at most, and integral, as deviation [N m]."""
    q_r = _of_command(command, q_w)
    held = np.diff(np.flatnonzero(np.concatenate([[True], np.diff(command) != 0.0, [True]])))
    drift = controller.ki * rec.dt * np.sqrt((len(rec) * q_w**2 + float(held @ held) * q_r**2) / 12.0)
    return controller.kp * (q_w + q_r), float(drift)


def rounding_of(rec: Record, command: Vector, controller: PI, logged: Vector, step: float) -> float:
    """Root mean square of what rounding makes of a replay [N m].

    A torque printed with d digits is off by one unit of the last digit.
    """
    size, own = np.abs(logged), rounding_step(logged)
    steps = np.full(len(logged), own)
    if own > 0.0 and lattice_step(logged) == 0.0:
        highest = np.floor(np.log10(size.max()))
        steps *= 10.0 ** (np.floor(np.log10(np.where(size > 0.0, size, size.max()))) - highest)
    at_once, drift = _of_signals(rec, command, controller, step)
    rounded = float(np.mean(steps**2)) / 12.0 + SINGLE_PRECISION**2 * float(np.mean(logged**2))
    return float(np.sqrt(rounded + at_once**2 / 12.0 + drift**2))
