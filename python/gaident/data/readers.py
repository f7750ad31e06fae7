"""read: a log file to a Record. Which reader takes a file stands in one table, READERS."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.arguments import arg
from gaident.data.assemble import assemble
from gaident.data.formats.binary import read_mat, read_npz
from gaident.data.formats.delimited import TextOptions, open_text
from gaident.data.formats.frames import frame_table, is_frame, open_parquet
from gaident.data.formats.hdf import open_hdf
from gaident.data.formats.instruments import open_mdf, open_tdms
from gaident.data.formats.table import Table
from gaident.data.formats.units import Constants
from gaident.data.record import Record
from gaident.data.wanted import Wanted
from gaident.errors import ReadError

__all__ = ["READERS", "Reader", "open_log", "read", "read_columns"]

_HEAD = 4096


@dataclass(frozen=True)
class Reader:
    """A log format: its extensions, how its content begins (if it has a mark), and what opens it.

    open  of the path for messages, the file, the options of text, and a stack that closes it again
    """

    name: str
    extensions: tuple[str, ...]
    begins: tuple[bytes, ...]
    open: Callable[[str, Path, TextOptions, ExitStack], Table]


READERS = (
    Reader("MAT 7.3", (), (b"MATLAB 7.3",), lambda path, file, _, stack: open_hdf(path, file, stack)),
    Reader("MAT", (".mat",), (b"MATLAB 5.0",), lambda path, file, *_: read_mat(path, file.read_bytes())),
    Reader("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), (b"\x89HDF",), lambda path, file, _, stack: open_hdf(path, file, stack)),
    Reader("Parquet", (".parquet", ".pq"), (b"PAR1",), lambda path, file, _, stack: open_parquet(path, file, stack)),
    Reader("TDMS", (".tdms",), (b"TDSm",), lambda path, file, _, stack: open_tdms(path, file, stack)),
    Reader("MDF", (".mf4", ".mdf"), (b"MDF ", b"UnFinMF"), lambda path, file, _, stack: open_mdf(path, file, stack)),
    Reader("NPZ", (".npz",), (), lambda path, file, *_: read_npz(path, file.read_bytes())),
    Reader(
        "text",
        (".csv", ".txt", ".tsv", ".dat", ".asc", ".log"),
        (),
        lambda path, file, options, _: open_text(path, file, options),
    ),
)
"""A mark in the content counts before the extension; what neither knows is read as text."""

_FOREIGN = (
    (b"PK\x03\x04", "a zip archive or an Excel workbook", "unpack it, or save the sheet as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook", "save the sheet as CSV"),
    (b"\x1f\x8b", "compressed with gzip", "unpack it first"),
    (b"\x93NUMPY", "a single numpy array", "save named columns with numpy.savez"),
    (b"{", "JSON", "export the log as CSV; what gaident saved is loaded with gaident.load"),
    (b"#ROSBAG", "a ROS bag", "export the topic as CSV"),
    (b"\x89MCAP", "an MCAP recording", "export the topic as CSV"),
)


def read(
    path: str | os.PathLike[str] | Any,
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
    decimate: int = 1,
    resample: float | None = None,
    gear_ratio: float | None = None,
    load_side: str | Sequence[str] = (),
    measured: bool = True,
    torque_is: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> Record:
    """Read a log to a Record in SI units: text tables, MAT, HDF5, NPZ, Parquet, TDMS, MDF, a pandas DataFrame.

    path     str or Path, or a DataFrame. MAT 7.3 and HDF5 need h5py, Parquet pyarrow, TDMS nptdms, MDF asammdf: the
             extras hdf5, parquet, tdms and mdf of this package. Text longer than 32 MB, HDF5, Parquet, TDMS and MDF
             are read block by block.
    columns  channel -> column of the file; channels are command, velocity, torque, position and time. A
             column is its name (or the name without a unit: `w` for `w [rpm]`), its number '#3' or 3 (zero
             based), or, in MAT and NPZ, a column of a two-dimensional array, 'data[:,3]' (zero based). None:
             columns that bear the channels' own names. {"time": None} ignores a time column.
    units    channel -> unit ("rpm", "deg/s", "counts", "%", "A", "ms", ...) or the factor to SI as a number.
             What is not given is taken from the file (`w [rpm]`, or a line of units below the names), else it
             is SI; time stamps that are a date name their unit by their size.
    dt       sample time [s]. None: from the column named for time, or one called as time is (time, t, __time,
             timestamp, /topic/header/stamp, ...), which must be regular, or what the file states. With dt and such a
             column, both must agree within 1 %.
    name     of the record; None: the file's name without its ending
    counts_per_turn, torque_constant [N m/A], rated_torque [N m], torque_per_volt [N m/V]
             constants of the drive, for the units counts, A, %, V
    velocity_cutoff_hz
             a log with a position and no velocity gets differentiate(position, dt, velocity_cutoff_hz). None, the plain
             difference, suits identification: a velocity that is filtered alone biases the inertia of a fast axis
    decimate 10: every tenth sample behind a linear-phase low-pass whose delay is compensated, see
             Record.decimate; the log is decimated as it is read, whatever its length
    resample [s] put channels with irregular time stamps, or of several rates, on one even axis, by linear
             interpolation; never done unasked
    gear_ratio, load_side
             turns of the motor per turn of the load, and the channels that were measured behind the gear: their
             motion is multiplied by it, their torque divided
    measured False: a log without velocity and position will do, as a proposed command that is to be simulated; its velocity
             is 0 then
    torque_is "commanded": the torque is the controller's command; "measured": a measured current times a constant, behind the
             actuator and with the sensor's noise. None: measured where the column's name says so (`Actual current`, `I_q`,
             `M_ist`, `torque feedback`), else commanded; the record's repr shows which it is
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
        decimate=decimate,
        resample=resample,
        gear_ratio=gear_ratio,
        load_side=(load_side,) if isinstance(load_side, str) else tuple(load_side),
        measured=measured,
        torque_is=torque_is,
    ).check()
    with open_log(path, TextOptions(delimiter, decimal, skip, encoding)) as table:
        return assemble(table, wanted, "" if is_frame(path) else Path(path).stem)


def read_columns(
    path: str | os.PathLike[str] | Any,
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
    with open_log(path, TextOptions(delimiter, decimal, skip, encoding)) as table:
        real = [column for column in table.columns if column.values.dtype.kind != "c"]
        if table.batches is None:
            # A copy each: a column must not keep the whole table alive, nor change another when it is written to.
            return {column.key: np.array(column.whole(), dtype=np.float64) for column in real}
        parts: dict[str, list[NDArray[np.float64]]] = {column.key: [] for column in real}
        for block in table.blocks(real):
            for column in block.columns:
                parts[column.key].append(np.array(column.whole(), dtype=np.float64))
        return {key: np.concatenate([*values, np.zeros(0)]) for key, values in parts.items()}


@contextmanager
def open_log(source: str | os.PathLike[str] | Any, options: TextOptions) -> Iterator[Table]:
    """The columns of a log file or a DataFrame; what stays in the file can be read until the context ends."""
    with ExitStack() as stack:
        if is_frame(source):
            _only_for_text("a DataFrame", "no file", options)
            yield frame_table(source)
            return
        file, shown = _file(source)
        with open(file, "rb") as stream:
            head = stream.read(_HEAD)
        reader = _choose(shown, head)
        if reader.name != "text":
            _only_for_text(shown, reader.name, options)
        table = reader.open(shown, file, options, stack)
        yield table if table.form else replace(table, form=reader.name)


def _only_for_text(shown: str, form: str, options: TextOptions) -> None:
    given = [key for key, value in vars(options).items() if value is not None]
    if given:
        raise ReadError(f"{arg(given[0])} is for text tables, but {shown} is {form}; leave {given[0]} out")


def _file(path: str | os.PathLike[str]) -> tuple[Path, str]:
    """The file, once it is known to be one that can be read, and its path for messages."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise ReadError(f"path={path!r:.80} is no path; give the file's name as str or pathlib.Path, or a DataFrame")
    file, shown = Path(path), os.fspath(path)
    shown = shown if shown.isprintable() else repr(shown)
    try:
        if file.is_dir():
            raise ReadError(f"{shown}: this is a folder; name one log file in it")
        if not file.exists():
            raise ReadError(f"{shown}: there is no such file{_near(file)}; check the path (now in {Path.cwd()})")
        if not file.is_file():
            raise ReadError(f"{shown}: this is no regular file; save the log to a file first")
        with open(file, "rb") as stream:
            empty = not stream.read(1)
    except (OSError, ValueError) as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"{shown!r}: cannot be read ({error}); check the path and its permissions") from None
    if empty:
        raise ReadError(f"{shown}: the file is empty; give a log with at least 20 samples")
    return file, shown


def _near(file: Path) -> str:
    if not file.parent.is_dir():
        return f", nor a folder {str(file.parent)!r}"
    near = difflib.get_close_matches(file.name, [other.name for other in file.parent.iterdir()], n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _choose(shown: str, head: bytes) -> Reader:
    """The reader by the content's mark, else by the extension."""
    # HDF5 may begin behind a block of the user's, as MAT of version 7.3 does.
    if head[512:516] == b"\x89HDF":
        return _named("HDF5")
    for reader in READERS:
        if reader.begins and head.startswith(reader.begins):
            return reader
    # An NPZ file of another name is known by the first file in the archive.
    if head.startswith(b"PK\x03\x04") and b".npy" in head[30:300]:
        return _named("NPZ")
    extension = Path(shown).suffix.lower()
    by_extension = next((reader for reader in READERS if extension in reader.extensions), None)
    if by_extension is not None and by_extension.name in ("MAT", "NPZ"):
        return by_extension
    for mark, what, remedy in _FOREIGN:
        if head.startswith(mark):
            raise ReadError(f"{shown}: this is {what}, which read cannot open; {remedy}")
    return _named("text") if by_extension is None else by_extension


def _named(name: str) -> Reader:
    return next(reader for reader in READERS if reader.name == name)
