"""Numbers of a controller that are given as None, from logs of the referee (servo_referee.py)."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gaident as ga
import servo_referee as referee
from gaident.errors import ControllerError, RecordError
from gaident.identification.controller_numbers import with_estimates
from referee_logs import AXIS, KI, KP, NOTCH, T, command, dip, log, low, slower

UNKNOWN = ga.PI(kp=None, ki=None)


def test_the_names_of_what_is_unknown() -> None:
    drive = ga.Cascade(
        ga.PI(None, 2.0, command_weight=None), T, position=ga.P(None), velocity_feedforward=None,
        torque_filters=(ga.LowPass(time_constant=None), ga.Notch(80.0, None, 0.7)),
    )  # fmt: skip
    names = ("velocity_feedforward", "velocity.kp", "velocity.command_weight", "position.gain",
             "torque_filters[0].time_constant", "torque_filters[1].numerator_damping")  # fmt: skip
    assert drive.unknown == names and UNKNOWN.unknown == ("kp", "ki") and ga.PI(KP, KI).unknown == ()
    whole = drive.with_numbers(dict.fromkeys(names, 0.25))
    assert whole.unknown == () and whole.torque_filters[1] == ga.Notch(80.0, 0.25, 0.7)


CASES: dict[str, tuple[Callable[[], dict[str, Any]], ga.Cascade, dict[str, float]]] = {
    "gains": (dict, ga.Cascade(UNKNOWN), {"velocity.kp": KP, "velocity.ki": KI}),
    "weight": (
        lambda: {"weight": 0.4},
        ga.Cascade(ga.PI(None, None, command_weight=None)),
        {"velocity.kp": KP, "velocity.ki": KI, "velocity.command_weight": 0.4},
    ),
    "low pass": (
        lambda: {"torque_filters": [low(4e-4)]},
        ga.Cascade(UNKNOWN, torque_filters=ga.LowPass(None)),  # type: ignore[arg-type]
        {"velocity.kp": KP, "velocity.ki": KI, "torque_filters[0].time_constant": 4e-4},
    ),
    "notch": (
        lambda: {"torque_filters": [dip()]},
        ga.Cascade(ga.PI(KP, KI), torque_filters=ga.Notch(None, None, None)),  # type: ignore[arg-type]
        {f"torque_filters[0].{name}": value for name, value in NOTCH.items()},
    ),
    "feedforward": (
        lambda: {"aff": 9e-4, "fff": 0.02},
        ga.Cascade(UNKNOWN, acceleration_feedforward=None, friction_feedforward=None),
        {"acceleration_feedforward": 9e-4, "friction_feedforward": 0.02, "velocity.kp": KP, "velocity.ki": KI},
    ),
    "hold at a limit": (
        lambda: {"torque_limit": 0.6, "windup": "hold"},
        ga.Cascade(ga.PI(None, None, torque_limit=0.6, anti_windup="hold")),
        {"velocity.kp": KP, "velocity.ki": KI},
    ),
    "a limit that is not given": (
        lambda: {"torque_limit": 0.6, "windup": "hold"},
        ga.Cascade(UNKNOWN),
        {"velocity.kp": KP, "velocity.ki": KI},
    ),
}  # fmt: skip
"""Name -> (arguments of the referee, made anew for each run: its filters keep their state; given; numbers)."""


# A feedforward of jumps acts between the lines of a slower log, which shows nothing of it.
@pytest.mark.parametrize(
    ("name", "every"), [(name, every) for name in CASES for every in (1, 4) if (name, every) != ("feedforward", 4)]
)
def test_each_number_is_found(name: str, every: int) -> None:
    made, given, true = CASES[name]
    given = ga.Cascade(**{**vars(given), "period": T})
    found = with_estimates([slower(every, 0.02 if every > 1 else 0.0, **made())], given).trusted()
    assert set(found.estimates) == set(true)
    json.dumps([vars(e) for e in found.estimates.values()])  # plain numbers, to be saved
    for key, value in true.items():
        estimate = found.estimates[key]
        off = abs(estimate.value - value)
        exact = every == 1 and "limit" not in name  # an integrator that is held now and then, beside the limit, spoils a stretch
        # What a limit does between two lines, or beside it, is no part of the deviation.
        assert off < (1e-6 * value if exact else max(5.0 * estimate.std, 0.01 * value)), (key, estimate)
        assert exact or estimate.std < (0.2 if key != "friction_feedforward" else 2.0) * value, (key, estimate)


def test_a_position_loop() -> None:
    q = np.cumsum(command()) * T
    w, u, p = referee.simulate(AXIS, q, T, kp=KP, ki=KI, position_gain=20.0, position_every=4, kff=0.8, aff=1e-3)
    rec = ga.Record(T, position_command=q, velocity=w, torque=u, position=p)
    given = ga.Cascade(
        UNKNOWN, T, position=ga.P(None), position_period=4 * T, velocity_feedforward=None, acceleration_feedforward=None
    )
    found = with_estimates([rec], given).trusted().estimates
    true = {
        "position.gain": 20.0,
        "velocity_feedforward": 0.8,
        "velocity.kp": KP,
        "velocity.ki": KI,
        "acceleration_feedforward": 1e-3,
    }
    assert {name: found[name].value for name in true} == pytest.approx(true, rel=1e-5)


def test_noise_on_a_measured_torque_makes_the_deviations() -> None:
    off = []
    for seed in range(6):
        found = with_estimates([log(seed, noise=0.02)], UNKNOWN).trusted().estimates
        off += [(found["kp"].value - KP) / found["kp"].std, (found["ki"].value - KI) / found["ki"].std]
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 2.0, off


def test_identify_and_diagnose_use_and_report_them() -> None:
    noise = 0.02 * np.random.default_rng(3).standard_normal(2400)
    reads = iter(noise)
    axis = referee.Axis(1e-3, 0.01)
    w, u, _ = referee.simulate(axis, command(), T, kp=KP, ki=KI, weight=0.0, velocity_filters=[lambda w: w + next(reads)])
    rec = ga.Record(T, command=command(), velocity=w + noise, torque=u)
    idn = ga.identify(rec, ga.Cascade(ga.PI(None, None, command_weight=0.0)))
    assert idn.controller_numbers["velocity.kp"].value == pytest.approx(KP)
    assert "Of the controller, from the logged torque" in idn.summary()
    again = ga.Identification.from_dict(json.loads(json.dumps(idn.to_dict())))
    assert again.controller_numbers == idn.controller_numbers
    dia = ga.diagnose(rec, UNKNOWN)  # the drive's is an IP controller: the form is found, too
    assert [f.effect for f in dia.causes] == ["command_weight"] and dia.verdict == "explained"
    assert dia.controller_numbers["ki"].value == pytest.approx(KI)
    assert dia.controller is not None and dia.controller.unknown == () and dia.controller.gains.ki == pytest.approx(KI)
    assert "velocity.kp" not in dia.controller_numbers and "other_gains" not in dia.summary()
    assert ga.Diagnosis.from_dict(json.loads(json.dumps(dia.to_dict()))).controller_numbers == dia.controller_numbers
    with pytest.raises(ControllerError, match=r"kp of the controller is None.*another form.*command_weight"):
        ga.identify(rec, UNKNOWN)


def test_what_cannot_be_known_is_refused_with_the_remedy() -> None:
    rec = log()
    with pytest.raises(RecordError, match=r"kp of the controller is None.*no torque.*give Record"):
        ga.identify(rec.with_channels(torque=None), UNKNOWN)
    with pytest.raises(RecordError, match=r"velocity.kp of the controller is None.*no position_command"):
        ga.diagnose(rec, ga.Cascade(UNKNOWN, position=ga.P(20.0)))
    with pytest.raises(ControllerError, match=r"kp is None, not known: give a number here"):
        ga.simulate(ga.OneMass(J=1e-3, D=0.01), rec, UNKNOWN)
    with pytest.raises(ControllerError, match=r"friction_feedforward of the controller is None.*do not show it.*give its number"):
        still = ga.Record(T, command=np.zeros(len(rec)), velocity=rec.velocity, torque=-KP * rec.velocity)
        ga.identify(still, ga.Cascade(ga.PI(KP, 0.0), friction_feedforward=None))


@pytest.mark.parametrize("shift", [-1, 1])
def test_a_torque_that_the_log_wrote_on_another_line(shift: int) -> None:
    rec = log().shifted(torque=shift)
    found = with_estimates([rec], UNKNOWN).trusted()
    assert found.estimates["kp"].value == pytest.approx(KP, rel=1e-9)
    assert found.estimates["ki"].value == pytest.approx(KI, rel=1e-9)
    assert any("wrote the torque a line " + ("late" if shift > 0 else "early") in note for note in found.notes)
    filtered = with_estimates([log(torque_filters=[low(4e-4)])], UNKNOWN)
    assert not any("a line" in note for note in filtered.notes)


def test_an_error_says_what_makes_the_torque_follow() -> None:
    rec = log()
    assert rec.torque is not None
    reversed_torque = rec.with_channels(torque=-rec.torque)
    for given in (UNKNOWN, ga.PI(None, KI), ga.Cascade(UNKNOWN, T)):
        with pytest.raises(ControllerError, match=r"follows with the other sign: reverse the sign of the torque"):
            ga.identify(reversed_torque, given)
    with pytest.raises(ControllerError, match=r"kp of the controller is None.*follows with another ki: give ki=None"):
        ga.identify(rec, ga.PI(None, 0.0))
    with pytest.raises(ControllerError, match=r"velocity.ki of the controller is None.*another kp: give kp=None"):
        ga.diagnose(rec, ga.Cascade(ga.PI(3.0 * KP, None), T))
    assert with_estimates([log(ki=0.0)], ga.PI(None, 0.0)).trusted().estimates["kp"].value == pytest.approx(KP)


@pytest.mark.parametrize("position", [None, ga.P(None), ga.P(20.0)])
def test_data_of_a_cascade_gives_it_back(position: ga.P | None) -> None:
    given = ga.Cascade(UNKNOWN, T, position=position, torque_filters=(ga.LowPass(None), ga.Notch(None, 0.1, None)))
    again = ga.Cascade.from_dict(json.loads(json.dumps(given.to_dict())))
    assert again == given and again.unknown == given.unknown


@pytest.mark.parametrize("period", [None, 1e-3, 0.5e-3])
def test_a_torque_that_needs_a_negative_integral_gain_is_refused(period: float | None) -> None:
    """Fitted with ki >= 0 it would be 0, and nothing would say why."""
    rng, dt = np.random.default_rng(0), 1e-3
    command = np.repeat([0, 20.0, -30, 10, -10, 40, -20, 5, 30, -5, 0, 15, -25, 8, 0], 100)
    noise = 0.02 * rng.standard_normal(len(command))
    drive, still = ga.OneMass(J=4e-4, D=2e-3), np.zeros(len(command))
    done = ga.run(drive, ga.Record(dt, command=command - noise, velocity=still), ga.PI(0.05, 1.5))
    error = command - done.velocity - noise
    rec = ga.Record(dt, command=command, velocity=done.velocity + noise, torque=0.05 * error - 0.3 * dt * np.cumsum(error))
    pi = ga.PI(kp=None, ki=None)
    given = pi if period is None else ga.Cascade(pi, period=period)
    with pytest.raises(ga.GaidentError, match=r"ki of the controller is None.* best with -0\.3\d* N m/rad.*give ki=0"):
        ga.identify(rec, given)


@pytest.mark.long
@pytest.mark.parametrize("known", [True, False])
def test_a_pi_alone_in_a_cascade_at_the_rate_of_the_log_is_that_pi(known: bool) -> None:
    """Its form is looked for in the same way."""
    rng, dt = np.random.default_rng(0), 1e-3
    command = np.repeat([0, 20.0, -30, 10, -10, 40, -20, 5, 30, -5, 0, 15, -25, 8, 0], 100)
    noise = 0.02 * rng.standard_normal(len(command))
    drive, still = ga.OneMass(J=4e-4, D=2e-3), np.zeros(len(command))
    true = ga.Cascade(ga.PI(0.05, 1.5), torque_filters=(ga.LowPass(1.5e-3),))
    done = ga.run(drive, ga.Record(dt, command=command - noise, velocity=still), true)
    rec = ga.Record(dt, command=command, velocity=done.velocity + noise, torque=done.torque)
    pi = ga.PI(0.05, 1.5) if known else ga.PI(kp=None, ki=None)
    alone, within = (ga.diagnose(rec, c, seed=1) for c in (pi, ga.Cascade(pi, period=dt)))
    assert [f.effect for f in within.causes] == ["torque_filter"] and within.verdict == "explained"
    assert within.findings == alone.findings and within.controller == alone.controller
    assert (
        ga.identify(rec, ga.Cascade(ga.PI(0.05, 1.5), period=dt), seed=1).model
        == ga.identify(rec, ga.PI(0.05, 1.5), seed=1).model
    )
