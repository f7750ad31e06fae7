"""Two filters that a bare PI has not, in a log of every fourth sample of the controller."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig
from gaident.diagnosis.controller.form_findings import loop_of

PERIOD = 125e-6
PI = ga.PI(0.05, 2.5)
FAST, SLOW, SLOWEST = (ga.LowPass(time) for time in (0.4e-3, 0.8e-3, 2e-3))
NOTCH = ga.Notch(400.0, numerator_damping=0.1, denominator_damping=0.7)

LOOPS = {
    "torque and velocity": ga.Cascade(PI, PERIOD, torque_filters=(FAST,), velocity_filters=(SLOW,)),
    "torque and command": ga.Cascade(PI, PERIOD, torque_filters=(FAST,), command_filters=(SLOWEST,)),
    "velocity and command": ga.Cascade(PI, PERIOD, velocity_filters=(FAST,), command_filters=(SLOWEST,)),
    "notch and low pass": ga.Cascade(PI, PERIOD, torque_filters=(NOTCH, FAST)),
}
FOUND = {"torque_filters": "torque_filter", "velocity_filters": "velocity_feedback_filter", "command_filters": "command_filter"}


def log(loop: ga.Cascade) -> ga.Record:
    """Two masses under levels with a small square wave on them; the command changes on lines of the log."""
    plant = Plant(2e-4, 2e-3, 0.05, 2.5, 4 * PERIOD, 3e-4, 1e-3, 60.0, 2e-3, cascade=loop)
    rng = np.random.default_rng(7)
    levels = rng.permutation([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0])
    command = np.repeat(levels, 187)
    command[:20] = 0.0
    small = np.repeat(rng.choice([-2.0, 2.0], len(command) // 8 + 1), 8)[: len(command)]
    return rig(plant, command + small * (command != 0.0), noise=Noise(white=0.03), seed=3)


@pytest.mark.long
@pytest.mark.parametrize("name", LOOPS)
def test_both_are_found_with_their_numbers(name: str) -> None:
    loop = LOOPS[name]
    found = {f.effect: f.parameters for f in loop_of([log(loop)], ga.Cascade(PI, PERIOD)).findings}
    filters = {FOUND[place]: getattr(loop, place) for place in FOUND if getattr(loop, place)}
    assert set(found) == set(filters)
    for effect, expected in filters.items():
        for f in expected:
            for parameter, value in ((field.name, getattr(f, field.name)) for field in fields(f)):
                estimate = found[effect][parameter]
                assert abs(estimate.value - value) < 4.0 * estimate.std < 0.2 * value, (effect, parameter)


@pytest.mark.long
def test_where_one_is_enough_no_second_one_is_found() -> None:
    loop = ga.Cascade(PI, PERIOD, torque_filters=(SLOW,))
    assert [f.effect for f in loop_of([log(loop)], ga.Cascade(PI, PERIOD)).findings] == ["torque_filter"]
