"""A torque limit before a torque filter, in logs of fewer lines than the controller has samples, a bare PI given.

The filter hides when the limit acts: the logged torque comes up to it, or overshoots it, some lines later, and leaves it late.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant
from gaident.diagnosis.controller.forms import form_shown
from gaident.diagnosis.controller.slow_forms import limited
from gaident.identification.logged_stretches import plateau_of
from loop_cases import INDUSTRY_BITS, LOOPS, PERIOD, industrial_case, limit_for, low_pass, pi


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


def with_low_pass(every: int, scheme: str) -> tuple[ga.Record, ga.Cascade]:
    """A drive as in industry, its limit with this anti-windup before a low pass; and its controller."""
    time = {"tracking_time": 6e-3} if scheme == "tracking" else {}

    def made(plant: Plant, rng: np.random.Generator) -> ga.Cascade:
        velocity = pi(plant, torque_limit=limit_for(plant, rng), anti_windup=scheme, **time)
        return ga.Cascade(velocity, PERIOD, torque_filters=(low_pass(rng, 0.2e-3, 0.8e-3),))

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(LOOPS, "own", made)
        rec, _, whole, _ = industrial_case("own", every, "coulomb_friction", 3000, INDUSTRY_BITS, True)
    return rec, whole


@pytest.mark.long
@pytest.mark.parametrize("every", [2, 4])
@pytest.mark.parametrize("scheme", ["hold", "tracking"])
def test_limit_and_anti_windup_before_a_filter_are_found_together(every: int, scheme: str) -> None:
    """At the limit of an integrator that winds up, which is 2 to 5 % off, another anti-windup comes closest."""
    rec, whole = with_low_pass(every, scheme)
    limit = whole.velocity.torque_limit
    assert limit is not None
    free = whole.with_limits(None, None)
    found = limited([rec], free)
    assert found.gain > 1000.0 and found.limit is not None and abs(found.limit - limit) < 3e-3 * limit
    velocity, true = found.controller.velocity, whole.velocity
    assert velocity.anti_windup == scheme
    assert velocity.tracking_time == (None if true.tracking_time is None else pytest.approx(true.tracking_time, rel=0.02))
    # The run of a record that starts in motion shows no limit: the plateau of its torque is all that is known.
    moving = rec[int(np.argmax(np.abs(rec.velocity) > 0.3 * np.abs(rec.velocity).max())) :]
    assert rec.torque is not None and moving.torque is not None
    one = limited([rec, moving], free)
    assert one.limit is None or one.limit == max(np.abs(rec.torque).max(), np.abs(moving.torque).max())


@pytest.mark.long
@pytest.mark.parametrize(("every", "effect"), [(2, "cogging"), (4, "coulomb_friction")])
def test_a_limit_is_found_where_a_notch_leaves_no_plateau(every: int, effect: str) -> None:
    rec, _, whole, truth = industrial_case("notch", every, effect, 3071000, INDUSTRY_BITS, True)
    limit, (notch,) = whole.velocity.torque_limit, whole.torque_filters
    assert rec.torque is not None and limit is not None
    assert not np.isfinite(plateau_of(np.abs(rec.torque)))
    shown = form_shown([rec], ga.PI(truth.plant.kp, truth.plant.ki), every=every)
    assert shown is not None and {*shown.numbers} == {"torque_filter", "torque_saturation"}
    value, std = shown.numbers["torque_saturation"]["limit"]
    assert abs(value - limit) < 1e-3 * limit and abs(value - limit) < 2.0 * std < 0.02 * limit
    frequency, std = shown.numbers["torque_filter"]["frequency"]
    assert abs(frequency - notch.frequency) < 2.0 * std


def test_a_limit_that_only_tames_another_controller_is_none() -> None:
    """With a limit the run of a controller whose gains are wrong is off by less, but its torque does not follow either."""
    rec, whole = with_low_pass(2, "none")
    wrong = ga.Cascade(ga.PI(2.0 * whole.velocity.kp, 3.0 * whole.velocity.ki), whole.period, torque_filters=whole.torque_filters)
    assert rec.torque is not None
    part = rec[:1000]
    assert part.torque is not None and not np.isfinite(plateau_of(np.abs(part.torque)))
    assert limited([part], wrong).limit is None
