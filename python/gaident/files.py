"""Files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import secrets
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gaident.checks import checked_path

__all__ = ["check_writable", "write_whole"]

_PREFIX, _SUFFIX = ".gaident-", ".part"


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise what `write_whole` would raise for this path, before the work whose result is written there."""
    _place(path)


def write_whole(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file so that its name shows the old content or all of the new one, whenever the process or the machine stops.

    The content goes to a file of another name in the same folder, then to the disk, then the name is changed.
    A file that is there already keeps its mode, and its owner where the system allows it; a symbolic link stays a link,
    and the file that it points to is written.
    A pipe or a character device, such as /dev/null, is written in place.

    Parameters
    ----------
    path : str or path-like
        The file.
    content : bytes
        All of it.

    Raises
    ------
    OSError
        Where that fails, where the file is write-protected, or where it is a folder, a socket or a disk; what stood there stays.
    GaidentError
        Where `path` is no path.
    """
    target, found = _place(path)
    if found is not None and not stat.S_ISREG(found.st_mode):
        _write_in_place(target, content)
        return
    _remove_leftovers(target.parent)
    with _temporary(target.parent, 0o666 if found is None else 0o600) as (descriptor, temporary):
        if found is not None:
            with contextlib.suppress(PermissionError):  # only root gives files away; the content counts
                os.fchown(descriptor, found.st_uid, found.st_gid)
            os.fchmod(descriptor, found.st_mode & 0o777)
        _write_all(descriptor, content)
        os.fsync(descriptor)
        temporary.replace(target)
    with contextlib.suppress(OSError):  # some file systems cannot do this for a folder
        _sync_folder(target.parent)


def _place(path: str | os.PathLike[str]) -> tuple[Path, os.stat_result | None]:
    """Where the content goes, behind links, and what stands there; raises where nothing can be written."""
    given = checked_path(path)
    found = _stat_of(given)
    if found is not None and not stat.S_ISREG(found.st_mode):
        if stat.S_ISDIR(found.st_mode):
            raise IsADirectoryError(errno.EISDIR, "this is a folder; name a file in it", str(given))
        if not (stat.S_ISCHR(found.st_mode) or stat.S_ISFIFO(found.st_mode)):
            raise OSError(errno.EINVAL, "this is no file, pipe or character device; name a file", str(given))
        return given, found
    target = Path(os.path.realpath(given))
    if not target.parent.is_dir():
        raise FileNotFoundError(f"cannot write {target}: there is no folder {target.parent}; create it first")
    if found is not None and not (found.st_mode & 0o222 and os.access(target, os.W_OK)):
        raise PermissionError(errno.EACCES, "the file is write-protected; choose another name, or allow writing", str(target))
    return target, found


def _stat_of(path: Path) -> os.stat_result | None:
    """What stands at the path, behind links; None: nothing yet."""
    try:
        return os.stat(path)
    except FileNotFoundError:
        return None


def _write_in_place(path: Path, content: bytes) -> None:
    # Without waiting, a pipe that nobody reads is an error and not a wait without end.
    descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
    try:
        os.set_blocking(descriptor, True)
        _write_all(descriptor, content)
    finally:
        os.close(descriptor)


def _write_all(descriptor: int, content: bytes) -> None:
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(descriptor, rest) :]


@contextmanager
def _temporary(folder: Path, mode: int) -> Iterator[tuple[int, Path]]:
    """A new file of a name that no other write has, locked while it is open; it is removed unless it was renamed."""
    while True:
        path = folder / f"{_PREFIX}{secrets.token_hex(8)}{_SUFFIX}"
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        try:
            with contextlib.suppress(OSError):  # a file system without locks: leftovers stay there
                fcntl.flock(descriptor, fcntl.LOCK_EX)
            # Another write may have taken the file for a leftover before it was locked.
            if os.fstat(descriptor).st_nlink:
                yield descriptor, path
                return
        finally:
            path.unlink(missing_ok=True)
            os.close(descriptor)


def _remove_leftovers(folder: Path) -> None:
    """Remove what writes left that were killed: files of such a name that no process has locked."""
    for path in folder.glob(f"{_PREFIX}*{_SUFFIX}"):
        with contextlib.suppress(OSError):
            descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOFOLLOW)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink()
            finally:
                os.close(descriptor)


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
