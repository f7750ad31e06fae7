"""The command line in a shell: Ctrl-C, the progress bar on a terminal, output that is closed or full."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from cli_cases import LOOP, NAMES, command, interrupted
from clock import fastest
from gaident.cli import main

# The bar without its 0.3 s of waiting, so that a short run shows it; what is drawn takes some 0.2 s of search.
AT_ONCE = """
import sys
from gaident import cli
from gaident.show import progress_bar
progress_bar._QUIET = 0.0
sys.exit(cli.main(sys.argv[1:]))
"""
# What identify has imported; before, that parsing and help import none of it.
IMPORTED = """
import sys
from gaident.cli import main
heavy = ("numpy", "scipy", "matplotlib", "gaident.data.record", "gaident.diagnosis")
assert main(["identify", "--help"]) == 0 and main(["--help"]) == 0 and main(["identify", "--kp", "x"]) == 2
assert not [name for name in heavy if name in sys.modules]
assert main(sys.argv[1:]) == 0
print(*sys.modules, file=sys.stderr)
"""


def test_a_reader_that_goes_away(here: Path) -> None:
    with subprocess.Popen(
        command("identify", "step.csv", *NAMES, *LOOP, "--json"),
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        err = process.stderr.read()
        assert process.wait(30) == 141  # as of a process that SIGPIPE ends
    assert err == ""


def test_a_command_imports_what_it_needs(here: Path) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP]
    done = subprocess.run([sys.executable, "-c", IMPORTED, *args], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    imported = done.stderr.splitlines()[-1].split()
    assert "gaident.identification.identify" in imported
    # Of SciPy the tail of chi square and a least-squares solver: no statistics, no filters.
    assert not {"scipy.signal", "scipy.stats", "scipy.interpolate", "matplotlib"} & {*imported}
    assert not {"gaident.results.store", "gaident.cli.demonstration"} & {*imported}
    assert "gaident.identification.replay.replay" in imported  # the controller is run again on the log
    assert not [name for name in imported if name.startswith("gaident.diagnosis")]


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_ctrl_c_ends_within_half_a_second(here: Path) -> None:
    args = ["identify", "step.csv", *NAMES, *LOOP, "--trials", "100000", "--out", "idn.json"]
    assert fastest(lambda: interrupted(args, after=0.7), below=0.5) < 0.5
    assert [p.name for p in here.iterdir()] == ["step.csv"]


@pytest.mark.skipif(os.name != "posix", reason="pseudo terminals")
def test_progress_bar_on_a_terminal_only(here: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    import pty

    args = ["identify", "step.csv", *NAMES, *LOOP, "--paper", "--trials", "40", "--workers", "1"]
    ours, theirs = pty.openpty()
    with subprocess.Popen([sys.executable, "-c", AT_ONCE, *args], stdout=subprocess.PIPE, stderr=theirs, text=True) as process:
        os.close(theirs)
        seen = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # how Linux says that the other side is closed
                break
            if not part:
                break
            seen += part
        assert process.stdout is not None
        assert process.stdout.read().startswith("(p,q) = ")
        assert process.wait(30) == 0
    os.close(ours)
    text = re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", seen)
    bars = re.findall(rb" (\d+)%", text)
    assert bars and bars == sorted(bars, key=int)
    assert re.search(rb"\d+ s left gen(eration|\.) \d+, best (fitness )?[\d.e-]+", text)
    assert text.split(b"\r")[-1].strip() == b""  # nothing of it stays
    monkeypatch.setattr("gaident.show.progress_bar._QUIET", 0.0)
    assert main(["identify", "step.csv", *NAMES, *LOOP, "--paper", "--workers", "1"]) == 0
    assert capfd.readouterr().err == ""


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, which only Linux has")
@pytest.mark.parametrize(
    ("arguments", "buffered"),
    # argparse itself ignores that an unbuffered --version or --help cannot be written
    [(["--version"], True), (["--help"], True), (["effects"], True), (["effects"], False)],
)
def test_a_full_output_is_1_with_buffering_and_without(arguments: list[str], buffered: bool, tmp_path: Path) -> None:
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    environment |= {} if buffered else {"PYTHONUNBUFFERED": "1"}
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "gaident", *arguments], stdout=full, stderr=subprocess.PIPE, text=True,
            env=environment, cwd=tmp_path, timeout=60,
        )  # fmt: skip
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.splitlines()) == 1, done.stderr
