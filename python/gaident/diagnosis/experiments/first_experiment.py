"""Which experiment to make: before any record the one that excites everything, afterwards a menu to choose from.

Commands keep to the drive's limits: speed; travel, by integrating the command exactly; torque, as far as the drive is known:

    u = kp d      what a loop answers to a jump of the command by d, before the drive has moved
    u = J a       what a ramp of slope a takes; where it ends, the speed overshoots by J a / kp at most

Where kp is known, no jump asks for more than 80 % of the torque, so that nothing shows a saturation, and speeds leave room
for the overshoot: a third of a jump, and that of the ramps. What is not known, the proposal says.
A tenth of speed and travel is kept free in any case.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, checked_axis, joined, say
from gaident.checks import above_zero
from gaident.control.controller import checked_controller
from gaident.control.filtering import rate_limited
from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.diagnosis.experiments.commands import largest_jump
from gaident.diagnosis.experiments.excitation import position_of
from gaident.diagnosis.experiments.menu import MENU, Bench, Builder, prbs_moving, reversals, slow_stairs, speed_ladder, steps
from gaident.diagnosis.library.settings import OF_SETTING
from gaident.diagnosis.library.sides import called_of
from gaident.diagnosis.library.terms import LIBRARY
from gaident.errors import SettingsError
from gaident.models.drive_torque import torque_of
from gaident.policy.table import POLICY
from gaident.results.experiment import Limits, Proposal, swept

__all__ = ["Limits", "MenuItem", "Proposal", "candidate_commands", "first_experiment", "limits_of"]

Vector = NDArray[np.float64]

LONGEST_COMMAND = 20_000_000  # no decision: what an argument may be: samples
AT_ONCE = 2  # no decision: the samples that a jump takes by the shape of the commands: a reversal has a sample of rest between


@dataclass(frozen=True, eq=False)
class MenuItem:
    """One experiment of the menu: name, command [rad/s] (n,), the effects it is good at, why: it goes on from the name.

    position_command: the path [rad] (n,), where a position drives the loop.
    """

    name: str
    command: Vector
    dt: float
    separates: tuple[str, ...]
    reason: Text
    position_command: Vector | None = None

    def scaled(self, factor: float) -> MenuItem:
        """The same, so many times as large."""
        path = None if self.position_command is None else factor * self.position_command
        return replace(self, command=factor * self.command, position_command=path)

    def along_a_path(self, slope: float) -> MenuItem:
        """The same for a loop that a position drives: its velocity within a slope [rad/s^2], and the path that this makes.

        x(n) = dt sum_(k < n) v(k)
        """
        command = rate_limited(self.command, slope, self.dt, 0.0)
        path = self.dt * (np.cumsum(command) - command)
        return replace(self, command=command, position_command=path)

    def proposal(self, separates: Sequence[str], margin: float) -> Proposal:
        """This item as a proposal for the rivals `separates`."""
        reason = say("{}: {}", self.name.capitalize(), self.reason)
        return Proposal(self.command, self.dt, tuple(separates), margin, reason, self.position_command)


def first_experiment(
    dt: float, limits: Limits, inertia: float | None = None, kp: float | None = None, axis: str = "rotary"
) -> Proposal:
    """Propose a command for the first record of a drive: it shows every effect of the library within the limits.

    Levels with reversals and dither, slow stairs with rests, reversals with small and large torque, steps of three sizes, and
    the first levels once more at the end.

    Parameters
    ----------
    dt : float
        Sample time [s].
    limits : Limits
        What the experiment may do.
    inertia : float, optional
        Total inertia [kg m^2]: ramps then use at most 60 % of the torque; None: gentle ramps.
    kp : float, optional
        Proportional gain of the controller [N m s/rad]: no jump of the command then asks for more torque than there is, and none
        shows torque_saturation. None: jumps are sized by the speed alone, `reason` says what they ask for.
    axis : {"rotary", "linear"}
        "linear": positions are lengths, and what returns with every turn is not among what the experiment shows.

    Returns
    -------
    Proposal
        The command [rad/s] and what it is for.

    Raises
    ------
    SettingsError
        For a duration of fewer than 400 samples, or another axis.

    Examples
    --------
    >>> import gaident as ga
    >>> first = ga.first_experiment(dt=1e-3, limits=ga.Limits(speed=80.0, torque=2.4, duration=4.0))
    >>> len(first.command), bool(abs(first.command).max() < 80.0), "backlash" in first.separates
    (3776, True, True)
    """
    bench = _bench(dt, limits, inertia, kp)
    parts: tuple[tuple[Builder, float], ...] = (
        (speed_ladder, 0.22),
        (slow_stairs, 0.18),
        (reversals, 0.10),
        (prbs_moving, 0.12),
        (steps, 0.16),
        (speed_ladder, 0.22),
    )
    command = _within(
        np.concatenate([_filled(build, replace(bench, seconds=share * bench.seconds)) for build, share in parts]), bench
    )
    periodic = {name for name, term in LIBRARY.items() if term.harmonic} if checked_axis(axis) == "linear" else set()
    names = dict.fromkeys(effect for item in MENU for effect in item[2] if effect not in periodic)
    if kp is not None:
        del names[OF_SETTING["torque_limit"]]
    return Proposal(command, dt, tuple(names), math.nan, _first_reason(command, limits, inertia, bench, axis))


def _first_reason(command: Vector, limits: Limits, inertia: float | None, b: Bench, axis: str) -> Text:
    """What the first experiment is for, and which of the limits it cannot promise to keep."""
    jump = largest_jump(command, AT_ONCE)
    every = "every effect that does not depend on the turns of a shaft" if axis == "linear" else "every effect"
    parts = [Text(f"No record yet: this triggers {every}, as far as travel allows.")]
    if b.kp is not None:
        text = (
            "No record yet: this triggers {} but {}, as far as travel allows: its largest jump, of "
            "{:.3g} {rad/s}, asks for {:.3g} of {:.3g} {N m}."
        )
        parts = [say(text, every, called_of(OF_SETTING["torque_limit"]), jump, b.kp * jump, limits.torque)]
    else:
        top = float(np.abs(command).max())
        text = (
            "{Torque} and speed limit are not promised: its largest jump, of {:.3g} {rad/s}, asks for kp times that, more than "
            "{:.3g} {N m} where kp is above {:.3g} {N m s/rad}, and may overshoot its {:.3g} {rad/s}; give kp to keep both."
        )
        parts.append(say(text, jump, limits.torque, limits.torque / jump, top))
    if inertia is None:
        text = (
            "Its ramps of up to {:.3g} {rad/s^2} ask for the {inertia} times that, and overshoot by as much divided by kp where "
            "they end; give the {inertia} to size them by {torque} and speed limit."
        )
        parts.append(say(text, b.slope))
    return joined(" ", parts)


def candidate_commands(dt: float, limits: Limits, inertia: float | None = None, kp: float | None = None) -> list[MenuItem]:
    """The menu within the limits; arguments as for `first_experiment`. Each command fills the duration at most."""
    bench = _bench(dt, limits, inertia, kp)
    return [MenuItem(name, _within(_filled(build, bench), bench), dt, effects, why) for name, build, effects, why in MENU]


def limits_of(records: Record | Sequence[Record], controller: PI | None = None, axis: str = "rotary") -> Limits:
    """What records show to be allowed, see `Limits.of`."""
    listed = [records] if isinstance(records, Record) else records
    if not isinstance(listed, Sequence) or not all(isinstance(r, Record) for r in listed):
        raise SettingsError(f"records is {type(records).__name__}: give a gaident.Record or a list of them")
    checked_controller(controller)
    asked = [rec.velocity if rec.command is None else rec.command for rec in listed]
    travel = max((float(np.ptp(position_of(rec))) for rec in listed), default=0.0)
    torque = max((float(np.abs(torque_of(rec, controller)).max()) for rec in listed), default=0.0)
    if controller is not None and controller.torque_limit is not None:
        torque = controller.torque_limit
    return Limits(
        speed=max((float(np.abs(r).max()) for r in asked), default=0.0) / POLICY.used_share,
        torque=torque,
        travel=math.inf if checked_axis(axis) == "rotary" and travel >= math.tau else travel / POLICY.used_share,
        duration=max((rec.duration for rec in listed), default=0.0),
    )


def _bench(dt: float, limits: Limits, inertia: float | None, kp: float | None) -> Bench:
    if not isinstance(limits, Limits):
        raise SettingsError(f"limits is {limits!r}: give gaident.Limits(speed, torque, travel, duration)")
    dt = above_zero(dt, "dt", SettingsError, "give one number > 0")
    inertia, kp = (
        None if value is None else above_zero(value, name, SettingsError, "give one number > 0")
        for name, value in (("inertia", inertia), ("kp", kp))
    )
    least = POLICY.least_command * dt
    if limits.duration < least:
        raise SettingsError(f"duration is {limits.duration:g} s, {int(limits.duration / dt)} samples: give {least:g} s or more")
    if limits.duration / dt > LONGEST_COMMAND:
        raise SettingsError(f"duration is {limits.duration:g} s, more than {LONGEST_COMMAND} samples of {dt:g} s: give less")
    stroke = POLICY.used_share * limits.travel
    speed = min(POLICY.used_share * limits.speed, stroke / (POLICY.stroke_samples * dt))
    top, slope = _ramps(limits, inertia, kp)
    # Half a stroke to rise, half to fall: v^2 = slope * stroke.
    speed = min(speed, POLICY.ramped_stroke * math.sqrt(slope * stroke)) if math.isfinite(stroke) else speed
    return Bench(dt, speed, min(speed, top), stroke, slope, limits.duration, limits.torque, kp, int(limits.duration / dt + 1e-9))


def _ramps(limits: Limits, inertia: float | None, kp: float | None) -> tuple[float, float]:
    """(speed to go to [rad/s], slope [rad/s^2]): speed + J a / kp <= speed limit, J a <= 60 % of the torque."""
    if kp is not None and inertia is not None:
        torque = min(POLICY.ramp_torque * limits.torque, kp * POLICY.overshoot_room * limits.speed)
        return min(POLICY.used_share * limits.speed, limits.speed - torque / kp), torque / inertia
    # What is not known is left to time: a ramp takes a share of the record's, with kp a longer one to a lower speed.
    top, hurry = (POLICY.used_share, POLICY.ramp_hurry) if kp is None else (1.0 - POLICY.overshoot_room, POLICY.ramp_hurry_kp)
    slope = hurry * top * limits.speed / limits.duration if inertia is None else POLICY.ramp_torque * limits.torque / inertia
    return top * limits.speed, slope


def _filled(build: Builder, bench: Bench) -> Vector:
    """The pattern, quickened (then slowed down) until it fits the bench's time, as often as it then fits."""
    room = int(bench.seconds / bench.dt + 1e-9)
    bench = replace(bench, room=room)
    pattern = build(bench)
    for attempt in range(POLICY.quickened):
        if len(pattern) <= room:
            break
        # Ramps of a heavy axis take their time whatever the dwell: lower speeds are reached sooner.
        slower = 1.0 if attempt < POLICY.slower_after else POLICY.slower_again
        bench = replace(bench, seconds=POLICY.shorter_again * bench.seconds, speed=slower * bench.speed, top=slower * bench.top)
        pattern = build(bench)
    return np.tile(pattern, max(1, room // len(pattern)))[: max(room, 1)]


def _within(command: Vector, bench: Bench) -> Vector:
    """The command, lowered where it still is too fast, sweeps too much or jumps too far."""
    low, high = swept(command, bench.dt)
    factor = min(1.0, bench.travel / max(high - low, 1e-300), bench.speed / max(float(np.abs(command).max()), 1e-300))
    return command * min(factor, bench.jump / max(largest_jump(command, AT_ONCE), 1e-300))
