"""What describes the record rather than the drive: outliers and the lattice of a quantised velocity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaident.control.pi import PI
from gaident.data.record import Record
from gaident.data.signals.lattice import changes, lattice_step
from gaident.models.model import Model
from gaident.models.simulate import simulate
from gaident.policy.table import POLICY

__all__ = ["cleaned", "left_out", "outliers", "quantisation", "unexplained"]

Vector = NDArray[np.float64]

ROBUST = 1.4826  # no decision: a formula: median absolute deviation of normal noise -> standard deviation
SECOND = 1.5  # no decision: sqrt(14/6), noise of the line through two samples before over that through the two next ones
SHORTEST = 7  # no decision: the fewest samples of which all of these differences can be taken at all
PASSES = 4  # no decision: neighbours hide each other, no more than four in a row; passes end where none is new


def left_out(rec: Record, model: Model, controller: PI | None) -> NDArray[np.intp]:
    """Samples that stand out of the velocity, or out of the linear model's error: a slope of the velocity may hide them."""
    with np.errstate(over="ignore", invalid="ignore"):
        error = rec.velocity - simulate(model, rec, controller)
    if np.all(np.abs(error) < POLICY.diverged * np.abs(rec.velocity).max()):
        return outliers(rec.velocity, error)
    return outliers(rec.velocity)


def outliers(velocity: Vector, error: Vector | None = None) -> NDArray[np.intp]:
    """Samples of the sensor that leave the signal and come back at once.

    Such a sample exceeds its neighbours by far more than is usual, and the lines through the samples on either side miss it by
    as much, in the same direction.
    A corner, an impact or the end of a delay lies on the line from one side; from a round top both lines lead beyond it.
    A sample is no outlier where the model follows it, so that the `error` does not jump too.
    """
    w, e = velocity.copy(), None if error is None else error.copy()
    hit = np.zeros(0, dtype=np.intp)
    for _ in range(PASSES):  # neighbouring outliers mask each other
        more = np.union1d(hit, _leaving(w, e))
        if len(more) == len(hit):
            break
        hit = more
        for signal in (w,) if e is None else (w, e):
            _interpolate(signal, hit)
    return hit


def _leaving(w: Vector, error: Vector | None) -> NDArray[np.intp]:
    """One pass of `outliers`."""
    if len(w) < SHORTEST:
        return np.zeros(0, dtype=np.intp)
    middle = _middle(w)
    spread = ROBUST * float(np.median(np.abs(middle - np.median(middle))))
    steps = changes(w)
    quantum = float(steps[steps > 0.0].min()) if np.any(steps > 0.0) else 0.0
    size, least = np.abs(middle), POLICY.outlier_far * max(spread, quantum)
    left = (size > least) & _missed(w, middle, least) & _missed(w[::-1], middle[::-1], least)[::-1]
    if error is not None:
        left &= np.sign(middle) * _middle(error) > POLICY.outlier_missed * size
    found = np.flatnonzero(left)
    near = POLICY.outlier_reach
    around = np.lib.stride_tricks.sliding_window_view(np.pad(size, near), 2 * near + 1)[found]
    beside = np.abs(np.arange(-near, near + 1)) <= 2  # where the outlier itself shows
    largest = size[found] >= around[:, beside].max(axis=1)
    alone = np.sum(around[:, ~beside] > POLICY.outlier_alone * size[found, None], axis=1) < 2  # where much is as rough it rings
    kept: NDArray[np.intp] = found[largest & alone] + 2
    return kept


def _middle(w: Vector) -> Vector:
    """By how much each sample but two at either end exceeds the mean of its four neighbours."""
    exceeds: Vector = w[2:-2] - 0.25 * (w[:-4] + w[1:-3] + w[3:-1] + w[4:])
    return exceeds


def _missed(w: Vector, middle: Vector, least: float) -> NDArray[np.bool_]:
    """Whether the line through the two samples before each misses it by a good part of `middle` and by `least`.

    The sample just before may be spoiled too: then the two before that decide, with more noise.
    """
    before = np.concatenate([[w[0]], w])  # w(-1) = w(0)
    now, one, two, three = before[3:-2], before[2:-3], before[1:-4], before[:-5]
    sign = np.sign(middle)
    first, second = sign * (now - 2.0 * one + two), sign * (now - 3.0 * two + 2.0 * three)
    missed: NDArray[np.bool_] = np.maximum(first, second / SECOND) > np.maximum(POLICY.outlier_missed * np.abs(middle), least)
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
    return rec.with_channels(velocity=w)


def cleaned_signal(signal: Vector, hit: NDArray[np.intp]) -> Vector:
    """Another signal with interpolated values in place of outliers."""
    cleaned = signal.copy()
    _interpolate(cleaned, hit)
    return cleaned


def left_unexplained(
    records: Sequence[Record],
    of_log: Sequence[NDArray[np.intp]],
    clean: Sequence[Record],
    error: Vector,
    kept: Sequence[NDArray[np.bool_]],
) -> int:
    """Number of outliers of the log, and of samples that the model found does not follow.

    of_log: outliers of each record. error (n,): of the model on the clean records. kept: of each record, False where samples were
    left out.
    """
    count = sum(len(np.unique(own)) for own in of_log)
    if all(np.all(lines) for lines in kept):
        return count
    hit = np.concatenate([np.isin(np.arange(len(r)), own) for r, own in zip(records, of_log, strict=True)])
    measured = np.concatenate([r.velocity for r in records])
    missing = error - np.concatenate([r.velocity for r in clean])
    return count + unexplained(measured, missing + measured, np.maximum(np.concatenate(kept), hit).astype(np.float64))


def unexplained(velocity: Vector, error: Vector, weight: Vector) -> int:
    """Samples that were left out and that leave the error (n,) of the model that was found, too; weight (n,): 0 where left out.

    In a log with few lines a shaft that rings shows peaks of one line, which the linear model misses and the found one follows.
    """
    left = np.flatnonzero(weight[2:-2] == 0.0)
    size, missed = _middle(velocity)[left], _middle(error)[left]
    return int(np.sum(np.sign(size) * missed > POLICY.outlier_missed * np.abs(size)))


def quantisation(records: tuple[Record, ...]) -> float:
    """Step of the lattice that all velocities lie on [rad/s], 0 where there is none or only a text log's."""
    w = np.concatenate([r.velocity for r in records])
    step = lattice_step(w)
    return step if step > POLICY.sensor_step * float(np.ptp(w)) else 0.0
