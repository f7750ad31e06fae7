"""friction_map(): the torque that is left of each record when the inertia is taken out, by velocity.

left = u - J a   of the filtered motion, samples at standstill left out
half of (left(w) - left(-w)) is friction, half of (left(w) + left(-w)) a load that does not change its sign with the motion
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gaident.axis import checked_axis, said, say, unit
from gaident.checks import size_of_drive
from gaident.data.record import Record
from gaident.errors import RecordError, SettingsError
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.regression.motion import ORDER, Motion, cutoff_of, motion_of
from gaident.files import write_whole
from gaident.show.wording import number, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FrictionMap", "friction_map"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

BINS = 12  # no decision: a grid: bins of a direction, where nobody asks for others
FEWEST, MOST = 1, 1000  # no decision: what an argument may be


@dataclass(frozen=True, eq=False)
class FrictionMap:
    """Torque that is left when the inertia is taken out, by velocity, a row for each record. Made by `friction_map`.

    Attributes
    ----------
    names : tuple of str
        Names of the records.
    velocity : ndarray, shape (m,)
        Middles of the bins, ascending, those backwards first [rad/s].
    edges : ndarray, shape (m/2 + 1,)
        Edges of the bins of a direction, ascending [rad/s].
    torque : ndarray, shape (r, m)
        Mean of each bin [N m]; nan where a record has no sample there.
    scatter : ndarray, shape (r, m)
        Standard deviation of the samples of each bin [N m].
    count : ndarray of int, shape (r, m)
        Samples of each bin.
    inertia : float
        The inertia that was taken out [kg m^2].
    axis : {"rotary", "linear"}
        Kind of the axis.

    See Also
    --------
    friction_map : Makes it, with an example.
    """

    names: tuple[str, ...]
    velocity: Vector
    edges: Vector
    torque: Matrix
    scatter: Matrix
    count: NDArray[np.int64]
    inertia: float
    axis: str = "rotary"

    @property
    def friction(self) -> Matrix:
        """Half of the difference of both directions, shape (r, m/2), by ascending speed [N m]; nan where one is missing."""
        back, forth = self._directions
        return np.asarray(0.5 * (forth - back))

    @property
    def load(self) -> Matrix:
        """Half of the sum of both directions, shape (r, m/2) [N m]; nan where one is missing."""
        back, forth = self._directions
        return np.asarray(0.5 * (forth + back))

    @property
    def _directions(self) -> tuple[Matrix, Matrix]:
        middle = len(self.velocity) // 2
        return self.torque[:, :middle][:, ::-1], self.torque[:, middle:]

    def summary(self, axis: str | None = None) -> str:
        """Return a table of the friction of each record by speed.

        `axis`: "linear" for units of m and N, "rotary" for rad and N m; None: those of the axis.
        """
        axis = self.axis if axis is None else axis
        speeds = self.velocity[len(self.velocity) // 2 :]
        shown = [k for k in range(len(speeds)) if np.any(np.isfinite(self.friction[:, k]))]
        rows: list[tuple[str, ...]] = [(f"speed [{unit('rad/s', axis)}]", *self.names)]
        for k in shown:
            rows.append((number(float(speeds[k])), *(number(float(f)) if np.isfinite(f) else "" for f in self.friction[:, k])))
        head = said(say("Friction [{N m}] at {} {kg m^2}, half of the difference of both directions", number(self.inertia)), axis)
        return "\n".join([head, *table(rows)])

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all bins as CSV: record, velocity, torque, scatter, count."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("record", "velocity", "torque", "scatter", "count"))
        for name, *rows in zip(self.names, self.torque, self.scatter, self.count, strict=True):
            for w, *values in zip(self.velocity, *rows, strict=True):
                writer.writerow((name, repr(float(w)), repr(float(values[0])), repr(float(values[1])), int(values[2])))
        write_whole(path, text.getvalue().encode())

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        lists = {name: getattr(self, name).tolist() for name in ("velocity", "edges", "torque", "scatter", "count")}
        return {
            "schema": "gaident/friction_map",
            "schema_version": 1,
            "names": list(self.names),
            **lists,
            "inertia": self.inertia,
            "axis": self.axis,
        }

    def plot(self, axis: str | None = None) -> Figure:
        """Draw the torque of each record over the velocity; `axis`: as `summary` takes it."""
        from gaident.remedies.pictures import plot_friction

        rows = tuple(zip(self.names, self.torque, self.scatter, strict=True))
        return plot_friction(self.velocity, rows, self.axis if axis is None else axis)


def friction_map(
    records: Record | Sequence[Record], *, inertia: float | None = None, bins: int = BINS, axis: str = "rotary"
) -> FrictionMap:
    """Return the torque by velocity of records of one axis, its inertia taken out: how friction differs from record to record.

    No model is simulated: the motion passes a zero-phase filter, as in `inverse_dynamics`.

    Parameters
    ----------
    records : Record or sequence of Record
        Records with a torque that move.
    inertia : float, optional
        Inertia of the axis [kg m^2]; None: that of the regression of all records.
    bins : int
        Bins of each direction, from 1 to 1000; they are closer at low speeds.
    axis : {"rotary", "linear"}
        Kind of the axis: which units `summary` and `plot` have.

    Returns
    -------
    FrictionMap
        A row for each record.

    Raises
    ------
    RecordError
        For a record without a torque, or without a motion.
    SettingsError
        For something else than records, an inertia that is not above 0, and bins out of their range.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> def run(friction):
    ...     drive = ga.OneMass(J=0.01, D=0.0).model().with_effect("coulomb_friction", torque=friction)
    ...     torque = np.repeat([1.0, -1.0, 0.8, -0.7], 250)
    ...     rec = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    ...     return ga.Record(1e-3, torque=torque, velocity=ga.simulate(drive, rec))
    >>> found = ga.friction_map([run(0.2), run(0.3)], inertia=0.01, bins=3)
    >>> np.nanmean(found.friction, axis=1).round(1).tolist()
    [0.2, 0.3]
    """
    checked_axis(axis)
    given = (records,) if isinstance(records, Record) else records
    if not isinstance(given, Sequence) or not given or not all(isinstance(r, Record) for r in given):
        raise SettingsError(f"records is {type(records).__name__}: give a gaident.Record or a list of them")
    if isinstance(bins, bool) or not isinstance(bins, int) or not FEWEST <= bins <= MOST:
        raise SettingsError(f"bins is {bins!r}: give a whole number from {FEWEST} to {MOST}")
    for rec in given:
        if rec.torque is None:
            raise RecordError(f"record {rec.name!r} has no torque: its friction does not show; log it")
    if inertia is None:
        mass = inverse_dynamics(list(given), axis=axis).parameters["inertia"].value
    else:
        mass = size_of_drive(inertia, "inertia", SettingsError, "give a number > 0, or None")
    motions = [motion_of(rec, cutoff_of(rec, ORDER), ORDER) for rec in given]
    speeds = [np.abs(m.velocity[~m.still]) for m in motions]
    for rec, moving in zip(given, speeds, strict=True):
        if not len(moving):
            raise RecordError(f"record {rec.name!r} does not move: its friction does not show; give records that move")
    low, high = min(float(np.min(s)) for s in speeds), max(float(np.max(s)) for s in speeds)
    edges = np.geomspace(low, high, bins + 1)
    middles = np.sqrt(edges[1:] * edges[:-1])
    parts = [_binned(m, mass, edges) for m in motions]
    torque, scatter, count = (np.array([part[i] for part in parts]) for i in range(3))
    names = tuple(rec.name or f"record {i}" for i, rec in enumerate(given, 1))
    return FrictionMap(names, np.concatenate([-middles[::-1], middles]), edges, torque, scatter, count, mass, axis)


def _binned(motion: Motion, inertia: float, edges: Vector) -> tuple[Vector, Vector, NDArray[np.int64]]:
    """(mean, standard deviation, count) of each bin, those backwards first."""
    assert motion.torque is not None
    seen = ~motion.still
    left, velocity = (motion.torque - inertia * motion.acceleration)[seen], motion.velocity[seen]
    bins = len(edges) - 1
    place = np.clip(np.searchsorted(edges, np.abs(velocity), side="right") - 1, 0, bins - 1)
    at = np.where(velocity > 0.0, bins + place, bins - 1 - place)
    count = np.bincount(at, minlength=2 * bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(at, left, minlength=2 * bins) / count
        square = np.bincount(at, (left - mean[at]) ** 2, minlength=2 * bins) / count
    return mean, np.sqrt(square), count.astype(np.int64)
