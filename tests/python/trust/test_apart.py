"""Foreign formats are read in a process of their own: what crashes, hangs or fills the memory there is an error here."""

from __future__ import annotations

import _thread
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from multiprocessing import spawn
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.data.formats.foreign import apart
from gaident.errors import ReadError

LOG = b"\x89HDF\r\n\x1a\n" + bytes(2000)  # the library that is stood in for does not look at it

LIBRARY = """
import os, sys, time
class File:
    def __init__(self, *_, **__):
        {}
    def __enter__(self):
        return self
    def __exit__(self, *_):
        pass
    def visititems(self, function):
        pass
class Dataset:
    pass
"""

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="the limits are those of POSIX")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A log in a format whose library `stand_in` writes."""
    path = tmp_path / "log.h5"
    path.write_bytes(LOG)
    return path


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, does: str) -> None:
    """A library called h5py that does this when it opens a file."""
    (folder / "h5py.py").write_text(LIBRARY.format(does))
    monkeypatch.syspath_prepend(folder)


@POSIX
@pytest.mark.parametrize(
    ("does", "said"),
    [
        ("os.kill(os.getpid(), 11)", r"h5py ended \(signal SIGSEGV\) while the file was opened; copy the file again"),
        ("os.abort()", r"h5py ended \(signal SIGABRT\)"),
        ("os._exit(3)", r"h5py ended \(code 3\)"),
        ("sys.exit(0)", r"h5py ended \(code 0\)"),
        ("bytearray(4 << 30)", r"h5py needs more than 768 MiB of memory to read it"),
        ("[bytes(1 << 20) for _ in iter(int, 1)]", r"h5py needs more than 768 MiB of memory to read it"),
        ("print('x' * 100_000); os.write(1, b'{}' * 100_000); os.write(2, b'damaged'); raise OSError('flaw')", r"\(flaw\)"),
        ("raise RuntimeError('a\\nb')", r"not a whole HDF5 file \(a\)"),
        ("sys.stdin.read(); os.read(0, 10); raise OSError('flaw')", r"\(flaw\)"),
    ],
)
def test_what_a_library_does_is_an_error_that_names_the_file(
    does: str, said: str, log: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    stand_in(log.parent, monkeypatch, does)
    with pytest.raises(ReadError, match=rf"^{log}: .*{said}") as caught:
        ga.read(log)
    assert "\n" not in str(caught.value) and "export a CSV" in str(caught.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.long
@POSIX
@pytest.mark.parametrize("does", ["exec('while True: pass')", "[sum(range(10**9)) for _ in range(100)]"])
def test_a_library_that_does_not_end_is_stopped(does: str, log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(log.parent, monkeypatch, does)
    began = time.perf_counter()
    with pytest.raises(ReadError, match=rf"^{log}: .*h5py took too long while the file was opened; copy the file again"):
        ga.read(log)
    assert time.perf_counter() - began < 30.0  # 5 s of processor time, on a machine that does other things


def test_a_library_that_waits_is_stopped_by_the_clock(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "_ANSWER", 1.0)
    stand_in(log.parent, monkeypatch, "time.sleep(600)")
    with pytest.raises(ReadError, match=r"h5py took too long while the file was opened"):
        ga.read(log)


def test_nothing_stays_of_a_process_that_was_stopped(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = log.parent / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    does = "import tempfile; tempfile.mkstemp(); open('here', 'w').close(); os.abort()"
    stand_in(log.parent, monkeypatch, does)
    for _ in range(2):
        with pytest.raises(ReadError, match="h5py ended"):
            ga.read(log)
    assert not list(temporary.iterdir())


def written(path: Path) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["time"], file["torque"], file["velocity"] = np.arange(50) * 1e-3, np.arange(50.0), np.arange(50.0) ** 2
    return path


SCRIPT = """
import gaident as ga
print(len(ga.read("log.h5")))
assert "h5py" not in __import__("sys").modules
"""


def test_a_script_without_a_guard_reads_and_imports_no_library(tmp_path: Path) -> None:
    """Modules of the same names in the working folder are not imported."""
    written(tmp_path / "log.h5")
    scripts = tmp_path / "scripts"
    scripts.mkdir()
    (scripts / "script.py").write_text(SCRIPT)
    for name in ("json", "numpy", "h5py", "gaident"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the module of the working folder')")
    command = [sys.executable, str(scripts / "script.py")]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=60)
    assert (done.stdout, done.stderr) == ("50\n", "")


def test_a_program_that_contains_python_is_told_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "log.h5")
    for program in (str(tmp_path / "nothing"), "true" if sys.platform == "win32" else "/bin/true"):
        monkeypatch.setattr(spawn, "_python_exe", os.fsencode(program))
        with pytest.raises(ReadError, match=r"log\.h5: HDF5 is read in a process of its own.*does not start.*set_executable"):
            ga.read(path)
    multiprocessing.set_executable(sys.executable)
    assert len(ga.read(path)) == 50


@POSIX
def test_names_that_are_no_text_are_read(tmp_path: Path) -> None:
    path = written(tmp_path / "log.h5")
    odd = Path(os.fsdecode(os.fsencode(tmp_path) + b"/l\xe9g \n.h5"))
    path.rename(odd)
    assert len(ga.read(odd)) == 50


def test_reading_ends_with_the_interrupt(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C while the library hangs: the error is KeyboardInterrupt, at once, and no process stays."""
    stand_in(log.parent, monkeypatch, "time.sleep(600)")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # some shells start jobs with it ignored
    timer = threading.Timer(1.0, _thread.interrupt_main)
    timer.start()
    began = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        ga.read(log)
    assert time.perf_counter() - began < 3.0
