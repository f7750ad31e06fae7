"""A stated coherence weighs the frequencies of a response: what it says of their errors sharpens the result."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

DRIVE = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=2e-3)
F = np.geomspace(4.0, 400.0, 120)
AVERAGES = 32


def errors(draws: int) -> tuple[np.ndarray, np.ndarray, list[bool]]:
    """Relative errors of JM with and without the coherence, and whether 95 % intervals with it contain the truth.

    The noise is that of H1 over so many averages: var G = (1 - coherence) |G|^2 / (coherence averages).
    """
    exact = DRIVE.model().frequency_response(2.0 * np.pi * F)
    weighed, plain, inside = [], [], []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        coherence = rng.uniform(0.5, 0.999, len(F))
        e = rng.standard_normal((2, len(F)))
        g = exact * (1.0 + np.sqrt((1.0 - coherence) / coherence / AVERAGES / 2.0) * (e[0] + 1j * e[1]))
        with_it = ga.identify(ga.FrequencyResponse(F, g, coherence=coherence))
        without = ga.identify(ga.FrequencyResponse(F, g))
        assert (with_it.p, with_it.q) == (without.p, without.q) == (1, 2)
        m = with_it.mechanics.with_shaft_damping
        weighed.append(m.JM / DRIVE.JM - 1.0)
        plain.append(without.mechanics.with_shaft_damping.JM / DRIVE.JM - 1.0)
        inside += [abs(getattr(m, name) - getattr(DRIVE, name)) < 1.96 * m.std[name] for name in ("JM", "JL", "KG")]
    return np.array(weighed), np.array(plain), inside


def rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(x**2)))


def test_the_coherence_sharpens_the_result() -> None:
    weighed, plain, inside = errors(6)
    assert rms(weighed) < 0.012 and rms(weighed) < 0.7 * rms(plain)
    assert np.mean(inside) > 0.7


@pytest.mark.long
def test_the_coherence_sharpens_the_result_threefold_and_the_deviations_hold() -> None:
    """25 draws: 1.7 % without it, 0.6 % with it."""
    weighed, plain, inside = errors(25)
    assert rms(weighed) < 0.009 and rms(plain) > 0.012 and rms(weighed) < 0.5 * rms(plain)
    assert np.mean(inside) > 0.85  # 75 intervals of 25 draws: 0.95 within two deviations
