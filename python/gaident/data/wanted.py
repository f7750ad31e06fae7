"""What the user asked of read, and the factor to SI that follows from it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from gaident.arguments import arg
from gaident.checks import one_of, yes_or_no
from gaident.data.column_score import LOAD_QUANTITY
from gaident.data.formats.table import Column, LogTable
from gaident.data.formats.units import QUANTITIES, Constants, factor, is_any_unit
from gaident.data.record import CHANNELS
from gaident.data.signals.arrays import positive_number, sample_time
from gaident.data.signals.decimation import factor_of
from gaident.data.torque_kind import SAMPLE, TORQUE_KINDS, TORQUE_LOGS
from gaident.errors import ReadError

__all__ = ["Wanted", "si_factor", "wanted_of"]


@dataclass(frozen=True)
class Wanted:
    """What the user asked of read; see there."""

    columns: Mapping[str, str | int | None] | None
    units: Mapping[str, str | float]
    dt: float | None
    constants: Constants
    name: str | None = None
    velocity_cutoff_hz: float | None = None
    decimate: int = 1
    resample: float | None = None
    gear_ratio: float | None = None
    load_side: tuple[str, ...] = ()
    measured: bool = True
    torque_is: str | None = None
    torque_log: str = SAMPLE
    shift: Mapping[str, int] = field(default_factory=dict)

    def check(self) -> Wanted:
        """Itself, once what can be judged without the file is right; else ReadError or RecordError."""
        for argument, value in (("columns", self.columns), ("units", self.units)):
            if value is not None and not isinstance(value, Mapping):
                raise ReadError(
                    f"{arg(argument, repr(value))} is no mapping; give for example {arg(argument, '...', 'velocity')}"
                )
            _known(argument, value or ())
        yes_or_no(self.measured, "measured", ReadError)
        self.constants.check()
        for quantity, unit in self.units.items():
            factor(quantity, unit, self.constants)
        if self.dt is not None:
            sample_time(self.dt)
        factor_of(self.decimate)
        if self.resample is not None:
            sample_time(self.resample, "give the sample time of the even axis in seconds", "resample")
            if self.dt is not None:
                raise ReadError("dt and resample are both given; resample takes the log's time stamps, leave dt out")
        self._check_gear()
        if self.torque_is is not None:
            one_of(self.torque_is, "torque_is", TORQUE_KINDS, ReadError)
        one_of(self.torque_log, "torque_log", TORQUE_LOGS, ReadError)
        self._check_shift()
        if self.name is not None and not isinstance(self.name, str):
            raise ReadError(f"name={self.name!r} is no text; give a str")
        return self

    def _check_shift(self) -> None:
        if not isinstance(self.shift, Mapping):
            raise ReadError(f"shift={self.shift!r} is no mapping; give for example {arg('shift', '-1', 'torque')}")
        if self.shift and (factor_of(self.decimate) > 1 or self.resample is not None):
            raise ReadError(
                "shift counts the log's own samples, which decimate and resample do away with: read the log without them, then "
                "use rec.shifted(...).decimate(...)"
            )

    def _check_gear(self) -> None:
        for channel in self.load_side:
            if channel not in CHANNELS:
                raise ReadError(f"load_side: {channel!r} is no channel; known are {', '.join(CHANNELS)}")
            if channel in LOAD_QUANTITY:
                raise ReadError(
                    f"load_side names {channel!r}, whose scale is estimated and needs no gear ratio: leave it out there, or read "
                    f"the column as {LOAD_QUANTITY[channel]!r} where it stands for the motor's own"
                )
        if self.gear_ratio is not None:
            positive_number(self.gear_ratio, "gear_ratio", "", "give the turns of the motor per turn of the load")
        if bool(self.load_side) != (self.gear_ratio is not None):
            given, lacking = ("load_side", "gear_ratio") if self.load_side else ("gear_ratio", "load_side")
            raise ReadError(
                f"{given} is given without {lacking}: give both or none, {arg('gear_ratio', '...')} the turns of the motor "
                "per turn of "
                f"the load, {arg('load_side', '...')} the channels that were measured behind the gear"
            )


def _named(channels: object) -> tuple[str, ...]:
    """The channels that `load_side` names. Raises ReadError for what names none."""
    named = (channels,) if isinstance(channels, str) else tuple(channels) if isinstance(channels, Iterable) else (channels,)
    for channel in named:
        if not isinstance(channel, str):
            raise ReadError(f"load_side is {channels!r:.80}: give the name of a channel, or a list of names")
    return named


def wanted_of(
    columns: Mapping[str, str | int | None] | None = None,
    units: Mapping[str, str | float] | None = None,
    dt: float | None = None,
    *,
    load_side: str | Sequence[str] = (),
    shift: Mapping[str, int] | None = None,
    **more: Any,
) -> Wanted:
    """The arguments of `read` that say what a record is made of, checked. Raises ReadError or RecordError."""
    constants = {f.name: more.pop(f.name) for f in fields(Constants) if f.name in more}
    return Wanted(
        columns=columns,
        units={} if units is None else units,
        dt=dt,
        constants=Constants(**constants),
        load_side=_named(load_side),
        shift={} if shift is None else shift,
        **more,
    ).check()


def si_factor(table: LogTable, wanted: Wanted, quantity: str, column: Column) -> float:
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
            f"{table.path}: column {column.key!r} says its unit is {column.unit!r}{known}: {error.marked}; "
            f"or give {arg('units', '...', quantity)}, which counts before the file's"
        ) from None


def _known(argument: str, keys: Iterable[object]) -> None:
    for key in keys:
        if key not in QUANTITIES:
            near = difflib.get_close_matches(str(key), QUANTITIES, n=1)
            guess = f" (did you mean {near[0]!r}?)" if near else ""
            raise ReadError(f"{argument}: {key!r} is no channel{guess}; known are {', '.join(QUANTITIES)}")
