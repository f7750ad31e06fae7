"""From the columns of a log to a Record: channels, units, sample time, derived velocity."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaident.data.arrays import MINIMUM_SAMPLES, positive_number
from gaident.data.conditioning import differentiate
from gaident.data.record import CHANNELS, Record
from gaident.data.table import Column, Table
from gaident.data.timeaxis import check_given, sample_time
from gaident.data.units import QUANTITIES, Constants, factor, is_any_unit
from gaident.errors import ReadError, RecordError

__all__ = ["Wanted", "assemble"]

_TIME_NAMES = ("time", "t", "Time", "TIME")


@dataclass(frozen=True)
class Wanted:
    """What the user asked of read; see there."""

    columns: Mapping[str, str | int | None] | None
    units: Mapping[str, str | float]
    dt: float | None
    name: str | None
    constants: Constants
    velocity_cutoff_hz: float | None

    def check(self) -> Wanted:
        """Itself, once what can be judged without the file is right; else ReadError or RecordError."""
        for argument, value in (("columns", self.columns), ("units", self.units)):
            if value is not None and not isinstance(value, Mapping):
                raise ReadError(f"{argument}={value!r} is no mapping; give for example {argument}={{'velocity': ...}}")
            _known(argument, value or ())
        self.constants.check()
        for quantity, unit in self.units.items():
            factor(quantity, unit, self.constants)
        if self.dt is not None:
            positive_number(self.dt, "dt", "s", "give the sample time in seconds, for example dt=1e-3")
        if self.name is not None and not isinstance(self.name, str):
            raise ReadError(f"name={self.name!r} is no text; give a str")
        return self


def assemble(table: Table, wanted: Wanted, stem: str) -> Record:
    """The Record that `wanted` describes, from `table`; `stem` names it if the user did not."""
    named = _channels(table, wanted)
    time = _time_column(table, wanted)
    for quantity in wanted.units:
        if quantity not in named and quantity != "time":
            raise ReadError(
                f"{table.path}: units names {quantity!r}, but no such column is read; "
                f"add it to columns={{{quantity!r}: ...}}, or leave its unit out"
            )
    values = {channel: table.numbers(column, channel) for channel, column in named.items()}
    timed = {**values, **({"time": time.values} if time is not None and wanted.dt is None else {})}
    lengths = {channel: len(array) for channel, array in timed.items()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(f"{channel} {length}" for channel, length in lengths.items())
        raise ReadError(f"{table.path}: the columns have unequal lengths ({listed}); name columns of one run")
    count = next(iter(lengths.values()))
    if count < MINIMUM_SAMPLES:
        raise RecordError(
            f"{table.path}: the log has {count} samples, but at least {MINIMUM_SAMPLES} are needed; give a longer log"
        )
    dt = _sample_time(table, wanted, time)
    scaled = {channel: _scale(table, wanted, channel, named[channel], array) for channel, array in values.items()}
    try:
        if "velocity" not in scaled:
            scaled["velocity"] = differentiate(scaled["position"], dt, wanted.velocity_cutoff_hz)
        name = stem if wanted.name is None else wanted.name
        return Record(dt, name=name, **{channel: scaled.get(channel) for channel in CHANNELS})
    except RecordError as error:
        raise RecordError(f"{table.path}: {error}") from None


def _channels(table: Table, wanted: Wanted) -> dict[str, Column]:
    """Channel -> column, complete enough for a Record; time is not among them."""
    if len(table.columns) == 1:
        raise ReadError(
            f"{table.path}: the log holds one column only, {table.columns[0].key!r}, but a record needs "
            "the velocity and a "
            f"command or torque; if other columns were not recognised, give delimiter="
        )
    if wanted.columns is None:
        found = {channel: column for channel in CHANNELS if (column := table.own(channel)) is not None}
    else:
        found = {
            channel: table.find(address, channel)
            for channel, address in wanted.columns.items()
            if address is not None and channel != "time"
        }
    if "velocity" not in found and "position" not in found:
        raise ReadError(_say_missing(table, "velocity", "the velocity (or the position, to derive it from)"))
    if "command" not in found and "torque" not in found:
        raise ReadError(_say_missing(table, "torque", "the command or the torque"))
    if "velocity" in found and wanted.velocity_cutoff_hz is not None:
        raise ReadError(
            f"velocity_cutoff_hz={wanted.velocity_cutoff_hz!r} is for a velocity derived from position, "
            "but the velocity "
            f"is read from {found['velocity'].key!r}; leave one of them out"
        )
    return found


def _say_missing(table: Table, channel: str, what: str) -> str:
    return (
        f"{table.path}: no column is named for {what}; the file holds {table.listing()}; "
        f"say which it is with columns={{{channel!r}: ...}}"
    )


def _time_column(table: Table, wanted: Wanted) -> Column | None:
    """The column named for time; else one that is called so; else None."""
    columns = wanted.columns or {}
    if "time" in columns:
        address = columns["time"]
        return None if address is None else table.find(address, "time")
    for name in _TIME_NAMES:
        column = table.own(name)
        if column is not None:
            return column
    if wanted.dt is None:
        raise ReadError(
            f"{table.path}: dt is not given and no column is called time or t; give dt= [s], or "
            f"columns={{'time': ...}} with one of {table.listing()}"
        )
    return None


def _sample_time(table: Table, wanted: Wanted, time: Column | None) -> float:
    if time is None:
        if wanted.dt is None:
            raise ReadError(f"{table.path}: columns={{'time': None}} ignores the time column; give dt= [s] then")
        return float(wanted.dt)
    explicit = wanted.columns is not None and "time" in wanted.columns
    if wanted.dt is None:
        return sample_time(table, time, _factor(table, wanted, "time", time))
    # A column that only happens to be called time must not stand in the way of a dt, unless it is one.
    if explicit or (time.bad is None and time.values.dtype.kind in "iuf" and np.isfinite(time.values).all()):
        second = _factor(table, wanted, "time", time)
        check_given(table, time, second, wanted.dt)
        if explicit:
            sample_time(table, time, second)
    return float(wanted.dt)


def _scale(table: Table, wanted: Wanted, channel: str, column: Column, values: NDArray[np.float64]) -> NDArray[np.float64]:
    size = _factor(table, wanted, channel, column)
    return values if size == 1.0 else values * size


def _factor(table: Table, wanted: Wanted, quantity: str, column: Column) -> float:
    """Factor to SI: the user's unit before the file's."""
    if quantity in wanted.units:
        return factor(quantity, wanted.units[quantity], wanted.constants)
    if column.unit is None:
        return 1.0
    try:
        return factor(quantity, column.unit, wanted.constants)
    except ReadError as error:
        known = "" if is_any_unit(column.unit) else ", which is not known"
        raise ReadError(
            f"{table.path}: column {column.key!r} says its unit is {column.unit!r}{known}: {error}; "
            f"or give units={{{quantity!r}: ...}}, which counts before the file's"
        ) from None


def _known(argument: str, keys: Iterable[object]) -> None:
    for key in keys:
        if key not in QUANTITIES:
            near = difflib.get_close_matches(str(key), QUANTITIES, n=1)
            guess = f" (did you mean {near[0]!r}?)" if near else ""
            raise ReadError(f"{argument}: {key!r} is no channel{guess}; known are {', '.join(QUANTITIES)}")
