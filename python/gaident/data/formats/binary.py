"""Readers for MAT (version 5 and 4) and NPZ files."""

from __future__ import annotations

import io
import zipfile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.mat import DamagedError, variables
from gaident.data.formats.stored import Matrix, array_table, check_unpacked
from gaident.data.formats.table import LogTable, Stored, first_line
from gaident.errors import ReadError

__all__ = ["read_mat", "read_npz"]


def read_mat(path: str, raw: bytes) -> LogTable:
    """Numeric variables of a MAT file of version 5 or 4; fields of a 1 x 1 struct are named `log.speed`."""
    try:
        content = variables(raw)
    except DamagedError as error:
        raise ReadError(
            f"{path}: not a whole MAT file of version 5 ({error}); copy it again, "
            f"or save it in MATLAB with save('log.mat', '-v7')"
        ) from None
    arrays: dict[str, NDArray[Any] | Stored | Matrix] = {}
    others: list[str] = []
    for name, value in content:
        if name in arrays:
            raise ReadError(f"{path}: two variables are called {name!r}; save the log again with one name for each")
        # MATLAB keeps what its objects need in a variable without a name.
        if name:
            sort_array(name, value, arrays, others)
    return array_table(path, arrays, others)


def read_npz(path: str, raw: bytes) -> LogTable:
    """Numeric arrays of an NPZ file; nothing pickled is ever loaded."""
    arrays: dict[str, NDArray[Any] | Stored | Matrix] = {}
    others: list[str] = []
    name = "the archive"
    try:
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            if len(set(archive.files)) != len(archive.files):
                raise ReadError(f"{path}: two arrays of one name in it; save the log again with one name for each")
            check_unpacked(path, sum(member.file_size for member in archive.zip.infolist()), len(raw))
            for name in archive.files:
                sort_array(name, np.asarray(archive[name]), arrays, others)
    except ReadError:
        raise
    except Exception as error:
        if "allow_pickle" in str(error) and zipfile.is_zipfile(io.BytesIO(raw)):
            raise ReadError(
                f"{path}: {name!r} is a pickled object array, which is never loaded, for it could run any "
                "code; "
                f"save plain numbers, numpy.savez(file, {name}=numpy.asarray(x, dtype=float))"
            ) from None
        raise ReadError(
            f"{path}: not a whole NPZ file ({type(error).__name__}: {first_line(error)}); copy it again, "
            f"or save it with numpy.savez"
        ) from None
    return array_table(path, arrays, others)


def sort_array(
    name: str, value: NDArray[Any] | str, arrays: dict[str, NDArray[Any] | Stored | Matrix], others: list[str]
) -> None:
    """Put a variable among the arrays of numbers, flat where it is a row or a column, or among the others."""
    if isinstance(value, str):
        others.append(f"{name!r} ({value})")
    elif value.dtype.kind not in "iufbc":
        others.append(f"{name!r} ({'text' if value.dtype.kind in 'US' else value.dtype})")
    elif value.size == 0:
        others.append(f"{name!r} (empty)")
    elif value.size == max(value.shape, default=1):
        arrays[name] = value.reshape(-1)
    elif value.ndim == 2:
        arrays[name] = value
    else:
        others.append(f"{name!r} ({value.ndim}-dimensional)")
