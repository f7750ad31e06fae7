"""Numbers of the controller that the model of the axis moves, and what becomes of the effects that stood for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.control.found import FoundNumbers
from gaident.diagnosis.controller.joint_numbers import joint_numbers
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.select import Selection
from gaident.estimation.found_numbers import worth
from gaident.estimation.objective import Fit, Objective
from gaident.policy.table import POLICY
from one_mass import TAU, D, J, data_of, filtered, loop_record

STD = 0.3  # of ln tau, as the torque showed it
FRICTION = 0.05  # N m
EXACT = 3e-4  # of ln tau, as the model of the axis shows it


def selection(off: float, *effects: str) -> Selection:
    """A model with these effects, of an axis with dry friction, whose controller was found so far off [of ln tau]."""
    record = loop_record(FRICTION)
    data = data_of(record, FoundNumbers(filtered, np.log([TAU]) + off, np.array([[STD**2]])))
    objective = Objective(data, np.ones(len(record)))
    task = Task(objective, scales_of(data), ga.OneMass(J=J, D=D).model(), (), lambda message: None)
    space, base = task.space(), task.one_mass()
    final = base
    for effect in effects:
        longer = final.hypothesis.extended(LIBRARY[effect])
        starts = LIBRARY[effect].starts(longer.parameters.scales)[:8]
        fits = [space.refitted(longer, np.array([*final.x, *row]), POLICY.long) for row in starts]
        final = min(fits, key=space.score)
    return Selection(space, base, space.refitted(final.hypothesis, final.x), {}, None)


def joint(found: Selection) -> Selection | None:
    """What the numbers make of a selection, which is compared with no other model."""
    return joint_numbers(found, lambda selection, final: replace(selection, final=final))


def gain(found: Selection, better: Selection) -> float:
    """By how much a model with moved numbers is better [BIC units]."""
    here = better.space
    return found.space.score(found.final) - here.score(better.final) - worth(here.objective, better.final)


def numbers(fit: Fit) -> FoundNumbers:
    """Those of the data that drive a model."""
    assert fit.predictor.data.found is not None
    return fit.predictor.data.found


@pytest.mark.parametrize("off", [-1.0, 1.0])
def test_an_effect_that_stood_for_a_number_goes_and_one_of_the_axis_stays(off: float) -> None:
    """A filter of the controller that is off by one deviation looks like a resonance."""
    found = selection(off * STD, "coulomb_friction", "extra_resonance")
    without = found.space.without(found.final, "extra_resonance")
    assert found.space.score(found.final) < found.space.score(without) - 200.0, "with the numbers as found it is needed"
    better = joint(found)
    assert better is not None and better.final.effects == ("coulomb_friction",)
    assert numbers(better.final).at == pytest.approx(np.log([TAU]), abs=0.01 * STD)
    assert better.final.x[-1] == pytest.approx(FRICTION, rel=0.01)
    assert better.rivals == {} and better.whitened is None
    data = better.final.predictor.data
    assert better.space.data is better.base.predictor.data is data and better.space.data is not found.space.data
    assert better.base.effects == () and better.base.cost > better.final.cost


def test_numbers_that_the_model_would_move_by_little_stay() -> None:
    """What moving them gains has to pay ln N for each: 2 deviations of the joint fit do not."""
    found = selection(1.8 * EXACT, "coulomb_friction")
    moved = selection(8.0 * EXACT, "coulomb_friction")
    assert joint(found) is None
    better = joint(moved)
    assert better is not None and numbers(better.final).at == pytest.approx(np.log([TAU]), abs=3.0 * EXACT)


def test_what_takes_the_place_has_to_be_better_by_the_margin() -> None:
    found = selection(8.0 * EXACT, "coulomb_friction")
    better = joint(found)
    assert better is not None and gain(found, better) > POLICY.swap
    for more, taken in ((0.5, False), (-0.5, True)):
        policy = replace(POLICY, swap=gain(found, better) + more)
        assert (joint(replace(found, space=replace(found.space, policy=policy))) is not None) is taken


def test_where_no_number_was_found_nothing_is_done() -> None:
    found = selection(STD, "coulomb_friction")
    for numbers_of in (None, replace(numbers(found.final), covariance=np.zeros((1, 1)))):
        data = replace(found.final.predictor.data, found=numbers_of)
        assert joint(replace(found, final=replace(found.final, hypothesis=found.final.hypothesis.over(data)))) is None
