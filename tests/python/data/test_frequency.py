"""The frequency response that a record shows: right where the command is the instrument, biased and said so where it is not."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.errors import GaidentError, RecordError
from gaident.identification.response.averaged import measured_response, response_of, sampled_response

DT = 1e-3
PLANT = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1e-3, KG=12.0, DG=2e-3).model()
CONTROLLER = ga.PI(kp=0.02, ki=0.4)


def record(noise: float, loop: ga.PI = CONTROLLER, samples: int = 8000) -> ga.Record:
    """A random binary command; noise [rad/s] on the velocity that the controller reads."""
    rng = np.random.default_rng(3)
    command = 20.0 + 10.0 * np.repeat(rng.choice([-1.0, 1.0], samples // 2), 2)
    n = noise * rng.standard_normal(samples)
    done = ga.run(PLANT, ga.Record(DT, command=command - n, velocity=np.zeros(samples)), loop)
    return ga.Record(DT, command=command, velocity=done.velocity + n, torque=done.torque)


def off(found: Any, loop: ga.PI | None = CONTROLLER) -> np.ndarray:
    """Distance from the truth in standard deviations, without the window's first frequencies, where it leaks."""
    used = (found.frequency > 5.0 * found.resolution) & (found.coherence > found.threshold)
    truth = sampled_response(PLANT, found.frequency, DT, loop)
    return (np.abs(found.value - truth) / found.std)[used]


def within(frequency: np.ndarray) -> np.ndarray:
    """Above resonance and antiresonance (50 and 32 Hz), which windows smear, and below what the command excites."""
    return (frequency > 80.0) & (frequency < 400.0)


def test_the_command_as_instrument_gives_the_drive_whatever_the_noise() -> None:
    noisy = measured_response(record(3.0), CONTROLLER)
    assert noisy.instrument and "Joint input-output" in noisy.sentence and noisy.windows >= 8
    assert np.mean(off(noisy) ** 2) < 3.0  # 1 for an estimate of two parts with the right deviation, and what the windows leak
    quiet = measured_response(record(0.0), CONTROLLER)
    truth = sampled_response(PLANT, quiet.frequency, DT, CONTROLLER)
    used = within(quiet.frequency)
    assert np.all(np.abs(quiet.value / truth - 1.0)[used] < 0.1) and np.all(quiet.coherence[used] > 0.9)


def test_deviation_and_threshold_are_right_where_frequencies_are_taken_together() -> None:
    """White torque and white noise, G = 1: what the estimates scatter, and how often chance passes its threshold."""
    rng = np.random.default_rng(0)
    off_by, claimed, passed = [], [], []
    for _ in range(60):
        u, e, other = rng.standard_normal((3, 6000))
        found = measured_response(ga.Record(DT, torque=u, velocity=u + e))
        off_by.append(np.abs(found.value - 1.0) ** 2)
        claimed.append(found.std**2)
        chance = measured_response(ga.Record(DT, torque=u, velocity=other))
        passed.append(chance.coherence > chance.threshold)
    bands = np.arange(len(claimed[0])) // 20  # few frequencies taken together, then ever more
    for band in range(4):
        there = bands == band
        assert np.sqrt(np.mean(np.array(off_by)[:, there]) / np.mean(np.array(claimed)[:, there])) == pytest.approx(1.0, abs=0.08)
        assert np.mean(np.array(passed)[:, there]) == pytest.approx(0.05, abs=0.02)


def test_without_it_a_loop_biases_the_estimate_and_the_sentence_says_so() -> None:
    rec = record(3.0)
    blind = measured_response(ga.Record(DT, velocity=rec.velocity, torque=rec.torque))
    assert not blind.instrument and "H1" in blind.sentence and "biased" in blind.sentence
    assert np.mean(off(blind) ** 2) > 20.0
    # Where the command has nothing (a value of two samples: 500 Hz), it is minus the inverse of the controller.
    np.testing.assert_allclose(blind.value[-1], -1.0 / CONTROLLER.kp, rtol=0.1)
    open_loop = record(3.0)
    assert open_loop.torque is not None
    driven = ga.run(PLANT, ga.Record(DT, torque=open_loop.torque, velocity=np.zeros(len(open_loop))))
    free = measured_response(ga.Record(DT, torque=open_loop.torque, velocity=driven.velocity))
    truth = sampled_response(PLANT, free.frequency, DT)
    assert np.median(np.abs(free.value / truth - 1.0)) < 0.02


def test_the_torque_is_made_where_it_is_not_logged_and_a_dead_command_is_refused() -> None:
    rec = record(0.5)
    without = ga.Record(DT, command=rec.command, velocity=rec.velocity)
    np.testing.assert_allclose(measured_response(without, CONTROLLER).value, measured_response(rec, CONTROLLER).value, rtol=1e-6)
    with pytest.raises(RecordError, match="no controller to make it from"):
        measured_response(without)
    dead = ga.Record(DT, command=np.full(len(rec), 20.0), velocity=rec.velocity, torque=rec.torque)
    with pytest.raises(RecordError, match="command of this loop never changes"):
        measured_response(dead, CONTROLLER)
    even = ga.Record(DT, velocity=rec.velocity, torque=np.full(len(rec), 0.06))
    with pytest.raises(RecordError, match="torque never changes"):
        measured_response(even)


def test_a_bilinear_loop_has_its_own_response() -> None:
    loop = replace(CONTROLLER, loop="continuous")
    found = measured_response(record(0.0, loop), loop)
    truth = sampled_response(PLANT, found.frequency, DT, loop)
    used = within(found.frequency)
    assert np.all(np.abs(found.value / truth - 1.0)[used] < 0.1)


def test_the_model_estimated_the_same_way_shares_the_windows_and_the_effects() -> None:
    """Friction bends the record's response away from the linear part; the extended model follows it."""
    friction = PLANT.with_effect("coulomb_friction", torque=0.1)
    base = record(0.0)
    assert base.command is not None
    slow = ga.Record(DT, command=base.command - 20.0, velocity=np.zeros(len(base)))
    done = ga.run(friction, slow, CONTROLLER)
    rec = ga.Record(DT, command=slow.command, velocity=done.velocity, torque=done.torque)
    found = response_of(rec, friction, CONTROLLER)
    assert found.simulated is not None
    np.testing.assert_allclose(found.simulated.value, found.measured.value, rtol=1e-6)
    linear = sampled_response(PLANT, found.measured.frequency, DT, CONTROLLER)
    low = found.measured.frequency < 5.0
    assert np.median(np.abs(found.measured.value / linear)[low]) < 0.8
    assert response_of(rec, ga.Model(1.0, [900.0]), CONTROLLER).simulated is None  # it runs away


def test_pictures_of_a_result_have_names_and_hertz_on_request() -> None:
    rec = record(0.5, samples=1500)
    idn = ga.identify(rec, controller=CONTROLLER, space=ga.SearchSpace(p=(1, 1), q=(2, 2), gain=(1e3, 1e4), real=(0, 60),
                      imaginary=(0, 500)))  # fmt: skip
    figures = [idn.plot_bode(), idn.plot_bode(hz=True), idn.plot_poles(), idn.plot_poles(hz=True)]
    labels = [figure.axes[-1].get_xlabel() for figure in figures]
    assert labels == ["frequency [rad/s]", "frequency [Hz]", "real part [rad/s]", "real part [Hz]"]
    lines = [figure.axes[0].lines[1].get_xdata() for figure in figures[:2]]
    np.testing.assert_allclose(lines[0], 2.0 * np.pi * np.asarray(lines[1]))
    assert [ax.get_ylabel() for ax in figures[0].axes] == ["magnitude [rad/s/(N m)]", "phase [deg]", "coherence"]
    assert idn.plot_convergence().axes[0].get_xlabel() == "generation"
    assert len(idn.plot_structures().axes[0].patches) == len(idn.structures)
    loaded = ga.Identification.from_dict(idn.to_dict())
    assert loaded.plot_bode(hz=True).axes[-1].get_xlabel() == "frequency [Hz]" and len(loaded.plot_bode().axes) == 2
    drawn = io.BytesIO()
    figures[0].savefig(drawn, format="png", dpi=50)
    assert drawn.getvalue().startswith(b"\x89PNG")
    assert "two masses" in idn._repr_html_()


def test_a_loaded_diagnosis_asks_for_its_record() -> None:
    from report_cases import diagnosed

    dia = diagnosed()
    assert len(dia.plot_bode(hz=True).axes) == 3
    with pytest.raises(GaidentError, match=r"plot_bode\(records\)"):
        ga.Diagnosis.from_dict(dia.to_dict()).plot_bode()
    shown = dia._repr_html_()
    assert "coulomb friction" in shown and "<script" not in shown
    assert f"<b>coulomb friction</b>: {dia.causes[0].evidence[:30]}" in shown
