"""Reader for HDF5 and for MAT of version 7.3, which is HDF5 inside; nothing is read before it is asked for."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import Matrix, array_table, check_unpacked, library
from gaident.data.formats.table import LogTable, Stored, first_line
from gaident.errors import ReadError

__all__ = ["open_hdf"]

_CACHE = 1 << 26  # no decision: memory; bytes of unpacked chunks that are kept, so that no chunk is unpacked for each block
_UNIT_KEYS = ("units", "unit", "Unit", "Units", "UNIT")


def open_hdf(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Numeric datasets of an HDF5 file, named by their path (`run1/speed`), fields of compound ones too.

    In a MAT file of version 7.3 they are named as MATLAB does (`log.speed`), and what MATLAB stores column by column
    is turned back. An attribute `units` or `unit` of a dataset is its unit.
    """
    h5py = library("h5py", "hdf5", path, "an HDF5 file (MAT of version 7.3 is one too)")
    try:
        root = stack.enter_context(h5py.File(file, "r", rdcc_nbytes=_CACHE))
        content = _Content(path, _is_matlab(file), file.stat().st_size)
        root.visititems(lambda name, node: content.add(name, node) if isinstance(node, h5py.Dataset) else None)
    except (ReadError, MemoryError):
        raise
    except Exception as error:  # whatever a damaged file leads h5py into
        what, remedy = ("HDF5", "export a CSV") if not _is_matlab(file) else ("MAT 7.3", "save it with save('log.mat', '-v7')")
        raise ReadError(f"{path}: not a whole {what} file ({first_line(error)}); copy it again, or {remedy}") from None
    form = "MAT 7.3" if content.matlab else "HDF5"
    return array_table(path, content.arrays, content.others, content.units, form)


def _is_matlab(file: Path) -> bool:
    with open(file, "rb") as stream:
        return stream.read(10) == b"MATLAB 7.3"  # no decision: a format: how such a file begins


class _Content:
    """The columns of an open file, sorted as they are found."""

    def __init__(self, path: str, matlab: bool, size: int) -> None:
        self.path, self.matlab, self.bytes = path, matlab, size
        self.arrays: dict[str, NDArray[Any] | Stored | Matrix] = {}
        self.units: dict[str, str] = {}
        self.others: list[str] = []

    def add(self, name: str, data: Any) -> None:
        # MATLAB keeps what cells and objects point to in #refs#.
        if self.matlab:
            if name.startswith("#"):
                return
            name = name.replace("/", ".")
        if data.is_virtual or data.external:
            raise ReadError(f"{self.path}: {name!r} lies in another file, which is never opened; copy it into this one")
        check_unpacked(self.path, (data.size or 0) * data.dtype.itemsize, self.bytes)
        unit = next((_text(data.attrs[key]) for key in _UNIT_KEYS if key in data.attrs), None)
        if unit:
            self.units[name] = unit
        if data.dtype.names:
            self._compound(name, data)
        elif data.dtype.kind not in "iufb" or _text(data.attrs.get("MATLAB_class", "")) in ("char", "cell"):
            self.others.append(f"{name!r} ({'text' if data.dtype.kind in 'SUO' else data.dtype})")
        elif data.size is None or data.size == 0 or "MATLAB_empty" in data.attrs:
            self.others.append(f"{name!r} (empty)")
        elif data.size == max(data.shape, default=1):
            self.arrays[name] = _flat(self.path, data)
        elif data.ndim == 2:
            self.arrays[name] = _matrix(self.path, data, self.matlab)
        else:
            self.others.append(f"{name!r} ({data.ndim}-dimensional)")

    def _compound(self, name: str, data: Any) -> None:
        for field in data.dtype.names:
            dtype = data.dtype[field]
            if data.ndim == 1 and data.size and dtype.kind in "iufb" and not dtype.shape:
                self.arrays[f"{name}/{field}"] = Stored(self.path, data.shape[0], dtype, _field_reader(data, field))
            else:
                self.others.append(f"{name}/{field!r} ({dtype})")


def _flat(path: str, data: Any) -> Stored:
    axis = int(np.argmax(data.shape)) if data.ndim else 0

    def rows(start: int, stop: int) -> NDArray[Any]:
        if data.ndim == 0:
            return np.asarray(data[()]).reshape(1)[start:stop]
        where = [slice(None)] * data.ndim
        where[axis] = slice(start, stop)
        return np.asarray(data[tuple(where)]).reshape(-1)

    return Stored(path, int(data.size), data.dtype, rows)


def _matrix(path: str, data: Any, turned: bool) -> Matrix:
    rows, columns = data.shape
    if turned:
        return Matrix(path, (columns, rows), data.dtype, lambda i, k: np.asarray(data[k, i]))
    return Matrix(path, (rows, columns), data.dtype, lambda i, k: np.asarray(data[i, k]))


def _field_reader(data: Any, field: str) -> Any:
    return lambda start, stop: np.asarray(data[start:stop][field])


def _text(value: object) -> str:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
