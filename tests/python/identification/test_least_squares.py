"""The conventional identification: M-sequences, regression in equation (7), and the way back to the plant."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from gaident.errors import ModelError, RecordError, SettingsError
from gaident.identification.m_sequence import TAPS
from gaident.identification.plant_of_discrete import plant_of_discrete

DT = 0.444e-3
ONE = ga.OneMass(1.02e-4, 0.003)
TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59)
LOOPS = ("continuous", "sampled", None)
NAMES = {ga.OneMass: ("J", "D"), ga.TwoMass: ("JM", "DM", "JL", "DL", "KG")}


def loop_of(name: str | None, factor: float = 5.5637) -> ga.PI | None:
    return None if name is None else ga.PI(0.0232 * factor, 1.367 * factor, loop=name)


def recorded(drive: ga.OneMass | ga.TwoMass, controller: ga.PI | None, noise: float, seed: int = 0) -> ga.Record:
    """A noisy M-sequence record of an exact drive; without a controller the sequence is the torque."""
    signal = ga.m_sequence(9, 20.0 if controller else 0.5, hold=4)
    key = "command" if controller else "torque"
    rec = ga.Record(DT, velocity=np.zeros(len(signal)), **{key: signal})
    w = ga.simulate(drive, rec, controller)
    return ga.Record(DT, velocity=w + noise * np.random.default_rng(seed).standard_normal(len(w)), **{key: signal})


# --- M-sequences


@pytest.mark.parametrize("n", [n for n in TAPS if n <= 16])
def test_an_m_sequence_is_white_over_its_period(n: int) -> None:
    s = ga.m_sequence(n)
    spectrum = np.abs(np.fft.fft(s)) ** 2
    correlation = np.fft.ifft(spectrum).real
    assert len(s) == 2**n - 1
    np.testing.assert_allclose(correlation[0], len(s))
    np.testing.assert_allclose(correlation[1:], -1.0, atol=1e-6 * len(s))


def test_level_hold_and_seed_of_an_m_sequence() -> None:
    s = ga.m_sequence(5, amplitude=3.0, hold=4, offset=10.0)
    assert set(s.tolist()) == {7.0, 13.0} and len(s) == 31 * 4
    np.testing.assert_array_equal(s, np.repeat(s[::4], 4))
    other = ga.m_sequence(5, 3.0, 4, 10.0, seed=9)
    shifts = [k for k in range(31) if np.array_equal(np.roll(s[::4], k), other[::4])]
    assert len(shifts) == 1 and shifts != [0]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"register": 1}, "register is 1: give a whole number of bits from 2 to 24"),
        ({"register": 9.0}, "register is 9.0"),
        ({"register": 9, "hold": 0}, "hold is 0"),
        ({"register": 9, "seed": 512}, "seed is 512: give a whole number from 1 to 511"),
        ({"register": 9, "amplitude": 0.0}, "amplitude is 0: give a finite number > 0"),
        ({"register": 9, "offset": float("nan")}, "offset is nan"),
    ],
)
def test_refused_m_sequences(arguments: dict[str, float], words: str) -> None:
    with pytest.raises(SettingsError, match=words):
        ga.m_sequence(**arguments)  # type: ignore[arg-type]


# --- the way back


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("factor", [1.0, 5.5637])
def test_equation_7_goes_back_to_the_plant(loop: str | None, factor: float) -> None:
    controller = loop_of(loop, factor)
    integrator, fast = ga.Model(5e3, [0.0]), ga.Model(9e3, [-20.0, -30 + 900j, -30 - 900j], [-900.0, -2000.0])
    for model in (ONE.model(), TWO.model(), integrator, fast):
        d = model.discrete(DT, controller)
        found = plant_of_discrete(d.alpha, d.beta, DT, controller)
        assert found.misfit < 1e-13 and found.note == ""
        assert found.model is not None
        assert found.model.gain == pytest.approx(model.gain, rel=1e-9)
        np.testing.assert_allclose(found.model.poles, model.poles, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(found.model.zeros, model.zeros, rtol=1e-6, atol=1e-6)


def test_the_covariance_decides_which_coefficients_are_met() -> None:
    controller = loop_of("continuous")
    d = ONE.model().discrete(DT, controller)
    wrong = d.alpha + np.array([0.0, 0.01, 0.0])
    weights = np.diag([1e-12, 1.0, 1e-12, 1e-12, 1e-12])
    found = plant_of_discrete(wrong, d.beta, DT, controller, weights).model
    assert found is not None
    np.testing.assert_allclose([found.gain, found.poles[0]], [ONE.model().gain, ONE.model().poles[0]], rtol=1e-5)
    blind = plant_of_discrete(wrong, d.beta, DT, controller)
    assert blind.model is not None and abs(blind.model.poles[0] / ONE.model().poles[0] - 1.0) > 0.02
    assert blind.misfit > 1e-3


def test_a_polynomial_without_a_plant_says_so() -> None:
    found = plant_of_discrete(np.array([0.0, 0.1]), np.array([-0.5]), DT)
    assert found.model is None
    assert "pole at z = -0.5" in found.note
    with pytest.raises(ModelError, match=r"alpha and beta have the shapes \(2,\) and \(2,\)"):
        plant_of_discrete(np.zeros(2), np.zeros(2), DT)


# --- the regression


@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize("drive", [ONE, TWO], ids=["one mass", "two masses"])
def test_without_noise_the_regression_is_exact(drive: ga.OneMass | ga.TwoMass, loop: str | None) -> None:
    controller = loop_of(loop)
    order = drive.model().order + (controller is not None)
    rec = recorded(drive, controller, 0.0)
    truth = drive.model().discrete(DT, controller)
    for options in ({}, {"instruments": True, "whitening": True}):
        found = ga.least_squares(rec, order, controller, **options)
        np.testing.assert_allclose(found.alpha, truth.alpha, atol=1e-8)
        np.testing.assert_allclose(found.beta, truth.beta, atol=1e-8)
        np.testing.assert_allclose(found.simulate(rec), rec.velocity, atol=1e-5)
        assert found.converged and found.stable and found.order == order
        assert isinstance(found.mechanics, type(drive))
        for name in NAMES[type(drive)]:
            assert getattr(found.mechanics, name) == pytest.approx(getattr(drive, name), rel=1e-4), name


def test_the_conventional_method_on_a_record_that_it_can_take() -> None:
    """One mass, little noise: plain least squares is right to a few per cent, as the paper has it."""
    controller = loop_of("sampled", 1.6744)
    found = ga.least_squares(recorded(ONE, controller, 0.01), 2, controller)
    assert isinstance(found.mechanics, ga.OneMass)
    assert pytest.approx(ONE.J, rel=0.02) == found.mechanics.J


def test_noise_bends_plain_least_squares_and_not_the_refined_method() -> None:
    controller = loop_of("sampled")
    truth = TWO.model().discrete(DT, controller)
    theta = np.r_[truth.alpha, truth.beta]
    plain, refined, mechanical = [], [], []
    for seed in range(20):
        rec = recorded(TWO, controller, 0.3, seed)
        f = ga.least_squares(rec, 4, controller)
        plain.append((np.r_[f.alpha, f.beta] - theta) / np.sqrt(np.diag(f.covariance)))
        f = ga.least_squares(rec, 4, controller, instruments=True, whitening=True)
        assert f.converged and f.noise_std == pytest.approx(0.3, rel=0.1)
        refined.append((np.r_[f.alpha, f.beta] - theta) / np.sqrt(np.diag(f.covariance)))
        assert isinstance(f.mechanics, ga.TwoMass)
        assert pytest.approx(TWO.JL, rel=0.1) == f.mechanics.JL
        names = NAMES[ga.TwoMass]
        mechanical.append([(getattr(f.mechanics, n) - getattr(TWO, n)) / f.mechanics.std[n] for n in names])
    assert np.abs(np.mean(plain, axis=0)).max() > 50.0
    # Deviations in units of their own standard deviation: mean 0 +- 0.22, spread 1 +- 0.16.
    assert np.abs(np.mean(refined, axis=0)).max() < 4.0 / 20**0.5
    assert np.abs(np.mean(mechanical, axis=0)).max() < 4.0 / 20**0.5
    for spread in (np.std(refined, axis=0), np.std(mechanical, axis=0)):
        assert np.all((spread > 0.5) & (spread < 1.7))


def test_the_record_is_not_changed_and_need_not_begin_at_rest() -> None:
    controller = loop_of("sampled", 1.6744)
    rec = recorded(ONE, controller, 0.0)
    found = ga.least_squares(rec[500:], 2, controller)
    truth = ONE.model().discrete(DT, controller)
    np.testing.assert_allclose(found.beta, truth.beta, atol=1e-8)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"rec": [1.0]}, RecordError, "rec is list"),
        ({"order": 1}, SettingsError, "order is 1: give a whole number N >= 2"),
        ({"order": 2.0}, SettingsError, "order is 2.0"),
        ({"order": 410}, RecordError, "rec has 2044 samples, too few for order 410: give at least 2052"),
        ({"controller": None}, RecordError, "has no torque, the input of the regression: give Record"),
        ({"rec": ga.Record(DT, np.full(99, 43.6), np.ones(99))}, RecordError, "constant input of 43.6"),
    ],
)
def test_refusals(change: dict[str, object], error: type[Exception], words: str) -> None:
    controller = loop_of("sampled")
    arguments: dict[str, object] = {"rec": recorded(ONE, controller, 0.0), "order": 2, "controller": controller, **change}
    with pytest.raises(error, match=words):
        ga.least_squares(**arguments)  # type: ignore[arg-type]


def test_it_shares_nothing_with_the_core() -> None:
    """Of gaident these files import records, errors, the value types of models and the policy; no simulation."""
    folder = Path(ga.__file__).parent / "identification"
    allowed = {
        "errors",
        "data.record",
        "arguments",
        "control.pi",
        "models.model",
        "models.discrete",
        "models.mechanics",
        "models.factors",
        "models.held_torque",  # what a line of a log means, no simulation
        "checks",
        "policy.table",  # how many regressions, no simulation
    }
    for name in ("least_squares.py", "plant_of_discrete.py", "m_sequence.py"):
        tree = ast.parse((folder / name).read_text())
        found = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and (n.module or "").startswith("gaident")}
        others = {m.removeprefix("gaident.") for m in found} - allowed - {"identification.plant_of_discrete"}
        assert not others, f"{name}: {others}"
        assert not [n for n in ast.walk(tree) if isinstance(n, ast.Attribute) and n.attr in ("discrete", "core")], name
