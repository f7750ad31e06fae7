"""What goes between the two processes: lines of JSON, and numbers as their bytes. Nothing is pickled."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.stored import Matrix
from gaident.data.formats.table import Column, LogTable, Stored

__all__ = ["block_of", "described", "receive", "send", "table_of", "values_of"]

_NUMBERS = "iufbc"
_LONGEST = 1 << 28  # no decision: memory; bytes of a line


def send(stream: BinaryIO, message: dict[str, Any], values: NDArray[Any] | None = None) -> None:
    """Write a message, and the values that it announces."""
    raw = b"" if values is None else np.ascontiguousarray(values).tobytes()
    stream.write(json.dumps({**message, "bytes": len(raw)}).encode("ascii") + b"\n")
    stream.write(raw)
    stream.flush()


def receive(stream: BinaryIO) -> tuple[dict[str, Any], bytes] | None:
    """The next message and its values; None where the other side has ended or writes something else."""
    line = stream.readline(_LONGEST)
    try:
        message = json.loads(line)
        raw = stream.read(int(message["bytes"]))
    except (ValueError, TypeError, KeyError):
        return None
    return (message, raw) if len(raw) == message["bytes"] else None


def described(table: LogTable) -> dict[str, Any]:
    """A table without its values."""
    columns = [
        {
            "key": column.key,
            "names": column.names,
            "unit": column.unit,
            "clock": column.clock,
            "period": column.period,
            "length": len(column.values),
            "dtype": column.values.dtype.str,
        }
        for column in table.columns
    ]
    matrices: dict[str, Any] = {name: {"shape": m.shape, "dtype": m.dtype.str} for name, m in table.matrices.items()}
    return {
        "columns": columns,
        "matrices": matrices,
        "others": table.others,
        "form": table.form,
        "batches": table.batches is not None,
    }


def _number_type(dtype: str) -> np.dtype[Any]:
    """The number type that a message names. Raises ValueError for any other."""
    found = np.dtype(dtype)
    if found.kind not in _NUMBERS:
        raise ValueError(f"dtype {dtype!r} is none of numbers")
    return found


def table_of(path: str, message: dict[str, Any], ask: Any, blocks: Any) -> LogTable:
    """The table that a message describes.

    ask     (what is asked for, number type, length) -> the values of it; called when they are needed
    blocks  numbers of columns -> iterator over (message, values) of their blocks
    """
    if message["batches"]:
        return _batched(path, message, blocks)

    def stored(where: dict[str, Any], dtype: np.dtype[Any], length: int) -> Stored:
        return Stored(path, length, dtype, lambda a, b: ask({**where, "rows": [a, b]}, dtype, b - a))

    columns = tuple(
        Column(
            c["key"],
            stored({"column": k}, _number_type(c["dtype"]), int(c["length"])),
            tuple(c["names"]),
            c["unit"],
            clock=c["clock"],
            period=c["period"],
        )
        for k, c in enumerate(message["columns"])
    )
    matrices: dict[str, Any] = {name: _matrix(path, name, m, ask) for name, m in message["matrices"].items()}
    return LogTable(path, columns, matrices=matrices, others=tuple(message["others"]), form=message["form"])


def _batched(path: str, message: dict[str, Any], blocks: Any) -> LogTable:
    """A table that is read row by row, of all wanted columns at once."""
    columns = tuple(Column(c["key"], np.zeros(0), tuple(c["names"]), c["unit"]) for c in message["columns"])
    numbers = {column.key: k for k, column in enumerate(columns)}

    def batches(wanted: Sequence[Column]) -> Iterator[LogTable]:
        for block, raw in blocks([numbers[column.key] for column in wanted]):
            yield LogTable(path, tuple(_filled(wanted, block, raw)), first=int(block["first"]))

    return LogTable(path, columns, others=tuple(message["others"]), batches=batches, form=message["form"])


def _filled(wanted: Sequence[Column], block: dict[str, Any], raw: bytes) -> Iterator[Column]:
    """The columns with their rows of a block."""
    at, rows = 0, int(block["rows"])
    for column, part in zip(wanted, block["columns"], strict=True):
        dtype = _number_type(part["dtype"])
        values = np.frombuffer(raw, dtype=dtype, count=rows, offset=at)
        at += values.nbytes
        bad = part["bad"]
        yield replace(column, values=values, unit=part["unit"], bad=None if bad is None else (int(bad[0]), str(bad[1])))


def block_of(block: LogTable) -> tuple[dict[str, Any], NDArray[Any]]:
    """The message of a block, and the bytes of its columns one after another."""
    columns = [{"dtype": c.values.dtype.str, "unit": c.unit, "bad": c.bad} for c in block.columns]
    raw = b"".join(np.ascontiguousarray(c.whole()).tobytes() for c in block.columns)
    rows = len(block.columns[0].values) if block.columns else 0
    return {"rows": rows, "first": block.first, "columns": columns}, np.frombuffer(raw, dtype=np.uint8)


def _matrix(path: str, name: str, message: dict[str, Any], ask: Any) -> Matrix:
    dtype, (rows, columns) = _number_type(message["dtype"]), message["shape"]

    def read(row: Any, column: Any) -> NDArray[Any]:
        along, at = (0, column) if isinstance(row, slice) else (1, row)
        run = row if along == 0 else column
        where = {"matrix": name, "along": along, "at": int(at), "rows": [run.start, run.stop]}
        return np.asarray(ask(where, dtype, run.stop - run.start))

    return Matrix(path, (int(rows), int(columns)), dtype, read)


def values_of(table: LogTable, where: dict[str, Any]) -> NDArray[Any]:
    """What a message asks for."""
    rows: Sequence[int] = where["rows"]
    if "column" in where:
        return np.asarray(table.columns[int(where["column"])].values[rows[0] : rows[1]])
    matrix, at = table.matrices[where["matrix"]], int(where["at"])
    column = matrix[:, at] if where["along"] == 0 else matrix[at, :]
    return np.asarray(column[rows[0] : rows[1]])
