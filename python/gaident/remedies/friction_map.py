"""friction_map(): the torque that is left of each record when the inertia is taken out, by velocity.

left = u - J a   of the filtered motion, samples at standstill left out
half of (left(w) - left(-w)) is friction, half of (left(w) + left(-w)) a load that does not change its sign with the motion

Where a record holds a speed, its mean torque is friction and load, whatever the inertia, the controller and how slow the log is:
steady/plateaus.py finds such stretches, steady/laws.py the law behind them.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.axis import checked_axis, linear_sentences, said, say, unit
from gaident.checks import one_of, several, size_of_drive
from gaident.data.record import Record
from gaident.data.signals.arrays import floats
from gaident.errors import RecordError, SettingsError
from gaident.estimation.regression.inverse_dynamics import inverse_dynamics
from gaident.estimation.regression.motion import ORDER, Motion, cutoff_of, motion_of
from gaident.files import write_whole
from gaident.remedies.steady.laws import FrictionLaw, laws_of
from gaident.remedies.steady.plateaus import Plateau, plateaus_of
from gaident.remedies.steady.words import held_lines, notes_of
from gaident.results.estimate import Estimate
from gaident.results.json_text import json_text
from gaident.show.wording import number, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["FrictionMap", "friction_map"]

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]

BINS = 12  # no decision: a grid: bins of a direction, where nobody asks for others
HELD = ("record", "start", "stop", "velocity", "torque", "std", "independent", "samples", "temperature")
HOTTEST = 1e6  # no decision: what an argument may be
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
        The inertia that was taken out [kg m^2]; nan where none was given and the records show none.
    axis : {"rotary", "linear"}
        Kind of the axis.
    plateaus : tuple of Plateau
        Stretches at a held speed with their torque, of all records.
    law : FrictionLaw or None
        The law of friction that fits them best; None where they tell none.
    rivals : tuple of FrictionLaw
        Laws that they do not tell from it, the best first.
    beyond : float
        Standard deviation by which plateaus scatter beyond their own [N m].
    temperature_slope : Estimate or None
        By how much the friction changes to a degree of the temperature [N m]; None where no temperature was given, or one.
    notes : tuple of str
        What the plateaus cannot tell, and which speeds would.

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
    plateaus: tuple[Plateau, ...] = ()
    law: FrictionLaw | None = None
    rivals: tuple[FrictionLaw, ...] = ()
    beyond: float = 0.0
    temperature_slope: Estimate | None = None
    notes: tuple[str, ...] = ()

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

    @property
    def _laws(self) -> tuple[FrictionLaw, ...]:
        return () if self.law is None else (self.law, *self.rivals)

    def summary(self, axis: str | None = None) -> str:
        """Return the held speeds with their law as text, and a table of the friction of each record by speed.

        `axis`: "linear" for units of m and N, "rotary" for rad and N m; None: those of the axis.
        """
        axis = self.axis if axis is None else axis
        parts = [*held_lines(self.plateaus, self._laws, self.temperature_slope, self.notes, axis), self._between(axis)]
        return "\n\n".join("\n".join(part) for part in parts if part)

    def _between(self, axis: str) -> list[str]:
        """The friction of each record by speed, of what moves between held speeds too; nothing where no inertia is known."""
        speeds = self.velocity[len(self.velocity) // 2 :]
        shown = [k for k in range(len(speeds)) if np.any(np.isfinite(self.friction[:, k]))]
        if not shown or not np.isfinite(self.inertia):
            return []
        rows: list[tuple[str, ...]] = [(f"speed [{unit('rad/s', axis)}]", *self.names)]
        for k in shown:
            rows.append((number(float(speeds[k])), *(number(float(f)) if np.isfinite(f) else "" for f in self.friction[:, k])))
        text = say("Friction [{N m}] at {} {kg m^2}, half of the difference of both directions", number(self.inertia))
        return [said(text, axis), *table(rows)]

    def to_csv(self, path: str | os.PathLike[str], rows: str = "bins") -> None:
        """Write a table as CSV, in SI units.

        Parameters
        ----------
        path : str or path-like
            File to write.
        rows : {"bins", "plateaus"}
            "bins": record, velocity, torque, scatter, count of all bins.
            "plateaus": record, start, stop, velocity, torque, std, independent, samples, temperature, law (its torque there).

        Raises
        ------
        SettingsError
            For other rows.
        """
        one_of(rows, "rows", ("bins", "plateaus"), SettingsError)
        write_whole(path, _csv(self._bins() if rows == "bins" else self._held()).encode())

    def _bins(self) -> list[tuple[Any, ...]]:
        found: list[tuple[Any, ...]] = [("record", "velocity", "torque", "scatter", "count")]
        for name, *values in zip(self.names, self.torque, self.scatter, self.count, strict=True):
            for w, torque, scatter, count in zip(self.velocity, *values, strict=True):
                found.append((name, repr(float(w)), repr(float(torque)), repr(float(scatter)), int(count)))
        return found

    def _held(self) -> list[tuple[Any, ...]]:
        found: list[tuple[Any, ...]] = [(*HELD, "law")]
        for p in self.plateaus:
            law = "" if self.law is None else repr(float(self.law.torque(p.velocity)))
            found.append((*(getattr(p, name) for name in HELD), law))
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        lists = {name: getattr(self, name).tolist() for name in ("velocity", "edges", "torque", "scatter", "count")}
        slope = self.temperature_slope
        return {
            "schema": "gaident/friction_map",
            "schema_version": 1,
            "names": list(self.names),
            **lists,
            "inertia": self.inertia,
            "axis": self.axis,
            "plateaus": [asdict(p) for p in self.plateaus],
            "law": None if self.law is None else self.law.to_dict(),
            "rivals": [law.to_dict() for law in self.rivals],
            "beyond": self.beyond,
            "temperature_slope": None if slope is None else {"value": slope.value, "std": slope.std, "unit": slope.unit},
            "notes": list(self.notes),
            "linear_axis": linear_sentences(self.notes),
        }

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write all of it as JSON, what `to_dict` gives; the file appears whole or not at all."""
        write_whole(path, json_text(self.to_dict()).encode())

    def plot(self, axis: str | None = None) -> Figure:
        """Draw the torque of each record over the velocity, and that of held speeds with their law; `axis`: as in `summary`."""
        from gaident.remedies.pictures import plot_friction

        rows = tuple(zip(self.names, self.torque, self.scatter, strict=True))
        if self.plateaus and not np.isfinite(self.inertia):  # the acceleration is in the bins
            rows = ()
        return plot_friction(self.velocity, rows, self.axis if axis is None else axis, self.plateaus, self._laws)


def friction_map(
    records: Record | Sequence[Record],
    *,
    inertia: float | None = None,
    bins: int = BINS,
    axis: str = "rotary",
    temperature: ArrayLike | Sequence[ArrayLike | None] | None = None,
) -> FrictionMap:
    """Return the torque by velocity of records of one axis: the held speeds with their law of friction, and what lies between.

    No model is simulated.
    At held speeds the mean torque is friction and load, also in a log that is far slower than the loop.
    Between them the inertia is taken out of a motion behind a zero-phase filter, as in `inverse_dynamics`: how friction differs
    from record to record.

    Parameters
    ----------
    records : Record or sequence of Record
        Records with a torque that move.
    inertia : float, optional
        Inertia of the axis [kg m^2]; None: that of the regression of all records, where they show one.
        One that is given is taken out of held speeds as well.
    bins : int
        Bins of each direction, from 1 to 1000; they are closer at low speeds.
    axis : {"rotary", "linear"}
        Kind of the axis: which units `summary` and `plot` have.
    temperature : sequence, optional
        Temperature of each record in any unit: a number or an array (n,) of its samples, None where it has none.
        Of one record, the number or the array alone.

    Returns
    -------
    FrictionMap
        Held speeds, their law with its rivals, and a row for each record.

    Raises
    ------
    RecordError
        For a record without a torque, or without a motion.
    SettingsError
        For something else than records, an inertia that is not above 0, bins out of their range, and temperatures that are no
        numbers, or not one for each record or sample.

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

    Held speeds in a log that is slower than the loop:

    >>> drive = ga.OneMass(J=0.01, D=0.02).model().with_effect("coulomb_friction", torque=0.3)
    >>> command = np.repeat([2.0, 5.0, 10.0, 20.0, -20.0, -10.0, -5.0, -2.0], 1000)
    >>> run = ga.run(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), ga.PI(kp=5.0, ki=500.0))
    >>> slow = ga.Record(20e-3, velocity=run.velocity[::20], torque=run.torque[::20])
    >>> law = ga.friction_map(slow).law
    >>> print(law.name, round(law.viscous.value, 3), round(law.effects["coulomb_friction"]["torque"].value, 2))
    viscous friction + coulomb friction 0.02 0.3
    """
    checked_axis(axis)
    given = several(records, Record, "records", SettingsError, "give a gaident.Record or a list of them")
    if isinstance(bins, bool) or not isinstance(bins, int) or not FEWEST <= bins <= MOST:
        raise SettingsError(f"bins is {bins!r}: give a whole number from {FEWEST} to {MOST}")
    for i, rec in enumerate(given):
        if rec.torque is None:
            which = f"record {rec.name!r}" if rec.name else f"records[{i}]"
            raise RecordError(f"{which} has no torque: its friction does not show; log it")
    known = None if inertia is None else size_of_drive(inertia, "inertia", SettingsError, "give a number > 0, or None")
    heat = _temperatures(temperature, given, isinstance(records, Record))
    mass = _regressed(given, axis) if known is None else known
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
    held = [plateaus_of(rec, name, known, of) for rec, name, of in zip(given, names, heat, strict=True)]
    plateaus = [p for found, _ in held for p in found]
    fitted = laws_of(plateaus)
    notes = notes_of(given, plateaus, [left for _, left in held], fitted, mass)
    best = fitted.laws[0] if fitted.laws else None
    velocity, more = np.concatenate([-middles[::-1], middles]), (fitted.laws[1:], fitted.beyond, fitted.slope, tuple(notes))
    return FrictionMap(names, velocity, edges, torque, scatter, count, mass, axis, tuple(plateaus), best, *more)


def _regressed(records: Sequence[Record], axis: str) -> float:
    """The inertia of the regression of all records [kg m^2]; nan where they show none, as at held speeds alone."""
    try:
        return inverse_dynamics(list(records), axis=axis).parameters["inertia"].value
    except RecordError:
        return float(np.nan)


def _temperatures(given: Any, records: Sequence[Record], alone: bool) -> list[Vector]:
    """The temperature at each sample of each record, nan where there is none."""
    remedy = "give for each record a number, an array with one for each of its samples, or None"
    if given is None:
        return [np.full(len(rec), np.nan) for rec in records]
    parts = [given] if alone else list(given) if isinstance(given, Sequence | np.ndarray) else []
    if len(parts) != len(records):
        raise SettingsError(f"temperature has {len(parts)} entries and there are {len(records)} records: {remedy}")
    found = []
    for rec, part in zip(records, parts, strict=True):
        try:
            values = floats(np.nan if part is None else part)
        except TypeError:
            raise SettingsError(f"temperature is {part!r:.60}: {remedy}") from None
        if np.any(np.abs(values) > HOTTEST):
            raise SettingsError(f"temperature has {np.nanmax(np.abs(values)):g}, which nothing has: {remedy}")
        if values.shape not in ((), (len(rec),)):
            raise SettingsError(f"temperature has the shape {values.shape} for a record of {len(rec)} samples: {remedy}")
        found.append(np.broadcast_to(values, (len(rec),)).astype(np.float64))
    return found


def _csv(rows: Sequence[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _binned(motion: Motion, inertia: float, edges: Vector) -> tuple[Vector, Vector, NDArray[np.int64]]:
    """(mean, standard deviation, count) of each bin, those backwards first."""
    assert motion.torque is not None
    seen = ~motion.still
    mass = inertia if np.isfinite(inertia) else 0.0
    left, velocity = (motion.torque - mass * motion.acceleration)[seen], motion.velocity[seen]
    bins = len(edges) - 1
    place = np.clip(np.searchsorted(edges, np.abs(velocity), side="right") - 1, 0, bins - 1)
    at = np.where(velocity > 0.0, bins + place, bins - 1 - place)
    count = np.bincount(at, minlength=2 * bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.bincount(at, left, minlength=2 * bins) / count
        square = np.bincount(at, (left - mean[at]) ** 2, minlength=2 * bins) / count
    return mean, np.sqrt(square), count.astype(np.int64)
