"""A two-mass drive's log and how the tests call the command line on it."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.cli import main

LOOP = ("--kp", "0.0232", "--ki", "1.367", "--loop", "continuous")
NAMES = ("--columns", "command=w_ref,velocity=w", "--columns", "torque=u,time=t")
TRUTH = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
LONG = """
import signal, sys
from gaident.cli.main import COMMANDS, _command, main
_command(COMMANDS[sys.argv[1]])  # imported: what is interrupted is the work
signal.signal(signal.SIGINT, signal.default_int_handler)  # some shells start jobs with it ignored
print("ready", flush=True)
sys.exit(main(sys.argv[1:]))
"""


def command(*args: object) -> list[str]:
    return [sys.executable, "-m", "gaident", *map(str, args)]


def called(*args: object, cwd: Path | None = None, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*args), capture_output=True, text=True, cwd=cwd, timeout=60, **more)


def write_step(path: str) -> None:
    """Writes the log of a two-mass drive, a velocity step."""
    controller = ga.PI(0.0232, 1.367, loop="continuous")
    still = ga.Record(0.444e-3, command=np.full(250, 43.6), velocity=np.zeros(250))
    run = ga.run(TRUTH, still, controller)
    velocity = run.velocity + 0.3 * np.random.default_rng(4).standard_normal(250)
    columns = np.column_stack([still.time, np.full(250, 43.6), velocity, run.torque])
    np.savetxt(path, columns, delimiter=",", header="t,w_ref,w,u", comments="")


def interrupted(args: list[str], after: float = 0.0, until: Callable[[], bool] = lambda: True) -> float:
    """Sends Ctrl-C to a call `after` so many seconds, and not before `until`; asserts that it ends with one line.

    Returns the seconds that it took to.
    """
    with subprocess.Popen(
        [sys.executable, "-c", LONG, *args], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(after)
        given_up = time.monotonic() + 60.0
        while not until():
            assert time.monotonic() < given_up and process.poll() is None
            time.sleep(0.05)
        assert process.poll() is None
        began = time.perf_counter()
        process.send_signal(signal.SIGINT)
        code = process.wait(30)
        seconds = time.perf_counter() - began
        assert process.stdout.read() == ""
        assert process.stderr.read() == "gaident: interrupted\n"
    assert code == 130
    return seconds


def refusal(args: list[str], capsys: pytest.CaptureFixture[str], code: int = 2) -> str:
    """The one line on stderr of a call that must fail with `code` and print nothing."""
    assert main(args) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1 and err.startswith("gaident: "), err
    assert "Traceback" not in err and "internal error" not in err
    return err
