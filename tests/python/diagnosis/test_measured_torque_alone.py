"""Clean drives whose torque was measured with noise: nothing is named, and the selected linear model is judged."""

from __future__ import annotations

import numpy as np
import pytest
from drive_rig import Noise, Plant, rig

import gaident as ga


def measured(seed: int, share: float, effects: dict[str, dict[str, float]] | None = None) -> ga.Record:
    """A log under steps of speed that reach the torque limit; the torque with white noise, as a share of its rms."""
    rng = np.random.default_rng(seed)
    limited = ga.Cascade(ga.PI(0.05, 0.5, torque_limit=1.0), period=1e-3)
    plant = Plant(J=1e-3, D=2e-3, kp=0.05, ki=0.5, dt=1e-3, cascade=limited)
    speeds = np.repeat(rng.choice([50.0, -50.0, 20.0, -20.0, 80.0, -80.0, 10.0, -10.0, 0.0], 20), 150)
    rec = rig(plant, speeds, effects or {}, Noise(white=0.1), seed=seed)
    noise = share * np.sqrt(np.mean(rec.torque**2)) * rng.standard_normal(len(rec))
    return ga.Record(1e-3, velocity=rec.velocity, torque=rec.torque + noise, torque_is="measured")


@pytest.mark.parametrize("share", [0.02, 0.05])
@pytest.mark.parametrize("seed", range(8))
def test_the_noise_of_a_measured_torque_is_no_cause(seed: int, share: float) -> None:
    dia = ga.diagnose(measured(seed, share))
    assert dia.verdict == "adequate" and not dia.causes, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)
    assert dia.before.rmse == dia.after.rmse and dia.after.fit_percent > 90.0


def test_a_cause_shows_through_that_noise() -> None:
    dia = ga.diagnose(measured(3, 0.05, {"coulomb_friction": {"torque": 0.08}}))
    (found,) = dia.causes
    assert found.effect == "coulomb_friction" and found.parameters["torque"].value == pytest.approx(0.08, rel=0.1)
