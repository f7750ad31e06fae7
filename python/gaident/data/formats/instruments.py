"""Readers for the files of data loggers: TDMS (National Instruments) and MDF (ASAM), through their own libraries."""

from __future__ import annotations

import gc
import io
import math
import sys
import traceback
from collections import Counter
from contextlib import ExitStack, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import library, midnight, seconds_since, unique_keys
from gaident.data.formats.table import Column, LogTable, Stored, first_line
from gaident.errors import ReadError

__all__ = ["open_mdf", "open_tdms"]


def open_tdms(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Channels of a TDMS file, by name (by `group/channel` where several groups have one); read when asked for.

    The waveform properties wf_increment (sample time) and unit_string are taken over.
    """
    nptdms = library("nptdms", "tdms", path, "a TDMS file")
    try:
        opened = stack.enter_context(nptdms.TdmsFile.open(file))
        channels = [channel for group in opened.groups() for channel in group.channels()]
        names = [channel.name for channel in channels]
        times, columns, others = Counter(names), [], []
        for channel in channels:
            long = f"{channel.group_name}/{channel.name}"
            key = channel.name if times[channel.name] == 1 else long
            if channel.dtype is None or np.dtype(channel.dtype).kind not in "iufbM" or len(channel) == 0:
                others.append(f"{key!r} ({'empty' if len(channel) == 0 else channel.dtype})")
                continue
            columns.append(_tdms_column(path, channel, key, long))
    except Exception as error:  # whatever a damaged file leads nptdms into
        raise ReadError(f"{path}: not a whole TDMS file ({first_line(error)}); copy it again, or export a CSV") from None
    return _table(path, columns, others, "TDMS")


def _tdms_column(path: str, channel: Any, key: str, long: str) -> Column:
    increment = channel.properties.get("wf_increment")
    period = float(increment) if isinstance(increment, (int, float)) and increment > 0 and math.isfinite(increment) else None
    unit = channel.properties.get("unit_string") or channel.properties.get("NI_UnitDescription") or None
    dtype = np.dtype(channel.dtype)
    stamps = dtype.kind == "M"
    origin = midnight(np.asarray(channel[0:1])) if stamps else None

    def rows(start: int, stop: int) -> NDArray[Any]:
        values = np.asarray(channel[start:stop])
        return seconds_since(origin, values) if stamps else values

    names = tuple({channel.name, long} - {key})
    stored = Stored(path, len(channel), np.dtype(np.float64) if stamps else dtype, rows)
    return Column(key, stored, names, "s" if stamps else unit, period=period)


def open_mdf(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Channels of an MDF file of version 3 or 4, each with the master of its group as clock; read when asked for.

    A file that was cut short is refused, and one whose channels lie outside their records, which asammdf would read all the
    same and end the process.
    """
    asammdf = library("asammdf", "mdf", path, "an MDF measurement")
    flaw = ""
    try:
        with redirect_stdout(io.StringIO()):  # asammdf prints what it finds damaged
            columns, others = _mdf_columns(path, stack.enter_context(asammdf.MDF(file)))
    except Exception as error:  # asammdf raises its own and whatever a damaged file leads it into
        flaw = first_line(error)
        _forget(error)
    if flaw:
        raise ReadError(f"{path}: not a whole MDF file ({flaw}); copy it again, or export a CSV")
    return _table(path, columns, others, "MDF")


def _forget(error: Exception) -> None:
    """Lets a half opened file go in silence: it would print a traceback of its own when it is collected."""
    hook = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        traceback.clear_frames(error.__traceback__)
        error.__traceback__ = None
        gc.collect()
    finally:
        sys.unraisablehook = hook


def _mdf_columns(path: str, mdf: Any) -> tuple[list[Column], list[str]]:
    found = [
        (g, c, channel.name, int(group.channel_group.cycles_nr), mdf.masters_db.get(g))
        for g, group in enumerate(mdf.groups)
        for c, channel in enumerate(group.channels)
    ]
    keys = unique_keys([name for _, _, name, _, _ in found])
    at = {(g, c): key for (g, c, *_), key in zip(found, keys, strict=True)}
    columns, others = [], []
    for g, c, name, count, master in found:
        if count == 0:
            others.append(f"{name!r} (empty)")
            continue
        if _outside(mdf.groups[g].channel_group, mdf.groups[g].channels[c]):
            raise ValueError(f"channel {name!r} lies outside its record")
        sample = mdf.get(group=g, index=c, record_count=1)
        if sample.samples.ndim != 1 or sample.samples.dtype.kind not in "iufb":
            others.append(f"{name!r} ({'text' if sample.samples.dtype.kind in 'SU' else sample.samples.dtype})")
            continue
        clock = None if master is None or master == c else at[(g, master)]
        stored = Stored(path, count, sample.samples.dtype, _mdf_reader(mdf, g, c, is_master=master == c))
        unit = "s" if master == c else sample.unit or None
        columns.append(Column(at[(g, c)], stored, () if at[(g, c)] == name else (name,), unit, clock=clock))
    return columns, others


def _outside(group: Any, channel: Any) -> bool:
    """Whether the bits of a channel lie outside the record of its group, in MDF of version 3 or 4."""
    size = 8 * int(group.samples_byte_nr)  # no decision: a unit: bits of a byte
    if hasattr(channel, "start_offset"):
        # no decision: a unit: bits of a byte
        return 8 * int(channel.additional_byte_offset) + int(channel.start_offset) + int(channel.bit_count) > size
    in_record = channel.channel_type in (0, 2)  # values of fixed length, master; others are computed, or stand elsewhere
    # no decision: a unit: bits of a byte
    return in_record and 8 * int(channel.byte_offset) + int(channel.bit_offset) + int(channel.bit_count) > size


def _mdf_reader(mdf: Any, group: int, index: int, is_master: bool) -> Any:
    def rows(start: int, stop: int) -> NDArray[Any]:
        with redirect_stdout(io.StringIO()):
            signal = mdf.get(group=group, index=index, record_offset=start, record_count=stop - start)
        return np.asarray(signal.timestamps if is_master else signal.samples)

    return rows


def _table(path: str, columns: list[Column], others: list[str], form: str) -> LogTable:
    if not columns:
        rest = f" (only {', '.join(others)})" if others else ""
        raise ReadError(f"{path}: the file contains no channels of numbers{rest}; give a log with measured channels")
    return LogTable(path, tuple(columns), others=tuple(others), form=form)
