"""Files that appear whole or not at all, locks, and the streams and limits of a process.

The only module that calls what Windows has not, or has otherwise.
There a file that is open cannot be removed or replaced, so that no lock has to say that it is in use.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from gaident.checks import checked_path

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl
    import resource

__all__ = ["check_writable", "detached_streams", "limit_memory", "limit_seconds", "lock_alone", "write_whole"]

_PREFIX, _SUFFIX = ".gaident-", ".part"
_BINARY: int = getattr(os, "O_BINARY", 0)  # no decision: Windows, where ends of lines are changed without it


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise what `write_whole` would raise for this path, before the work whose result is written there."""
    _place(path)


def lock_alone(descriptor: int) -> None:
    """Lock an open file until it is closed; raises BlockingIOError where another process has locked it."""
    if sys.platform == "win32":
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError as error:
            raise BlockingIOError(errno.EWOULDBLOCK, "another process has locked the file") from error
    else:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def detached_streams() -> tuple[BinaryIO, BinaryIO]:
    """Return what this process is asked and where it answers; its usual streams lead nowhere from here on."""
    questions, answers = os.dup(0), os.dup(1)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for usual in (0, 1, 2):
        os.dup2(nowhere, usual)
    os.close(nowhere)
    if sys.platform == "win32":
        msvcrt.setmode(questions, os.O_BINARY)
        msvcrt.setmode(answers, os.O_BINARY)
        msvcrt.SetErrorMode(msvcrt.SEM_FAILCRITICALERRORS | msvcrt.SEM_NOGPFAULTERRORBOX)  # no window at a crash
    return os.fdopen(questions, "rb"), os.fdopen(answers, "wb")


def limit_memory(room: int) -> None:
    """Let this process take `room` bytes more, and leave no file of its memory at a crash; where the system has such limits."""
    if sys.platform != "win32":
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        with contextlib.suppress(OSError, ValueError):  # where a system does not say what is taken, or keeps no such limit
            pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
            hard = resource.getrlimit(resource.RLIMIT_AS)[1]
            resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + room, hard))


def limit_seconds(seconds: float) -> None:
    """Let this process end at so many seconds of processor time; only where the system has such limits."""
    if sys.platform != "win32":
        with contextlib.suppress(OSError, ValueError):
            hard = resource.getrlimit(resource.RLIMIT_CPU)[1]
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, hard))


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
    with _renamed(target, 0o666 if found is None else 0o600) as descriptor:
        if found is not None and sys.platform != "win32":
            with contextlib.suppress(PermissionError):  # only root gives files away; the content counts
                os.fchown(descriptor, found.st_uid, found.st_gid)
            os.fchmod(descriptor, found.st_mode & 0o777)
        _write_all(descriptor, content)
        os.fsync(descriptor)
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
    if sys.platform == "win32":
        path.write_bytes(content)
        return
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
def _renamed(target: Path, mode: int) -> Iterator[int]:
    """A new file of a name that no other write has, locked while it is open; it gets the target's name, or is removed."""
    while True:
        path = target.parent / f"{_PREFIX}{secrets.token_hex(8)}{_SUFFIX}"
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _BINARY, mode)
        whole = False
        try:
            if sys.platform != "win32":
                with contextlib.suppress(OSError):  # a file system without locks: leftovers stay there
                    fcntl.flock(descriptor, fcntl.LOCK_EX)
            # Another write may have taken the file for a leftover before it was locked.
            if os.fstat(descriptor).st_nlink:
                yield descriptor
                whole = True
                if sys.platform != "win32":
                    path.replace(target)  # while it is locked
                return
        finally:
            os.close(descriptor)
            try:
                if whole and sys.platform == "win32":
                    path.replace(target)  # an open file gets no other name there
            finally:
                path.unlink(missing_ok=True)


def _remove_leftovers(folder: Path) -> None:
    """Remove what writes left that were killed: files of such a name that no process has locked."""
    for path in folder.glob(f"{_PREFIX}*{_SUFFIX}"):
        # On Windows, where none is told from one that is being written, what was killed stays.
        with contextlib.suppress(OSError):
            if sys.platform != "win32":
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
