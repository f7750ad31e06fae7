"""The PI controller: what it accepts, what it refuses and how it says so."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident import _core
from gaident.control.beside import beside_pi
from gaident.control.cascade import controller_of
from gaident.control.pi import PI
from gaident.errors import ControllerError
from gaident.identification.replay.driven_records import torque_driven


def test_defaults_are_a_digital_controller_without_limits() -> None:
    ctl = PI(0.0232, 1.367)
    assert (ctl.kp, ctl.ki, ctl.loop) == (0.0232, 1.367, "sampled")
    assert not ctl.limited
    assert ctl.limits == (math.inf, math.inf)
    assert ctl == PI(kp=0.0232, ki=1.367, loop="sampled", torque_limit=None, integrator_limit=None)
    assert hash(ctl) == hash(PI(0.0232, 1.367))


def test_limits_and_integers_become_floats() -> None:
    ctl = PI(1, 0, "continuous", torque_limit=2, integrator_limit=3)
    assert ctl.limited
    assert ctl.limits == (2.0, 3.0)
    assert all(isinstance(value, float) for value in (ctl.kp, ctl.ki, ctl.torque_limit, ctl.integrator_limit))


def test_is_immutable() -> None:
    with pytest.raises(AttributeError):
        PI(1.0, 1.0).kp = 2.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"kp": -1.0, "ki": 1.0}, ["kp", "-1", "negative gain"]),
        ({"kp": 1.0, "ki": -0.5}, ["ki", "-0.5"]),
        ({"kp": math.nan, "ki": 1.0}, ["kp", "nan"]),
        ({"kp": 1.0, "ki": math.inf}, ["ki", "inf"]),
        ({"kp": "0.02", "ki": 1.0}, ["kp", "'0.02'"]),
        ({"kp": 0.0, "ki": 0.0}, ["kp and ki", "controller=None"]),
        ({"kp": 1.0, "ki": 1.0, "loop": "continous"}, ["loop", "'continous'", "did you mean 'continuous'?"]),
        ({"kp": 1.0, "ki": 1.0, "loop": "Sampled"}, ["loop", "did you mean 'sampled'?"]),
        ({"kp": 1.0, "ki": 1.0, "loop": 3}, ["loop", "3", "sampled, continuous"]),
        ({"kp": 1.0, "ki": 1.0, "torque_limit": 0.0}, ["torque_limit", "0", "None for no limit"]),
        ({"kp": 1.0, "ki": 1.0, "torque_limit": -2.0}, ["torque_limit", "-2"]),
        ({"kp": 1.0, "ki": 1.0, "integrator_limit": math.nan}, ["integrator_limit", "nan"]),
        ({"kp": 1.0, "ki": 1.0, "integrator_limit": math.inf}, ["integrator_limit", "None for no limit"]),
    ],
)
def test_refuses_with_name_value_and_remedy(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises(ControllerError) as refusal:
        PI(**arguments)  # type: ignore[arg-type]
    for word in words:
        assert word in str(refusal.value)


def test_dictionary_round_trip_through_json() -> None:
    limited = PI(0.3, 4.0, torque_limit=1.5, integrator_limit=0.5)
    for ctl in (PI(0.1, 2.0), PI(0.1, 0.0, "continuous"), limited):
        assert PI.from_dict(json.loads(json.dumps(ctl.to_dict()))) == ctl
    assert PI.from_dict({"kp": 0.1, "ki": 2}) == PI(0.1, 2.0)


def test_from_dict_names_the_wrong_key() -> None:
    with pytest.raises(ControllerError, match=r"'torque_limt'.*did you mean 'torque_limit'"):
        PI.from_dict({"kp": 1.0, "ki": 1.0, "torque_limt": 2.0})
    with pytest.raises(ControllerError, match="lacks ki"):
        PI.from_dict({"kp": 1.0})
    with pytest.raises(ControllerError, match="give a dictionary"):
        PI.from_dict([1.0, 2.0])  # type: ignore[arg-type]


def test_a_forgotten_gain_is_named_with_its_remedy() -> None:
    with pytest.raises(ControllerError, match=r"PI lacks ki: give PI\(kp=..., ki=...\), ki=0 for a proportional controller"):
        PI(kp=1.0)
    with pytest.raises(ControllerError, match="PI lacks kp and ki"):
        PI()
    assert PI(kp=1.0, ki=0).ki == 0.0


def test_the_core_clamps_a_sum_and_limits_a_rate_as_one_sample_after_the_other() -> None:
    rng = np.random.default_rng(5)
    steps = rng.standard_normal(300)
    total, sums, value, followed = 0.3, [], -1.0, []
    for x in steps.tolist():
        total = min(max(total + x, -1.5), 1.5)
        sums.append(total)
        value += min(max(x - value, -0.2), 0.2)
        followed.append(value)
    given = steps.copy()
    np.testing.assert_array_equal(_core.clamped_sum(given, 1.5, 0.3), sums)
    np.testing.assert_array_equal(_core.rate_limited(given, 0.2, -1.0), followed)
    np.testing.assert_array_equal(given, steps)


REC = ga.Record(1e-3, command=np.repeat([0.0, 5.0, -5.0], 40), velocity=np.arange(120.0), torque=np.repeat([0.1, -0.1, 0.0], 40))
DRIVE = ga.OneMass(J=1e-3, D=0.01)
TAKE_ANY: dict[str, Callable[[Any], object]] = {
    "simulate": lambda c: ga.simulate(DRIVE, REC, c),
    "run": lambda c: ga.run(DRIVE, REC, c),
    "simulate_many": lambda c: ga.simulate_many([DRIVE], REC, c),
    "initial_state": lambda c: ga.initial_state(DRIVE, REC, c),
    "identify": lambda c: ga.identify(REC, c),
    "diagnose": lambda c: ga.diagnose(REC, c),
    "to_c": lambda c: DRIVE.model().to_c(None, 1e-3, c),
}
TAKE_A_BARE_PI: dict[str, Callable[[Any], object]] = {
    "discrete": lambda c: DRIVE.model().discrete(1e-3, c),
    "least_squares": lambda c: ga.least_squares(REC, 2, c),
}


@pytest.mark.parametrize("name", [*TAKE_ANY, *TAKE_A_BARE_PI])
def test_every_function_says_what_a_controller_is(name: str) -> None:
    with pytest.raises(ga.errors.SettingsError, match=r"controller is 0\.5: give a gaident.PI or a Cascade, or None"):
        {**TAKE_ANY, **TAKE_A_BARE_PI}[name](0.5)


@pytest.mark.parametrize("controller", [ga.Cascade(ga.PI(0.1, 1.0)), ga.PI(0.1, 1.0, rule="backward")])
@pytest.mark.parametrize("name", TAKE_A_BARE_PI)
def test_what_holds_for_a_bare_pi_refuses_others(name: str, controller: ga.PI | ga.Cascade) -> None:
    with pytest.raises(ga.errors.SettingsError, match="of a bare PI only"):
        TAKE_A_BARE_PI[name](controller)


def test_controllers_answer_for_themselves() -> None:
    bare, other = ga.PI(0.1, 1.0, integrator_limit=0.2), ga.PI(0.1, 1.0, rule="backward")
    cascade = ga.Cascade(other, period=1e-3, position=ga.P(20.0))
    assert [c.one_equation for c in (bare, other, cascade)] == [True, False, False]
    assert [c.driven_by for c in (bare, other, cascade)] == ["command", "command", "position_command"]
    assert bare.limited and bare.limits == (np.inf, 0.2) and not cascade.limited
    assert cascade.with_limits(None, 0.3).velocity.integrator_limit == 0.3
    holding = ga.PI(0.1, 1.0, torque_limit=2.0, anti_windup="tracking", tracking_time=1e-3)
    assert holding.with_limits(None, None) == ga.PI(0.1, 1.0), "without a limit there is nothing to hold at"
    assert np.array_equal(other.torque_of(REC), ga.Cascade(other).torque_of(REC))
    assert [controller_of(c.to_dict()) for c in (bare, other, cascade)] == [bare, other, cascade]


def test_what_a_controller_has_beside_its_gains_is_said_by_name() -> None:
    """No reproach: the reader gave it, and is told what follows from it."""
    pi = ga.PI(1.0, 2.0, rule="backward", torque_limit=12.0)
    assert beside_pi(ga.PI(1.0, 2.0)) == ""
    assert beside_pi(pi) == "the backward rule and a torque limit"
    whole = ga.Cascade(
        ga.PI(1.0, 2.0, torque_limit=12.0, anti_windup="hold"),
        position=ga.P(30.0),
        acceleration_feedforward=1e-3,
        torque_filters=(ga.LowPass(1e-3), ga.Notch(100.0, 0.1, 0.5)),
        velocity_filters=(ga.LowPass(1e-3),),
        delay=1e-4,
    )
    assert beside_pi(whole) == (
        "a torque limit, an anti-windup, a position controller, an acceleration feedforward, 2 torque filters, a velocity filter "
        "and a delay"
    )
    rec = ga.Record(1e-3, command=np.ones(30), velocity=np.zeros(30), torque=np.ones(30))
    (note,) = torque_driven([rec], pi).notes
    assert note.startswith("Your controller has the backward rule and a torque limit beside kp and ki; so ")
