"""Long records: searched in part, fitted, compared and judged on all samples, in bounded memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import f

import gaident as ga
from gaident.identification.adequacy import independence_p
from gaident.identification.noise import autocorrelation, autoregression_of, ljung_box
from gaident.identification.parts import search_parts
from gaident.identification.space import derive_space
from gaident.models.drive_torque import torque_of
from gaident.models.starts import noise_std, stretches

DT = 0.444e-3
CTL = ga.PI(0.116, 6.8)
TWO_MASS = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model()


def closed(command: np.ndarray, noise: float = 0.1, seed: int = 0, controller: ga.PI = CTL) -> ga.Record:
    blank = ga.Record(dt=DT, command=command, velocity=np.zeros(len(command)))
    w = ga.simulate(TWO_MASS, blank, controller)
    return ga.Record(dt=DT, command=command, velocity=w + noise * np.random.default_rng(seed).standard_normal(len(w)))


def stairs(samples: int, seed: int = 0, each: int = 500) -> np.ndarray:
    levels = np.random.default_rng(seed).uniform(-40.0, 40.0, -(-samples // each))
    return np.repeat(levels, each)[:samples]


def test_short_records_are_searched_whole() -> None:
    records = [closed(stairs(8000)), closed(stairs(8000, 1))]
    parts = search_parts(records, CTL, [False, True])
    assert [(len(r), m) for r, m in parts] == [(8000, False), (8000, True)]


def test_the_search_looks_where_something_moves() -> None:
    """Standstill around a busy stretch: the window lies in the busy stretch and starts in motion."""
    command = np.zeros(60_000)
    command[30_000:42_000] = stairs(12_000)
    ((part, moving),) = search_parts([closed(command)], CTL, [False])
    assert len(part) == 8192 and moving
    assert np.mean(part.command != 0.0) > 0.95


def test_a_start_at_rest_is_preferred_where_it_is_excited_enough() -> None:
    rec = closed(stairs(60_000))
    ((part, moving),) = search_parts([rec], CTL, [False])
    assert not moving and np.shares_memory(part.velocity, rec.velocity) and part.velocity[0] == rec.velocity[0]
    ((_, moving),) = search_parts([rec], CTL, [True])
    assert moving


def test_of_many_records_as_many_are_taken_as_the_search_needs() -> None:
    records = [closed(stairs(1000, k) * (20.0 if k == 13 else 1.0), seed=k) for k in range(30)]
    parts = search_parts(records, CTL, [False] * 30)
    assert 8192 <= sum(len(r) for r, _ in parts) < 8192 + 1000
    assert parts[0][0].digest == records[13].digest, "the one that moves most comes first"


@pytest.mark.parametrize("start", [0, 1234])
def test_a_long_record_is_fitted_to_all_samples_whatever_the_workers(start: int) -> None:
    rec = closed(stairs(40_000))[start:]
    idn = ga.identify(rec, CTL, workers=1, seed=2)
    assert (idn.p, idn.q) == (1, 2) and not idn.falsified
    assert idn.samples == 40_000 - start and idn.rmse == pytest.approx(0.1, rel=0.02)
    assert np.sqrt(np.mean(idn.residual(rec) ** 2)) == pytest.approx(idn.rmse, rel=1e-9)
    for name, truth in (("gain", TWO_MASS.gain), ("zero_pair_1_imaginary", max(z.imag for z in TWO_MASS.zeros))):
        e = idn.parameters[name]
        assert abs(e.value - truth) < 5.0 * e.std and e.std < 2e-3 * truth, name
    # An eighth of the samples says it with nearly three times the deviation: all of them must have been used.
    part = ga.identify(rec[:5000], CTL, workers=1, seed=2)
    assert idn.parameters["gain"].std < 0.55 * part.parameters["gain"].std
    again = ga.identify(rec, CTL, workers=2, seed=2)
    assert again.model == idn.model and again.parameters == idn.parameters and again.structures == idn.structures
    assert again.history == idn.history and again.adequacy == idn.adequacy


def test_chains_of_masses_are_compared_where_a_long_record_falsifies_the_model() -> None:
    """A velocity that saturates: no linear structure holds, the smallest mechanism is reported."""
    rec = closed(stairs(40_000), noise=0.02)
    bent = ga.Record(dt=DT, command=rec.command, velocity=np.clip(rec.velocity, -25.0, 25.0))
    idn = ga.identify(bent, CTL, workers=1)
    assert idn.falsified
    assert idn.p == 1 and idn.q in (0, 2)
    assert {(s.p, s.q) for s in idn.structures} >= {(1, 0), (1, 2)}


MEMORY = """
import sys
import numpy as np
import scipy.optimize, scipy.special  # so that their import does not fill what the first identify() leaves free
import gaident as ga

def kib(field):
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith(field))

rng = np.random.default_rng(0)
n = 600_000
command = np.repeat(rng.uniform(-40.0, 40.0, n // 500), 500)
ctl = ga.PI(0.116, 6.8)
model = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59).model()
w = ga.simulate(model, ga.Record(dt=0.444e-3, command=command, velocity=np.zeros(n)), ctl)
rec = ga.Record(dt=0.444e-3, command=command, velocity=w + 0.1 * rng.standard_normal(n))
ga.identify(rec[:2000], ctl, workers=1)
with open("/proc/self/clear_refs", "w") as reset:
    reset.write("5")
before = kib("VmRSS")
idn = ga.identify(rec, ctl, workers=1)
print(idn.p, idn.q, idn.samples, kib("VmHWM") - before)
"""


def test_memory_does_not_grow_with_the_record() -> None:
    """One array as long as this record is 4.6 MiB, the derivatives of one fit would be 28 MiB."""
    if not os.access("/proc/self/clear_refs", os.W_OK):
        pytest.skip("needs Linux: the peak of resident memory is reset through /proc/self/clear_refs")
    environment = {**os.environ, "PYTHONPATH": str(Path(ga.__file__).parents[1]), "OPENBLAS_NUM_THREADS": "1"}
    found = subprocess.run(
        [sys.executable, "-c", MEMORY], capture_output=True, text=True, check=True, env=environment, timeout=120
    ).stdout.split()
    assert found[:3] == ["1", "2", "600000"]
    assert int(found[3]) < 25 * 1024


def test_ranges_of_a_long_record_are_those_of_its_whole_arrays() -> None:
    """Block by block, also across the edges of blocks and with a clamped integral."""
    for controller in (CTL, ga.PI(0.116, 6.8, integrator_limit=1.0, torque_limit=3.0)):
        rec = closed(stairs(600_000), noise=0.0, controller=controller)
        u, w = torque_of(rec, controller), rec.velocity
        if controller is CTL:
            e = rec.command - w
            integral = np.cumsum(0.5 * controller.ki * DT * (e + np.concatenate([[0.0], e[:-1]])))
            assert np.allclose(u, controller.kp * e + integral, rtol=1e-9, atol=1e-9)
        simulated = ga.run(TWO_MASS, rec, controller).torque
        assert np.allclose(u, simulated, atol=1e-6), "without noise it is the torque of the simulation"

        def integrals(x: np.ndarray) -> np.ndarray:
            return np.concatenate([[0.0], np.cumsum(0.5 * DT * (x[1:] + x[:-1]))])

        columns = np.column_stack([integrals(u), -integrals(w), np.ones(len(w))])
        rigid = np.linalg.lstsq(columns, w, rcond=None)[0][0]
        motor = float(np.diff(w) @ u[:-1]) * DT / (float(u @ u) * DT**2)
        space = derive_space([rec], controller)
        assert space.gain == pytest.approx((min(rigid, motor) / 30.0, max(rigid, motor) * 1000.0), rel=1e-4)


def test_noise_of_a_long_signal_is_read_from_stretches_of_it() -> None:
    w = np.random.default_rng(3).standard_normal(1_500_000)
    parts = stretches(w)
    assert len(parts) == 64 and all(np.shares_memory(p, w) for p in parts)
    assert noise_std(w) == pytest.approx(1.0, rel=0.01)
    assert [len(p) for p in stretches(w[:1000])] == [1000]


def test_autoregression_and_whiteness_of_known_noise() -> None:
    white = np.random.default_rng(4).standard_normal(20_000)
    e = white.copy()
    for n in range(2, len(e)):
        e[n] += 0.8 * e[n - 1] - 0.3 * e[n - 2]
    noise = autoregression_of(autocorrelation(e[:12_000], 30) + autocorrelation(e[12_000:], 30), len(e))
    assert noise.order >= 2 and noise.phi[:2] == pytest.approx([0.8, -0.3], abs=0.04)
    assert noise.std == pytest.approx(1.0, rel=0.02)
    assert ljung_box([white], 20) > 1e-3 and ljung_box([e], 20) < 1e-10


def test_independence_test_equals_the_projection_of_whole_arrays() -> None:
    rng = np.random.default_rng(5)
    own = rng.standard_normal((4, 300)) * np.array([[1.0], [1e3], [1e-4], [1.0]])
    extra = np.vstack([rng.standard_normal((3, 300)), own[0] + own[1], np.zeros(300)])  # two that say nothing new
    for strength in (0.0, 0.3):
        v = rng.standard_normal(300) + strength * extra[0] + own[2] * 1e4
        rows = np.vstack([v, own, extra])
        basis = np.linalg.qr(own.T)[0]
        rest, more = v - basis @ (basis.T @ v), extra[:3] - (extra[:3] @ basis) @ basis.T
        directions = np.linalg.qr(more.T)[0]
        explained = float(np.sum((directions.T @ rest) ** 2))
        left = float(rest @ rest) - explained
        expected = f.sf((explained / 3.0) / (left / (300 - 4 - 3)), 3, 300 - 4 - 3)
        assert independence_p(rows @ rows.T, len(own), 300) == pytest.approx(expected, rel=1e-6)
        assert (expected < 1e-3) == (strength > 0.0)


def test_a_short_record_without_dependence_is_falsified_as_often_as_the_level_says() -> None:
    """With 6 samples more than columns the limit of many samples finds 0.002 for a p of 0.01."""
    rng = np.random.default_rng(6)
    found = []
    for _ in range(4000):
        rows = rng.standard_normal((1 + 4 + 8, 18))
        found.append(independence_p(rows @ rows.T, 4, 18))
    p = np.array(found)
    for level in (0.01, 0.1, 0.5):
        assert np.mean(p < level) == pytest.approx(level, abs=4.0 * (level * (1.0 - level) / len(p)) ** 0.5)
