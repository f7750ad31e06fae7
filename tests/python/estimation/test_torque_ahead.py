"""A torque that goes on between the lines of a log slower than its controller, whose period nobody gave."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, log_of, rig, skip_without_library
from gaident.diagnosis.experiments.candidates import unresolved
from gaident.estimation.regression.torque_lag import torque_lag
from gaident.models.made_torque import late

DT, EVERY, KP, KI, SLOPE = 1e-3, 4, 0.08, 4.0, 1500.0
NOTCHED = ga.Cascade(ga.PI(KP, KI), DT / EVERY, position=ga.P(20.0), torque_filters=(ga.Notch(200.0, 0.1, 0.7),))
GIVEN = ga.Cascade(ga.PI(KP, KI), position=ga.P(20.0))
ONE = Plant(J=1e-3, D=2e-3, kp=KP, ki=KI, dt=DT, cascade=NOTCHED)


def command() -> np.ndarray:
    """Angles of moves at levels of both signs, 0.3 s each, with ramps between them [rad]."""
    levels = np.random.default_rng(3).permutation([5.0, -10.0, 20.0, -40.0, 60.0, -60.0, 30.0, -3.0, 0.0, 15.0])
    ramp = np.arange(300) * SLOPE * DT
    before = np.append(0.0, levels[:-1])
    speed = np.concatenate([a + np.sign(b - a) * np.minimum(ramp, abs(b - a)) for a, b in zip(before, levels, strict=True)])
    return np.asarray(np.cumsum(speed) * DT)


def record(plant: Plant, differenced: bool) -> ga.Record:
    """Read by an encoder of 2^20 lines, with dry friction."""
    skip_without_library()
    noise = Noise(white=0.0, encoder=2.0 * np.pi / 2**20, differenced=differenced)
    return rig(plant, command(), {"coulomb_friction": {"torque": 0.15}}, noise, 1)


@pytest.mark.parametrize("differenced", [False, True])
def test_the_mean_of_a_torque_over_a_line_is_ahead_of_it(differenced: bool) -> None:
    """(r - 1)/(2r) lines, less the age of the velocity, half a sample of the controller."""
    seen = torque_lag(record(ONE, differenced))
    assert seen is not None
    expected = (EVERY - 1 - differenced) / (2.0 * EVERY)
    assert abs(seen.lag - expected) < max(3.0 * seen.std, 0.03)


def test_a_torque_ahead_is_on_its_way_to_that_of_the_next_line() -> None:
    u = np.array([0.0, 1.0, 3.0, 2.0])
    assert late(u, -0.25, 0.0) == pytest.approx([0.25, 1.5, 2.75, 2.0])
    assert late(u, 0.0, 0.0) is u


@pytest.mark.long
@pytest.mark.parametrize("differenced", [False, True])
def test_a_forgotten_period_is_no_second_mass(differenced: bool) -> None:
    dia = ga.diagnose(record(ONE, differenced), GIVEN)
    assert any("goes on, as that of a controller does that is faster" in note for note in dia.notes), dia.summary()
    assert {f.effect: f.alternatives for f in dia.causes} == {"coulomb_friction": ()}, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=1e-3) and "stiffness" not in dia.mechanics
    assert dia.causes[0].parameters["torque"].value == pytest.approx(0.15, rel=0.01)


@pytest.mark.long
def test_a_torque_that_is_held_is_not_moved() -> None:
    at_its_rate = replace(ONE, cascade=replace(NOTCHED, period=DT))
    rec = record(at_its_rate, differenced=False)
    seen = torque_lag(rec)
    assert seen is not None and abs(seen.lag) < max(3.0 * seen.std, 0.03)
    dia = ga.diagnose(rec.with_channels(position_command=None))
    assert not any("goes on, as that of a controller" in note for note in dia.notes), dia.summary()


def test_a_torque_that_follows_exactly_is_not_ahead() -> None:
    """The deviation of its lag is 0."""
    t = DT * np.arange(4000)
    held = 0.2 * np.sin(5.0 * t)
    drive = ga.OneMass(J=1e-3, D=2e-3)
    rec = ga.Record(DT, torque=held, velocity=ga.simulate(drive, ga.Record(DT, torque=held, velocity=np.zeros(len(t)))))
    dia = ga.diagnose(rec)
    assert dia.causes == () and not any("goes on, as that of a controller" in note for note in dia.notes), dia.summary()


def test_a_jump_at_the_first_line_moves_no_torque() -> None:
    """Continued beyond the record's start, torque and motion do not fit; lags of 0.6 to 0.9 samples came of that."""
    skip_without_library()
    plant = Plant(J=0.02, D=0.05, kp=0.8, ki=4.0, dt=DT, cascade=ga.Cascade(ga.PI(0.8, 4.0), position=ga.P(6.0)))
    t = DT * np.arange(6000)
    angle = 2.0 * np.cos(2.0 * np.pi * 0.4 * t) + np.sin(2.0 * np.pi * 0.7 * t)
    friction = {"coulomb_friction": {"torque": 0.1}}
    rec = rig(plant, angle, friction, Noise(white=0.02), 1, position_logged=True).with_channels(position_command=None)
    seen = torque_lag(rec)
    assert seen is not None and abs(seen.lag) < 0.1, seen


@pytest.mark.long
def test_of_an_axis_under_gravity_nothing_is_named_that_the_torque_between_the_lines_makes() -> None:
    """A 100 Hz log of a 1 kHz controller, which nobody gave: 0.45 lines. Held, it had a second mass, and gravity at both ends."""
    skip_without_library()
    gains, fast, every = ga.PI(0.5, 4.0), 1e-3, 10
    plant = Plant(J=0.02, D=0.05, kp=0.5, ki=4.0, dt=every * fast, cascade=ga.Cascade(gains, period=fast))
    levels = np.random.default_rng(2).uniform(-8.0, 8.0, 16)
    asked = np.repeat(levels, 150 * every)
    command = np.zeros(len(asked))
    for k in range(1, len(asked)):
        command[k] = command[k - 1] + np.clip(asked[k] - command[k - 1], -0.03, 0.03)
    hidden = {"coulomb_friction": {"torque": 0.3}, "unbalance": {"amplitude": 1.0, "phase": 0.0}}
    rec = log_of(plant, command, hidden, Noise(white=0.02), 1).with_channels(command=None)
    assert torque_lag(rec) is not None, "gravity is part of the regression"
    dia = ga.diagnose(rec)
    assert any("goes on, as that of a controller" in note for note in dia.notes), dia.summary()
    assert sorted(f.effect for f in dia.causes) == ["coulomb_friction", "unbalance"], dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(0.02, rel=0.01) and "stiffness" not in dia.mechanics
    found = {f.effect: f.parameters for f in dia.causes}
    assert found["coulomb_friction"]["torque"].value == pytest.approx(0.3, rel=0.02)
    assert found["unbalance"]["amplitude"].value == pytest.approx(1.0, rel=0.01)


@pytest.mark.parametrize(("lines", "age", "looked_for"), [(1, -0.45, False), (2, -0.45, False), (3, -0.45, True), (1, 0.0, True)])
def test_peaks_between_the_lines_of_a_log_show_no_limit_of_the_torque(lines: int, age: float, looked_for: bool) -> None:
    torque = np.full(100, 0.2)
    torque[40 : 40 + lines] = 1.0
    torque[60:62] = 0.9, -0.9  # on either side: two peaks of one line
    data: Any = SimpleNamespace(age=age, torque_logged=True, driven=[ga.Record(0.01, velocity=torque, torque=torque)])
    why = unresolved(data)
    assert (not why) == looked_for
    assert looked_for or (set(why) == {"torque_saturation"} and "log every sample" in why["torque_saturation"])
