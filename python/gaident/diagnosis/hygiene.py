"""What describes the record rather than the drive: outliers and the lattice of a quantised velocity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaident.data.record import Record
from gaident.diagnosis.lattice import lattice_step

__all__ = ["cleaned", "outliers", "quantisation"]

Vector = NDArray[np.float64]

ROBUST = 1.4826  # median absolute deviation of normal noise -> standard deviation
FAR = 9.0  # standard deviations
MISSED = 0.4  # of what an outlier stands out by: the least that the lines from either side, and a model, miss it by
PASSES = 4


def outliers(velocity: Vector, error: Vector | None = None) -> NDArray[np.intp]:
    """Samples of the sensor that leave the signal and come back at once.

    Both steps, to the sample and from it, are far beyond the usual, and the lines through the samples on either side miss it by
    as much, in the same direction. A corner, an impact or the end of a delay lies on the line from one side; from a round top
    both lines lead beyond it. A slope of the signal hides an outlier; where the error of a model is given, one that stands out
    of it is found there as well. What the model follows is none.
    """
    w, e = velocity.copy(), None if error is None else error.copy()
    hit = np.zeros(0, dtype=np.intp)
    for _ in range(PASSES):  # neighbours hide each other
        more = np.union1d(hit, _leaving(w, e))
        if len(more) == len(hit):
            break
        hit = more
        for signal in (w,) if e is None else (w, e):
            _interpolate(signal, hit)
    return hit


def _leaving(w: Vector, error: Vector | None) -> NDArray[np.intp]:
    """One pass of `outliers`."""
    if len(w) < 7:
        return np.zeros(0, dtype=np.intp)
    middle = _middle(w)
    around = 0.5 * (np.abs(w[3:-1] - w[1:-3]) + np.abs(w[4:] - w[:-4]))
    spread = ROBUST * float(np.median(np.abs(middle - np.median(middle))))
    steps = np.abs(np.diff(w))
    quantum = float(steps[steps > 0.0].min()) if np.any(steps > 0.0) else 0.0
    clear = np.abs(middle) > 3.0 * around
    if error is not None:
        clear[np.setdiff1d(outliers(error), [0, 1]) - 2] = True
    far = (np.abs(middle) > FAR * max(spread, quantum)) & clear
    both = np.sign(w[2:-2] - w[1:-3]) == np.sign(w[2:-2] - w[3:-1])
    sides = _missed(w, middle) & _missed(w[::-1], middle[::-1])[::-1]
    if error is not None:
        sides &= np.sign(middle) * _middle(error) > MISSED * np.abs(middle)
    return np.flatnonzero(far & both & sides) + 2


def _middle(w: Vector) -> Vector:
    """By how much each sample but two at either end exceeds the mean of its four neighbours."""
    exceeds: Vector = w[2:-2] - 0.25 * (w[:-4] + w[1:-3] + w[3:-1] + w[4:])
    return exceeds


def _missed(w: Vector, middle: Vector) -> NDArray[np.bool_]:
    """Whether the line through two samples before each misses it by a good part of `middle`; one of them may be spoiled too."""
    before = np.concatenate([[w[0]], w])  # w(-1) = w(0)
    now, one, two, three = before[3:-2], before[2:-3], before[1:-4], before[:-5]
    sign = np.sign(middle)
    missed: NDArray[np.bool_] = np.maximum(sign * (now - 2.0 * one + two), sign * (now - 3.0 * two + 2.0 * three)) > (
        MISSED * np.abs(middle)
    )
    return missed


def _interpolate(w: Vector, hit: NDArray[np.intp]) -> None:
    """Straight lines over the samples `hit`, in place."""
    good = np.ones(len(w), dtype=bool)
    good[hit] = False
    w[hit] = np.interp(hit, np.flatnonzero(good), w[good])


def cleaned(rec: Record, hit: NDArray[np.intp]) -> Record:
    """The record with interpolated velocities in place of outliers: what the controller saw, as far as it is known."""
    if len(hit) == 0:
        return rec
    w = rec.velocity.copy()
    _interpolate(w, hit)
    return Record(rec.dt, command=rec.command, velocity=w, torque=rec.torque, position=rec.position, name=rec.name)


def quantisation(records: tuple[Record, ...]) -> float:
    """Step of the lattice that all velocities lie on [rad/s], 0 where there is none or only a text log's."""
    w = np.concatenate([r.velocity for r in records])
    step = lattice_step(w)
    return step if step > 1e-4 * float(np.ptp(w)) else 0.0
