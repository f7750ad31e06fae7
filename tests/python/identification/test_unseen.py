"""A resonance above what responses or a log reach: it is always said that none would have shown, and its tail is fitted."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

SHAFT = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=1500.0, DG=2e-3)
RESONANCE = SHAFT.resonance / (2.0 * np.pi)  # 563 Hz, behind an antiresonance at 356 Hz
DT, LOOP = 1e-3, ga.PI(kp=0.05, ki=1.0)


def response(highest: float, seed: int = 0, dt: float | None = None) -> ga.FrequencyResponse:
    """Up to a frequency [Hz], with 1 % of noise."""
    f = np.geomspace(highest / 200.0, highest, 100)
    g = SHAFT.model().frequency_response(2.0 * np.pi * f)
    e = np.random.default_rng(seed).standard_normal((2, 100))
    return ga.FrequencyResponse(f, g * (1.0 + 0.01 / np.sqrt(2.0) * (e[0] + 1j * e[1])), 0.01 * np.abs(g), dt=dt)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("share", [0.5, 0.6, 0.7, 0.8, 0.9, 0.97])
def test_the_tail_of_a_resonance_above_the_band_is_fitted_and_said(share: float, seed: int) -> None:
    """From half of the resonance on: below, between and above the antiresonance."""
    highest = share * RESONANCE
    idn = ga.identify(response(highest, seed))
    assert (idn.p, idn.q, idn.falsified) == (1, 2, False) and idn.unseen_above == pytest.approx(highest)
    m = idn.mechanics.with_shaft_damping
    assert abs(m.J - 5e-4) < 4.0 * m.std["J"] and abs(m.JM - 2e-4) < 4.0 * m.std["JM"]
    assert any(w.startswith("A resonance of") and "lies above the highest frequency of the responses" in w for w in idn.warnings)
    said = f"A resonance above {highest:.4g} Hz would not have shown, but by what it does below: the responses end there."
    assert said in " ".join(idn.summary().split())


def test_a_resonance_far_above_the_band_is_unseen() -> None:
    idn = ga.identify(response(0.1 * RESONANCE))
    assert (idn.p, idn.q, idn.falsified) == (1, 0, False) and pytest.approx(5e-4, rel=0.02) == idn.mechanics.J
    said = f"A resonance above {0.1 * RESONANCE:.4g} Hz would not have shown: the responses end there."
    assert said in " ".join(idn.summary().split())


def test_a_resonance_inside_the_band_leaves_the_sentence() -> None:
    """Another one might lie above."""
    idn = ga.identify(response(900.0))
    assert (idn.p, idn.q) == (1, 2) and not any("lies above the highest" in w for w in idn.warnings)
    assert "A resonance above 900 Hz would not have shown: the responses end there." in " ".join(idn.summary().split())
    assert ga.Identification.from_dict(idn.to_dict()).unseen_above == idn.unseen_above == pytest.approx(900.0)


def record(stiffness: float) -> ga.Record:
    drive = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=stiffness, DG=2e-3).model()
    command = np.repeat(np.random.default_rng(2).uniform(-20.0, 20.0, 20), 100)
    noise = 0.05 * np.random.default_rng(3).standard_normal(command.size)
    done = ga.run(drive, ga.Record(DT, command=command - noise, velocity=0.0 * command), LOOP)
    return ga.Record(DT, command=command, velocity=done.velocity + noise, torque=done.torque)


@pytest.mark.parametrize("stiffness", [12.0, 3000.0, 40000.0])
def test_of_a_log_it_is_said_always(stiffness: float) -> None:
    """Resonances of 50, 800 and 2900 Hz under a log of 1 kHz."""
    idn = ga.identify(record(stiffness), LOOP)
    assert idn.unseen_above == pytest.approx(400.0)
    assert "A resonance above 400 Hz would not have shown: the log has too few lines." in " ".join(idn.summary().split())


def test_beside_a_log_the_higher_end_counts() -> None:
    soft = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=2e-3).model()
    f = np.geomspace(5.0, 450.0, 60)
    beside = ga.FrequencyResponse(f, soft.frequency_response(2.0 * np.pi * f))
    idn = ga.identify([record(12.0), beside], LOOP)
    assert idn.unseen_above == pytest.approx(450.0)
    assert "A resonance above 450 Hz would not have shown: log and responses end there." in " ".join(idn.summary().split())
