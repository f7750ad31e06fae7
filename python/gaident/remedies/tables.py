"""Tables of the torque that a drive adds beforehand: friction by velocity, gravity and cogging by angle, inertia."""

from __future__ import annotations

import csv
import io
import math
import os
import re
import textwrap
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.axis import called, linear_sentences, said, say, unit
from gaident.checks import LARGEST, checked_path
from gaident.data.signals.arrays import floats
from gaident.errors import SettingsError
from gaident.export.c_source import c_name
from gaident.files import write_whole
from gaident.remedies.c_tables import c_tables
from gaident.remedies.following.errors import FollowingError
from gaident.show.wording import WIDTH, number, table

__all__ = ["FeedforwardTables", "Wave"]

Vector = NDArray[np.float64]

SHOWN = 4  # no decision: printed: speeds of the summary


def _of_motion(values: ArrayLike, name: str) -> Vector:
    """Numbers of a motion; raises SettingsError naming the argument."""
    remedy = "give real numbers, one or an array of them"
    try:
        array = floats(values)
        if np.asarray(values).dtype.kind == "b":
            raise TypeError("true or false")
    except TypeError as reason:
        raise SettingsError(f"{name} is {values!r:.60} ({reason}): {remedy}") from None
    far = array[~(np.abs(array) <= LARGEST)]  # not a number, too
    if far.size:
        raise SettingsError(f"{name} has {far[0]:g}, which no drive reaches ({LARGEST:g} at most): {remedy}")
    return array


@dataclass(frozen=True)
class Wave:
    """A torque that returns with the angle: sine sin(order angle) + cosine cos(order angle).

    Attributes
    ----------
    effect : str
        The effect behind it.
    order : float
        Periods per turn; of a linear axis per 2 pi metres.
    sine, cosine : float
        Coefficients of the torque that is to be added [N m].

    See Also
    --------
    feedforward : Makes it.
    """

    effect: str
    order: float
    sine: float
    cosine: float


@dataclass(frozen=True, eq=False)
class FeedforwardTables:
    """What a drive adds to the torque for a known motion. Made by `feedforward`.

    Every torque has the sign with which it is added to the motor's: friction of a positive velocity is positive.
    At standstill the friction is 0, and up to the lowest speed of the table it grows in proportion.

    Attributes
    ----------
    velocity : ndarray, shape (m,)
        Velocities of the table of friction, ascending, of both directions [rad/s].
    friction : ndarray, shape (m,)
        Dry friction and drag there [N m].
    viscous : float
        Viscous friction, of which no table is needed [N m s/rad].
    constant : float
        Torque of a constant load [N m].
    angle : ndarray, shape (k,)
        Angles of the table of gravity and cogging, from 0 [rad].
    by_angle : ndarray, shape (k,)
        Their torque there [N m].
    waves : tuple of Wave
        The same as coefficients of sine and cosine.
    inertia : float
        For the feedforward of the acceleration [kg m^2].
    doubts : tuple of str
        Why the model behind the tables is not to be trusted.
    notes : tuple of str
        What the tables do not contain, in plain sentences.
    axis : {"rotary", "linear"}
        Kind of the axis.
    following : FollowingError or None
        The following error in the simulated loop, without and with the tables; None where no loop can be simulated.
    no_following : str
        Why it is None.

    See Also
    --------
    feedforward : Makes it, with an example.
    """

    velocity: Vector
    friction: Vector
    viscous: float
    constant: float
    angle: Vector
    by_angle: Vector
    waves: tuple[Wave, ...]
    inertia: float
    doubts: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    axis: str = field(default="rotary")
    following: FollowingError | None = None
    no_following: str = ""

    def torque(self, velocity: ArrayLike, angle: ArrayLike = 0.0, acceleration: ArrayLike = 0.0) -> Vector:
        """Return the torque to add for a motion.

        Parameters
        ----------
        velocity : array_like
            Velocity of the motion [rad/s].
        angle : array_like
            Angle, counted as in the record [rad].
        acceleration : array_like
            Acceleration [rad/s^2].

        Returns
        -------
        ndarray
            Torque [N m], of the shape that the three have together.

        Raises
        ------
        SettingsError
            For what is no number of a drive's motion, and shapes that do not go together.
        """
        w, x, a = (_of_motion(v, n) for v, n in ((velocity, "velocity"), (angle, "angle"), (acceleration, "acceleration")))
        try:
            np.broadcast_shapes(w.shape, x.shape, a.shape)
        except ValueError:
            told = f"velocity, angle and acceleration have the shapes {w.shape}, {x.shape} and {a.shape}"
            raise SettingsError(f"{told}: give one number for all, or as many of each") from None
        middle = len(self.velocity) // 2
        speeds = np.concatenate([self.velocity[:middle], [0.0], self.velocity[middle:]])
        levels = np.concatenate([self.friction[:middle], [0.0], self.friction[middle:]])
        turning = sum((v.sine * np.sin(v.order * x) + v.cosine * np.cos(v.order * x) for v in self.waves), np.zeros_like(x))
        return np.asarray(np.interp(w, speeds, levels) + self.viscous * w + self.constant + turning + self.inertia * a)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all tables as one CSV file: the columns table, at, value and unit, in SI units."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(("table", "at", "value", "unit"))
        torque = unit("N m", self.axis)
        writer.writerow(("inertia", "", repr(self.inertia), unit("kg m^2", self.axis)))
        writer.writerow(("viscous", "", repr(self.viscous), unit("N m s/rad", self.axis)))
        writer.writerow(("constant", "", repr(self.constant), torque))
        for name, places, values in (("friction", self.velocity, self.friction), ("angle", self.angle, self.by_angle)):
            for at, value in zip(places, values, strict=True):
                writer.writerow((name, repr(float(at)), repr(float(value)), torque))
        for wave in self.waves:
            writer.writerow(("sine", repr(wave.order), repr(wave.sine), torque))
            writer.writerow(("cosine", repr(wave.order), repr(wave.cosine), torque))
        write_whole(path, text.getvalue().encode())

    def to_c(self, path: str | os.PathLike[str] | None, name: str | None = None) -> str:
        """Write the tables as one C99 file with a function of velocity, angle and acceleration.

        Parameters
        ----------
        path : str or path-like, or None
            File to write; None: none is written.
        name : str, optional
            Name of the function and beginning of every other name; None: that of the file.

        Returns
        -------
        str
            The text of the file.

        Raises
        ------
        SettingsError
            For a name that C does not take.
        """
        if name is not None and not (isinstance(name, str) and re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name)):
            raise SettingsError(f"name is {name!r:.80}: give what C takes as a name, letters, digits and _")
        target = None if path is None else checked_path(path)
        text = c_tables(self, name or c_name("feedforward" if target is None else target.stem))
        if target is not None:
            write_whole(target, text.encode())
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        how = () if self.following is None else self.following.notes
        lists: Mapping[str, Vector] = {n: getattr(self, n) for n in ("velocity", "friction", "angle", "by_angle")}
        return {
            "schema": "gaident/feedforward",
            "schema_version": 1,
            **{name: values.tolist() for name, values in lists.items()},
            **{name: getattr(self, name) for name in ("viscous", "constant", "inertia", "axis")},
            "waves": [asdict(wave) for wave in self.waves],
            "doubts": list(self.doubts),
            "notes": list(self.notes),
            "following": None if self.following is None else self.following.to_dict(),
            "no_following": str(self.no_following),
            "linear_axis": linear_sentences([*self.doubts, *self.notes, *how, self.no_following]),
        }

    def summary(self, axis: str | None = None) -> str:
        """Return the tables as text, doubts first; `axis`: "linear" for units of m and N, None for those of the axis."""
        shown = self.axis if axis is None else axis
        torque = unit("N m", shown)
        step = max(1, (len(self.velocity) // 2 - 1) // SHOWN)
        rows: list[tuple[str, ...]] = [(f"velocity [{unit('rad/s', shown)}]", f"friction [{torque}]")]
        rows += [(number(float(w)), number(float(f))) for w, f in zip(self.velocity[::step], self.friction[::step], strict=True)]
        waves: list[tuple[str, ...]] = [("order", f"sine [{torque}]", f"cosine [{torque}]", "")]
        for wave in self.waves:
            order = wave.order / math.tau if shown == "linear" else wave.order
            waves.append((number(order), number(wave.sine), number(wave.cosine), said(called(wave.effect), shown)))
        parts = [
            [line for doubt in self.doubts for line in textwrap.wrap(f"Warning: {said(doubt, shown)}", WIDTH)],
            [
                said(say("{Torque} to add, positive for a motion forwards"), shown),
                f"  acceleration  {number(self.inertia)} {unit('kg m^2', shown)}",
                f"  velocity      {number(self.viscous)} {unit('N m s/rad', shown)}",
                f"  constant      {number(self.constant)} {torque}",
            ],
            table(rows) if np.any(self.friction) else [],
            table(waves) if self.waves else [],
            [line for note in self.notes for line in textwrap.wrap(said(note, shown), WIDTH)],
            self._brought(shown),
        ]
        return "\n\n".join("\n".join(lines) for lines in parts if lines)

    def _brought(self, axis: str) -> list[str]:
        """What the tables bring in the loop, or why that is not there."""
        if self.following is not None:
            return self.following.lines(axis)
        why = f"What the tables bring is not simulated: {said(self.no_following, axis)}."
        return textwrap.wrap(why, WIDTH) if self.no_following else []
