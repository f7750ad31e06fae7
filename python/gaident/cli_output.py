"""What the command line writes: files, whole or not at all, and a progress bar."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from gaident.data.record import Record
from gaident.diagnosis.experiments import Proposal
from gaident.errors import SettingsError
from gaident.files import write_whole
from gaident.models.simulate import Run

__all__ = ["Progress", "csv_targets", "csv_text", "naming", "proposal_csv", "target_of", "write"]


class Progress:
    """A bar on stderr from 0.3 s on; as a context it gives the callback, None where there is no terminal."""

    WIDTH = 24

    def __init__(self, stream: TextIO | None) -> None:
        self.terminal = stream if stream is not None and stream.isatty() else None
        self.began = time.monotonic()
        self.last = self.began + 0.2
        self.shown = False

    def __enter__(self) -> Callable[[float, str], None] | None:
        return None if self.terminal is None else self.show

    def show(self, fraction: float, message: str) -> None:
        """Draws the bar, ten times a second at most."""
        now = time.monotonic()
        if now - self.last < 0.1:
            return
        self.last = now
        self.shown = True
        full = round(self.WIDTH * min(max(fraction, 0.0), 1.0))
        bar = "#" * full + "." * (self.WIDTH - full)
        line = f"[{bar}] {100.0 * fraction:3.0f} %  {now - self.began:.0f} s  {message}"
        self._put(line[: shutil.get_terminal_size().columns - 1])

    def __exit__(self, *_: object) -> None:
        if self.shown:
            self._put("")

    def _put(self, line: str) -> None:
        if self.terminal is not None:
            self.terminal.write(f"\r{line}\x1b[K")
            self.terminal.flush()


def csv_text(rec: Record, result: Run | None, axis: str) -> str:
    """The run, or without one the record itself, as `gaident` reads it again."""
    from gaident.show.wording import unit, velocity_unit

    v = velocity_unit(axis)
    columns = {"time [s]": rec.time}
    if result is None and rec.command is not None:
        columns[f"command [{v}]"] = rec.command
    columns[f"velocity [{v}]"] = rec.velocity if result is None else result.velocity
    torque = rec.torque if result is None else result.torque
    if torque is not None:
        columns[f"torque [{unit('N m', axis)}]"] = torque
    rows = (",".join(f"{x:.12g}" for x in row) for row in zip(*columns.values(), strict=True))
    return "\n".join([",".join(columns), *rows, ""])


def proposal_csv(proposal: Proposal, axis: str) -> str:
    """A proposed command as a log that a drive's signal generator takes: time and command."""
    from gaident.show.report import command

    return command.proposal_csv(proposal, axis)


def target_of(path: str | None, logs: Sequence[str], suffixes: Sequence[str] = ()) -> Path | None:
    """Where to write, looked at before the work begins."""
    if path is None:
        return None
    target = Path(path)
    if suffixes and target.suffix.lower() not in suffixes:
        raise SettingsError(f"{path}: a picture ends in {', '.join(suffixes)}; rename it")
    if any(target.exists() and Path(log).exists() and target.samefile(log) for log in logs):
        raise SettingsError(f"{path}: this is the log itself; write to another file")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder; name a file in it")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: there is no folder {target.parent}; create it first")
    return target


def csv_targets(path: str | None, logs: Sequence[str], several: bool) -> list[Path]:
    if path is None:
        return []
    folder = Path(path)
    if not several and not folder.is_dir():
        target = target_of(path, logs)
        return [] if target is None else [target]
    folder.mkdir(parents=True, exist_ok=True)
    names = [Path(log).stem for log in logs]
    if len(set(names)) < len(names):
        raise SettingsError("two logs bear the same name, so would their CSV files: rename one, or use --json")
    found = [target_of(str(folder / f"{name}_simulated.csv"), logs) for name in names]
    return [target for target in found if target is not None]


def write(target: Path, content: bytes) -> None:
    """The file appears whole or not at all."""
    with naming(target):
        write_whole(target, content)


@contextmanager
def naming(target: Path) -> Iterator[None]:
    """What goes wrong in writing bears the name that the user gave."""
    try:
        yield
    except OSError as error:
        raise OSError(f"cannot write {target}: {error.strerror or error}") from error
