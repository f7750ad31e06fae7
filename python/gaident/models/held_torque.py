"""What is held over a line of the log: a commanded torque as it stands, a sampled one as its mean there.

A log of means has that mean in its next line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.data.record_checks import at_its_lines, is_held
from gaident.data.signals.decimation import means_ahead
from gaident.data.torque_kind import COMMANDED, HELD, MEAN, MEASURED, SAMPLE, SMOOTH
from gaident.policy.table import POLICY

__all__ = ["held_from_lines", "held_mean", "held_torque", "kind_of_held", "sampled_between", "torque_at_lines"]

Signal = NDArray[np.float64]


def sampled_between(rec: Record) -> bool:
    """Whether the torque is a sample, at each line, of one that changes between the lines: low-passed, or not held that long."""
    slow = rec.torque_is == MEASURED and rec.dt > POLICY.longest_hold
    return rec.torque_log == SMOOTH or (rec.torque_log == SAMPLE and slow)


def held_from_lines(rec: Record) -> bool:
    """Whether the torque jumps at each line and is held until the next, see `is_held`."""
    return is_held(rec.torque_is, rec.torque_log)


def kind_of_held(rec: Record, dt: float) -> str:
    """`torque_is` of a record with lines of dt [s], made of `rec`, whose torque is held over each: none is drawn straight."""
    return COMMANDED if dt > POLICY.longest_hold else rec.torque_is


def held_torque(rec: Record) -> Signal:
    """What a simulation holds over each line of the log [N m] (n,): the logged torque or, of a sampled one, its mean there.

        u_h(n) = (u(n) + u(n+1))/2        a torque that goes straight from line to line; the last line is held
        u_h(n) = u(n+1)                   a log of means since the line before
        u_h(n) = the mean over the line of what a band-limited signal is there (`means_ahead`)     a smooth torque

    Held from its line on, a sampled torque would be half a line late.
    """
    assert rec.torque is not None
    u = np.ascontiguousarray(rec.torque, dtype=np.float64)
    if rec.torque_log == MEAN:
        return np.append(u[1:], u[-1])
    if rec.torque_log == SMOOTH:
        return means_ahead(u)
    return np.append(0.5 * (u[1:] + u[:-1]), u[-1]) if sampled_between(rec) else u  # no decision: a formula: a mean of two


def torque_at_lines(rec: Record) -> Signal:
    """The torque that acts at each line [N m] (n,), behind a filter that passes no step; of a log of means see `at_its_lines`.

    u(n)                  a sampled torque
    (u(n-1) + u(n))/2     a commanded torque, or another that is held; nothing before the first
    """
    assert rec.torque is not None
    if rec.torque_log == MEAN:
        return at_its_lines(rec.torque)
    if not held_from_lines(rec):
        return rec.torque
    return 0.5 * (rec.torque + np.append(rec.torque[:1], rec.torque[:-1]))  # no decision: a formula: a mean of two


def held_mean(rec: Record) -> Record:
    """The record with the torque that is held over each line in place of a mean since the line before."""
    if rec.torque is None or rec.torque_log != MEAN:
        return rec
    return rec.with_channels(torque=held_torque(rec), torque_is=kind_of_held(rec, rec.dt), torque_log=HELD)
