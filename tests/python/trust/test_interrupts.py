"""Ctrl-C comes through in what lasts, and what cannot be aligned is refused at once."""

from __future__ import annotations

import subprocess
import sys
import time

import numpy as np
import pytest

import gaident as ga
from gaident.errors import RecordError

WORK = """
import os, signal, sys, threading, time
import numpy as np
import gaident as ga
n = 1_000_000
drive, pi = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model(), ga.PI(0.02, 0.6)
command = np.repeat(np.random.default_rng(0).uniform(-50.0, 50.0, n // 1000), 1000)
rec = ga.Record(1e-3, command=command, velocity=np.zeros(n))
rough = drive.with_effect("coulomb_friction", torque=0.02)

def one_record(samples):  # the slowest without effects: in pairs of floats, 5 s
    record = ga.Record(1e-3, command=np.resize(command, samples), velocity=np.zeros(samples))
    return lambda: ga.simulate(drive, record, ga.PI(0.02, 0.6, torque_limit=0.1), arithmetic="float")

work = {
    "simulate": lambda: one_record(30_000_000),
    "simulate_many": lambda: lambda: ga.simulate_many([drive] * 1000, rec, pi),
    "with effects": lambda: lambda: ga.simulate_many([rough] * 1000, rec, pi),
}[sys.argv[1]]()
sent = []

def interrupt():
    sent.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)

threading.Timer(1.0, interrupt).start()
try:
    work()
except KeyboardInterrupt:
    print(time.perf_counter() - sent[0])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot send itself Ctrl-C there")
@pytest.mark.parametrize("kind", ["simulate_many", "with effects", pytest.param("simulate", marks=pytest.mark.long)])
def test_ctrl_c_within_a_second_where_the_core_works(kind: str) -> None:
    done = subprocess.run([sys.executable, "-c", WORK, kind], capture_output=True, text=True, timeout=120)
    assert done.stderr == ""
    assert float(done.stdout) < 1.0


@pytest.mark.parametrize("slow", [0.06, 1.0, 100.0, 1e3])
def test_a_log_far_shorter_than_the_other_s_steps_is_refused_at_once(slow: float) -> None:
    """It took 150 s, or asked for 373 GiB."""
    steps = np.cumsum(np.random.default_rng(0).standard_normal(1000))
    began = time.perf_counter()
    with pytest.raises(RecordError, match=r"rec (lasts 1 s at dt=0\.001 s and other|has dt=0\.001 s and other 1000 s)"):
        ga.align(ga.Record(1e-3, command=steps, velocity=steps), ga.Record(slow, command=steps, velocity=steps))
    assert time.perf_counter() - began < 2.0
