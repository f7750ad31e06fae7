"""Which logs there are, whose they are and of when: what paths say."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import datetime, timezone
from pathlib import PurePath
from urllib.parse import quote

from gaident.checks import checked_path
from gaident.errors import SettingsError
from gaident.fleets.task import shown

__all__ = ["Names", "named_logs", "names_of"]

Names = Callable[[str], tuple[str, datetime]]
"""Path of a log -> (name of the axis, time of the log)."""

LONGEST_NAME = 240  # no decision: a format: what a name of a folder may be

_DATE = re.compile(
    r"(?<!\d)(20\d\d)[-_.]?(0[1-9]|1[0-2])[-_.]?(0[1-9]|[12]\d|3[01])"
    r"(?:[T_ -]?([01]\d|2[0-3])[-_.:h]?([0-5]\d)(?:[-_.:m]?([0-5]\d))?)?"
)


def _paths_of(logs: object) -> Iterator[str]:
    """The paths that an argument means: a pattern, or paths and patterns; one after the other, in no order.

    Raises SettingsError for all else, and where a pattern fits no file.
    """
    if isinstance(logs, (str, os.PathLike)):
        yield from _fitting(checked_path(logs, "logs", SettingsError).as_posix())
        return
    if not isinstance(logs, Iterable) or isinstance(logs, Mapping | bytes):
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
            raise SettingsError(f"names is {names!r}: it does not fit {shown(path)}; correct it, or leave that log out")
        own = match.groupdict().get("time")
        if own is None:
            return match["axis"], _by_folder(path)[1]
        date = _DATE.search(own)
        if date is None:
            raise SettingsError(f"names is {names!r}: its group time is {own!r} in {shown(path)}, no date like 2026-03-31T14:05")
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
        where = f"the date {date[0]!r} in {shown(path)} is none ({error})"
        raise SettingsError(f"logs: {where}; rename the log, or give names=") from None


def named_logs(logs: object, named: Names) -> Iterator[tuple[str, str, str]]:
    """(path, axis, time) of each log; raises SettingsError where a function gives something else."""
    found = False
    for path in _paths_of(logs):
        found = True
        axis, when = _checked(named, path)
        if len(quote(axis, safe="")) > LONGEST_NAME:
            raise SettingsError(
                f"names gives the axis {axis!r} for {shown(path)}: too long for a folder, of {LONGEST_NAME} letters at most "
                "(one that is not ASCII counts as three and more); give names= that makes it shorter"
            )
        yield path, axis, when
    if not found:
        raise SettingsError("logs is empty: give a pattern such as 'logs/**/*.csv', or a list of paths")


def _checked(named: Names, path: str) -> tuple[str, str]:
    """(axis, time in UTC) that a function of names says of a log; raises SettingsError."""
    try:
        given = named(path)
    except SettingsError:
        raise
    except Exception as error:
        remedy = "correct the function, or leave that log out"
        raise SettingsError(f"names raises {type(error).__name__} ({error}) for {shown(path)}: {remedy}") from error
    remedy = "return the name of the axis and a datetime"
    pair = isinstance(given, tuple) and len(given) == 2 and isinstance(given[0], str) and isinstance(given[1], datetime)
    if not pair or not given[0]:
        raise SettingsError(f"names gives {given!r:.80} for {shown(path)}: {remedy}")
    axis, when = given
    try:
        utc = when if when.tzinfo is None else when.astimezone(timezone.utc)
        return shown(axis), utc.replace(tzinfo=None).isoformat(timespec="seconds")
    except (OverflowError, ValueError) as error:
        raise SettingsError(f"names gives {given!r:.120} for {shown(path)} ({error}): {remedy}") from error
