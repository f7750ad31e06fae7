"""A feedforward of the command's slope over the past period, as of a controller that knows no coming command."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import cont2discrete

import gaident as ga
from gaident.control.controller import Controller
from gaident.errors import ControllerError
from gaident.identification.controller_numbers import with_estimates
from gaident.identification.logged_torque import corrected, not_followed
from gaident.identification.replay.driven_records import torque_driven
from gaident.results.store import schema

T = 250e-6
INERTIA, VISCOUS, KP, KI, KV = 1.5e-3, 2e-3, 0.3, 15.0, 30.0
GIVEN = ga.Cascade(ga.PI(KP, KI, rule="backward"), T, position=ga.P(KV), velocity_feedforward=1.0)
PAST = replace(GIVEN, feedforward_over="past")


def profile(n: int) -> np.ndarray:
    """Positions at the controller's samples [rad] of moves with limited acceleration, at rest first and last."""
    speeds = np.repeat([0.0, 60.0, 120.0, 25.0, -50.0, -120.0, -35.0, 0.0, 40.0, 0.0], n // 10)
    speed = np.zeros(n)
    for k in range(1, n):
        speed[k] = speed[k - 1] + np.clip(speeds[min(k, len(speeds) - 1)] - speed[k - 1], -0.375, 0.375)
    return np.concatenate([[0.0], np.cumsum(speed[:-1])]) * T


def log(every: int, acceleration: float = 0.0, n: int = 8000) -> ga.Record:
    """One rigid mass behind a cascade that is written out here, step by step; a line for every so many of its samples."""
    A, B, *_ = cont2discrete(
        (np.array([[0.0, 1.0], [0.0, -VISCOUS / INERTIA]]), np.array([[0.0], [1 / INERTIA]]), np.eye(2), np.zeros((2, 1))), T
    )
    rng, wanted = np.random.default_rng(5), profile(n)
    state, stored, lines = np.zeros(2), 0.0, np.empty((3, n))
    for k in range(n):
        slope, before = ((wanted[max(j, 0)] - wanted[max(j - 1, 0)]) / T for j in (k, k - 1))
        velocity = state[1] + 2e-3 * rng.standard_normal()
        error = KV * (wanted[k] - state[0]) + slope - velocity
        stored += KI * T * error
        torque = KP * error + stored + acceleration * (slope - before) / T
        lines[:, k] = state[0], velocity, torque
        state = A @ state + B[:, 0] * torque
    q, w, u = lines[:, ::every]
    return ga.Record(every * T, velocity=w, torque=u, position=q, position_command=wanted[::every])


def follows(rec: ga.Record, controller: Controller) -> bool:
    """Whether the logged torque follows from command, position and velocity through this controller."""
    return not (torque_driven([rec], controller).doubts or not_followed([rec], controller))


@pytest.mark.long
@pytest.mark.parametrize("every", [1, 4])
def test_the_torque_tells_the_period_of_the_slope(every: int) -> None:
    rec = log(every)
    way = {"interpolation": "smooth"} if every > 1 else {}
    assert not follows(rec, GIVEN) and follows(rec, replace(PAST, **way))
    found = corrected([rec], GIVEN)
    assert found is not None and found.controller == replace(PAST, **way) and found.estimates == {}
    assert "the past period (feedforward_over 'past')" in str(found.note)
    for number, true in (("velocity_feedforward", 1.0), ("position", KV)):
        open_one = replace(GIVEN, **{number: ga.P(None) if number == "position" else None})
        numbers = with_estimates([rec], open_one)
        assert isinstance(numbers.controller, ga.Cascade) and numbers.controller.feedforward_over == "past"
        assert not numbers.doubt and next(iter(numbers.estimates.values())).value == pytest.approx(true, rel=1e-3)


def test_an_acceleration_feedforward_is_two_periods_late() -> None:
    rec = log(1, acceleration=INERTIA)
    with_both = replace(PAST, acceleration_feedforward=INERTIA)
    assert follows(rec, with_both) and not follows(rec, replace(with_both, feedforward_over="coming"))


@pytest.mark.long
def test_a_diagnosis_takes_it_for_no_effect() -> None:
    dia = ga.diagnose(log(1), GIVEN)
    assert dia.verdict == "adequate" and not dia.findings, dia.summary()
    assert dia.controller == PAST and any("feedforward_over" in note for note in dia.notes)
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed: pip install '.[test]'")
    jsonschema.Draft202012Validator(schema()).validate(json.loads(dia.to_json()))
    assert ga.Diagnosis.from_dict(json.loads(dia.to_json())).controller == PAST
    assert dia.mechanics["inertia"].value == pytest.approx(INERTIA, rel=1e-3)


def test_what_is_simulated_has_the_slope_of_the_past_period() -> None:
    rec = log(1)
    model = ga.Model(1.0 / INERTIA, poles=[-VISCOUS / INERTIA])
    errors = [np.std(rec.velocity - ga.simulate(model, rec, one)) for one in (PAST, GIVEN)]
    assert errors[0] < 3e-3 < 0.1 * errors[1]


def test_the_period_is_a_setting() -> None:
    assert ga.Cascade.from_dict(PAST.to_dict()) == PAST and "feedforward_over" not in GIVEN.to_dict()
    assert [c.feedforward_over for c in PAST.readings(T)] == ["past", "coming"]
    bare = replace(GIVEN, velocity_feedforward=0.0)
    assert bare.readings(T) == (bare,), "nothing is fed forward"
    with pytest.raises(ControllerError, match="feedforward_over is 'last': it must be one of coming, past"):
        replace(GIVEN, feedforward_over="last")


@pytest.mark.long
def test_gains_that_can_change_places_are_said_to() -> None:
    """kp d' + (kp Kv + ki) d + ki Kv integral(d): sum and product of Kv and ki/kp show, and behind noise not which is which."""
    unknown = replace(GIVEN, velocity=ga.PI(None, None, rule="backward"), position=ga.P(None), velocity_feedforward=None)
    rec = log(4)
    sharp = with_estimates([rec], unknown).estimates
    for name, true in (("velocity.ki", KI), ("position.gain", KV)):
        assert sharp[name].value == pytest.approx(true, rel=2e-3) and sharp[name].std < 2e-3 * true, "the clock tells them apart"
    noisy = rec.with_channels(torque=rec.torque + 0.05 * np.random.default_rng(1).standard_normal(len(rec)))
    numbers = with_estimates([noisy], unknown)
    assert not numbers.doubt and numbers.estimates["velocity.kp"].value == pytest.approx(KP, rel=0.05)
    for name, true in (("velocity.ki", KI), ("position.gain", KV)):
        found = numbers.estimates[name]
        assert abs(found.value - true) < 2.0 * found.std and found.std > 0.1 * true
    (said,) = [str(note) for note in numbers.notes if "can change places" in str(note)]
    assert "position.gain = " in said and "velocity.ki = " in said
    alone = with_estimates([noisy], replace(unknown, position=ga.P(KV)))
    assert alone.estimates["velocity.ki"].value == pytest.approx(KI, rel=0.05)
    assert not any("can change places" in str(note) for note in alone.notes)
