"""Reader for MDF (ASAM, version 3 and 4) through its library, which reads what was stored and converts nothing."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.foreign.conversions import Conversion, conversion_of
from gaident.data.formats.stored import channel_table, check_unpacked, library, unique_keys
from gaident.data.formats.table import Column, LogTable, Stored, first_line
from gaident.errors import ReadError

__all__ = ["open_mdf"]

_PIECE = 1 << 22  # no decision: memory; values that are read at once: for fewer, the library reads the whole channel too
_OLD = 4  # no decision: a format: the version before which the blocks of an MDF have their first form
_BYTES_OF_VALUE = 8  # no decision: a unit: bytes of a float64


def open_mdf(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Channels of an MDF file of version 3 or 4, each with the master of its group as clock; read when asked for.

    What was stored becomes values by linear and rational conversions and by tables, which are applied here.
    A channel whose conversion is a formula is none: a formula can run code where a library evaluates it.
    A value that the file marks as invalid is NaN.
    A file that was cut short is refused, and one whose channels lie outside their records, which asammdf would read all the
    same and end the process.
    """
    asammdf = library("asammdf", "mdf", path, "an MDF measurement")
    try:
        mdf = stack.enter_context(asammdf.MDF(file, process_bus_logging=False))
        columns, others = _Channels(path, mdf, file.stat().st_size).columns()
    except (ReadError, MemoryError):
        raise
    except Exception as error:  # asammdf raises its own and whatever a damaged file leads it into
        raise ReadError(f"{path}: not a whole MDF file ({first_line(error)}); copy it again, or export a CSV") from None
    return channel_table(path, columns, others, "MDF")


class _Channels:
    """The channels of an open file, whose conversions are taken out of it before anything is read."""

    def __init__(self, path: str, mdf: Any, size: int) -> None:
        self.path, self.mdf, self.bytes = path, mdf, size
        self.conversions: dict[tuple[int, int], Conversion] = {}
        self.units: dict[tuple[int, int], str | None] = {}
        version = int(str(mdf.version).split(".")[0])
        for g, group in enumerate(mdf.groups):
            for c, channel in enumerate(group.channels):
                block = channel.conversion
                # In version 3 the time of samples that are only counted is made by the library, of their rate.
                counted = version < _OLD and not channel.bit_count and mdf.masters_db.get(g) == c
                self.conversions[g, c] = Conversion() if counted else conversion_of(block, version)
                unit = getattr(block, "unit", None) or getattr(channel, "unit", None)
                self.units[g, c] = str(unit).strip() or None if unit else None
                channel.conversion = None

    def columns(self) -> tuple[list[Column], list[str]]:
        """The channels that are numbers, and what the file contains besides."""
        found = [
            (g, c, channel.name, int(group.channel_group.cycles_nr), self.mdf.masters_db.get(g))
            for g, group in enumerate(self.mdf.groups)
            for c, channel in enumerate(group.channels)
        ]
        keys = unique_keys([name for _, _, name, _, _ in found])
        at = {(g, c): key for (g, c, *_), key in zip(found, keys, strict=True)}
        columns: list[Column] = []
        others: list[str] = []
        for g, c, name, count, master in found:
            flaw = "empty" if count == 0 else self._flaw(g, c, name, count)
            if flaw:
                others.append(f"{name!r} ({flaw})")
                continue
            clock = None if master is None or master == c or self.conversions[g, master].flaw else at[(g, master)]
            if clock is None and master is not None and master != c:
                others.append(f"{name!r} (its time has {self.conversions[g, master].flaw})")
                continue
            stored = Stored(self.path, count, np.dtype(np.float64), _reader(self.mdf, g, c, self.conversions[g, c], master == c))
            unit = "s" if master == c else self.units[g, c]
            columns.append(Column(at[(g, c)], stored, () if at[(g, c)] == name else (name,), unit, clock=clock))
        return columns, others

    def _flaw(self, g: int, c: int, name: str, count: int) -> str:
        """Why a channel is no column of numbers; "" where it is one."""
        if _outside(self.mdf.groups[g].channel_group, self.mdf.groups[g].channels[c]):
            raise ValueError(f"channel {name!r} lies outside its record")
        if self.conversions[g, c].flaw:
            return self.conversions[g, c].flaw
        check_unpacked(self.path, _BYTES_OF_VALUE * count, self.bytes)
        sample = self.mdf.get(group=g, index=c, record_count=1, ignore_invalidation_bits=True)
        if sample.samples.ndim != 1 or sample.samples.dtype.kind not in "iufb":
            return "text" if sample.samples.dtype.kind in "SU" else str(sample.samples.dtype)
        return ""


def _outside(group: Any, channel: Any) -> bool:
    """Whether the bits of a channel lie outside the record of its group, in MDF of version 3 or 4."""
    size = 8 * int(group.samples_byte_nr)  # no decision: a unit: bits of a byte
    if hasattr(channel, "start_offset"):
        # no decision: a unit: bits of a byte
        return 8 * int(channel.additional_byte_offset) + int(channel.start_offset) + int(channel.bit_count) > size
    in_record = channel.channel_type in (0, 2)  # values of fixed length, master; others are computed, or stand elsewhere
    # no decision: a unit: bits of a byte
    return in_record and 8 * int(channel.byte_offset) + int(channel.bit_offset) + int(channel.bit_count) > size


def _reader(mdf: Any, group: int, index: int, conversion: Conversion, is_master: bool) -> Any:
    """What reads rows of a channel; the piece that was read last is kept."""
    kept: dict[int, NDArray[np.float64]] = {}

    def piece(number: int) -> NDArray[np.float64]:
        if number not in kept:
            kept.clear()
            # Not ignored, the library leaves them out, and the values behind move up.
            signal = mdf.get(
                group=group, index=index, record_offset=number * _PIECE, record_count=_PIECE, ignore_invalidation_bits=True
            )
            values = np.asarray(signal.timestamps if is_master else signal.samples)
            values = values.astype(np.float64) if conversion.apply is None else conversion.apply(values)
            invalid = getattr(signal, "invalidation_bits", None)
            if not is_master and invalid is not None and len(invalid) == len(values):
                values = np.where(np.asarray(invalid, dtype=bool), np.nan, values)
            kept[number] = values
        return kept[number]

    def rows(start: int, stop: int) -> NDArray[Any]:
        first, last = start // _PIECE, max(start, stop - 1) // _PIECE
        parts = [piece(k)[max(0, start - k * _PIECE) : stop - k * _PIECE] for k in range(first, last + 1)]
        return np.concatenate(parts) if len(parts) > 1 else parts[0]

    return rows
