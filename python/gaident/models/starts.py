"""The noise of a record's velocity, and whether the record begins at rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.axis import Text, say
from gaident.control.controller import Controller
from gaident.data.record import Record
from gaident.data.signals.lattice import changes
from gaident.policy.table import POLICY

__all__ = ["constant_beside", "doubtful_start", "noise_std", "rounding_noise", "starts_moving", "stretches", "torque_before"]


AT_ONCE = 4  # no decision: a formula: samples that a third difference takes, which shows no noise where they are equal


def noise_std(velocity: NDArray[np.float64], step: float = 0.0) -> float:
    """Standard deviation of white noise on a smooth signal, from its third differences (median, so robust) [rad/s].

    step: of the lattice that the signal lies on, where it is known [rad/s]; rounding alone then makes step/sqrt(12).

    A third difference of white noise has the variance 1 + 9 + 9 + 1 = 20 times the noise's.
    Runs of four equal values and more are left out: an axis at rest, or a coarse encoder between two of its steps,
    shows no noise. Of a long signal evenly spaced stretches, a million samples in all, will do.
    """
    thirds = np.concatenate([np.diff(w, 3)[_outside_runs(w)] for w in stretches(velocity)])
    least = step / np.sqrt(12.0)
    # no decision: a formula: third differences of white noise and their median
    return float(max(1.4826 * np.median(np.abs(thirds)) / np.sqrt(20.0), least)) if len(thirds) else float(least)


def rounding_noise(velocity: NDArray[np.float64], step: float, differenced: bool) -> float:
    """Standard deviation of the noise that rounding makes of a velocity on a lattice of this step [rad/s].

    A rounded velocity: step/sqrt(12). The difference of two rounded angles: step/sqrt(6) while the axis moves, nothing at rest.
    With the part p of a step by which the true difference exceeds a whole number of them, its error has the variance p (1 - p) of
    a step squared, 1/6 in the mean of all speeds (B. Widrow, I. Kollar, Quantization Noise, Cambridge University Press, 2008).
    Third differences show less of a coarse one: their median is that of whole steps.
    """
    if not differenced:
        return step / float(np.sqrt(12.0))
    still = np.convolve(velocity == 0.0, np.ones(AT_ONCE), "valid") == AT_ONCE  # no count in so many samples
    resting = np.convolve(still, np.ones(AT_ONCE)) > 0.0
    return step * float(np.sqrt(1.0 - np.mean(resting))) / float(np.sqrt(6.0))


def _outside_runs(x: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Of each four neighbouring samples, whether none of them is part of a run of four equal values or more."""
    same = changes(x) == 0.0
    four = same[:-2] & same[1:-1] & same[2:]  # samples i to i + 3 are equal
    in_run = np.zeros(len(x), dtype=bool)
    for k in range(4):
        in_run[k : k + len(four)] |= four
    clear: NDArray[np.bool_] = ~(in_run[:-3] | in_run[1:-2] | in_run[2:-1] | in_run[3:])
    return clear


# no decision: how many samples a spread is taken from
def stretches(x: NDArray[np.float64], count: int = 64, length: int = 16384) -> list[NDArray[np.float64]]:
    """Evenly spaced parts of a long signal; of a shorter one the whole."""
    if len(x) <= count * length:
        return [x]
    return [x[i : i + length] for i in np.linspace(0, len(x) - length, count).astype(int).tolist()]


def starts_moving(rec: Record, controller: Controller | None) -> bool:
    """Whether the record does not start at rest.

    At rest the first velocity is noise: within six standard deviations of it, or one step of a quantised signal, of zero.
    In the continuous loop a command at sample 0 passes through at once,
    so a first velocity between 0 and 0.6 of that command is no motion.
    A record whose input never changes counts as started at rest by a step at sample 0: with an unknown state before it, the
    record would say nothing about zeros and gain (see `doubtful_start`).
    No step at sample 0 makes 0.6 of the usual speed at once.
    """
    return _first_is_motion(rec, controller) and not _taken_for_a_step(rec, controller)


def torque_before(rec: Record, stored: float = 0.0) -> float:
    """The torque that acted before a record [N m], which a delay or a lag of the torque still contains where it begins.

    That of its first line where the record begins in motion, or a standstill is held first: so is the torque.
    Else what an integrator stored before the record, for a load; 0 where that is not known.
    """
    if rec.torque is None:
        return 0.0
    first, rest = np.abs(rec.velocity[: POLICY.held_samples]), _rest(rec)
    if first[0] > rest and not _taken_for_a_step(rec, None):  # `starts_moving`, of an open loop
        return float(rec.torque[0])
    if stored:
        return stored
    return float(rec.torque[0]) if np.all(first <= rest) else 0.0


def constant_beside(off: NDArray[np.float64], size: float) -> float:
    """The mean of what a torque of this size is off by [N m], where it stands out of the rest and is not to be neglected; or 0.

    That is what an integrator stored before the record, for a load, where `off` is the logged torque minus that made from rest.
    """
    if len(off) < POLICY.least_rows:
        return 0.0
    mean = float(np.mean(off))
    return mean if abs(mean) > max(POLICY.above_noise * float(np.std(off)), POLICY.negligible * size) else 0.0


def doubtful_start(rec: Record, controller: Controller | None) -> Text | None:
    """A sentence where a record's input is constant and its first velocity is not that of rest."""
    if not (_taken_for_a_step(rec, controller) and _first_is_motion(rec, controller)):
        return None
    name = f"Record {rec.name}" if rec.name else "The record"
    return say(
        "{} starts at {:.4g} {rad/s} while its input never changes: taken as a step from rest at its first sample. If the step "
        "came earlier, give the record from before it; if the drive is not a digital one, give its loop as continuous.",
        name,
        rec.velocity[0],
    )


def _constant_input(rec: Record, controller: Controller | None) -> bool:
    source = rec.torque if controller is None else rec.command
    return source is not None and bool(np.all(source == source[0]))


def _taken_for_a_step(rec: Record, controller: Controller | None) -> bool:
    """Whether the input never changes and the axis may have begun to move at the first sample, by its velocity there."""
    if not _constant_input(rec, controller):
        return False
    held = POLICY.held_share * float(np.median(np.abs(rec.velocity)))
    return abs(float(rec.velocity[0])) <= max(held, _rest(rec))


def _first_is_motion(rec: Record, controller: Controller | None) -> bool:
    first = float(rec.velocity[0])
    if controller is not None and controller.loop == "continuous" and rec.command is not None and rec.command[0] != 0.0:
        passed = first / float(rec.command[0])
        if 0.0 <= passed <= POLICY.rest_share:
            return False
    return abs(first) > _rest(rec)


def _rest(rec: Record) -> float:
    """Velocity up to which the axis of a record stands [rad/s]."""
    w = rec.velocity
    steps = np.concatenate([changes(part) for part in stretches(w)])
    moved = steps[steps > 0.0]
    # Repeats betray a quantised signal.
    quantum = float(moved.min()) if len(moved) and len(moved) < POLICY.repeats * len(steps) else 0.0
    top = max(float(w.max()), -float(w.min()))
    return max(POLICY.above_noise * noise_std(w), POLICY.rest_steps * quantum, POLICY.negligible * top)
