"""Record: one measured run of a drive."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.checks import one_of
from gaident.data.record_checks import (
    check_bounds,
    check_part,
    complete,
    decimated_channels,
    digest_of,
    equally_long,
    moved_channels,
    ranges_of,
    readable,
    sample_at,
    sample_time,
    saved_fields,
    slice_bounds,
    still_driven,
    texts,
    torque_kind,
    torque_line,
    unwrapped,
)
from gaident.data.signals.arrays import channel
from gaident.data.signals.decimation import factor_of
from gaident.data.torque_kind import COMMANDED, SAMPLE, SMOOTH
from gaident.errors import RecordError, check_schema
from gaident.files import write_whole
from gaident.providers import picture, provided
from gaident.version import version

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CHANNELS", "Record"]

CHANNELS = ("command", "velocity", "torque", "position", "position_command", "load_position", "load_velocity")
"""The channels of a record, in the order of its arguments."""

SCHEMA = "gaident/record"
SCHEMA_VERSION = 1  # no decision: a format: its version


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Record:
    """One measured run, sampled every `dt` seconds; immutable.

    The arrays are copied once to read-only float64; yours are never changed.
    `rec[a:b]` and `rec.between` share memory with the record they were cut from; their time starts at 0 again.
    A linear axis has m, m/s and N in the same places.

    Parameters
    ----------
    dt : float
        Sample time [s], > 0.
    command : array_like, shape (n,), optional
        Velocity command r [rad/s]. At least one of `command` and `torque` is given, and n >= 20.
    velocity : array_like, shape (n,)
        Measured motor velocity w [rad/s], the output that models are judged on.
    torque : array_like, shape (n,), optional
        Motor torque u [N m].
    position : array_like, shape (n,), optional
        Measured motor angle theta [rad]. One that wraps is continued where it jumps and the velocity does not; `notes` says so.
    name : str
        What reports call the record.
    position_command : array_like, shape (n,), optional
        Position command theta* [rad], which drives a loop with a position controller.
    load_position, load_velocity : array_like, shape (n,), optional
        What a second encoder at the load shows, in any unit: scale (sign included) and offset are estimated. In SI rad and rad/s.
        Where both are there the position is used. A position that wraps is continued, and `notes` says so.
    torque_is : {"commanded", "measured"}
        What the torque is.
        "commanded": as the controller issued it, before the actuator's limits, dead band, delay and lag.
        "measured": a measured current times a constant, behind the actuator, with the sensor's noise on it.
    torque_log : {"sample", "mean", "held", "smooth"}
        What a line contains: the "mean" over the controller's samples since the line before, or the value there, which is "held"
        or goes on "smooth", low-passed; "sample": held, but straight if measured and the lines are more than 4 ms apart.
    notes : sequence of str
        What was noticed and done when the log was read; results repeat it, digest and == do not know it.

    Raises
    ------
    RecordError
        NaN, infinities, unequal lengths, fewer than 20 samples, dt <= 0, arrays that are not one-dimensional real numbers,
        another `torque_is` or `torque_log`, or "measured" or "mean" without a torque.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> n = np.arange(100)
    >>> w, current = np.sin(0.1 * n), np.cos(0.1 * n)
    >>> rec = ga.Record(1e-3, velocity=w, torque=current, torque_is="measured", name="run 1")
    >>> rec
    Record('run 1', 100 samples, dt=0.001 s, 0.1 s; velocity -0.9999..0.9996, torque -0.9997..1 (measured))
    >>> len(rec[20:60]), len(rec.between(0.0, 0.05))
    (40, 50)
    """

    dt: float
    command: NDArray[np.float64] | None
    velocity: NDArray[np.float64]
    torque: NDArray[np.float64] | None
    position: NDArray[np.float64] | None
    position_command: NDArray[np.float64] | None
    load_position: NDArray[np.float64] | None
    load_velocity: NDArray[np.float64] | None
    name: str
    torque_is: str
    torque_log: str
    notes: tuple[str, ...]

    def __init__(
        self,
        dt: float,
        command: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        position: ArrayLike | None = None,
        name: str = "",
        *,
        position_command: ArrayLike | None = None,
        load_position: ArrayLike | None = None,
        load_velocity: ArrayLike | None = None,
        torque_is: str = COMMANDED,
        torque_log: str = SAMPLE,
        notes: Sequence[str] = (),
    ) -> None:
        complete(velocity, command, torque, position_command)
        name = readable(name)
        given = (command, velocity, torque, position, position_command, load_position, load_velocity)
        channels = {key: None if x is None else channel(x, key) for key, x in zip(CHANNELS, given, strict=True)}
        kind, line, dt = torque_kind(torque_is, channels["torque"]), torque_line(torque_log, channels["torque"]), sample_time(dt)
        said = (*texts(notes), *unwrapped(equally_long(channels), dt))
        self._fill(dt, channels, name=name, torque_is=kind, torque_log=line, notes=said)

    def _fill(self, dt: float, channels: Mapping[str, NDArray[np.float64] | None], **about: Any) -> None:
        """Set the fields of this frozen object, unchecked."""
        for key, value in {"dt": dt, **channels, **about}.items():
            object.__setattr__(self, key, value)

    def with_channels(
        self, *, dt: float | None = None, torque_is: str | None = None, torque_log: str | None = None, **changed: ArrayLike | None
    ) -> Record:
        """Return the record with other channels and all else as it is.

        Channels that are not named share memory with this record.
        A record that has lost its torque is "commanded" and "sample", as one that never had any.

        Parameters
        ----------
        dt : float, optional
            Another sample time [s].
        torque_is : {"commanded", "measured"}, optional
            What another torque is.
        torque_log : {"sample", "mean"}, optional
            What a line contains of it.
        **changed : array_like, shape (n,), or None
            Channel -> values, or None to leave the channel out. Where the length changes, give all channels.

        Returns
        -------
        Record
            A new record; this one stays as it is.

        Raises
        ------
        RecordError
            As the constructor does, and for a name that is no channel.

        Examples
        --------
        >>> import numpy as np
        >>> import gaident as ga
        >>> rec = ga.Record(1e-3, velocity=np.zeros(50), torque=np.ones(50))
        >>> float(rec.with_channels(velocity=rec.velocity + 1.0).velocity[0])
        1.0
        """
        for key in changed:
            one_of(key, "with_channels: the channel", CHANNELS, RecordError)
        old = {key: getattr(self, key) for key in CHANNELS}
        channels = old | {key: None if values is None else channel(values, key) for key, values in changed.items()}
        still_driven(channels, changed)
        made = object.__new__(type(self))
        period = self.dt if dt is None else sample_time(dt)
        torque = channels["torque"]
        kept = (COMMANDED, SAMPLE) if torque is None else (self.torque_is, self.torque_log)
        kind = kept[0] if torque_is is None else torque_kind(torque_is, torque)
        line = kept[1] if torque_log is None else torque_line(torque_log, torque)
        notes = tuple(dict.fromkeys((*self.notes, *unwrapped(equally_long(channels), period, changed))))
        made._fill(period, channels, **self._about | {"torque_is": kind, "torque_log": line, "notes": notes})
        return made

    @property
    def _about(self) -> dict[str, Any]:
        return {"name": self.name, "torque_is": self.torque_is, "torque_log": self.torque_log, "notes": self.notes}

    def channels(self) -> Iterator[tuple[str, NDArray[np.float64]]]:
        """Yield the channels that are there, as (name, array (n,)), in the order of the arguments."""
        for key in CHANNELS:
            values = getattr(self, key)
            if values is not None:
                yield key, values

    def __len__(self) -> int:
        """Number of samples n."""
        return len(self.velocity)

    @property
    def time(self) -> NDArray[np.float64]:
        """Time axis n*dt [s], shape (n,), from 0."""
        axis = np.arange(len(self), dtype=np.float64)
        axis *= self.dt
        return axis

    @property
    def duration(self) -> float:
        """Duration n*dt [s]: each sample stands for one sample time, `between(0, duration)` is the whole record."""
        return len(self) * self.dt

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the data, hexadecimal: of the sample time, the channels, "measured" and "mean" for such a torque.

        Equal data give equal digests on every machine; the name does not count.
        It gives records an order that does not depend on how they were passed, and reports a fingerprint.
        """
        return digest_of(self.dt, dict(self.channels()), self.torque_is, self.torque_log)

    def __getitem__(self, samples: slice) -> Record:
        """`rec[a:b]`: samples a to b-1, numpy's rules for negative and missing bounds; at least 20 remain."""
        return self._cut(*slice_bounds(samples, len(self)))

    def between(self, t0: float, t1: float) -> Record:
        """Return the samples with t0 <= time < t1.

        Parameters
        ----------
        t0, t1 : float
            Bounds [s] from the record's start; bounds beyond its ends are allowed.

        Returns
        -------
        Record
            The part, sharing memory with this record; its time starts at 0.

        Raises
        ------
        RecordError
            Where a bound is no number, t0 >= t1, or fewer than 20 samples are left.
        """
        check_bounds(t0, t1)
        start, stop = (sample_at(float(value), self.dt, len(self)) for value in (t0, t1))
        return self._cut(start, stop, f"between({t0!r}, {t1!r})")

    def decimate(self, factor: int) -> Record:
        """Return every `factor`-th sample behind a low-pass of linear phase, whose delay is compensated.

        The filter has 50 * factor + 1 taps.
        Up to 80 % of the new Nyquist frequency 1/(2 factor dt) all channels pass to within 0.03 %, in phase; from that frequency
        on they are damped by 72 dB and more. A torque then is "smooth".
        What a digital controller does in between is lost: identify in open loop, or with a continuous controller.

        Parameters
        ----------
        factor : int
            Samples that become one, >= 1.

        Returns
        -------
        Record
            The record with the sample time factor*dt and ceil(n/factor) samples.

        Raises
        ------
        RecordError
            Where the factor is no whole number >= 1, or fewer than 20 samples are left.
        """
        factor = factor_of(factor, "decimate", "({!r})")
        kept: Mapping[str, Any] = decimated_channels(dict(self.channels()), factor, self.torque_is, self.torque_log)
        return self.with_channels(dt=self.dt * factor, torque_log=SMOOTH if factor > 1 and "torque" in kept else None, **kept)

    def shifted(self, **samples: int) -> Record:
        """Return the record with channels moved against the others, for a log that wrote them on another line.

            x_new(n) = x(n - k),   k > 0: later, k < 0: earlier

        `samples` are channel=k; ``rec.shifted(torque=-1)`` is for a torque that the log wrote one sample late.
        The record is cut to what all channels cover then.

        Raises
        ------
        RecordError
            What is no channel of this record, no whole number, or leaves too few samples.

        Examples
        --------
        >>> import numpy as np
        >>> import gaident as ga
        >>> rec = ga.Record(1e-3, velocity=np.arange(30.0), torque=np.arange(30.0) - 1.0)
        >>> moved = rec.shifted(torque=-1)
        >>> len(moved), bool(np.all(moved.torque == moved.velocity))
        (29, True)
        """
        moved: Mapping[str, Any] = moved_channels(dict(self.channels()), samples)
        return self.with_channels(**moved)

    def plot(self, axis: str = "rotary", units: Mapping[str, str | float] | None = None) -> Figure:
        """Draw the channels over time: what the log contains, before anything is fitted.

        Parameters
        ----------
        axis : {"rotary", "linear"}
            "linear": words and units of m and N.
        units : mapping, optional
            Your units in place of SI, as `report` takes them: ``{"velocity": "rpm"}``.

        Returns
        -------
        matplotlib.figure.Figure
            The picture; `savefig` writes it.

        Raises
        ------
        SettingsError, ReadError
            For another axis, or a unit that it does not have.
        """
        return picture("plot_record", self, axis, units)

    def _cut(self, start: int, stop: int, text: str) -> Record:
        check_part(start, stop, text, len(self), self.duration)
        part = object.__new__(type(self))
        cut = {key: None if (v := getattr(self, key)) is None else v[start:stop] for key in CHANNELS}
        part._fill(self.dt, cut, **self._about)
        return part

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON: what was given, the channels as lists, None for those that are not there."""
        channels = {key: None if (v := getattr(self, key)) is None else v.tolist() for key in CHANNELS}
        about = {"dt": self.dt, **self._about, "notes": list(self.notes)}
        return {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, **about, **channels}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Record:
        """Return the record of what `to_dict` gave.

        Raises
        ------
        RecordError
            Where a key is missing, or the data make no record.
        GaidentError
            Where the data are something else or of a newer schema.
        """
        check_schema(data, SCHEMA, SCHEMA_VERSION)
        return cls(**saved_fields(data, CHANNELS))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the record as JSON, all digits, for `gaident.load`; the file appears whole or not at all."""
        write_whole(path, json.dumps({**self.to_dict(), "gaident_version": version()}).encode())

    def __eq__(self, other: object) -> bool:
        """Same sample time, same name, same channels, same values, a torque of the same kind."""
        if not isinstance(other, Record):
            return NotImplemented
        mine, yours = ({"dt": r.dt, **r._about, "notes": ()} for r in (self, other))
        theirs = dict(other.channels())
        same = mine == yours and len(self) == len(other) and dict(self.channels()).keys() == theirs.keys()
        return same and all(np.array_equal(values, theirs[key]) for key, values in self.channels())

    def __hash__(self) -> int:
        return hash((self.digest, self.name))

    def __repr__(self) -> str:
        label = f"{self.name!r}, " if self.name else ""
        channels = ranges_of(dict(self.channels()), self.torque_is, self.torque_log)
        return f"Record({label}{len(self)} samples, dt={self.dt:.6g} s, {self.duration:.4g} s; {channels})"

    def _repr_html_(self) -> str:
        return str(provided("record_html")(self))

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        # Arrays come out of a pickle writable; through the constructor they are checked and locked again.
        return _rebuilt, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})


def _rebuilt(kind: type[Record], state: dict[str, Any]) -> Record:
    return kind(**state)
