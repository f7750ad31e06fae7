"""A measured torque of a slow log is a sample of one that changes between the lines, and not held from its line on.

Truth: a fine simulation of a rigid axis with dry friction under a smooth torque, logged every 40th sample.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.diagnosis.selection.decimated import decimated_record
from gaident.estimation.mean_velocity import with_middles
from gaident.models.held_torque import held_torque
from gaident.policy.table import POLICY

J, B, C = 5.5, 22.0, 13.0
FINE, EVERY = 1e-3, 40
TRUTH = ga.OneMass(J=J, D=B).model().with_effect("coulomb_friction", torque=C)


def logged(kind: str, every: int = EVERY) -> ga.Record:
    t = FINE * np.arange(40_000)
    u = 25.0 * np.sin(1.9 * t) + 14.0 * np.sin(5.3 * t + 1.0)
    w = ga.simulate(TRUTH, ga.Record(FINE, torque=u, velocity=np.zeros(len(u))))
    w = w + 1e-3 * np.random.default_rng(1).standard_normal(len(w))
    return ga.Record(every * FINE, torque=u[::every], velocity=w[::every], torque_is=kind)


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_a_sampled_torque_goes_straight_between_the_lines() -> None:
    """Held it would be half a line late: B dt/2 = 0.44 of an inertia of 5.5, and ten times the error of the truth."""
    held, straight = (rms(ga.simulate(TRUTH, rec) - rec.velocity) for rec in map(logged, ("commanded", "measured")))
    assert straight < 0.1 * held and held > 0.02


def test_a_fast_log_is_as_it_was() -> None:
    fast = logged("measured", every=4)
    assert fast.dt <= POLICY.longest_hold
    assert np.array_equal(held_torque(fast), fast.torque)
    assert np.array_equal(ga.simulate(TRUTH, fast), ga.simulate(TRUTH, fast.with_channels(torque_is="commanded")))


def test_the_mean_over_a_line_is_held() -> None:
    rec = ga.Record(0.01, torque=np.arange(100.0), velocity=np.zeros(100), torque_is="measured")
    assert np.array_equal(held_torque(rec), [*(np.arange(99) + 0.5), 99.0])
    halves = with_middles(rec)
    assert np.allclose(held_torque(halves)[:198].reshape(-1, 2).mean(axis=1), held_torque(rec)[:99])
    coarse = decimated_record(rec, 4)
    assert np.array_equal(held_torque(coarse), held_torque(rec).reshape(-1, 4).mean(axis=1))


@pytest.mark.long
def test_the_cause_and_the_inertia_behind_a_sampled_torque() -> None:
    """Half a line late the same data were named otherwise, and B dt/2 is 8 % of the inertia."""
    dia = ga.diagnose(logged("measured"))
    assert [f.effect for f in dia.findings if not f.is_noise] == ["coulomb_friction"]
    assert abs(1.0 / dia.model.gain / J - 1.0) < 0.01


def test_identify_draws_a_sampled_torque_straight_too() -> None:
    """The truth is rigid without dry friction; held, its inertia would be B dt/2 too small."""
    t = FINE * np.arange(40_000)
    u = 25.0 * np.sin(1.9 * t) + 14.0 * np.sin(5.3 * t + 1.0)
    rigid = ga.OneMass(J=J, D=B).model()
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(u))
    w = ga.simulate(rigid, ga.Record(FINE, torque=u, velocity=0.0 * noise)) + noise
    rec = ga.Record(EVERY * FINE, torque=u[::EVERY], velocity=w[::EVERY], torque_is="measured")
    found = ga.identify(rec, seed=1).model
    assert (found.p, found.q) == (1, 0) and abs(1.0 / found.gain / J - 1.0) < 0.005


@pytest.mark.long
@pytest.mark.parametrize("seed", [2, 4, 5])
def test_what_a_measured_torque_does_between_the_lines_is_no_shaft(seed: int) -> None:
    """A rigid motor in a velocity loop of 16 kHz, its current measured and logged at 1 kHz without noise."""
    skip_without_library()
    inertia, every, fine = 4e-4, 16, 62.5e-6
    rng = np.random.default_rng(seed)
    levels = rng.permutation([5.0, -10.0, 20.0, -40.0, 40.0, -30.0, 30.0, -5.0, 10.0, -20.0])
    chips = np.repeat(rng.choice([-1.0, 1.0], 300), 160)
    starts = 0.3 * np.arange(len(levels))
    times = np.column_stack([starts, starts + np.abs(np.diff(levels, prepend=0.0)) / 400.0])
    passed = np.column_stack([np.concatenate([[0.0], levels[:-1]]), levels])
    command = np.interp(fine * np.arange(48000), times.ravel(), passed.ravel())
    command += np.where(np.arange(48000) // 4800 % 2, chips, 0.0)
    plant = Plant(J=inertia, D=5e-4, kp=0.12, ki=6.0, dt=fine)
    log = run_drive(plant, command, {"coulomb_friction": {"torque": 0.03}}, substeps=2)
    velocity = log.truth[::every] + 0.02 * rng.standard_normal(3000)
    dia = ga.diagnose(ga.Record(every * fine, velocity=velocity, torque=log.torque[::every], torque_is="measured"))
    assert "stiffness" not in dia.mechanics, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(inertia, rel=3e-3)
    assert [f.effect for f in dia.causes] == ["coulomb_friction"]
    assert any("one of a shaft above 175 Hz would not have been named" in words for words in dia.one_sided.values()), (
        dia.one_sided
    )
