"""Reader for TDMS, the files of LabVIEW (National Instruments), through a library of its own."""

from __future__ import annotations

import math
from collections import Counter
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import channel_table, check_unpacked, library, midnight, seconds_since
from gaident.data.formats.table import Column, LogTable, Stored, first_line
from gaident.errors import ReadError

__all__ = ["open_tdms"]


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
            check_unpacked(path, np.dtype(channel.dtype).itemsize * len(channel), file.stat().st_size)
            columns.append(_tdms_column(path, channel, key, long))
    except (ReadError, MemoryError):
        raise
    except Exception as error:  # whatever a damaged file leads nptdms into
        raise ReadError(f"{path}: not a whole TDMS file ({first_line(error)}); copy it again, or export a CSV") from None
    return channel_table(path, columns, others, "TDMS")


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
