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


def outliers(velocity: Vector, error: Vector | None = None) -> NDArray[np.intp]:
    """Samples that leave the signal and come back: both steps, to the sample and from it, are far beyond the usual.

    A corner of the signal has one large second difference, an outlier at n has d(n) large and d(n-1), d(n+1) half of it with the
    other sign. A slope of the signal hides one; where the error of a model is given, one that stands out of it does as well.
    """
    w = velocity
    if len(w) < 7:
        return np.zeros(0, dtype=np.intp)
    middle = w[2:-2] - 0.25 * (w[:-4] + w[1:-3] + w[3:-1] + w[4:])
    around = 0.5 * (np.abs(w[3:-1] - w[1:-3]) + np.abs(w[4:] - w[:-4]))
    spread = ROBUST * float(np.median(np.abs(middle - np.median(middle))))
    steps = np.abs(np.diff(w))
    quantum = float(steps[steps > 0.0].min()) if np.any(steps > 0.0) else 0.0
    local = np.maximum(spread, quantum)
    clear = np.abs(middle) > 3.0 * around
    if error is not None:
        clear[np.setdiff1d(outliers(error), [0, 1]) - 2] = True
    far = (np.abs(middle) > FAR * local) & clear
    both = np.sign(w[2:-2] - w[1:-3]) == np.sign(w[2:-2] - w[3:-1])
    return np.flatnonzero(far & both) + 2


def cleaned(rec: Record, hit: NDArray[np.intp]) -> Record:
    """The record with interpolated velocities in place of outliers: what the controller saw, as far as it is known."""
    if len(hit) == 0:
        return rec
    w = rec.velocity.copy()
    good = np.ones(len(w), dtype=bool)
    good[hit] = False
    w[hit] = np.interp(hit, np.flatnonzero(good), w[good])
    return Record(rec.dt, command=rec.command, velocity=w, torque=rec.torque, position=rec.position, name=rec.name)


def quantisation(records: tuple[Record, ...]) -> float:
    """Step of the lattice that all velocities lie on [rad/s], 0 where there is none or only a text log's."""
    w = np.concatenate([r.velocity for r in records])
    step = lattice_step(w)
    return step if step > 1e-4 * float(np.ptp(w)) else 0.0
