"""Reader for Parquet files, block by block, through the library pyarrow."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from gaident.data.formats.frames import frame_column
from gaident.data.formats.stored import check_unpacked, library
from gaident.data.formats.table import BLOCK, Column, LogTable, first_line
from gaident.data.formats.unit_names import unit_of
from gaident.errors import ReadError

__all__ = ["open_parquet"]

_BUFFER = 1 << 18  # no decision: memory; bytes per column that are read ahead
_BYTES_OF_VALUE = 8  # no decision: a unit: bytes of a float64


def open_parquet(path: str, file: Path, stack: ExitStack) -> LogTable:
    """Numeric columns of a Parquet file, read block by block; a field's metadata `unit` or `units` is its unit."""
    parquet = library("pyarrow.parquet", "parquet", path, "a Parquet file")
    try:
        # Its defaults contain whole row groups, which may be the whole file, before the first row is given out.
        opened = stack.enter_context(parquet.ParquetFile(file, pre_buffer=False, buffer_size=_BUFFER))
        fields = list(opened.schema_arrow)
    except Exception as error:  # pyarrow's errors share no class
        raise ReadError(f"{path}: not a whole Parquet file ({first_line(error)}); copy it again, or export a CSV") from None
    check_unpacked(path, _BYTES_OF_VALUE * int(opened.metadata.num_rows), file.stat().st_size)
    names = [field.name for field in fields]
    times = Counter(names)
    twice = next((name for name in names if times[name] > 1), None)
    if twice is not None:
        raise ReadError(f"{path}: two columns are called {twice!r}; save the log again with one name for each")
    columns, others = [], []
    for field in fields:
        kind = np.dtype(field.type.to_pandas_dtype()).kind if _is_plain(field.type) else "O"
        if kind not in "iufbMm":
            others.append(f"{field.name!r} ({field.type})")
            continue
        metadata = field.metadata or {}
        stated = next((metadata[key].decode("utf-8", "replace") for key in (b"units", b"unit") if key in metadata), None)
        columns.append(Column(field.name, np.zeros(0), (), "s" if kind in "Mm" else stated or unit_of(field.name)))
    if not columns:
        raise ReadError(f"{path}: the file contains no columns of numbers (only {', '.join(others)})")

    origins: dict[str, Any] = {}  # midnight of each column of dates

    def batches(wanted: Sequence[Column]) -> Iterator[LogTable]:
        first = 0
        try:
            for batch in opened.iter_batches(BLOCK, columns=[column.key for column in wanted]):
                values = [
                    frame_column(column, batch.column(column.key).to_numpy(zero_copy_only=False), origins) for column in wanted
                ]
                yield LogTable(path, tuple(values), first=first)
                first += batch.num_rows
        except (ReadError, MemoryError):
            raise
        except Exception as error:
            raise ReadError(f"{path}: damaged ({first_line(error)}); copy it again") from None

    return LogTable(path, tuple(columns), others=tuple(others), batches=batches, form="Parquet")


def _is_plain(kind: Any) -> bool:
    try:
        np.dtype(kind.to_pandas_dtype())
    except (NotImplementedError, TypeError):
        return False
    return True
