"""Which logs there are, whose they are and of when: what paths say."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime, timezone
from pathlib import PurePath

from gaident.checks import checked_path
from gaident.errors import SettingsError

__all__ = ["Names", "names_of", "paths_of"]

Names = Callable[[str], tuple[str, datetime]]
"""Path of a log -> (name of the axis, time of the log)."""

_DATE = re.compile(
    r"(?<!\d)(20\d\d)[-_.]?(0[1-9]|1[0-2])[-_.]?(0[1-9]|[12]\d|3[01])"
    r"(?:[T_ -]?([01]\d|2[0-3])[-_.:h]?([0-5]\d)(?:[-_.:m]?([0-5]\d))?)?"
)


def paths_of(logs: object) -> Iterator[str]:
    """The paths that an argument means: a pattern, or paths and patterns; one after the other, in no order.

    Raises SettingsError for all else, and where a pattern fits no file.
    """
    if isinstance(logs, (str, os.PathLike)):
        yield from _fitting(checked_path(logs, "logs", SettingsError).as_posix())
        return
    if not isinstance(logs, Iterable):
        raise SettingsError(f"logs is {logs!r:.80}: give a pattern such as 'logs/**/*.csv', or a list of paths")
    for log in logs:
        yield from _fitting(checked_path(log, "logs", SettingsError).as_posix())


def _fitting(path: str) -> Iterator[str]:
    if not glob.has_magic(path) or os.path.exists(path):
        yield path
        return
    found = False
    for fitting in glob.iglob(path, recursive=True):
        if os.path.isfile(fitting):
            found = True
            yield fitting
    if not found:
        raise SettingsError(f"logs is {path!r}: no file fits this pattern; check the folder it begins in, and its ending")


def names_of(names: object) -> Names:
    """What reads axis and time out of a path; raises SettingsError."""
    if names is None:
        return _by_folder
    if callable(names):
        return names
    if not isinstance(names, str):
        raise SettingsError(f"names is {names!r:.80}: give a regular expression with the group (?P<axis>...), or a function")
    try:
        pattern = re.compile(names)
    except re.error as error:
        raise SettingsError(f"names is {names!r}: this is no regular expression ({error}); correct it") from None
    if "axis" not in pattern.groupindex:
        raise SettingsError(f"names is {names!r}: it has no group (?P<axis>...), which says whose log it is; add it")

    def named(path: str) -> tuple[str, datetime]:
        match = pattern.search(path)
        if match is None:
            raise SettingsError(f"names is {names!r}: it does not fit {path}; correct it, or leave that log out")
        own = match.groupdict().get("time")
        if own is None:
            return match["axis"], _by_folder(path)[1]
        date = _DATE.search(own)
        if date is None:
            raise SettingsError(f"names is {names!r}: its group time is {own!r} in {path}, no date like 2026-03-31T14:05")
        return match["axis"], _time(date, path)

    return named


def _by_folder(path: str) -> tuple[str, datetime]:
    """The folder is the axis; the date in the file's name, or in that of a folder, its time, or else that of its last change."""
    parts = PurePath(path).parts
    folder = next((p for p in parts[-2::-1] if not _DATE.fullmatch(p)), "") if parts[1:] else ""
    for part in reversed(parts):
        if (date := _DATE.search(part)) is not None:
            return folder or "axis", _time(date, path)
    try:
        changed = os.stat(path).st_mtime
    except OSError:  # the task says what is wrong with it
        changed = 0.0
    return folder or "axis", datetime.fromtimestamp(int(changed), timezone.utc)


def _time(date: re.Match[str], path: str) -> datetime:
    year, month, day, hour, minute, second = (int(part or 0) for part in date.groups())
    try:
        return datetime(year, month, day, hour, minute, second, tzinfo=timezone.utc)
    except ValueError as error:
        raise SettingsError(f"logs: the date {date[0]!r} in {path} is none ({error}); rename the log, or give names=") from None
