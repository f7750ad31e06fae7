"""Logs slower than their controller that start in motion: the state of controller and plant before is not known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.gains import start_state
from gaident.identification.controller_numbers import with_estimates
from gaident.models import simulate
from gaident.models.drive_torque import driven_by
from gaident.models.starts import starts_moving
from referee_logs import GIVEN, KI, KP, T, command, low, slower

CLOCK = ga.Cascade(GIVEN, T)
SKIPPED = 350  # lines, behind the step of line 300
FORMS: dict[str, tuple[Any, str]] = {
    "low pass": (lambda: {"torque_filters": [low(1e-3)]}, "torque_filter"),
    "weight": (lambda: {"weight": 0.3}, "command_weight"),
    "limit": (lambda: {"torque_limit": 0.6}, "torque_saturation"),
    "limit, tracking": (lambda: {"torque_limit": 0.6, "windup": "tracking", "tracking": 0.02}, "torque_saturation"),
}


@pytest.mark.parametrize("name", FORMS)
def test_a_form_is_seen_and_leaves_little(name: str) -> None:
    made, effect = FORMS[name]
    shown = form_shown([slower(4, **made())[SKIPPED:]], GIVEN, every=4)
    assert shown is not None and set(shown.numbers) == {effect}
    assert shown.rms < 0.05 * shown.before
    share = 0.012 if name == "low pass" else 0.01
    assert all(0.0 < std < share * value for value, std in shown.numbers[effect].values())
    if name == "low pass":
        value, std = shown.numbers[effect]["time_constant"]
        assert abs(value - 1e-3) < 3.0 * std  # what the velocity between the lines may do is in it


def test_unknown_gains_are_found() -> None:
    given = ga.Cascade(ga.PI(None, None), T)
    for every in (2, 4):
        found = with_estimates([slower(every)[SKIPPED:]], given).trusted().estimates
        assert found["velocity.kp"].value == pytest.approx(KP, rel=5e-3)
        assert found["velocity.ki"].value == pytest.approx(KI, rel=5e-3)


def test_the_torque_goes_between_the_lines_as_the_controller_makes_it() -> None:
    every, lines = 8, command(800)
    held = np.repeat(lines, every)
    run = ga.run(ga.OneMass(J=1e-3, D=0.01), ga.Record(T, command=held, velocity=0.0 * held), GIVEN)
    log = ga.Record(every * T, command=lines, velocity=run.velocity[::every], torque=run.torque[::every])
    true = run.torque.reshape(-1, every).mean(axis=1)
    assert log.torque is not None
    straight = log.torque + np.append(np.diff(log.torque), 0.0) * (every - 1) / (2 * every)
    for given, share in ((CLOCK, 0.03), (ga.Cascade(ga.PI(0.9 * KP, 1.1 * KI), T), 0.2)):
        assert np.std(driven_by(log, given).torque - true) < share * np.std(straight - true)
    other = ga.Cascade(ga.PI(10.0, 0.0), T)  # what it makes is nothing like the logged torque, which goes straight
    np.testing.assert_allclose(driven_by(log, other).torque[:-1], straight[:-1], atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("effect", ["", "transport_delay", "coulomb_friction"])
@pytest.mark.parametrize("every", [4, 8])
def test_nothing_is_named_that_is_not_there(every: int, effect: str) -> None:
    effects = {"": {}, "transport_delay": {"delay": 6e-4}, "coulomb_friction": {"torque": 0.03}}[effect]
    plant = Plant(J=1e-3, D=0.01, kp=KP, ki=KI, dt=every * T, cascade=CLOCK)
    rec = rig(plant, command(1600, seed=3), {effect: effects} if effect else {}, seed=1, noise=Noise(white=0.02))[SKIPPED:]
    dia = ga.diagnose(rec, CLOCK, seed=1)
    assert [f.effect for f in dia.causes] == [effect] * bool(effect)
    assert dia.verdict == ("explained" if effect else "adequate")
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=5e-3)
    assert any("A record starts in motion" in note for note in dia.notes)


def test_a_resonance_is_found_where_it_is() -> None:
    dia = ga.diagnose(slower(4)[SKIPPED:], CLOCK, seed=1)
    assert dia.verdict == "adequate"
    assert dia.mechanics["resonance"].value == pytest.approx(74.1, rel=5e-3)


@pytest.mark.parametrize("effect", [{}, {"coulomb_friction": {"torque": 0.1}}])
@pytest.mark.parametrize("limit", [None, 5.0])
@pytest.mark.parametrize("logged", [True, False])
def test_a_free_run_of_a_record_in_motion_begins_at_its_velocity(
    effect: dict[str, dict[str, float]], limit: float | None, logged: bool
) -> None:
    """Of the linear model too, whatever it lacks: dry friction, and a load that the integrator holds."""
    pi, linear = ga.PI(0.03, 1.0, torque_limit=limit), ga.OneMass(J=3e-4, D=2e-3).model()
    drive = linear.with_effect("coulomb_friction", torque=0.1).with_effect("load_torque", torque=0.3)
    noise = 0.02 * np.random.default_rng(1).standard_normal(900)
    command = np.repeat([40.0, 20.0, 40.0, 10.0, 30.0, 20.0], 150)
    done = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), pi)
    rec = ga.Record(1e-3, command=command, velocity=done.velocity + noise, torque=done.torque if logged else None)[120:]
    assert starts_moving(rec, pi)
    model = linear
    for name, values in effect.items():
        model = model.with_effect(name, **values)
    state = start_state(model, rec, pi)
    assert state is not None and len(state) == 2
    run = simulate(model, rec, pi, state)
    assert abs(run[0] - rec.velocity[0]) < 1.0 and np.max(np.abs(run - rec.velocity)[:25]) < 3.0
