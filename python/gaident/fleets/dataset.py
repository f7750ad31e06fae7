"""The dataset of a fleet: tables of logs and of parameters, a file for each axis and month, Parquet or CSV."""

from __future__ import annotations

import csv
import importlib.util
import io
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from gaident.errors import GaidentError, ReadError
from gaident.files import write_whole
from gaident.fleets.rows import LOG_COLUMNS, PARAMETER_COLUMNS

__all__ = ["FORMATS", "INDEX", "TABLES", "best_format", "part_file", "parts_of", "read_part", "remove_part", "write_part"]

FORMATS = ("parquet", "csv")
INDEX = "index.sqlite"
"""The file beside the tables that says which results are there."""
TABLES = {"logs": LOG_COLUMNS, "parameters": PARAMETER_COLUMNS}

Row = Mapping[str, Any]


def best_format() -> str:
    """Parquet where pyarrow is installed, else CSV."""
    return FORMATS[0] if importlib.util.find_spec("pyarrow") is not None else FORMATS[1]


def part_file(folder: Path, table: str, axis: str, month: str, kind: str) -> Path:
    """The file of an axis and a month."""
    return folder / table / f"axis={quote(axis, safe='')}" / f"month={month}" / f"part.{kind}"


def write_part(folder: Path, table: str, axis: str, month: str, rows: Iterable[Row], kind: str) -> None:
    """Write one file of a table; the same rows give the same bytes. Raises OSError."""
    target = part_file(folder, table, axis, month, kind)
    target.parent.mkdir(parents=True, exist_ok=True)
    columns = TABLES[table]
    rows = list(rows)
    content = _parquet(columns, rows) if kind == FORMATS[0] else _csv({"axis": axis, "month": month}, columns, rows)
    write_whole(target, content)


def remove_part(folder: Path, table: str, axis: str, month: str, kind: str) -> None:
    """Remove one file of a table, and its folders where nothing else is in them. Raises OSError."""
    file = part_file(folder, table, axis, month, kind)
    file.unlink(missing_ok=True)
    for above in (file.parent, file.parent.parent):
        if above.is_dir() and not any(above.iterdir()):
            above.rmdir()


def _parquet(columns: Mapping[str, type], rows: list[Row]) -> bytes:
    pyarrow = _pyarrow()
    import pyarrow.parquet as files

    kinds = {str: pyarrow.string(), float: pyarrow.float64(), int: pyarrow.int64(), bool: pyarrow.bool_()}
    fields, arrays = [], []
    for name, kind in columns.items():
        values = [row.get(name) for row in rows]
        if name == "time":
            text = pyarrow.array(values, pyarrow.string())
            arrays.append(text.cast(pyarrow.timestamp("s")).cast(pyarrow.timestamp("us")))
        else:
            arrays.append(pyarrow.array(values, kinds[kind]))
        fields.append(pyarrow.field(name, arrays[-1].type))
    # A stream of pyarrow's own, as in `read_part`: its threads must hold no object of Python when the interpreter ends.
    out = pyarrow.BufferOutputStream()
    files.write_table(pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields)), out)
    return bytes(out.getvalue().to_pybytes())


def _csv(first: Row, columns: Mapping[str, type], rows: Iterable[Row]) -> bytes:
    out = io.StringIO(newline="")
    writer = csv.DictWriter(out, [*first, *columns], extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({**row, **first})
    return out.getvalue().encode()


def _pyarrow() -> Any:
    try:
        import pyarrow
    except ImportError as error:
        raise GaidentError("this fleet is kept as Parquet, which needs pyarrow: pip install 'gaident[parquet]'") from error
    return pyarrow


def parts_of(folder: Path, table: str) -> Iterator[tuple[str, str, Path]]:
    """(axis, month, file) of a table, by their names. Raises ReadError where there is none."""
    found = sorted(f for f in (folder / table).glob("axis=*/month=*/part.*") if f.suffix[1:] in FORMATS)
    if not found:
        if (folder / INDEX).is_file():
            text = "the fleet was stopped before its tables were written; call gaident fleet again, which goes on where it was"
            raise ReadError(f"{folder}: {text}")
        raise ReadError(f"{folder}: there is no table {table!r} of a fleet; give the folder that gaident fleet wrote with --out")
    for file in found:
        axis, month = (unquote(part.partition("=")[2]) for part in file.parts[-3:-1])
        yield axis, month, file


def read_part(file: Path, table: str) -> list[dict[str, Any]]:
    """The rows of one file; time as text, what is missing as None. Raises ReadError."""
    columns = TABLES[table]
    try:
        if file.suffix[1:] == FORMATS[0]:
            pyarrow = _pyarrow()
            import pyarrow.parquet as files

            with pyarrow.OSFile(str(file)) as stream, files.ParquetFile(stream, pre_buffer=False) as opened:
                rows = opened.read(use_threads=False).to_pylist()
            return [{**row, "time": row["time"].isoformat()} for row in rows]
        with open(file, encoding="utf-8", newline="") as stream:
            return [{name: _value(row[name], kind) for name, kind in columns.items()} for row in csv.DictReader(stream)]
    except GaidentError:
        raise
    except (OSError, ValueError, LookupError) as error:
        raise ReadError(f"{file}: cannot be read ({error}); remove it, and the next gaident fleet writes it anew") from error


def _value(text: str, kind: type) -> Any:
    if text == "":
        return "" if kind is str else None
    return text == "True" if kind is bool else kind(text)
