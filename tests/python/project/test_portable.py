"""What Windows has not is called in one module, and that module works without it; see docs/install.md."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from places import PACKAGE, ROOT

# Modules and functions of POSIX alone, and of Windows alone.
MODULES = {"fcntl", "grp", "msvcrt", "pty", "pwd", "resource", "syslog", "termios", "tty", "winreg"}
POSIX = {"chown", "fchmod", "fchown", "fork", "getuid", "lchown", "mkfifo", "mknod", "nice", "set_blocking", "uname"}
FLAGS = {"O_NOCTTY", "O_NOFOLLOW", "O_NONBLOCK", "O_SYNC"}
ONE = PACKAGE / "files.py"

# As on Windows, as far as this machine can be like it: no POSIX modules, functions and flags, and no open file gets another name.
AS_ON_WINDOWS = """
import contextlib, errno, os, pathlib, secrets, stat, sys, types
import gaident.checks
locked = []
def locking(descriptor, how, size):
    if os.fstat(descriptor).st_ino in locked:
        raise PermissionError(errno.EACCES, "locked")
    locked.append(os.fstat(descriptor).st_ino)
sys.modules["msvcrt"] = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
sys.modules["fcntl"] = None
for name in {missing}:
    if hasattr(os, name):
        delattr(os, name)
replace = pathlib.Path.replace
def of_closed(path, target):
    opened = [os.readlink(f"/proc/self/fd/{{n}}") for n in range(3, 64) if os.path.lexists(f"/proc/self/fd/{{n}}")]
    assert str(path.resolve()) not in opened
    return replace(path, target)
pathlib.Path.replace = of_closed
sys.platform = "win32"
from gaident.files import lock_alone, write_whole
folder = pathlib.Path(sys.argv[1])
for content in (b"first\\n", b"second\\n"):
    write_whole(folder / "a.txt", content)
    assert (folder / "a.txt").read_bytes() == content
write_whole(os.devnull, b"nothing")
assert [path.name for path in folder.iterdir()] == ["a.txt"]
with open(folder / "a.txt", "rb+") as one:
    lock_alone(one.fileno())
    try:
        lock_alone(one.fileno())
    except BlockingIOError:
        print("locked")
"""


def test_one_module_calls_what_windows_has_not() -> None:
    found = []
    for file in sorted(PACKAGE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [node.attr] if isinstance(node, ast.Attribute) else []
            found += [(file.relative_to(ROOT), name) for name in names if name in MODULES | POSIX | FLAGS]
    assert {file for file, _ in found} == {ONE.relative_to(ROOT)}, found
    assert {"fcntl", "msvcrt", "fchown", "O_NOFOLLOW"} <= {name for _, name in found}


def test_the_core_includes_only_the_standard_library() -> None:
    allowed = {"<immintrin.h>", "<xmmintrin.h>", "<arm_neon.h>"}  # instructions of a processor, each behind its macro
    lines = [
        line.split(maxsplit=1)[1]
        for file in sorted((ROOT / "csrc" / "gaident").rglob("*.?pp"))
        for line in file.read_text(encoding="utf-8").splitlines()
        if line.startswith("#include <")
    ]
    assert len(lines) > 100
    assert {line for line in lines if ".h>" in line} == allowed


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="which files are open is asked of /proc")
def test_files_are_whole_without_posix(tmp_path: Path) -> None:
    code = AS_ON_WINDOWS.format(missing=sorted(POSIX | FLAGS))
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "locked\n"), done.stderr
