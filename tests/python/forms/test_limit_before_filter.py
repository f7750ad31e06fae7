"""A torque limit before a torque filter, in logs of fewer lines than the controller has samples, a bare PI given.

The filter hides when the limit acts: the logged torque comes up to it, or overshoots it, some lines later, and leaves it late.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.controller.forms import form_shown
from loop_cases import INDUSTRY_BITS, industrial_case


@pytest.mark.long
@pytest.mark.parametrize(
    ("loop", "every", "effect", "name"),
    [
        ("torque low pass", 2, "", "torque_filter"),
        ("torque low pass", 4, "coulomb_friction", "torque_filter"),
        ("torque low pass", 4, "backlash", "torque_filter"),
        ("notch", 2, "", "torque_filter"),
        ("velocity filter", 4, "", "velocity_feedback_filter"),
    ],
)
def test_limit_and_filter_are_found_together(loop: str, every: int, effect: str, name: str) -> None:
    rec, _, whole, truth = industrial_case(loop, every, effect, 3061000, INDUSTRY_BITS, True)
    limit = whole.velocity.torque_limit
    (built,) = whole.torque_filters or whole.velocity_filters
    assert limit is not None and np.mean(np.abs(rec.torque) > 0.9 * limit) > 0.001
    shown = form_shown([rec], ga.PI(truth.plant.kp, truth.plant.ki), every=every)
    assert shown is not None and {*shown.numbers} == {name, "torque_saturation"}
    assert abs(shown.numbers["torque_saturation"]["limit"][0] - limit) < 0.01 * limit
    for number, (value, std) in shown.numbers[name].items():
        truth_of = getattr(built, number)
        assert abs(value - truth_of) < 0.1 * truth_of and std < 0.1 * truth_of
