"""Files that gaident writes: the old content or all of the new one, whatever stands at the path and whoever writes beside."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.files import write_whole

SOME_TIMES = """
import sys
from gaident.files import write_whole
done = 0
for _ in range(25):
    write_whole(sys.argv[1], sys.argv[2].encode() * 200_000)
    done += 1
print(done)
"""
FOR_EVER = """
import sys
from gaident.files import write_whole
k = 0
while True:
    write_whole(sys.argv[1], bytes([65 + k % 26]) * 300_000)
    k += 1
"""


def test_a_device_is_written_in_place(tmp_path: Path) -> None:
    device = tmp_path / "null"
    try:
        os.mknod(device, 0o600 | stat.S_IFCHR, os.makedev(1, 3))
        write_whole(device, b"text")
    except PermissionError:
        pytest.skip("only root makes devices, and some file systems have none")
    assert stat.S_ISCHR(device.stat().st_mode)
    write_whole(os.devnull, b"text")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


def test_a_pipe_is_written_in_place_and_never_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="No such device"):
        write_whole(pipe, b"nobody reads")
    content = os.urandom(500_000)
    read: list[bytes] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        try:
            write_whole(pipe, content)
            break
        except OSError:  # the reader has not opened it yet
            time.sleep(0.01)
    reader.join(20.0)
    assert read == [content]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_a_link_stays_a_link_and_the_mode_stays(tmp_path: Path) -> None:
    file, link = tmp_path / "results" / "a.json", tmp_path / "latest.json"
    file.parent.mkdir()
    file.write_bytes(b"old")
    file.chmod(0o640)
    link.symlink_to(file)
    write_whole(link, b"new")
    assert (link.is_symlink(), file.read_bytes(), stat.S_IMODE(file.stat().st_mode)) == (True, b"new", 0o640)
    new = tmp_path / "new.json"
    write_whole(new, b"x")
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(new.stat().st_mode) == 0o666 & ~umask
    assert sorted(p.name for p in tmp_path.iterdir()) == ["latest.json", "new.json", "results"]


def test_a_write_protected_file_stays(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_bytes(b"old")
    file.chmod(0o444)
    with pytest.raises(PermissionError, match="write-protected; choose another name"):
        write_whole(file, b"new")
    assert file.read_bytes() == b"old"


def test_threads_with_one_target_tear_and_lose_nothing(tmp_path: Path) -> None:
    target, failed = tmp_path / "t.json", []

    def write(letter: bytes) -> None:
        for _ in range(50):
            try:
                write_whole(target, letter * 200_000)
            except OSError as error:
                failed.append(error)
            if len(set(target.read_bytes())) != 1:
                failed.append(OSError("torn"))

    threads = [threading.Thread(target=write, args=(letter,)) for letter in (b"a", b"b", b"c", b"d")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed
    assert [p.name for p in tmp_path.iterdir()] == ["t.json"]


def test_processes_with_one_target_tear_and_lose_nothing(tmp_path: Path) -> None:
    """Each says how often it wrote; one is killed amid its work, and its rest is removed by the next write."""
    target = tmp_path / "t.json"
    write_whole(target, b"Z" * 200_000)
    letters = ("a", "b", "c", "d")
    writers = [
        subprocess.Popen([sys.executable, "-c", SOME_TIMES, str(target), letter], stdout=subprocess.PIPE, text=True)
        for letter in letters
    ]
    seen: set[bytes] = set()
    with subprocess.Popen([sys.executable, "-c", FOR_EVER, str(target)]) as killed:
        while any(writer.poll() is None for writer in writers):
            content = target.read_bytes()
            assert len(set(content)) == 1 and len(content) in (200_000, 300_000)
            seen.add(content[:1])
        killed.send_signal(signal.SIGKILL)
    assert [writer.communicate()[0].split() for writer in writers] == [["25"]] * len(writers)
    assert {letter.encode() for letter in letters} & seen
    content = target.read_bytes()
    assert len(set(content)) == 1 and len(content) in (200_000, 300_000)
    write_whole(target, b"end")
    assert [p.name for p in tmp_path.iterdir()] == ["t.json"] and target.read_bytes() == b"end"


def test_a_killed_write_leaves_a_whole_file_and_its_rest_is_removed_by_the_next(tmp_path: Path) -> None:
    target = tmp_path / "t.json"
    write_whole(target, b"Z" * 300_000)
    # What a write leaves that is killed between its first byte and the new name, for certain.
    (tmp_path / ".gaident-0123456789abcdef.part").write_bytes(b"rest")
    for wait in (0.0, 0.003, 0.01, 0.02, 0.03):
        before = target.stat().st_ino
        with subprocess.Popen([sys.executable, "-c", FOR_EVER, str(target)]) as process:
            deadline = time.monotonic() + 30.0
            while target.stat().st_ino == before and time.monotonic() < deadline:
                time.sleep(0.001)
            time.sleep(wait)
            process.send_signal(signal.SIGKILL)
        content = target.read_bytes()
        assert (len(content), len(set(content))) == (300_000, 1)
    write_whole(target, b"end")
    assert [p.name for p in tmp_path.iterdir()] == ["t.json"]


def test_the_content_is_on_the_disk_before_the_name_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    sync, replace = os.fsync, Path.replace
    monkeypatch.setattr(os, "fsync", lambda fd: (done.append("sync"), sync(fd))[1])
    monkeypatch.setattr(Path, "replace", lambda path, to: (done.append("rename"), replace(path, to))[1])
    write_whole(tmp_path / "a", b"x")
    assert done == ["sync", "rename", "sync"]


def test_a_failed_write_leaves_what_stood_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a"
    target.write_bytes(b"old")

    def full(descriptor: int, content: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match="No space"):
        write_whole(target, b"new")
    monkeypatch.undo()
    assert target.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_a_name_of_255_letters_and_no_path(tmp_path: Path) -> None:
    long = tmp_path / ("x" * 255)
    write_whole(long, b"1")
    assert long.read_bytes() == b"1"
    rec = ga.Record(1e-3, torque=np.ones(20), velocity=np.zeros(20))
    for bad in (3, b"a.json", "a\0b", None):
        with pytest.raises(ga.GaidentError, match=r"^path is"):
            rec.save(bad)  # type: ignore[arg-type]
