"""Models as linear systems of scipy.signal and python-control: the delay exact and as Pade, linear effects included."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import signal

import gaident as ga
from gaident.errors import ModelError

TWO = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=1e-3).model()
THREE = ga.Model(4000.0, [-12.0, -6 + 160j, -6 - 160j, -20 + 420j, -20 - 420j], [-3 + 95j, -3 - 95j, -8 + 380j, -8 - 380j])
REAL = ga.Model(900.0, [-3.0, -40.0, -700.0], [-90.0])
DT = 1e-3
OMEGA = np.geomspace(1.0, 1200.0, 60)  # rad/s
U = 0.3 * np.random.default_rng(4).standard_normal(200)  # N m


def linear(model: ga.Model, delay: float) -> ga.Model:
    """The model with every linear effect."""
    model = model.with_effect("torque_lag", time_constant=0.8e-3).with_effect("velocity_filter", time_constant=1.5e-3)
    model = model.with_effect("extra_resonance", frequency=700.0, damping=0.05, zero_frequency=600.0, zero_damping=0.05)
    return model.with_effect("transport_delay", delay=delay)


def held(model: ga.Model, delay: float, fine: int = 40) -> np.ndarray:
    """Velocity at the samples of U held and delayed, by scipy's own discretisation `fine` times per sample."""
    steps = round(delay / DT * fine)
    u = np.concatenate([np.zeros(steps), np.repeat(U, fine)])[: len(U) * fine]
    system = signal.StateSpace(signal.ZerosPolesGain(list(model.zeros), list(model.poles), model.gain))
    return signal.lsim(system, u, DT / fine * np.arange(len(u)), interp=False)[1][::fine]


@pytest.mark.parametrize("delay", [0.0, 0.3e-3, 1e-3, 1.7e-3])
@pytest.mark.parametrize("model", [TWO, REAL], ids=["two_mass", "real"])
def test_sampled_the_delay_is_exact(model: ga.Model, delay: float) -> None:
    exact = held(model, delay)
    system = model.with_effect("transport_delay", delay=delay).to_scipy(DT)
    assert system.dt == DT
    found = signal.dlsim(system, U)[1].ravel()
    np.testing.assert_allclose(found, exact, rtol=0.0, atol=1e-7 * np.abs(exact).max())


def test_sampled_is_what_is_simulated() -> None:
    model = linear(THREE, 1.7e-3)
    found = signal.dlsim(model.to_scipy(DT), U)[1].ravel()
    rec = ga.Record(DT, torque=U, velocity=0.0 * U)
    # The simulation takes the mean of what the delay lets through over each substep, here the 64th of a sample.
    expected = ga.simulate(model, rec, substeps=64)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-3 * np.abs(expected).max())
    linear_only = THREE.to_scipy(DT)
    np.testing.assert_allclose(
        signal.dlsim(linear_only, U)[1].ravel(), ga.simulate(THREE, rec), rtol=0.0, atol=1e-9 * np.abs(expected).max()
    )


def test_continuous_holds_the_linear_effects() -> None:
    model = linear(TWO, 0.0)
    s = 1j * OMEGA
    extra = (700.0 / 600.0) ** 2 * (s**2 + 60.0 * s + 600.0**2) / (s**2 + 70.0 * s + 700.0**2)
    exact = TWO.frequency_response(OMEGA) * extra / (1.0 + 0.8e-3 * s) / (1.0 + 1.5e-3 * s)
    np.testing.assert_allclose(model.to_scipy().freqresp(OMEGA)[1], exact, rtol=1e-9)
    neutral = TWO.with_effect("torque_lag", time_constant=0.0).to_scipy()
    np.testing.assert_allclose(neutral.freqresp(OMEGA)[1], TWO.frequency_response(OMEGA), rtol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 4, 7])
def test_pade_comes_close_to_the_delay(order: int) -> None:
    delay = 1.5e-3
    # The first term that the approximation lacks: (n!)^2 / ((2n)! (2n+1)!) (omega T)^(2n+1)
    n, x = order, OMEGA[-1] * delay
    first = math.factorial(n) ** 2 / (math.factorial(2 * n) * math.factorial(2 * n + 1)) * x ** (2 * n + 1)
    exact = TWO.frequency_response(OMEGA) * np.exp(-1j * OMEGA * delay)
    found = TWO.with_effect("transport_delay", delay=delay).to_scipy(pade=order).freqresp(OMEGA)[1]
    assert np.abs(found / exact - 1.0).max() < first + 1e-12
    np.testing.assert_allclose(np.abs(found), np.abs(exact), rtol=1e-9)  # all-pass


def test_python_control_gets_the_same() -> None:
    control = pytest.importorskip("control", reason="python-control is not installed: pip install gaident[control]")
    model = linear(TWO, 1.7e-3)
    ours = model.to_scipy(pade=3)
    theirs = model.to_control(pade=3)
    np.testing.assert_allclose(theirs(1j * OMEGA), ours.freqresp(OMEGA)[1], rtol=1e-6)
    sampled = model.to_control(DT)
    assert isinstance(sampled, control.StateSpace) and sampled.dt == DT
    found = control.forced_response(sampled, None, U).outputs
    np.testing.assert_allclose(found, signal.dlsim(model.to_scipy(DT), U)[1].ravel(), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("to", ["to_scipy", "to_control"])
def test_refusals(to: str) -> None:
    if to == "to_control":
        pytest.importorskip("control", reason="python-control is not installed: pip install gaident[control]")

    def export(model: ga.Model, *args: object, **options: object) -> object:
        return getattr(model, to)(*args, **options)

    delayed = TWO.with_effect("transport_delay", delay=1e-3)
    with pytest.raises(ModelError, match=r"coulomb_friction, backlash|backlash|no linear system"):
        export(TWO.with_effect("coulomb_friction", torque=0.1).with_effect("backlash", gap=0.1), DT)
    with pytest.raises(ModelError, match=r"transport_delay of 0.001 s.*pade=3.*dt="):
        export(delayed)
    with pytest.raises(ModelError, match="pade is 0"):
        export(delayed, pade=0)
    with pytest.raises(ModelError, match="pade is 2: sampled, the delay is exact"):
        export(delayed, DT, pade=2)
    with pytest.raises(ModelError, match="dt is -1"):
        export(delayed, -1)
    with pytest.raises(ModelError, match="p = 0"):
        export(ga.Model(3.0, [-1.0], [-2.0]), DT)


def test_the_linear_part_has_what_is_linear() -> None:
    whole = linear(TWO, 1.7e-3).with_effect("coulomb_friction", torque=0.05)
    part = whole.linear
    assert {e.name for e in part.effects} == {"transport_delay", "torque_lag", "velocity_filter"}
    assert part.q == TWO.q + 2 and part.mechanism.effects == () and whole.mechanism == part.mechanism
    omega = np.array([1.0, 30.0, 400.0])
    expected = part.mechanism.frequency_response(omega) * np.exp(-1.7e-3j * omega)
    for name in ("torque_lag", "velocity_filter"):
        (effect,) = (e for e in part.effects if e.name == name)
        expected = expected / (1.0 + 1j * omega * effect.parameters["time_constant"])
    np.testing.assert_allclose(part.frequency_response(omega), expected, rtol=1e-12)
    with pytest.raises(ModelError, match="to_scipy"):
        part.discrete(1e-3)
    with pytest.raises(ModelError, match=r"coulomb_friction.*use model\.linear"):
        whole.frequency_response(omega)
