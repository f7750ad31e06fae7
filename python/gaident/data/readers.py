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
from gaident.data.formats.foreign.apart import open_apart
from gaident.data.formats.frames import frame_table, is_frame
from gaident.data.formats.sinumerik import open_sinumerik
from gaident.data.formats.table import Column, LogTable
from gaident.data.formats.time_names import time_and_unit
from gaident.data.record import Record
from gaident.data.torque_kind import SAMPLE
from gaident.data.wanted import wanted_of
from gaident.errors import ReadError

__all__ = ["READERS", "Reader", "open_log", "read", "read_columns"]

_HEAD = 4096  # no decision: a format: bytes that tell it


@dataclass(frozen=True)
class Reader:
    """A log format: its extensions, how its content begins (if it has a mark), and what opens it.

    open  of the path for messages, the file, the options of text, and a stack that closes it again
    """

    name: str
    extensions: tuple[str, ...]
    begins: tuple[bytes, ...]
    open: Callable[[str, Path, TextOptions, ExitStack], LogTable]


def _apart(form: str) -> Callable[[str, Path, TextOptions, ExitStack], LogTable]:
    """What opens a format in a process of its own."""
    return lambda path, file, _, stack: open_apart(form, path, file, stack)


READERS = (
    Reader("MAT 7.3", (), (b"MATLAB 7.3",), _apart("HDF5")),
    Reader("MAT", (".mat",), (b"MATLAB 5.0",), lambda path, file, *_: read_mat(path, file.read_bytes())),
    Reader("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), (b"\x89HDF",), _apart("HDF5")),
    Reader("Parquet", (".parquet", ".pq"), (b"PAR1",), _apart("Parquet")),
    Reader("TDMS", (".tdms",), (b"TDSm",), _apart("TDMS")),
    Reader("MDF", (".mf4", ".mdf"), (b"MDF ", b"UnFinMF"), _apart("MDF")),
    Reader("SINUMERIK trace", (".xml",), (b"<?xml", b"\xef\xbb\xbf<?xml", b"<traceSession"), open_sinumerik),
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
    resistance: float | None = None,
    inductance: float | None = None,
    back_emf_constant: float | None = None,
    screw: float | None = None,
    reference_speed: float | None = None,
    velocity_cutoff_hz: float | None = None,
    decimate: int = 1,
    resample: float | None = None,
    gear_ratio: float | None = None,
    load_side: str | Sequence[str] = (),
    measured: bool = True,
    torque_is: str | None = None,
    torque_log: str = SAMPLE,
    shift: Mapping[str, int] | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    skip: int | None = None,
    encoding: str | None = None,
) -> Record:
    """Read a log to a Record in SI units: text tables, MAT, HDF5, NPZ, Parquet, TDMS, MDF, traces of SINUMERIK, a DataFrame.

    Text longer than 32 MB, HDF5, Parquet, TDMS and MDF are read block by block.

    Parameters
    ----------
    path : str, path-like or pandas.DataFrame
        The log.
        MAT 7.3 and HDF5 need h5py, Parquet pyarrow, TDMS nptdms, MDF asammdf:
        the extras hdf5, parquet, tdms and mdf of this package.
    columns : mapping of str to str, int or None, optional
        Channel -> column of the file; channels are command, velocity, torque, position, position_command, load_position,
        load_velocity and time, and voltage and current, from which a torque is worked out.
        A column is its name (or the name without a unit: `w` for `w [rpm]`), its number '#3' or 3 (zero based), or, in MAT and
        NPZ, a column of a two-dimensional array, 'data[:,3]' (zero based).
        None: columns that bear the channels' own names. {"time": None} ignores a time column.
    units : mapping of str to str or float, optional
        Channel -> unit ("rpm", "deg/s", "counts", "%", "A", "ms", ...) or the factor to SI as a number.
        What is not given is taken from the file (`w [rpm]`, or a line of units below the names), else it is SI.
        Time stamps that are a date name their unit by their size.
    dt : float, optional
        Sample time [s].
        None: from the column named for time, or one called as time is (time, t, __time, timestamp, /topic/header/stamp, ...),
        which must be regular, or what the file states.
        With dt and such a column, both must agree within 1 %, and rows that are lost or doubled by its stamps, or a time that
        goes back, are refused.
    name : str, optional
        Name of the record; None: the file's name without its ending.
    counts_per_turn : float, optional
        Counts of the encoder in a turn [1], for the unit counts.
    torque_constant : float, optional
        Torque of a current [N m/A], for the unit A.
    rated_torque : float, optional
        Torque that is 100 % [N m], for the unit %.
    torque_per_volt : float, optional
        Torque of a voltage [N m/V], for the unit V.
    resistance, inductance, back_emf_constant : float, optional
        Of the motor's winding [Ohm], [H], [V s/rad]: a voltage becomes the torque kt (U - ke w)/R, see `Winding`; None: L = 0,
        ke = kt. Of voltage and current without a `torque_constant` the winding is estimated, and a note says so.
    screw : float, optional
        Length that a turn of the motor moves [m]: what is logged in mm, mm/min or N becomes angle, speed and torque of the motor.
    reference_speed : float, optional
        Speed that is 100 % [rad/s], for a velocity or command in %, per mille or 4000 hex.
    velocity_cutoff_hz : float, optional
        Corner [Hz].
        The velocity of a log that has a position and none is the difference of the position;
        with a corner all channels pass the same zero-phase low-pass first. Filtered alike, they keep the inertia.
        None, no filter, suits identification.
    decimate : int
        10: every tenth sample behind a low-pass of linear phase whose delay is compensated, see `Record.decimate`.
        The log is decimated as it is read, whatever its length.
    resample : float, optional
        Sample time [s] to which channels with irregular time stamps, or of several rates, are interpolated linearly; of a held
        torque the mean over each line is taken. Never done unasked.
    gear_ratio : float, optional
        Turns of the motor per turn of the load [1].
    load_side : str or sequence of str
        Channels that were measured behind the gear: their motion is multiplied by `gear_ratio`, their torque divided.
    measured : bool
        False: a log without velocity and position will do, as a proposed command that is to be simulated; its velocity is 0 then.
    torque_is : {"commanded", "measured"}, optional
        Whether the torque is the controller's command, or a measured current times a constant, with the sensor's noise.
        None: measured where the column's name says so (`Actual current`, `I_q`, `M_ist`, `torque feedback`), else commanded.
        The record's repr shows which it is.
    torque_log : {"sample", "mean", "held", "smooth"}
        What a line contains of it: its value there, or its mean since the line before, and how it goes on, see `Record`.
    shift : mapping of str to int, optional
        Channel -> samples by which it is moved against the others, where the log wrote it on another line.
        {"torque": -1} is for a torque that was logged one sample late; see `Record.shifted`.
    delimiter : str, optional
        Of a text table, where it cannot be found out: a character, "tab" or "space".
    decimal : {".", ","}, optional
        Decimal mark of a text table, where it cannot be found out.
    skip : int, optional
        Lines to leave out at the top of a text table, where this cannot be found out.
    encoding : str, optional
        Encoding of a text table as Python calls it, where it cannot be found out.

    Returns
    -------
    Record
        The channels in SI units.

    Raises
    ------
    ReadError
        Where the log cannot be read as asked; with file, line, and remedy.
    RecordError
        Where its values make no record; with index and remedy.

    See Also
    --------
    columns : What a log contains, before its columns are named.

    Examples
    --------
    >>> import gaident as ga
    >>> with open("run1.csv", "w") as log:
    ...     print("t [ms];w_ref [rpm];w [rpm]", file=log)
    ...     for i in range(30):
    ...         print(f"{i};{60 + i};{i}", file=log)
    >>> ga.read("run1.csv", columns={"time": "t", "command": "w_ref", "velocity": "w"})
    Record('run1', 30 samples, dt=0.001 s, 0.03 s; command 6.283..9.32, velocity 0..3.037)
    """
    wanted = wanted_of(
        columns,
        units,
        dt,
        name=name,
        counts_per_turn=counts_per_turn,
        torque_constant=torque_constant,
        rated_torque=rated_torque,
        torque_per_volt=torque_per_volt,
        resistance=resistance,
        inductance=inductance,
        back_emf_constant=back_emf_constant,
        screw=screw,
        reference_speed=reference_speed,
        velocity_cutoff_hz=velocity_cutoff_hz,
        decimate=decimate,
        resample=resample,
        gear_ratio=gear_ratio,
        load_side=load_side,
        measured=measured,
        torque_is=torque_is,
        torque_log=torque_log,
        shift=shift,
    )
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
    """Read all columns of a log as they stand in it, in its own units and order.

    Parameters
    ----------
    path : str, path-like or pandas.DataFrame
        The log, as `read` takes it.
    delimiter, decimal, skip, encoding : optional
        Of a text table, as `read` takes them.

    Returns
    -------
    dict of str to ndarray, shape (n,)
        Column -> values. Every key can be used in the `columns` of `read`.
        Columns without a name, or with one that others have too, end in #k, their number counted from 0.
        Cells that are no number are NaN; complex columns are left out.

    Raises
    ------
    ReadError
        Where the log cannot be read.

    Examples
    --------
    >>> import gaident as ga
    >>> with open("gains.csv", "w") as log:
    ...     print("kp,ki", file=log)
    ...     print("0.5,5", file=log)
    ...     print("0.6,6", file=log)
    >>> ga.read_columns("gains.csv")["ki"]
    array([5., 6.])
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
def open_log(source: str | os.PathLike[str] | Any, options: TextOptions) -> Iterator[LogTable]:
    """The columns of a log file or a DataFrame; what stays in the file can be read until the context ends."""
    with ExitStack() as stack:
        if is_frame(source):
            _only_for_text("a DataFrame", "no file", options)
            table = frame_table(source).checked()
            yield replace(table, columns=tuple(map(_timed, table.columns)))
            return
        file, shown = _file(source)
        with open(file, "rb") as stream:
            head = stream.read(_HEAD)
        reader = _choose(shown, head)
        if reader.name != "text":
            _only_for_text(shown, reader.name, options)
        table = reader.open(shown, file, options, stack).checked()
        yield replace(table, form=table.form or reader.name, columns=tuple(map(_timed, table.columns)))


def _timed(column: Column) -> Column:
    """The column with the unit of time that its name ends with, in a file that says no unit of it."""
    found = time_and_unit(column.key) if column.unit is None else None
    return column if found is None else replace(column, unit=found[1], names=(*column.names, found[0]))


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
