"""The process apart in which a foreign format is read: a crash, a hang or huge memory of its library becomes an error here.

The process is a new interpreter, not a copy of this one: it needs no `if __name__ == "__main__"`, runs under Windows' rules, and
knows nothing of this process but where modules are found.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from multiprocessing import spawn
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaident.data.formats.foreign.child import FORMS
from gaident.data.formats.foreign.wire import receive, send, table_of
from gaident.data.formats.table import LogTable
from gaident.errors import ReadError

__all__ = ["open_apart"]

_START = 120.0  # no decision: a limit; s in which an interpreter starts and imports, from a cold disk on a busy machine
_ANSWER = 60.0  # no decision: a limit; s that an answer may take by the clock
_STEP = 0.1  # no decision: a limit; s, after which a wait looks whether it is to end
_RATE = 5e6  # no decision: a limit; bytes/s of the file, which are added to it

_Answer = tuple[dict[str, Any], bytes]
# The module is found where this process finds it; the folder in which Python runs is not searched for it.
_BOOT = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); "
    "from gaident.data.formats.foreign.child import main; main()"
)  # fmt: skip


def open_apart(form: str, path: str, file: Path, stack: ExitStack) -> LogTable:
    """The table of a file whose format is read apart; what is asked for of its columns comes from there until `stack` closes.

    Raises ReadError, which names the file and the remedy, whatever becomes of the process.
    """
    child = stack.enter_context(_Child(form, path, file))
    return table_of(path, child.described(), child.values, child.blocks)


class _Child:
    """One process, which reads one file."""

    def __init__(self, form: str, path: str, file: Path) -> None:
        self.form, self.path, self.file = form, path, file.resolve()
        self.library = FORMS[form][0].partition(".")[0]
        self.seconds = _ANSWER + file.stat().st_size / _RATE
        self.late = False
        self.runs = 0
        self.lock = threading.Lock()
        self.received: queue.SimpleQueue[_Answer | None] = queue.SimpleQueue()

    def __enter__(self) -> _Child:
        # Temporary files of a library that is killed go with this folder.
        self.folder = tempfile.TemporaryDirectory(prefix="gaident-", ignore_cleanup_errors=True)
        try:
            self.process = self._started()
        except BaseException:
            self.folder.cleanup()
            raise
        assert self.process.stdin is not None and self.process.stdout is not None
        self.questions: Any = self.process.stdin
        self.answers: Any = self.process.stdout
        self.thread = threading.Thread(target=self._receive, name="answers of a process that reads a log", daemon=True)
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        self.thread.join()
        for stream in (self.questions, self.answers):
            with suppress(OSError):  # what was not sent is not wanted any more
                stream.close()
        self.folder.cleanup()

    def _started(self) -> subprocess.Popen[bytes]:
        python = os.fsdecode(spawn.get_executable() or "")
        places = [os.path.abspath(place) if not place or os.path.isdir(place) else place for place in map(os.fspath, sys.path)]
        isolated = ["-I"] if sys.flags.isolated else []
        environment = {
            **os.environ,
            **dict.fromkeys(("TMPDIR", "TEMP", "TMP"), self.folder.name),
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMEXPR_NUM_THREADS", "MALLOC_ARENA_MAX"), "1"),
            "ARROW_DEFAULT_MEMORY_POOL": "system",  # the others reserve addresses for what they may need
        }
        window: int = getattr(subprocess, "CREATE_NO_WINDOW", 0)  # no decision: Windows, where a program has a window else
        try:
            return subprocess.Popen(
                [python, *isolated, "-c", _BOOT, json.dumps(places)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                cwd=self.folder.name,
                env=environment,
                creationflags=window,
            )
        except (OSError, ValueError) as error:
            raise ReadError(self._no_start(str(error))) from None

    def _no_start(self, why: str) -> str:
        return (
            f"{self.path}: {self.form} is read in a process of its own, and that one does not start ({why}): its interpreter is "
            f"{spawn.get_executable()!r}; where this is a program that contains Python, name the interpreter with "
            "multiprocessing.set_executable, or export a CSV"
        )

    def described(self) -> dict[str, Any]:
        """What the file contains."""
        order = {"path": self.path, "form": self.form}
        started = self._exchange(order, _START, np.frombuffer(os.fsencode(self.file), dtype=np.uint8))
        if started is None:
            raise ReadError(self._no_start(f"no answer within {_START:g} s" if self.late else f"code {self.process.wait()}"))
        self._refuse(started[0])
        return self._checked(self._exchange(None, self.seconds), "opened")[0]

    def values(self, where: dict[str, Any], dtype: np.dtype[Any], length: int) -> NDArray[Any]:
        """Some rows of a column, shape (length,)."""
        with self.lock:
            _, raw = self._checked(self._exchange(where, self.seconds), "read")
        if len(raw) != length * dtype.itemsize:
            raise ReadError(f"{self.path}: damaged, {len(raw)} bytes where {length} values are announced; copy it again")
        return np.frombuffer(raw, dtype=dtype)

    def blocks(self, columns: list[int]) -> Iterator[_Answer]:
        """The blocks of some columns, by their numbers, of a table that is read row by row."""
        with self.lock:
            self.runs += 1
            run = self.runs
            self._checked(self._exchange({"batches": columns, "run": run}, self.seconds), "read")
        while True:
            with self.lock:
                message, raw = self._checked(self._exchange({"run": run}, self.seconds), "read")
            if "end" in message:
                return
            yield message, raw

    def _exchange(self, message: dict[str, Any] | None, seconds: float, values: NDArray[Any] | None = None) -> _Answer | None:
        """The answer to a message (None: to the last one); None where there is none, in time or ever."""

        if message is not None:
            with suppress(OSError):  # it has ended, which the answer shows
                send(self.questions, message, values)
        end = time.monotonic() + seconds
        # In short steps: on some systems, and in some threads, a wait does not end at Ctrl-C.
        while not self.late:
            with suppress(queue.Empty):
                return self.received.get(timeout=_STEP)
            self.late = time.monotonic() > end
        self.process.kill()
        return None

    def _receive(self) -> None:
        """Take what the process answers, until it has ended: a thread of its own."""
        answer = receive(self.answers)
        while answer is not None:
            self.received.put(answer)
            answer = receive(self.answers)
        self.received.put(None)

    def _checked(self, answer: _Answer | None, verb: str) -> _Answer:
        """The answer, where it is one that contains what was asked for."""
        if answer is None:
            raise ReadError(f"{self.path}: {self._end(verb)}; copy the file again, or export a CSV")
        self._refuse(answer[0])
        return answer

    def _refuse(self, message: dict[str, Any]) -> None:
        if "error" in message:
            raise ReadError(str(message["error"]))
        if "memory" in message:
            raise ReadError(
                f"{self.path}: {self.library} needs more than {message['memory']} MiB of memory to read it, which is beyond what "
                "a log of its size takes; copy the file again, or export a CSV"
            )

    def _end(self, verb: str) -> str:
        """What became of the process, in words."""
        code = self.process.wait()
        if self.late or code == -getattr(signal, "SIGXCPU", 0):
            return f"damaged or too much, {self.library} took too long while the file was {verb}"
        name = f"signal {signal.Signals(-code).name}" if -code in {int(s) for s in signal.Signals} else f"code {code}"
        return f"damaged or too much, {self.library} ended ({name}) while the file was {verb}"
