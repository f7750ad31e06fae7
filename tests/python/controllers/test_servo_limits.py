"""Limits that nobody told the diagnosis of, in the controller of a servo axis; the drive is that of servo_referee.py."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaident as ga
import servo_referee as referee
from gaident.control.controller import Limiting
from gaident.diagnosis.controller.form_findings import loop_of

T = 125e-6
KP, KI = 0.05, 2.0
AXIS = referee.Axis(1e-3, 0.01)
CLAMP, RATE = 0.25, 2000.0  # N m, rad/s^2


def record(every: int, source: np.ndarray, pi: dict[str, Any], **given: Any) -> ga.Record:
    """A log of the referee's drive, every `every`-th sample; pi: more of the referee's velocity controller."""
    filters = {"torque_filters": [referee.low_pass(4e-4, T)]}
    w, u, q = referee.simulate(AXIS, source, T, every, kp=KP, ki=KI, rule="backward", **filters, **pi, **given)
    placed = "position_gain" in given
    w = w + 0.005 * np.random.default_rng(4).standard_normal(len(w)) * (not placed)
    if placed:
        return ga.Record(every * T, velocity=w, torque=u, position=q, position_command=source[::every])
    return ga.Record(every * T, command=source[::every], velocity=w, torque=u)


def steps(samples: int) -> np.ndarray:
    return np.repeat(np.random.default_rng(3).uniform(-60.0, 60.0, 20), samples // 20)


def drive(**around: Any) -> ga.Cascade:
    return ga.Cascade(ga.PI(KP, KI, rule="backward"), period=T, torque_filters=(ga.LowPass(4e-4),), **around)


HIDDEN = {
    "integrator_clamp": ({"integrator_limit": CLAMP}, "limit", CLAMP),
    "command_rate_limit": ({"rate_limit": RATE}, "rate", RATE),
}


@pytest.mark.long
@pytest.mark.parametrize("effect", HIDDEN)
@pytest.mark.parametrize("every", [1, 4])
def test_a_hidden_limit_is_named(effect: str, every: int) -> None:
    """Where a line stands for each sample the replay shows it; of a slower log the loop that is simulated."""
    hidden, name, value = HIDDEN[effect]
    rec = record(every, steps(2000 * every), hidden)
    dia = ga.diagnose(rec, drive(), seed=1)
    assert [(f.effect, f.place) for f in dia.causes] == [(effect, "controller")], dia.summary()
    assert dia.causes[0].parameters[name].value == pytest.approx(value, rel=1e-2)
    assert dia.verdict == "explained"
    assert dia.controller == drive()
    assert dia.records == (rec,)
    if every == 1:
        assert "No model of the plant is involved" in dia.causes[0].evidence
        assert not any("does not follow" in note for note in dia.notes)


@pytest.mark.parametrize("every", [1, 4])
def test_a_known_limit_is_no_finding(every: int) -> None:
    rec = record(every, steps(2000 * every), {"integrator_limit": CLAMP})
    known = ga.Cascade(ga.PI(KP, KI, rule="backward", integrator_limit=CLAMP), period=T, torque_filters=(ga.LowPass(4e-4),))
    dia = ga.diagnose(rec, known, seed=1)
    assert (dia.verdict, dia.causes) == ("adequate", ())
    assert dia.controller == known
    assert "integrator_clamp" not in dia.not_testable


def test_a_slower_log_that_starts_in_motion() -> None:
    """How its loop moved before is not known: the torque drives the models, and limits inside are not testable."""
    rec = record(4, steps(8000), {})[350:]
    assert rec.velocity[0] > 10.0
    dia = ga.diagnose(rec, drive(), seed=1)
    assert any("A record starts in motion" in note for note in dia.notes)
    assert not any(f.place == "controller" for f in dia.findings)
    assert dia.after.rmse < 0.1
    assert "starts in motion" in dia.not_testable["integrator_clamp"]


REPLAYS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "alone": ({}, {}),
    "behind a filter": ({"command_filters": (ga.LowPass(2e-3),)}, {"command_filters": [referee.low_pass(2e-3, T)]}),
    "feedforward": (
        {"acceleration_feedforward": 1e-3, "friction_feedforward": 0.02},
        {"aff": 1e-3, "fff": 0.02},
    ),
    "in a position loop": (
        {"position": ga.P(50.0), "position_period": 4 * T, "velocity_feedforward": 0.9, "acceleration_feedforward": 1e-3},
        {"position_gain": 50.0, "position_every": 4, "kff": 0.9, "aff": 1e-3},
    ),
}


@pytest.mark.parametrize(
    "limits", [{"integrator_limit": 0.05}, {"rate_limit": 500.0}, {"integrator_limit": 0.05, "rate_limit": 500.0}]
)
@pytest.mark.parametrize("name", REPLAYS)
def test_the_replay_has_limits(name: str, limits: dict[str, float]) -> None:
    """What a cascade makes of the measured signals under further limits is what the referee's drive did."""
    around, given = REPLAYS[name]
    n = np.arange(2400)
    source = 3.0 * (1.0 - np.cos(2 * np.pi * n / 2400)) if "position" in around else steps(2400)
    given = {key: [referee.low_pass(2e-3, T)] if key == "command_filters" else value for key, value in given.items()}
    w, u, q = referee.simulate(AXIS, source, T, 1, kp=KP, ki=KI, **limits, **given)
    placed = "position" in around
    signals = {"position_command": source, "position": q} if placed else {"command": source}
    rec = ga.Record(T, velocity=w, torque=u, **signals)
    cascade = ga.Cascade(ga.PI(KP, KI), period=T, **around)
    also = Limiting(limits.get("integrator_limit", np.inf), limits.get("rate_limit", np.inf))
    known = len(rec) - cascade.ahead(rec.dt)
    made, free = cascade.torque_of(rec, also), cascade.torque_of(rec)
    assert np.abs(made - u)[:known].max() < 1e-9
    assert np.abs(free - u)[:known].max() > 1e-3


@pytest.mark.long
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("known", [True, False])
def test_a_limit_that_a_slow_log_shows_is_said_and_the_gains_are_as_sure_as_they_are(noise: float, known: bool) -> None:
    """Every fourth sample logged; what the velocity did between the lines, and noise on it, are part of the deviations."""
    dt, rng = 1e-3, np.random.default_rng(0)
    command = np.repeat([0, 20.0, -30, 10, -10, 40, -20, 5, 30, -5, 0, 15, -25, 8, 0], 100)
    true = ga.Cascade(ga.PI(0.05, 1.5, torque_limit=0.6, anti_windup="hold"), period=dt / 4)
    still = np.zeros(len(command))
    done = ga.run(ga.OneMass(J=4e-4, D=2e-3), ga.Record(dt, command=command, velocity=still), true)
    rec = ga.Record(dt, command=command, velocity=done.velocity + noise * rng.standard_normal(len(command)), torque=done.torque)
    found = loop_of([rec], ga.Cascade(ga.PI(0.05, 1.5) if known else ga.PI(kp=None, ki=None), period=dt / 4))
    limit, windup = found.findings
    assert (limit.effect, windup.effect, dict(windup.parameters)) == ("torque_saturation", "anti_windup", {})
    assert limit.parameters["limit"].value == pytest.approx(0.6)
    assert isinstance(found.controller, ga.Cascade) and found.controller.velocity.anti_windup == "hold"
    if not known:
        for name, value in (("velocity.kp", 0.05), ("velocity.ki", 1.5)):
            e = found.estimates[name]
            assert abs(e.value - value) < 4.0 * e.std < 0.06 * value
