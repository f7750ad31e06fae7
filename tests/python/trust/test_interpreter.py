"""Threads, the end of the interpreter, and what functions of a user's own keep."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from threadpoolctl import threadpool_info

import gaident as ga
from gaident.diagnosis.blas import one_thread
from gaident.errors import ModelError
from gaident.models.own_effects import OWN

ENDS = """
import sys, threading, time
import numpy as np
import gaident as ga

kind, wait = sys.argv[1], float(sys.argv[2])
n = 200_000 if kind in ("simulate", "effect") else 3000
command = np.repeat(np.random.default_rng(0).uniform(-50.0, 50.0, n // 100), 100)
rec = ga.Record(1e-3, command=command, velocity=np.random.default_rng(1).standard_normal(n))
drive, pi = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model(), ga.PI(0.02, 0.6)
size = ga.effects.Parameter("size", "N m", neutral=0.0, lowest=0.0, highest=1.0)
ga.effects.register("mine", [size], meaning="dry", friction=lambda s, size: size + 0.0 * s.velocity)
if kind == "progress":
    rec = ga.Record(1e-3, command=command, velocity=ga.simulate(drive, rec, pi) + 0.05 * rec.velocity)
work = {
    "simulate": lambda: ga.simulate(drive, rec, pi),
    "effect": lambda: ga.simulate(drive.with_effect("coulomb_friction", torque=0.02), rec, pi),
    "own": lambda: ga.simulate(drive.with_effect("mine", size=0.02), rec, pi),
    "progress": lambda: ga.identify(rec, pi, progress=lambda *_: None),
}[kind]
begun = threading.Event()

def for_ever():
    while True:
        begun.set()
        work()

threading.Thread(target=for_ever, daemon=True).start()
begun.wait()
time.sleep(wait)
"""


@pytest.mark.parametrize("kind", ["simulate", "effect", "own", "progress"])
def test_the_interpreter_ends_while_a_daemon_thread_is_in_the_core(kind: str) -> None:
    """It ended by abort or a segmentation fault: the thread's stack was unwound through the core's."""
    for wait in (0.05, 0.2, 0.33):
        done = subprocess.run([sys.executable, "-c", ENDS, kind, str(wait)], capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stderr) == (0, ""), wait


@pytest.fixture
def friction() -> Iterator[list[tuple[np.ndarray, ...]]]:
    """Signals that a function of a user's own keeps, each beside a copy."""
    kept: list[tuple[np.ndarray, ...]] = []

    def function(s: ga.effects.Signals, size: np.ndarray) -> np.ndarray:
        for signal in (s.velocity, s.angle, s.torque, s.command, size):
            kept.append((signal, signal.copy()))
        return size + 0.0 * s.velocity

    size = ga.effects.Parameter("size", "N m", neutral=0.0, lowest=0.0, highest=1.0)
    ga.effects.register("keeps", [size], meaning="dry", friction=function)
    kept.clear()
    yield kept
    for name in tuple(OWN):
        ga.effects.unregister(name)


def driven() -> ga.Record:
    return ga.Record(1e-3, torque=np.full(300, 0.1), velocity=np.zeros(300))


def test_signals_that_a_function_keeps_stay_as_they_were(friction: list[tuple[np.ndarray, ...]]) -> None:
    """They were memory of the core, freed behind the run and written over within it."""
    one = ga.OneMass(J=3e-4, D=0.004).model().with_effect("keeps", size=0.02)
    ga.simulate_many([one, one.with_effect("keeps", size=0.01)], driven())
    assert len(friction) > 1000
    for signal, copy in friction:
        np.testing.assert_array_equal(signal, copy)
        assert not signal.flags.writeable


@pytest.mark.parametrize(
    ("answer", "said"), [(None, "returns None at"), (-0.5, r"its friction is -0\.5 at .* return numbers >= 0")]
)
def test_a_function_that_answers_nothing_or_pushes_is_refused_as_it_runs(answer: float | None, said: str) -> None:
    def later(s: ga.effects.Signals, size: np.ndarray) -> np.ndarray | float | None:
        return answer if s.time > 0.27 else np.abs(size)

    size = ga.effects.Parameter("size", "N m", neutral=0.0, lowest=0.0, highest=1.0)
    ga.effects.register("later", [size], meaning="dry", friction=later)
    try:
        with pytest.raises(ModelError, match=said):
            ga.simulate(ga.OneMass(J=3e-4, D=0.004).model().with_effect("later", size=0.02), driven())
        with pytest.raises(ModelError, match="returns None"):
            ga.effects.register("never", [size], meaning="dry", torque=lambda s, size: None)
    finally:
        ga.effects.unregister("later")


def threads_of_blas() -> list[int]:
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_the_threads_of_blas_come_back_where_two_limits_overlap() -> None:
    """The second limit took over the first one's, and gave back that, for ever."""
    with one_thread():
        pass  # every library is loaded
    before = threads_of_blas()
    inside, leave, seen = threading.Event(), threading.Event(), []

    def second() -> None:
        with one_thread():
            inside.set()
            leave.wait(20.0)
            seen.append(threads_of_blas())

    thread = threading.Thread(target=second)
    with one_thread():
        thread.start()
        assert inside.wait(20.0)
    leave.set()
    thread.join()
    assert seen == [[1] * len(before)] and threads_of_blas() == before
