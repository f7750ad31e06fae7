"""A part of a log, and the parts around its gaps: each a record of its own."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.checks import real_number, yes_or_no
from gaident.data.assemble import assemble, channels_of
from gaident.data.clock import clock_of, common_clock, second_of
from gaident.data.formats.delimited import TextOptions
from gaident.data.formats.frames import is_frame
from gaident.data.formats.table import Column, LogTable
from gaident.data.readers import open_log
from gaident.data.record import Record
from gaident.data.signals.arrays import MINIMUM_SAMPLES
from gaident.data.signals.decimation import factor_of
from gaident.data.wanted import Wanted, wanted_of
from gaident.errors import ReadError
from gaident.policy.table import POLICY

__all__ = ["read_pieces"]

Vector = NDArray[np.float64]
Span = tuple[float, float]


def read_pieces(
    path: str | os.PathLike[str] | Any,
    columns: Mapping[str, str | int | None] | None = None,
    units: Mapping[str, str | float] | None = None,
    dt: float | None = None,
    *,
    start: float | None = None,
    stop: float | None = None,
    pieces: bool = True,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
    **more: Any,
) -> list[Record]:
    """Read a part of a log, and what lies around its gaps as records of their own.

    A gap is a step of the time that is longer than five of the usual ones.
    Nothing is made up for it: each piece has an initial state of its own, and `identify` and `diagnose` take the list.
    The columns that are read are kept in memory.

    Parameters
    ----------
    path, columns, units, dt : optional
        As `read` takes them.
    start, stop : float, optional
        First and last time [s], counted from the log's first line; None: from its beginning, to its end.
    pieces : bool
        False: one record, and a gap in it is refused as `read` does.
    delimiter, decimal, skip, encoding : optional
        Of a text table, as `read` takes them.
    **more : Any
        Further arguments of `read`: rated_torque, resample, ...

    Returns
    -------
    list of Record
        In the order of the log.
        Pieces of fewer than 20 samples, resampled and decimated as asked, are left out,
        and the first record's notes say how many.

    Raises
    ------
    ReadError, RecordError
        As `read`, and where nothing is left between start and stop.

    Examples
    --------
    >>> import gaident as ga
    >>> with open("run1.csv", "w") as log:
    ...     print("t [ms];w_ref [rpm];w [rpm]", file=log)
    ...     for i in [*range(30), *range(100, 140)]:
    ...         print(f"{i};{60 + i};{i}", file=log)
    >>> named = {"command": "w_ref", "velocity": "w"}
    >>> [(rec.name, len(rec)) for rec in ga.read_pieces("run1.csv", named)]
    [('run1 1', 30), ('run1 2', 40)]
    >>> [len(rec) for rec in ga.read_pieces("run1.csv", named, start=0.11)]
    [30]
    """
    wanted = wanted_of(columns, units, dt, **more)
    low, high = _bounds(start, stop)
    yes_or_no(pieces, "pieces", ReadError)
    with open_log(path, TextOptions(delimiter, decimal, skip, encoding)) as table:
        stem = "" if is_frame(path) else Path(path).stem
        named = channels_of(table, wanted)
        clocks = _clocks(table, wanted, named)
        used = {c.key: c for c in (*named.values(), *(c for c in clocks.values() if c is not None))}
        whole = {key: _whole(table, column) for key, column in used.items()}
        stamps = {key: _stamps(table, wanted, whole, clocks[channel], key) for channel, key in _keys(named).items()}
        origin = min(float(t[0]) for t in stamps.values() if len(t))
        spans = _spans(list(stamps.values()), (origin + low, origin + high), pieces)
        parts = [_part(table, whole, stamps, clocks, named, span, wanted) for span in spans]
        kept = [part for part in parts if part is not None]
        if not kept:
            asked = f"{low:g} to {high:g} s" if start is not None or stop is not None else "the log"
            raise ReadError(
                f"{table.path}: no piece of {MINIMUM_SAMPLES} samples without a gap lies in {asked}; take more of it, or put it "
                f"on an even axis with {arg('resample')} [s]"
            )
        several = len(spans) > 1
        found = [
            assemble(part, replace(wanted, name=_name(wanted, k) if several else wanted.name), f"{stem} {k}" if several else stem)
            for k, part in enumerate(kept, 1)
        ]
    short = len(parts) - len(kept)
    if short:
        note = f"{short} {'piece' if short == 1 else 'pieces'} of the log of fewer than {MINIMUM_SAMPLES} samples left out."
        first = found[0]
        channels: dict[str, Any] = dict(first.channels())
        kind, line = first.torque_is, first.torque_log
        found[0] = Record(first.dt, name=first.name, torque_is=kind, torque_log=line, notes=(*first.notes, note), **channels)
    return found


def _bounds(start: float | None, stop: float | None) -> Span:
    low = 0.0 if start is None else real_number(start, "start", ReadError, "give seconds from the log's first line")
    high = np.inf if stop is None else real_number(stop, "stop", ReadError, "give seconds from the log's first line")
    if not low < high:
        raise ReadError(f"{arg('start', f'{low:g}')} and {arg('stop', f'{high:g}')}: the first has to be the earlier one")
    return low, high


def _name(wanted: Wanted, k: int) -> str | None:
    return None if wanted.name is None else f"{wanted.name} {k}"


def _keys(named: Mapping[str, Column]) -> dict[str, str]:
    return {channel: column.key for channel, column in named.items()}


def _clocks(table: LogTable, wanted: Wanted, named: Mapping[str, Column]) -> dict[str, Column | None]:
    """The column with the time stamps of each channel; None: lines of one sample time."""
    if wanted.resample is not None:
        return {channel: clock_of(table, wanted, column) for channel, column in named.items()}
    common = common_clock(table, wanted, dict(named))
    return dict.fromkeys(named, common)


def _whole(table: LogTable, column: Column) -> Column:
    """The column with all its values in memory."""
    if table.batches is None:
        return replace(column, values=column.whole())
    blocks = [next(c for c in block.columns if c.key == column.key) for block in table.blocks([column])]
    rows = np.cumsum([0, *(len(b.values) for b in blocks)])
    bad = next(((row + b.bad[0], b.bad[1]) for row, b in zip(rows, blocks, strict=False) if b.bad is not None), None)
    return replace(column, values=np.concatenate([b.whole() for b in blocks]), bad=bad)


def _stamps(table: LogTable, wanted: Wanted, whole: Mapping[str, Column], clock: Column | None, key: str) -> Vector:
    """The time of each row [s]."""
    if clock is None or (wanted.dt is not None and wanted.columns is not None and wanted.columns.get("time", "") is None):
        step = wanted.dt or whole[key].period or 0.0
        return np.arange(len(whole[key].values), dtype=np.float64) * float(step)
    own = whole[clock.key]
    second = second_of(replace(table, columns=(own,), batches=None), wanted, own)
    stamps: Vector = np.asarray(own.whole(), dtype=np.float64) * second
    return stamps


def _spans(stamps: Sequence[Vector], asked: Span, pieces: bool) -> list[Span]:
    """What is asked for, cut where one of the clocks pauses."""
    cuts: list[Span] = []
    for t in stamps if pieces else ():
        steps = np.diff(t)
        usual = float(np.median(steps)) if len(steps) else 0.0
        for at in np.flatnonzero(steps > POLICY.pause * usual) if usual > 0.0 else ():
            cuts.append((float(t[at]), float(t[at + 1])))
    spans, (begin, end) = [], asked
    for before, after in sorted(set(cuts)):
        if after <= begin or before >= end:
            continue
        if before > begin:
            spans.append((begin, before))
        begin = after
    return [*spans, (begin, end)] if begin < end else spans


def _part(
    table: LogTable,
    whole: Mapping[str, Column],
    stamps: Mapping[str, Vector],
    clocks: Mapping[str, Column | None],
    named: Mapping[str, Column],
    span: Span,
    wanted: Wanted,
) -> LogTable | None:
    """The rows of a span as a table of their own; None where they are too few for a record, decimated as it is wanted."""
    rows: dict[str, slice] = {}
    for channel, column in named.items():
        t = stamps[column.key]
        # no decision: a stamp that is printed with few digits may stand a rounding beside the bound
        slack = 1e-6 * float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        inside = np.flatnonzero((t >= span[0] - slack) & (t <= span[1] + slack))
        if _samples(t[inside], wanted) < MINIMUM_SAMPLES:
            return None
        taken = slice(int(inside[0]), int(inside[-1]) + 1)
        rows[column.key] = taken
        clock = clocks[channel]
        if clock is not None:
            rows[clock.key] = taken
    columns = tuple(_cut(whole[c.key], rows[c.key]) if c.key in rows else replace(c, values=np.zeros(0)) for c in table.columns)
    extra = tuple(_cut(whole[key], taken) for key, taken in rows.items() if key not in {c.key for c in table.columns})
    ranges = {(taken.start, taken.stop) for taken in rows.values()}
    one = next(iter(rows.values())) if len(ranges) == 1 else None
    lines = table.lines[one] if table.lines is not None and one is not None else None
    start = one.start if one is not None else 0
    return replace(table, columns=(*columns, *extra), lines=lines, first=start, batches=None)


def _samples(t: Vector, wanted: Wanted) -> int:
    """Samples that a record of lines at these times has."""
    lines = len(t)
    if wanted.resample is not None and lines:
        lines = int((t[-1] - t[0]) / wanted.resample + 1e-9) + 1  # no decision: rounding
    return -(-lines // factor_of(wanted.decimate))


def _cut(column: Column, rows: slice) -> Column:
    bad = column.bad if column.bad is not None and rows.start <= column.bad[0] < rows.stop else None
    return replace(column, values=column.whole()[rows], bad=None if bad is None else (bad[0] - rows.start, bad[1]))
