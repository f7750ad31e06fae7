"""From the columns of a log to a Record: channels, units, sample time, derived velocity."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import NO_TIME, arg
from gaident.axis import Text, say
from gaident.data.clock import axis_of, clock_of, common_clock, part_of, second_of
from gaident.data.column_score import spoken_for
from gaident.data.counters import Counters
from gaident.data.formats.table import Column, LogTable
from gaident.data.record import CHANNELS, Record
from gaident.data.record_checks import is_held
from gaident.data.signals.arrays import MINIMUM_SAMPLES
from gaident.data.signals.conditioning import differentiate, low_pass
from gaident.data.signals.decimation import Decimator, decimated, factor_of
from gaident.data.signals.difference import backward_difference
from gaident.data.signals.resampling import interpolated, resampled
from gaident.data.timeaxis import SLOW_STEP, TimeAxis, even_step
from gaident.data.torque_kind import COMMANDED, HELD, MEAN, MEASURED, SMOOTH, kind_of_torque
from gaident.data.wanted import Wanted, si_factor
from gaident.data.winding_torque import ELECTRICAL, torque_of_winding
from gaident.errors import ReadError, RecordError
from gaident.policy.table import POLICY

__all__ = ["assemble", "channels_of"]

SAID = 3  # no decision: printed: columns that a sentence names
AS_THE_DRIVE = (
    "Neither velocity nor torque is logged: the velocity is the difference of the last two positions, as a drive forms it of its "
    "encoder, and the torque is what the given controller makes of it. What the drive's controller has beside that (filters, "
    "feedforward, other gains, a clock faster than the log) shows only in what the model misses."
)


def assemble(table: LogTable, wanted: Wanted, stem: str) -> Record:
    """The Record that `wanted` describes, from `table`; `stem` names it if the user did not.

    The rows come block by block, so that a log longer than memory can be decimated on its way in.
    """
    named = channels_of(table, wanted)
    for quantity in wanted.units:
        if quantity not in named and quantity != "time":
            raise ReadError(
                f"{table.path}: units names {quantity!r}, but no such column is read; "
                f"add it to {arg('columns', '...', quantity)}, or leave its unit out"
            )
    for channel in wanted.load_side:
        if channel not in named:
            raise ReadError(f"{table.path}: load_side names {channel!r}, but no such column is read; leave it out there")
    scales = {channel: _scale(table, wanted, channel, column) for channel, column in named.items()}
    kind = _torque_kind(table, wanted, named.get("torque")) if ELECTRICAL.isdisjoint(named) else ""
    counters = Counters(table, wanted, named)
    said: list[str] = [*_unnamed_torque(table, wanted, named), *_known_by_name(kind, wanted)]
    held = {"torque": wanted.torque_log == HELD} if is_held(kind, wanted.torque_log) else {}
    if wanted.resample is not None:
        dt, values, more = _on_even_axis(table, wanted, named, scales, counters, held)
        said += more
    else:
        dt, values = _block_by_block(table, wanted, named, scales, counters, held)
    said += [*_slow_clock(table, wanted, named, dt), *_held_long(kind, wanted, named, dt)]
    said += dict.fromkeys(column.note for column in named.values() if column.note)
    try:
        if "velocity" not in values and "position" not in values:
            values["velocity"] = np.zeros(len(next(iter(values.values()))))
        elif "velocity" not in values:
            if wanted.velocity_cutoff_hz is not None:  # all channels alike: filtered alone, a velocity is that of another plant
                values = {channel: low_pass(x, dt, wanted.velocity_cutoff_hz) for channel, x in values.items()}
                said.append(f"All channels went through the same zero-phase low-pass of {wanted.velocity_cutoff_hz:g} Hz.")
            if _placed_alone(values) and wanted.velocity_cutoff_hz is None:
                values["velocity"] = backward_difference(values["position"], dt)
                said.append(AS_THE_DRIVE)
            else:
                values["velocity"] = differentiate(values["position"], dt)
        made = ""
        if not ELECTRICAL.isdisjoint(named):
            values["torque"], kind, made, note = torque_of_winding(table, wanted, values, dt)
            said += [note] if note else []
        name = stem if wanted.name is None else wanted.name
        notes = (*counters.notes(), *said)
        channels: dict[str, Any] = {channel: values.get(channel) for channel in CHANNELS}
        line = _line_of(table, wanted, values, named)
        rec = Record(dt, name=name, torque_is=kind, torque_log=made or line, notes=notes, **channels)
        return rec.shifted(**wanted.shift) if wanted.shift else rec
    except RecordError as error:
        raise RecordError(f"{table.path}: {error.marked}") from None


def _placed_alone(values: Mapping[str, NDArray[np.float64]]) -> bool:
    """Whether the channels are a position, its command, and nothing of what a velocity controller reads or makes."""
    return (
        "position_command" in values and not {"velocity", "command", "torque"} & values.keys() and not ELECTRICAL & values.keys()
    )


def _torque_kind(table: LogTable, wanted: Wanted, column: Column | None) -> str:
    """What the torque is: as the user says, else as its column's name does."""
    if wanted.torque_is is None:
        return COMMANDED if column is None else kind_of_torque((column.key, *column.names)) or COMMANDED
    if column is None:
        raise ReadError(
            f"{table.path}: {arg('torque_is', repr(wanted.torque_is))} speaks of the torque, but no such column is read; name it "
            f"with {arg('columns', '...', 'torque')}, or leave torque_is out"
        )
    return wanted.torque_is


def _line_of(table: LogTable, wanted: Wanted, values: Mapping[str, NDArray[np.float64]], named: Mapping[str, Column]) -> str:
    """What a line contains of the torque that is read.

    Raises ReadError for a mean where there is none, or where what is read is none.
    """
    if wanted.torque_log == MEAN and "torque" not in values:
        raise ReadError(
            f"{table.path}: {arg('torque_log', repr(MEAN))} speaks of the torque, but no such column is read; name it with "
            f"{arg('columns', '...', 'torque')}, or leave torque_log out"
        )
    if wanted.torque_log == MEAN and (wanted.decimate > 1 or wanted.resample is not None):
        raise ReadError(
            f"{table.path}: {arg('torque_log', repr(MEAN))} cannot be read with decimate or resample, which leave no means: "
            "leave these out (in Python, decimate the record afterwards)"
        )
    if wanted.torque_log == MEAN and "voltage" in named:
        raise ReadError(
            f"{table.path}: {arg('torque_log', repr(MEAN))} speaks of a logged torque, and this one is worked out of a voltage: "
            "leave torque_log out"
        )
    return SMOOTH if wanted.decimate > 1 and "torque" in values else wanted.torque_log


def _known_by_name(kind: str, wanted: Wanted) -> list[Text]:
    """What to say of a torque that is measured by its column's name alone; kind: what it is taken for."""
    if kind != MEASURED or wanted.torque_is is not None:
        return []
    text = (
        "The {torque} is taken as measured, as the name of its column says; where it is the controller's command, give "
        "torque_is='commanded' (--torque-is commanded)."
    )
    return [say(text)]


def _held_long(kind: str, wanted: Wanted, named: Mapping[str, Column], dt: float) -> list[Text]:
    """What to say of a torque that counts as commanded and would be held for longer than any controller does."""
    column = named.get("torque")
    if column is None or wanted.torque_is is not None or kind_of_torque((column.key, *column.names)) is not None:
        return []
    held = dt / factor_of(wanted.decimate)
    if kind != COMMANDED or not held > POLICY.longest_hold:
        return []
    text = (
        "The {torque} counts as commanded, held for {:g} ms from each line on, and few drives hold it that long: give "
        "torque_is='measured' (--torque-is measured) where it was sampled, 'commanded' where it was held."
    )
    return [say(text, 1e3 * held)]


def _unnamed_torque(table: LogTable, wanted: Wanted, named: dict[str, Column]) -> list[str]:
    """What to say of columns that may be the torque where none is read; nothing where the user says that there is none."""
    if "torque" in named or not ELECTRICAL.isdisjoint(named) or "torque" in (wanted.columns or {}):
        return []
    used = {column.key for column in named.values()}
    free = [column for column in table.columns if column.key not in used]
    found = [
        min((column.key, *column.names), key=len)
        for column in free
        if spoken_for((column.key, *column.names), column.unit, "torque")[0] >= POLICY.words_needed
    ]
    if not found:
        return []
    which = " or ".join(repr(key) for key in found[:SAID])
    return [
        f"No torque is read, but by its name {which} may be it: give columns={{'torque': {found[0]!r}}} "
        f"(--columns {shlex.quote(f'torque={found[0]}')}). A logged torque shows what the controller does."
    ]


def _slow_clock(table: LogTable, wanted: Wanted, named: dict[str, Column], dt: float) -> list[str]:
    """What to say of a time column without a unit whose steps, taken as seconds, are long ones: it may count milliseconds."""
    if wanted.dt is not None or wanted.resample is not None or "time" in wanted.units:
        return []
    time = common_clock(table, wanted, named)
    if time is None or time.unit is not None or dt / factor_of(wanted.decimate) < SLOW_STEP:
        return []
    return [
        f"The time column {time.key!r} says no unit, and s was taken: a sample time of {dt:g} s. Where it counts milliseconds, "
        "give units={'time': 'ms'} (--units time=ms)."
    ]


_Values = dict[str, NDArray[np.float64]]


def _block_by_block(
    table: LogTable,
    wanted: Wanted,
    named: dict[str, Column],
    scales: dict[str, float],
    counters: Counters,
    held: Mapping[str, bool],
) -> tuple[float, _Values]:
    """(dt [s], channel -> values in SI) of a log with one even time axis; held: see `resampled`."""
    time = common_clock(table, wanted, named)
    keys = {channel: column for channel, column in named.items() if column is not time}
    columns = [*keys.values(), *([] if time is None else [time])]
    if table.batches is None:
        lengths = {channel: len(column.values) for channel, column in keys.items()}
        if time is not None and wanted.dt is None:
            lengths["time"] = len(time.values)
        if len(set(lengths.values())) > 1:
            listed = ", ".join(f"{channel} {length}" for channel, length in lengths.items())
            raise ReadError(
                f"{table.path}: the columns have unequal lengths ({listed}); name columns of one run, or, where they "
                f"were logged at several rates, put them on one axis with {arg('resample')} [s]"
            )
    factor = factor_of(wanted.decimate)
    decimators = {channel: Decimator(factor, channel in held) for channel in named}
    axis: TimeAxis | None = None
    count = 0
    for block in table.blocks(list({column.key: column for column in columns}.values())):
        channels = {ch: counters.passed(block, ch, block.numbers(part_of(block, c), ch)) for ch, c in named.items()}
        count += len(next(iter(channels.values())))
        if axis is None:
            axis = axis_of(block, wanted, time)
        if axis is not None and time is not None:
            axis.push(block, block.numbers(part_of(block, time), "time"))
        for channel, values in channels.items():
            decimators[channel].push(values if scales[channel] == 1.0 else values * scales[channel])
    if count < MINIMUM_SAMPLES:
        raise RecordError(
            f"{table.path}: the log has {count} samples, but at least {MINIMUM_SAMPLES} are needed; give a longer log"
        )
    dt = float(wanted.dt) if wanted.dt is not None else _stated(table, named) if axis is None else axis.sample_time(table)
    return dt * factor, {channel: decimator.finish() for channel, decimator in decimators.items()}


def _stated(table: LogTable, named: Mapping[str, Column]) -> float:
    """The sample time that the file states for these columns [s]."""
    periods = [column.period for column in named.values() if column.period is not None]
    if not periods:
        raise ReadError(f"{table.path}: {NO_TIME} ignores the time column; give {arg('dt')} [s] then")
    return periods[0]


def _on_even_axis(
    table: LogTable,
    wanted: Wanted,
    named: dict[str, Column],
    scales: dict[str, float],
    counters: Counters,
    held: Mapping[str, bool],
) -> tuple[float, _Values, list[Text]]:
    """(dt [s], channel -> values in SI, a note), each channel interpolated from time stamps of its own; held: see `resampled`."""
    assert wanted.resample is not None
    clocks = {channel: clock_of(table, wanted, column) for channel, column in named.items()}
    parts: dict[str, list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = {channel: [] for channel in named}
    for channel, column in named.items():
        clock, first = clocks[channel], 0
        for block in table.blocks([column] if clock is None else [column, clock]):
            values = counters.passed(block, channel, part_of(block, column).whole().astype(np.float64, copy=False))
            if clock is None:
                stamps = (first + np.arange(len(values))) * float(column.period or 0.0)
            else:
                stamps = part_of(block, clock).whole() * second_of(block, wanted, clock)
            parts[channel].append((np.asarray(stamps, dtype=np.float64), values * scales[channel]))
            first += len(values)
    whole = {channel: (np.concatenate([t for t, _ in p]), np.concatenate([x for _, x in p])) for channel, p in parts.items()}
    dt = float(wanted.resample)
    even = resampled(table.path, whole, dt, held)
    factor = factor_of(wanted.decimate)
    if factor > 1:
        even = {channel: decimated(x, factor, channel in held) for channel, x in even.items()}
    return dt * factor, even, interpolated(*min(even_step(np.diff(t)) for t, _ in whole.values()), dt)


def channels_of(table: LogTable, wanted: Wanted) -> dict[str, Column]:
    """Channel -> column, complete enough for a Record; time is not among them."""
    if len(table.columns) == 1 and wanted.measured:
        hint = "" if table.form == "DataFrame" else f"; if other columns were not recognised, give {arg('delimiter')}"
        raise ReadError(
            f"{table.path}: the log contains one column only, {table.columns[0].key!r}, but a record needs "
            f"the velocity and a command or torque{hint}"
        )
    if wanted.columns is None:
        found = {channel: column for channel in CHANNELS if (column := table.own(channel)) is not None}
    else:
        found = {
            channel: table.find(address, channel)
            for channel, address in wanted.columns.items()
            if address is not None and channel != "time"
        }
    if wanted.measured and "velocity" not in found and "position" not in found:
        raise ReadError(_say_missing(table, wanted, "velocity", "the velocity (or the position, to derive it from)"))
    if found.keys().isdisjoint(("command", "torque", "position_command", *ELECTRICAL)):
        raise ReadError(_say_missing(table, wanted, "torque", "the command or the torque"))
    if "velocity" in found and wanted.velocity_cutoff_hz is not None:
        raise ReadError(
            f"{arg('velocity_cutoff_hz', repr(wanted.velocity_cutoff_hz))} is for a velocity derived from position, "
            "but the velocity "
            f"is read from {found['velocity'].key!r}; leave one of them out"
        )
    return found


def _say_missing(table: LogTable, wanted: Wanted, channel: str, what: str) -> str:
    guess = ", or let gaident init write down what the log shows" if wanted.columns is None and table.form != "DataFrame" else ""
    return (
        f"{table.path}: no column is named for {what}; {table.said()}; "
        f"say which it is with {arg('columns', '...', channel)}{guess}"
    )


def _scale(table: LogTable, wanted: Wanted, channel: str, column: Column) -> float:
    """Factor to SI at the motor: the unit's, and the gear's where the channel was measured behind it."""
    size = si_factor(table, wanted, channel, column)
    if channel not in wanted.load_side:
        return size
    assert wanted.gear_ratio is not None
    return size / wanted.gear_ratio if channel == "torque" else size * wanted.gear_ratio
