"""Ctrl-C comes through in what lasts, and what cannot be aligned is refused at once."""

from __future__ import annotations

import importlib
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
signal.signal(signal.SIGINT, signal.default_int_handler)  # some shells start jobs with it ignored
n = 1_000_000
drive, pi = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model(), ga.PI(0.02, 0.6)
command = np.repeat(np.random.default_rng(0).uniform(-50.0, 50.0, n // 1000), 1000)
rec = ga.Record(1e-3, command=command, velocity=np.zeros(n))
rough = drive.with_effect("coulomb_friction", torque=0.02)

def record_of(samples):
    long = np.resize(command, samples)
    return ga.Record(1e-3, command=long, velocity=0.9 * long, torque=0.01 * long)

def one_record(samples):  # the slowest without effects: in pairs of floats, 5 s
    record = record_of(samples)
    return lambda: ga.simulate(drive, record, ga.PI(0.02, 0.6, torque_limit=0.1), arithmetic="float")

def of_long(function, *more, **options):
    record = record_of(20_000_000)
    return lambda: function(record, *more, **options)

late = rough.with_effect("torque_lag", time_constant=1e-3)  # alone it runs in lanes
fast = ga.PI(0.02, 0.6, loop="continuous")
kinds = {
    "simulate with effects": lambda: of_long(lambda rec: ga.simulate(rough, rec, pi)),
    "simulate in lanes": lambda: of_long(lambda rec: ga.run(late, rec, pi)),
    "run with load": lambda: of_long(lambda rec: ga.run(rough, rec, pi, load=True)),
    "continuous with effects": lambda: of_long(lambda rec: ga.run(rough, rec, fast)),
    "cascade": lambda: of_long(lambda rec: ga.simulate(drive, rec, ga.Cascade(pi))),
    "drive's arithmetic": lambda: of_long(lambda rec: ga.simulate(drive, rec, fast, arithmetic="drive_double")),
    "initial_state": lambda: of_long(lambda rec: ga.initial_state(drive, rec, pi)),
    "least_squares": lambda: of_long(ga.least_squares, 2, pi),
    "least_squares of order 4": lambda: of_long(ga.least_squares, 4, pi, instruments=True, whitening=True),
    "diagnose": lambda: (lambda: ga.diagnose(driven, pi)),
    "simulate": lambda: one_record(30_000_000),
    "simulate_many": lambda: lambda: ga.simulate_many([drive] * 1000, rec, pi),
    "with effects": lambda: lambda: ga.simulate_many([rough] * 1000, rec, pi),
}
if sys.argv[1] == "diagnose":
    answer = ga.run(rough, rec, pi)
    noise = 0.05 * np.random.default_rng(1).standard_normal(n)
    driven = rec.with_channels(velocity=answer.velocity + noise, torque=answer.torque)
work = kinds[sys.argv[1]]()
sent = []

def interrupt():
    sent.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)

timer = threading.Timer(float(sys.argv[2]), interrupt)
timer.start()
try:
    work()
    timer.cancel()
    timer.join()
    print(0.0)  # it ended before: a fast machine needs no Ctrl-C
except KeyboardInterrupt:
    print(time.perf_counter() - sent[0])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot send itself Ctrl-C there")
@pytest.mark.parametrize("kind", ["simulate_many", "with effects", pytest.param("simulate", marks=pytest.mark.long)])
def test_ctrl_c_within_a_second_where_the_core_works(kind: str) -> None:
    assert _seconds_to_the_end(kind, 1.0) < 1.0


def _seconds_to_the_end(kind: str, after: float) -> float:
    """From a Ctrl-C so many seconds after the work began."""
    command = [sys.executable, "-c", WORK, kind, str(after)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.stderr == ""
    return float(done.stdout)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot send itself Ctrl-C there")
@pytest.mark.parametrize("after", [0.1, 0.6])
@pytest.mark.parametrize(
    "kind",
    [
        *("simulate with effects", "simulate in lanes", "run with load", "continuous with effects", "cascade"),
        *("drive's arithmetic", "initial_state", "least_squares", "least_squares of order 4"),
    ],
)
def test_ctrl_c_within_a_second_of_twenty_million_samples(kind: str, after: float) -> None:
    """One run with effects went on for 1.8 s, a regression for 2.3 s."""
    assert _seconds_to_the_end(kind, after) < 1.0


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="a process cannot send itself Ctrl-C there")
@pytest.mark.parametrize("after", [0.5, 5.0, 12.0])
def test_ctrl_c_within_a_second_of_a_diagnosis(after: float) -> None:
    assert _seconds_to_the_end("diagnose", after) < 1.0


@pytest.mark.parametrize("controller", [None, ga.PI(0.02, 0.6), ga.PI(0.02, 0.6, loop="continuous"), "faster"])
@pytest.mark.parametrize("name", ["coulomb_friction", "torque_lag", "linear"])
def test_what_runs_in_blocks_is_the_beginning_of_the_longer_run(name: str, controller: ga.PI | str | None) -> None:
    """The core writes a run block by block, and looks for Ctrl-C between them: no block knows where another begins."""
    loop = ga.Cascade(ga.PI(0.02, 0.6), period=2.5e-4) if controller == "faster" else controller
    n = 9001
    command = np.repeat(np.random.default_rng(0).uniform(-50.0, 50.0, n // 100 + 1), 100)[:n]
    rec = ga.Record(1e-3, command=command, velocity=np.zeros(n), torque=0.01 * command)
    model = ga.OneMass(J=1e-3, D=0.01).model()
    if name != "linear":
        model = model.with_effect(name, **{"torque": 0.02} if name == "coulomb_friction" else {"time_constant": 1e-3})
    whole = ga.run(model, rec, loop)
    assert np.ptp(whole.velocity[1030:]) > 1.0
    many = ga.simulate_many([model] * 3, rec, loop)
    assert all(np.array_equal(row, whole.velocity) for row in many)
    for length in (1023, 1024, 1025, 2048, 8193):
        part = ga.run(model, rec[:length], loop)
        for signal in ("velocity", "torque", "position"):
            assert np.array_equal(getattr(part, signal), getattr(whole, signal)[:length])


def test_a_regression_in_blocks_is_that_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    # The functions of the same names hide their modules.
    names = "gaident.identification.least_squares", "gaident.models.simulate"
    module, starts = (importlib.import_module(name) for name in names)
    command = np.repeat(np.random.default_rng(0).uniform(-50.0, 50.0, 30), 100)
    drive, pi = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model(), ga.PI(0.02, 0.6)
    answer = ga.simulate(drive, ga.Record(1e-3, command=command, velocity=0.0 * command), pi)
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(command))
    rec = ga.Record(1e-3, command=command, velocity=answer + noise)
    # Instruments alone do not settle here: rounding grows from round to round.
    for options in ({}, {"whitening": True}, {"instruments": True, "whitening": True}):
        with monkeypatch.context() as patched:
            whole = ga.least_squares(rec, 4, pi, **options)
            patched.setattr(module, "BLOCK", 700 * 81)
            patched.setattr(module, "FILTERED", 333)
            parts = ga.least_squares(rec, 4, pi, **options)
        np.testing.assert_allclose(parts.alpha, whole.alpha, rtol=1e-7, atol=1e-7 * np.abs(whole.alpha).max())
        np.testing.assert_allclose(parts.beta, whole.beta, rtol=1e-7)
        np.testing.assert_allclose(parts.covariance, whole.covariance, rtol=1e-5, atol=1e-5 * np.abs(whole.covariance).max())
        assert parts.noise_std == pytest.approx(whole.noise_std, rel=1e-5) and parts.rounds == whole.rounds
    whole_start = ga.initial_state(drive, rec, pi)
    monkeypatch.setattr(starts, "BLOCK", 700)
    np.testing.assert_allclose(ga.initial_state(drive, rec, pi), whole_start, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("slow", [0.06, 1.0, 100.0, 1e3])
def test_a_log_far_shorter_than_the_other_s_steps_is_refused_at_once(slow: float) -> None:
    """It took 150 s, or asked for 373 GiB."""
    steps = np.cumsum(np.random.default_rng(0).standard_normal(1000))
    began = time.perf_counter()
    with pytest.raises(RecordError, match=r"rec (lasts 1 s at dt=0\.001 s and other|has dt=0\.001 s and other 1000 s)"):
        ga.align(ga.Record(1e-3, command=steps, velocity=steps), ga.Record(slow, command=steps, velocity=steps))
    assert time.perf_counter() - began < 2.0
