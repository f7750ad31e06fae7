"""Record: what one run of the drive left behind."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaident.arguments import arg
from gaident.data.signals.arrays import MINIMUM_SAMPLES, channel, positive_number
from gaident.data.signals.decimation import decimated, factor_of
from gaident.errors import RecordError, check_schema
from gaident.files import write_whole
from gaident.providers import provided
from gaident.version import version

__all__ = ["CHANNELS", "Record"]

CHANNELS = ("command", "velocity", "torque", "position")
"""The channels of a record, in the order of its arguments."""

SCHEMA = "gaident/record"
SCHEMA_VERSION = 1

_HASH_BLOCK = 1 << 18
# A time given as 0.3 s falls on sample 3 of dt = 0.1 s although 0.3 / 0.1 is 2.9999999999999996.
_TIME_SLACK = 1e-6


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Record:
    """One measured run, sampled every `dt` seconds; immutable.

    dt        sample time [s]
    command   velocity command r [rad/s], shape (n,), or None
    velocity  measured motor velocity w [rad/s], shape (n,): the output that models are judged on
    torque    motor torque command u as the controller issued it [N m], shape (n,), or None
    position  measured motor angle theta [rad], shape (n,), or None
    name      what reports call it

    At least one of command and torque is given, and n >= 20. A linear axis has m, m/s, N in the same places.
    The arrays are copied once to read-only float64; yours are never changed. `rec[a:b]` and `rec.between`
    share memory with the record they were cut from; their time starts at 0 again.

    Raises RecordError for NaN, infinities, unequal lengths, fewer than 20 samples, dt <= 0, and for arrays
    that are not one-dimensional real numbers.
    """

    dt: float
    command: NDArray[np.float64] | None
    velocity: NDArray[np.float64]
    torque: NDArray[np.float64] | None
    position: NDArray[np.float64] | None
    name: str

    def __init__(
        self,
        dt: float,
        command: ArrayLike | None = None,
        velocity: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        position: ArrayLike | None = None,
        name: str = "",
    ) -> None:
        if velocity is None:
            raise RecordError(
                "velocity=None, but a record needs the measured velocity; give velocity=, "
                "or derive it with differentiate(position, dt, cutoff_hz)"
            )
        if command is None and torque is None:
            raise RecordError("command=None and torque=None, but a record needs what drove the motor; give one of them")
        if not isinstance(name, str):
            raise RecordError(f"name={name!r} is no text; give a str")
        given = {"command": command, "velocity": velocity, "torque": torque, "position": position}
        channels = {key: None if values is None else channel(values, key) for key, values in given.items()}
        lengths = {key: len(values) for key, values in channels.items() if values is not None}
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{key} {length}" for key, length in lengths.items())
            raise RecordError(
                f"the channels have unequal lengths ({listed} samples); cut them to the same samples, "
                "or, where they come from two clocks, bring two records together with align"
            )
        sample_time = positive_number(dt, "dt", "s", f"give the sample time in seconds, for example {arg('dt', '1e-3')}")
        self._fill(sample_time, channels, str(name))

    def _fill(self, dt: float, channels: dict[str, NDArray[np.float64] | None], name: str) -> None:
        """Set the fields of this frozen object, unchecked."""
        for key, value in {"dt": dt, **channels, "name": name}.items():
            object.__setattr__(self, key, value)

    def channels(self) -> Iterator[tuple[str, NDArray[np.float64]]]:
        """The channels that are there, as (name, array (n,)), in the order of the arguments."""
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
        """n*dt [s]: each sample stands for one sample time, between(0, duration) is the whole record."""
        return len(self) * self.dt

    @property
    def digest(self) -> str:
        """SHA-256 of the sample time and the channels, hexadecimal; the name does not count.

        Equal data give equal digests on every machine: a canonical order for records, a fingerprint for
        reports.
        """
        sha = hashlib.sha256(f"gaident record 1 {self.dt.hex()} {len(self)}".encode())
        for key, values in self.channels():
            sha.update(f" {key} ".encode())
            for start in range(0, len(values), _HASH_BLOCK):
                # + 0.0 makes -0.0 the 0.0 that it equals
                block = values[start : start + _HASH_BLOCK] + 0.0
                sha.update(block.astype("<f8", copy=False).tobytes())
        return sha.hexdigest()

    def __getitem__(self, samples: slice) -> Record:
        """`rec[a:b]`: samples a to b-1, numpy's rules for negative and missing bounds; at least 20 remain."""
        if not isinstance(samples, slice):
            raise RecordError(f"rec[{samples!r}]: a record is cut by a slice, rec[a:b]; one value is rec.velocity[n]")
        text = f"rec[{_bound(samples.start)}:{_bound(samples.stop)}]"
        if samples.step is not None and samples.step != 1:
            raise RecordError(
                f"{text[:-1]}:{samples.step!r}]: the step must be 1, because leaving out samples folds high "
                f"frequencies down; cut with rec[a:b], and decimate behind a low-pass with rec.decimate({samples.step!r})"
            )
        try:
            start, stop, _ = samples.indices(len(self))
        except TypeError:
            raise RecordError(f"{text}: bounds are sample numbers, whole; cut by seconds with rec.between(t0, t1)") from None
        return self._cut(start, stop, text)

    def between(self, t0: float, t1: float) -> Record:
        """The samples with t0 <= time < t1 [s], t from the record's start, bounds beyond its ends allowed."""
        for key, value in (("t0", t0), ("t1", t1)):
            if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
                raise RecordError(f"between({t0!r}, {t1!r}): {key} is no number; give seconds")
            if math.isnan(value):
                raise RecordError(f"between({t0!r}, {t1!r}): {key} is NaN; give seconds")
        if not t0 < t1:
            raise RecordError(f"between({t0!r}, {t1!r}): t0 must be before t1; exchange them")
        start, stop = (self._sample_at(float(value)) for value in (t0, t1))
        return self._cut(start, stop, f"between({t0!r}, {t1!r})")

    def decimate(self, factor: int) -> Record:
        """Every `factor`-th sample behind a low-pass: linear phase, its delay compensated, 50 * factor + 1 taps.

        Up to 80 % of the new Nyquist frequency 1/(2 factor dt) all channels pass to within 0.03 %, in phase; from that
        frequency on they are damped by 72 dB and more. What a digital controller does between the new samples is no
        longer in the record: identify a decimated record in open loop, or with a continuous controller. At least 20
        samples remain. Raises RecordError.
        """
        factor = factor_of(factor, "decimate", "({!r})")
        count = -(-len(self) // factor)
        if count < MINIMUM_SAMPLES:
            raise RecordError(f"decimate({factor}) leaves {count} samples, but at least {MINIMUM_SAMPLES} are needed")
        thinned = {key: decimated(values, factor) for key, values in self.channels()}
        return Record(self.dt * factor, name=self.name, **thinned)

    def _sample_at(self, time: float) -> int:
        """First sample not before `time` [s], within 0..n."""
        return math.ceil(min(max(time / self.dt - _TIME_SLACK, 0.0), float(len(self))))

    def _cut(self, start: int, stop: int, text: str) -> Record:
        count = max(stop - start, 0)
        if count < MINIMUM_SAMPLES:
            raise RecordError(
                f"{text} leaves {count} samples, but at least {MINIMUM_SAMPLES} are needed; the record has "
                f"{len(self)} samples and lasts {self.duration:g} s, choose wider bounds"
            )
        part = object.__new__(type(self))
        cut = {key: None if (v := getattr(self, key)) is None else v[start:stop] for key in CHANNELS}
        part._fill(self.dt, cut, self.name)
        return part

    def to_dict(self) -> dict[str, Any]:
        """Plain data for JSON: dt, name and the channels as lists, None for those that are not there."""
        held = {key: None if (v := getattr(self, key)) is None else v.tolist() for key in CHANNELS}
        return {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "name": self.name, "dt": self.dt, **held}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Record:
        """The inverse of to_dict. Raises RecordError, and GaidentError where the data are something else or of a newer schema."""
        check_schema(data, SCHEMA, SCHEMA_VERSION)
        missing = [key for key in ("dt", "name", *CHANNELS) if key not in data]
        if missing:
            raise RecordError(f"the saved record lacks {', '.join(missing)}; save it again")
        command, velocity, torque, position = (data[key] for key in CHANNELS)
        return cls(data["dt"], command, velocity, torque, position, data["name"])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes JSON, all digits, for `gaident.load`; the file appears whole or not at all."""
        write_whole(path, json.dumps({**self.to_dict(), "gaident_version": version()}).encode())

    def __eq__(self, other: object) -> bool:
        """Same sample time, same name, same channels, same values."""
        if not isinstance(other, Record):
            return NotImplemented
        if (self.dt, self.name, len(self)) != (other.dt, other.name, len(other)):
            return False
        mine, yours = dict(self.channels()), dict(other.channels())
        return mine.keys() == yours.keys() and all(np.array_equal(mine[key], yours[key]) for key in mine)

    def __hash__(self) -> int:
        return hash((self.digest, self.name))

    def __repr__(self) -> str:
        label = f"{self.name!r}, " if self.name else ""
        held = ", ".join(f"{key} {values.min() + 0.0:.4g}..{values.max() + 0.0:.4g}" for key, values in self.channels())
        return f"Record({label}{len(self)} samples, dt={self.dt:.6g} s, {self.duration:.4g} s; {held})"

    def _repr_html_(self) -> str:
        html: str = provided("record_html")(self)
        return html

    def __reduce__(self) -> tuple[type[Record], tuple[Any, ...]]:
        # Arrays come out of a pickle writable; through the constructor they are checked and locked again.
        return type(self), tuple(getattr(self, field.name) for field in fields(self))


def _bound(value: object) -> str:
    return "" if value is None else repr(value)
