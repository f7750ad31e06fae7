"""What the command line writes: files, whole or not at all, pictures, summaries, JSON."""

from __future__ import annotations

import io
import shlex
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaident.checks import check_installed
from gaident.errors import SettingsError
from gaident.files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaident.data.record import Record
    from gaident.models.simulate import Run
    from gaident.results.experiment import Proposal
    from gaident.results.identification import Identification

__all__ = [
    "apart",
    "csv_targets",
    "csv_text",
    "naming",
    "print_json",
    "program",
    "proposal_csv",
    "save_figure",
    "summary_of",
    "target_of",
    "write",
]


def program() -> str:
    """How this program is called again, for a line to paste: gaident where the shell finds it, else with its folder."""
    called = Path(sys.argv[0])
    if called.stem != "gaident" or shutil.which("gaident") is not None:
        return "gaident"
    return shlex.quote(str(called))


def csv_text(rec: Record, result: Run | None, axis: str) -> str:
    """The run, or without one the record itself, as `gaident` reads it again."""
    from gaident.axis import unit, velocity_unit

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
    if suffixes:
        check_installed(("matplotlib",), "pictures", "a picture")
    if suffixes and target.suffix.lower() not in suffixes:
        raise SettingsError(f"{path}: a picture ends in {', '.join(suffixes)}; rename it")
    if any(target.exists() and Path(log).exists() and target.samefile(log) for log in logs):
        raise SettingsError(f"{path}: this is the log itself; write to another file")
    if target.is_dir():
        raise IsADirectoryError(f"cannot write {path}: it is a folder; name a file in it")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"cannot write {path}: there is no folder {target.parent}; create it first")
    return target


def apart(targets: Mapping[str, Path | None]) -> None:
    """Raises where two options name the same file."""
    seen: dict[Path, str] = {}
    for option, target in targets.items():
        if target is not None and (first := seen.setdefault(target.resolve(), option)) != option:
            raise SettingsError(f"{first} and {option} both name {target}: the second would overwrite the first; give two files")


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


def summary_of(idn: Identification, axis: str, units: Mapping[str, str | float] | None = None) -> str:
    """The summary, its remedies as options."""
    from gaident.show.summary import identification_summary

    return identification_summary(idn, axis, units)


def save_figure(figure: Figure, path: Path) -> None:
    """A picture in the format that its name ends in."""
    drawn = io.BytesIO()
    figure.savefig(drawn, format=path.suffix[1:].lower())
    write(path, drawn.getvalue())


def print_json(data: dict[str, Any]) -> None:
    """A result for programs."""
    from gaident.results.json_text import json_text

    print(json_text(data))
