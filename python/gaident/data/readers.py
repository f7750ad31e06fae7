"""read: a log file to a Record. Which reader takes a file stands in one table, READERS."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gaident.data.assemble import Wanted, assemble
from gaident.data.binary import read_mat, read_npz
from gaident.data.delimited import TextOptions, read_text
from gaident.data.record import Record
from gaident.data.table import Table
from gaident.data.units import Constants
from gaident.errors import ReadError

__all__ = ["READERS", "Reader", "read", "read_columns"]


@dataclass(frozen=True)
class Reader:
    """A log format: its extensions, how its content begins (if it has a mark), and what reads it."""

    name: str
    extensions: tuple[str, ...]
    begins: tuple[bytes, ...]
    read: Callable[[str, bytes, TextOptions], Table]


READERS = (
    Reader("MAT", (".mat",), (b"MATLAB 5.0", b"MATLAB 7.3"), lambda path, raw, _: read_mat(path, raw)),
    Reader("NPZ", (".npz",), (), lambda path, raw, _: read_npz(path, raw)),
    Reader("text", (".csv", ".txt", ".tsv", ".dat", ".asc", ".log"), (), read_text),
)
"""A mark in the content counts before the extension; what neither knows is read as text."""

_FOREIGN = (
    (b"PK\x03\x04", "a zip archive or an Excel workbook", "unpack it, or save the sheet as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook", "save the sheet as CSV"),
    (b"\x1f\x8b", "compressed with gzip", "unpack it first"),
    (b"\x93NUMPY", "a single numpy array", "save named columns with numpy.savez"),
    (b"\x89HDF", "an HDF5 file", "export the log as CSV, or with numpy.savez"),
    (b"TDSm", "a TDMS file", "export the log as CSV"),
    (b"MDF ", "an MDF measurement", "export the log as CSV or as MAT of version 5"),
    (b"PAR1", "a Parquet file", "export the log as CSV"),
)


def read(
    path: str | os.PathLike[str],
    columns: Mapping[str, str | int | None] | None = None,
    units: Mapping[str, str | float] | None = None,
    dt: float | None = None,
    *,
    name: str | None = None,
    counts_per_turn: float | None = None,
    torque_constant: float | None = None,
    rated_torque: float | None = None,
    torque_per_volt: float | None = None,
    velocity_cutoff_hz: float | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> Record:
    """Read a log file (CSV and other text tables, MAT of version 5, NPZ) to a Record in SI units.

    path     str or Path
    columns  channel -> column of the file; channels are command, velocity, torque, position and time. A
             column is its name (or the name without a unit: `w` for `w [rpm]`), its number '#3' or 3 (zero
             based), or, in MAT and NPZ, a column of a two-dimensional array, 'data[:,3]' (zero based). None:
             columns that bear the channels' own names. {"time": None} ignores a time column.
    units    channel -> unit ("rpm", "deg/s", "counts", "%", "A", "ms", ...) or the factor to SI as a number.
             What is not given is taken from the file (`w [rpm]`, or a line of units below the names), else it
             is SI.
    dt       sample time [s]. None: from the column named for time, or one called time, t or Time, which must
             be regular. With dt and such a column, both must agree within 1 %.
    name     of the record; None: the file's name without its ending
    counts_per_turn, torque_constant [N m/A], rated_torque [N m], torque_per_volt [N m/V]
             constants of the drive, for the units counts, A, %, V
    velocity_cutoff_hz
             a log with a position and no velocity gets differentiate(position, dt, velocity_cutoff_hz)
    delimiter, decimal, skip, encoding
             of a text table, where they cannot be found out: what separates columns (a character, "tab" or
             "space"), decimal mark ("." or ","), lines to leave out at the top, encoding as Python calls it

    Raises ReadError (or RecordError) with file, line or index, and remedy.
    """
    wanted = Wanted(
        columns=columns,
        units={} if units is None else units,
        dt=dt,
        name=name,
        constants=Constants(counts_per_turn, torque_constant, rated_torque, torque_per_volt),
        velocity_cutoff_hz=velocity_cutoff_hz,
    ).check()
    table = _read_table(path, TextOptions(delimiter, decimal, skip, encoding))
    return assemble(table, wanted, Path(path).stem)


def read_columns(
    path: str | os.PathLike[str],
    *,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> dict[str, NDArray[np.float64]]:
    """What a log file holds: column name -> values (n,), in the file's own units and order.

    Every key can be used in the `columns` of read. Columns without a name, or with one that others have too,
    end in #k, their number counted from 0. Cells that are no number are NaN; complex columns are left out.
    """
    table = _read_table(path, TextOptions(delimiter, decimal, skip, encoding))
    # A copy each: a column must not keep the whole table alive, nor change another when it is written to.
    return {column.key: np.array(column.values, dtype=np.float64) for column in table.columns if column.values.dtype.kind != "c"}


def _read_table(path: str | os.PathLike[str], options: TextOptions) -> Table:
    raw, shown = _content(path)
    reader = _choose(shown, raw)
    if reader.read is not read_text:
        given = [key for key, value in vars(options).items() if value is not None]
        if given:
            raise ReadError(f"{given[0]}= is for text tables, but {shown} is {reader.name}; leave {given[0]} out")
    return reader.read(shown, raw, options)


def _content(path: str | os.PathLike[str]) -> tuple[bytes, str]:
    """Bytes of the file, and its path for messages."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise ReadError(f"path={path!r:.80} is no path; give the file's name as str or pathlib.Path")
    file, shown = Path(path), os.fspath(path)
    shown = shown if shown.isprintable() else repr(shown)
    try:
        if file.is_dir():
            raise ReadError(f"{shown}: this is a folder; name one log file in it")
        if not file.exists():
            raise ReadError(f"{shown}: there is no such file{_near(file)}; check the path (now in {Path.cwd()})")
        if not file.is_file():
            raise ReadError(f"{shown}: this is no regular file; save the log to a file first")
        raw = file.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"{shown!r}: cannot be read ({error}); check the path and its permissions") from None
    if not raw:
        raise ReadError(f"{shown}: the file is empty; give a log with at least 20 samples")
    return raw, shown


def _near(file: Path) -> str:
    if not file.parent.is_dir():
        return f", nor a folder {str(file.parent)!r}"
    near = difflib.get_close_matches(file.name, [other.name for other in file.parent.iterdir()], n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _choose(shown: str, raw: bytes) -> Reader:
    """The reader by the content's mark, else by the extension."""
    for reader in READERS:
        if reader.begins and raw.startswith(reader.begins):
            return reader
    extension = Path(shown).suffix.lower()
    by_extension = next((reader for reader in READERS if extension in reader.extensions), None)
    if by_extension is not None and by_extension.name != "text":
        return by_extension
    # An NPZ file of another name is known by the first file in the archive.
    if raw.startswith(b"PK\x03\x04") and b".npy" in raw[30:300]:
        return next(reader for reader in READERS if reader.name == "NPZ")
    for mark, what, remedy in _FOREIGN:
        if raw.startswith(mark):
            raise ReadError(f"{shown}: this is {what}, which read cannot open; {remedy}")
    return READERS[-1]
