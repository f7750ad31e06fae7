"""How far long work has come: a line with bar, percentage, time left and what is being done, on a terminal or in a notebook."""

from __future__ import annotations

import importlib
import sys
import threading
import time
from collections.abc import Callable
from html import escape
from types import TracebackType
from typing import TextIO

from gaident.messages import Message, shortest

__all__ = ["Progress", "progress"]

_QUIET = 0.3  # s of work before anything is drawn
_FRACTION = 0.02  # of the work: before that no time left is told


class Progress:
    """Draws `(fraction, message)`; as a context it gives the function that takes them.

    Nothing is drawn, and None is given instead of a function, where `stream` is neither a terminal nor a notebook.
    On a terminal it appears after a moment whether or not something was told since, so that no long step looks like a standstill.
    NO_COLOR is respected. What was drawn is gone when the context ends.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self.stream = stream if stream is not None and (stream.isatty() or _in_notebook()) else None
        self.began = time.monotonic()
        self.bar: _TerminalBar | _NotebookBar | None = None
        self._told = 0.0, "starting"
        self._lock = threading.Lock()
        self._alarm: threading.Timer | None = None

    def __enter__(self) -> Callable[[float, str], None] | None:
        if self.stream is None:
            return None
        if not _in_notebook():  # a kernel shows what a thread draws in another cell
            self._alarm = threading.Timer(_QUIET, self._late)
            self._alarm.daemon = True
            self._alarm.start()
        return self.show

    def show(self, fraction: float, message: str) -> None:
        """fraction of the work that is done, 0 to 1; message: generation, best fitness, species, or what else is under way."""
        with self._lock:
            self._told = min(max(fraction, 0.0), 1.0), message
            if self.bar is not None or time.monotonic() - self.began >= _QUIET:
                self._draw()

    def doing(self, message: str) -> None:
        """What is under way now, as far as before."""
        if self.stream is not None:
            self.show(self._told[0], message)

    def _late(self) -> None:
        with self._lock:
            if self._alarm is not None and self.bar is None:
                self._draw()

    def _draw(self) -> None:
        if self.bar is None:
            self.bar = _NotebookBar() if _in_notebook() else _TerminalBar(self.stream)
        done, message = self._told
        left = (time.monotonic() - self.began) * (1.0 - done) / done if _FRACTION < done < 1.0 else None
        remains = "" if left is None else Message(f"about {_clock(left)} left", f"{_clock(left)} left")
        self.bar.update(done, message, remains)

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None) -> None:
        with self._lock:
            if self._alarm is not None:
                self._alarm.cancel()
                self._alarm = None
            if self.bar is not None:
                self.bar.stop()
                self.bar = None


class _TerminalBar:
    """A line drawn by rich."""

    def __init__(self, stream: TextIO | None) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
        from rich.progress import Progress as Bar

        texts = [TextColumn("{task.fields[left]}"), TextColumn("{task.fields[message]}", markup=False)]
        times = [TaskProgressColumn(), TimeElapsedColumn()]
        console = Console(file=stream, force_jupyter=False)
        # The streams are left alone: what is printed beside the bar goes where it was meant to.
        width = 24 if console.width >= 110 else 12
        self.taken = width + len(" 100% 0:00:00  ") + 1  # of the line, without the texts
        self.bar = Bar(
            BarColumn(width), *times, *texts, console=console, transient=True, redirect_stdout=False, redirect_stderr=False
        )
        self.task = self.bar.add_task("", total=1.0, message="", left="")
        self.bar.start()

    def update(self, done: float, message: str, left: str) -> None:
        # Where the line is too short, rich would shorten bar, percentage and time too: the words give way, then the message.
        width = self.bar.console.width - self.taken
        if len(left) + len(message) > width:
            left, message = shortest(left), shortest(message)
        room = max(0, width - len(left))
        shown = message if len(message) <= room else message[: max(0, room - 1)].rstrip() + "…"[:room]
        self.bar.update(self.task, completed=done, message=shown, left=left)

    def stop(self) -> None:
        self.bar.stop()


class _NotebookBar:
    """The same as HTML in the cell's output, ten times a second at most; needs no widgets."""

    def __init__(self) -> None:
        display = importlib.import_module("IPython.display")
        self.handle = display.display({"text/plain": "", "text/html": ""}, raw=True, display_id=True)
        self.last = 0.0

    def update(self, done: float, message: str, left: str) -> None:
        if time.monotonic() - self.last < 0.1:
            return
        self.last = time.monotonic()
        self._show(
            f'<progress max="1" value="{done:.4f}"></progress> ',
            "  ".join(filter(None, [f"{100.0 * done:.0f} %", left, message])),
        )

    def stop(self) -> None:
        self._show("", "")

    def _show(self, bar: str, text: str) -> None:
        self.handle.update({"text/plain": text, "text/html": bar + escape(text)}, raw=True)


def progress() -> Progress:
    """Show how far `identify` or `diagnose` have come, in a script or a notebook.

    Draws on standard error, in a notebook below the cell; nothing in a pipe.

    Returns
    -------
    Progress
        A context that gives the function for the argument `progress`.

    Examples
    --------
    >>> import numpy as np
    >>> import gaident as ga
    >>> torque = np.repeat([1.0, -1.0, 0.5, -0.5], 100)
    >>> still = ga.Record(1e-3, torque=torque, velocity=0.0 * torque)
    >>> rec = ga.Record(1e-3, torque=torque, velocity=ga.simulate(ga.OneMass(J=0.01, D=0.05), still))
    >>> with ga.progress() as shown:
    ...     idn = ga.identify(rec, progress=shown)
    """
    return Progress(sys.stderr)


def _in_notebook() -> bool:
    """Whether this runs in a notebook's kernel, as IPython says."""
    shell = sys.modules.get("IPython")
    if shell is None:
        return False
    instance = shell.get_ipython()
    return any(kind.__name__ == "ZMQInteractiveShell" for kind in type(instance).__mro__)  # Colab's is derived from it


def _clock(seconds: float) -> str:
    whole = max(1, round(seconds))
    return f"{whole} s" if whole < 100 else f"{whole // 60}:{whole % 60:02d} min" if whole < 6000 else f"{whole / 3600:.1f} h"
