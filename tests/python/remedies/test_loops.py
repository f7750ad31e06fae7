"""Loops of a digital controller and sampled drives: against python-control, and against simulations of the core."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.control.differencing import differencing
from gaident.remedies.loops import Loops, frequencies_of, position_frequencies
from gaident.remedies.margins import gain_margins, phase_margins
from gaident.remedies.plants import sampled_plants

T = 1e-3
ONE = ga.OneMass(J=3e-4, D=2e-3).model()
TWO = ga.TwoMass(JM=2e-4, DM=1e-3, JL=4e-4, DL=1e-3, KG=20.0, DG=2e-3).model()
RESONANCE = {"frequency": 900.0, "damping": 0.02, "zero_frequency": 700.0, "zero_damping": 0.015}
DRIVES = {
    "one mass": ONE,
    "two masses": TWO,
    "late": ONE.with_effect("transport_delay", delay=1.3e-3).with_effect("torque_lag", time_constant=0.8e-3),
    "filtered": TWO.with_effect("velocity_filter", time_constant=1.2e-3).with_effect("torque_lag", time_constant=0.3e-3),
    "resonance": ONE.with_effect("extra_resonance", **RESONANCE).with_effect("transport_delay", delay=2e-3),
}
PIS = {
    "trapezoidal": ga.PI(0.02, 0.9),
    "backward": ga.PI(0.03, 1.2, rule="backward"),
    "forward": ga.PI(0.015, 0.5, rule="forward", command_weight=0.4),
    "proportional": ga.PI(0.02, 0.0),
}
FILTERED = ga.Cascade(
    PIS["backward"],
    torque_filters=(ga.LowPass(0.7e-3), ga.Notch(120.0, 0.1, 0.6)),
    velocity_filters=(ga.LowPass(0.4e-3),),
    command_filters=(ga.LowPass(2e-3),),
    delay=0.4e-3,
)
CONTROLLERS = {**{name: ga.Cascade(pi) for name, pi in PIS.items()}, "filters": FILTERED}


def loops_of(model: ga.Model, cascade: ga.Cascade, differenced: bool = False) -> Loops:
    plants = sampled_plants([model.linear], T, cascade.delay, differenced)
    return Loops(plants, cascade, plants.responses(frequencies_of(plants, 600, 81)))


def test_drives_of_which_one_does_not_swing_have_as_many_frequencies() -> None:
    damped = ga.TwoMass(JM=1e-3, DM=0.01, JL=1e-3, DL=0.01, KG=100.0, DG=2.0).model()
    swinging = ga.TwoMass(JM=1e-3, DM=0.01, JL=1e-3, DL=0.01, KG=100.0, DG=0.01).model()
    plants = sampled_plants([damped.linear, swinging.linear], T, 0.0, False)
    found = frequencies_of(plants, 50, 11)
    assert found.shape[0] == 2 and np.all(np.diff(found) >= 0.0) and found.max() <= np.pi / T
    assert np.array_equal(np.unique(found[0]), np.unique(frequencies_of(sampled_plants([damped.linear], T, 0.0, False), 50, 11)))


def response_of(L: Any) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [rad/s] and the response there of a system of python-control, densely where a margin is read."""
    omega = np.unique(np.concatenate([np.geomspace(1.0, np.pi / T, 400), np.linspace(1.0, np.pi / T, 500)]))
    answer = L(np.exp(1j * omega * T))
    crossings = (np.diff(np.abs(answer) > 1.0)) | (np.diff(answer.imag > 0.0) & (answer.real[1:] < 0.0))
    at = np.append(np.nonzero(crossings)[0], np.argmin(np.abs(1.0 + answer)))
    near = [np.linspace(omega[max(k - 1, 0)], omega[min(k + 2, len(omega) - 1)], 40) for k in at]
    more = np.setdiff1d(np.concatenate(near), omega)
    order = np.argsort(np.concatenate([omega, more]))
    return np.concatenate([omega, more])[order], np.concatenate([answer, L(np.exp(1j * more * T))])[order]


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_margins_are_those_of_python_control(drive: str, name: str) -> None:
    control = pytest.importorskip("control")
    model, cascade = DRIVES[drive], CONTROLLERS[name]
    pi, loops = cascade.velocity, loops_of(model, cascade)
    delays = [e.values[0] for e in model.effects if e.name == "transport_delay"]
    delayed = model.with_effect("transport_delay", delay=sum(delays) + cascade.delay)
    newest = {"trapezoidal": 0.5, "backward": 1.0, "forward": 0.0}[pi.rule]
    law = control.tf([pi.kp + newest * pi.ki * T, (1.0 - newest) * pi.ki * T - pi.kp], [1.0, -1.0], T)
    law = law if pi.ki > 0.0 else control.tf([pi.kp], [1.0], T)
    for one in (*cascade.torque_filters, *cascade.velocity_filters):
        a = np.exp(-T / one.time_constant) if isinstance(one, ga.LowPass) else None
        if a is not None:
            law = law * control.tf([1.0 - a, 0.0], [1.0, -a], T)
        else:
            w = 2.0 * np.pi * one.frequency
            numbers = ([1.0, 2.0 * z * w, w * w] for z in (one.numerator_damping, one.denominator_damping))
            law = law * control.sample_system(control.tf(*numbers), T, method="bilinear", prewarp_frequency=w)
    L = delayed.to_control(T) * law
    omega, answer = response_of(L)
    _, phases, _, *_ = control.stability_margins(control.frd(answer, omega), returnall=True)
    assert loops.phase_margins[0] == pytest.approx(np.min(np.abs(phases), initial=np.inf), abs=0.05)
    assert 1.0 / loops.peaks[0] == pytest.approx(np.min(np.abs(1.0 + answer)), rel=5e-3, abs=3e-3)

    def stable(factor: float) -> bool:
        return bool(np.max(np.abs(control.feedback(factor * L, 1).poles())) < 1.0)

    assert loops.stable[0] == stable(1.0)
    factor = 10.0 ** (loops.gain_margins[0] / 20.0)
    if stable(1.0):
        assert all(map(stable, np.geomspace(1.0 / factor, factor, 9)[1:-1])) and stable(factor**0.99)
        assert not (stable(factor**1.01) and stable(factor**-1.01))


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_step_is_that_of_the_simulation(drive: str, name: str) -> None:
    model, cascade = DRIVES[drive], CONTROLLERS[name]
    if not (loops := loops_of(model, cascade)).stable[0]:
        pytest.skip("not stable")
    velocity, torque, _ = loops.step()
    assert loops.step_torque() == pytest.approx(np.abs(torque).max(), rel=1e-12)
    n = min(300, velocity.shape[1])
    run = ga.run(
        model,
        ga.Record(T, command=np.ones(n), velocity=np.zeros(n)),
        cascade,
        substeps=64 if model.effects or cascade.delay else None,
    )
    tolerance = 1e-4 if model.effects or cascade.delay else 1e-9  # the core takes lags and delays in substeps
    assert np.allclose(velocity[0, :n], run.velocity, atol=tolerance)
    assert np.allclose(torque[0, :n], run.torque, atol=tolerance)


@pytest.mark.parametrize("every", [1, 4])
def test_the_position_loop_is_that_of_the_simulation(every: int) -> None:
    cascade = replace(FILTERED, position=ga.P(12.0), position_period=every * T)
    placed = loops_of(TWO, cascade).placed(every)
    angle = placed.step(12.0)[0]
    n = min(120, len(angle))
    rec = ga.Record(T, position_command=np.ones(n * every), velocity=np.zeros(n * every))
    start = rec.position_command
    assert start is not None
    rec = ga.Record(T, position_command=start, velocity=rec.velocity, position=None)
    run = ga.run(TWO, ga.Record(T, position_command=np.r_[0.0, start[1:]], velocity=rec.velocity), cascade)
    late = np.r_[np.zeros(every), np.repeat(angle, every)]  # the command steps at the next sample of the position controller
    assert np.allclose(run.position[: n * every : every][1:], late[: n * every : every][1:], atol=1e-5)
    omega = position_frequencies(placed.period, 4000)
    L = 12.0 * placed.response(omega)
    assert phase_margins(L)[0] > 60.0 and gain_margins(L)[0] > 6.0 and placed.stable(12.0)[0]
    worst = gain_margins(L)[0]
    factor = 10.0 ** (worst / 20.0)
    assert placed.stable(12.0 * 0.999 * factor)[0] and not placed.stable(12.0 * 1.001 * factor)[0]


def test_a_differenced_angle_is_read_as_the_core_reads_it() -> None:
    cascade = CONTROLLERS["trapezoidal"]
    velocity, _, _ = loops_of(ONE, cascade, differenced=True).step()
    rec = ga.Record(T, command=np.ones(200), velocity=np.zeros(200))
    run = ga.run(ONE, rec, differencing(cascade), substeps=64)
    assert np.allclose(velocity[0, :200], run.velocity, atol=2e-3)
    plain, _, _ = loops_of(ONE, cascade).step()
    assert np.max(np.abs(plain[0, :100] - run.velocity[:100])) > 1e-2


def test_stiffness_and_noise_are_those_of_a_long_simulation() -> None:
    """A torque at the shaft, and noise on the velocity, of a loop that is written out here."""
    pi, loops = PIS["trapezoidal"], loops_of(ONE, CONTROLLERS["trapezoidal"])
    a = np.exp(-2e-3 / 3e-4 * T)
    b = (1.0 - a) / 2e-3

    def run(push: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w = integral = before = angle = 0.0
        angles, torques = np.zeros(len(push)), np.zeros(len(push))
        for n, (d, v) in enumerate(zip(push, noise, strict=True)):
            error = -(w + v)
            integral += pi.ki * T * 0.5 * (error + before)
            before = error
            u = pi.kp * error + integral
            angles[n], torques[n] = angle, u
            mean = (w - (u + d) / 2e-3) * (1.0 - a) / (2e-3 / 3e-4 * T) + (u + d) / 2e-3
            angle += mean * T
            w = a * w + b * (u + d)
        return angles, torques

    k = np.arange(20_000)
    answer = loops.responses
    softest = max(np.geomspace(2.0, 300.0, 12), key=lambda w: np.ptp(run(np.sin(w * T * k), 0.0 * k)[0][12_000:]))
    amplitude = 0.5 * np.ptp(run(np.sin(softest * T * k), 0.0 * k)[0][12_000:])
    assert 1.0 / amplitude == pytest.approx(float(loops.stiffness[0]), rel=0.1)
    assert 1.0 / amplitude >= float(loops.stiffness[0]) * (1.0 - 1e-2) and answer.omega.shape[0] == 1
    rng = np.random.default_rng(0)
    noisy = run(0.0 * k, 0.1 * rng.standard_normal(len(k)))[1]
    assert float(np.std(noisy)) == pytest.approx(0.1 * float(loops.noise_gain[0]), rel=0.03)


def test_a_delay_of_very_many_samples_is_refused() -> None:
    with pytest.raises(ga.errors.ModelError, match="300 samples of the controller"):
        loops_of(ONE.with_effect("transport_delay", delay=0.3), CONTROLLERS["trapezoidal"])
