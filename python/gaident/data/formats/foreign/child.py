"""The process that reads one file of a foreign format and answers what its parent asks: started by `apart.open_apart` only.

It imports what the format needs and nothing else, keeps to limits of memory and processor time where the system has them, and
writes nothing but its answers: whatever a library prints goes nowhere.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from contextlib import ExitStack, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from gaident.files import detached_streams, limit_memory, limit_seconds

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gaident.data.formats.table import LogTable

__all__ = ["FORMS", "main"]

FORMS = {
    "HDF5": ("h5py", "gaident.data.formats.foreign.hdf", "open_hdf"),
    "MDF": ("asammdf", "gaident.data.formats.foreign.mdf", "open_mdf"),
    "Parquet": ("pyarrow.parquet", "gaident.data.formats.foreign.parquet", "open_parquet"),
    "TDMS": ("nptdms", "gaident.data.formats.foreign.tdms", "open_tdms"),
}
"""Format -> its library, and the module and function that open it."""

_MEMORY = 768 << 20  # no decision: memory; bytes beyond what the libraries take
_MEMORY_TIMES = 20  # no decision: memory: and times the file
_SECONDS = 4.0  # no decision: a limit; s of processor time that a small file may take
_RATE = 5e6  # no decision: a limit; bytes/s of a file, and of the values that are asked for


def main() -> None:
    """Read the order from the standard input, open the file, answer until the parent closes."""
    # Before NumPy is imported: a library has a thread for each processor else, and each of them memory.
    os.cpu_count = lambda: 1
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    warnings.simplefilter("ignore")
    sources, answers = detached_streams()
    from gaident.data.formats.foreign.wire import described, receive, send
    from gaident.errors import ReadError

    order = receive(sources)
    if order is None:
        return
    path, file = str(order[0]["path"]), Path(os.fsdecode(order[1]))
    library, module, function = FORMS[order[0]["form"]]
    if library.startswith("pyarrow"):
        sys.modules["pandas"] = None  # type: ignore[assignment]  # imported where it is found, and not needed: 1.5 s
    opened = getattr(import_module(module), function)
    with suppress(Exception):  # said by the reader
        import_module(library)
    limits = _Limits(file)
    send(answers, {"started": True})
    limits.begin()
    with ExitStack() as stack:
        try:
            table = opened(path, file, stack)
            send(answers, described(table))
            _answer(table, sources, answers, limits)
        except ReadError as error:
            send(answers, {"error": error.marked})
        except MemoryError:
            send(answers, {"memory": limits.memory})
        # The libraries have nothing to finish, and a damaged file may make them fail at that.
        os._exit(0)


def _answer(table: LogTable, sources: BinaryIO, answers: BinaryIO, limits: _Limits) -> None:
    """Give out what is asked for, until the parent closes."""
    from gaident.data.formats.foreign.wire import block_of, receive, send, values_of

    running: dict[int, Iterator[LogTable]] = {}
    while (question := receive(sources)) is not None:
        where = question[0]
        if "batches" in where:
            assert table.batches is not None
            running[where["run"]] = table.batches([table.columns[k] for k in where["batches"]])
            send(answers, {"begun": True})
        elif "run" in where:
            block = next(running[where["run"]], None)
            message, values = ({"end": True}, None) if block is None else block_of(block)
            limits.grow(0 if values is None else values.nbytes)
            send(answers, message, values)
        else:
            limits.grow(8 * max(0, where["rows"][1] - where["rows"][0]))  # no decision: a unit: bytes of a value
            send(answers, {"values": True}, values_of(table, where))


class _Limits:
    """Limits of memory and of processor time, which grow with the file and with what is asked for; on Linux and its like."""

    def __init__(self, file: Path) -> None:
        self.size = file.stat().st_size
        self.asked = 0
        self.memory = (_MEMORY + _MEMORY_TIMES * self.size) >> 20  # no decision: a unit: MiB
        self.before = 0.0

    def begin(self) -> None:
        """From here on the file counts, and no more the libraries."""
        self.before = _used()
        limit_memory(_MEMORY + _MEMORY_TIMES * self.size)
        self.grow(0)

    def grow(self, asked: int) -> None:
        """So many bytes of values more are asked for."""
        self.asked += asked
        limit_seconds(self.before + _SECONDS + (self.size + self.asked) / _RATE)


def _used() -> float:
    times: Any = os.times()
    return float(times.user + times.system)


if __name__ == "__main__":
    main()
