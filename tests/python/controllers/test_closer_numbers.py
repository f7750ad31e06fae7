"""Numbers of the controller that the model of the axis shows closer: what becomes of records, findings and notes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.axis import said
from gaident.control.found import FoundNumbers
from gaident.diagnosis.controller.controller_place import AsLogged
from gaident.diagnosis.controller.driving import Driving
from gaident.diagnosis.controller.log_shift import Aligned
from gaident.diagnosis.explain.wording import closer_numbers, of_the_mechanics
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding
from one_mass import PI, STEPS, TAU, data_of, filtered, loop_record

Z, STD = np.log([TAU]), 0.3
FILTER, WEIGHT = "velocity_feedback_filter", "command_weight"


def named(z: NDArray[np.float64], covariance: NDArray[np.float64]) -> dict[str, dict[str, tuple[float, float]]]:
    """The time constant of the filter, as a finding and as a number that was None."""
    tau = float(np.exp(z[0]))
    pair = tau, tau * float(np.sqrt(covariance[0, 0]))
    return {FILTER: {"time_constant": pair}, "": {"time_constant": pair}}


FOUND = FoundNumbers(filtered, Z, np.array([[STD**2]]), named=named)
"""As the torque showed them."""
DATA = data_of(loop_record(), FOUND)


def driving() -> Driving:
    """A record and one held out under the filter, with what was found of it; another finding and another number."""
    rng = np.random.default_rng(0)
    given = [ga.Record(1e-3, command=STEPS, velocity=STEPS + rng.standard_normal(len(STEPS))) for _ in range(2)]
    records = [r.with_channels(torque=filtered(Z).torque_of(r), command=None) for r in given]
    moved = Aligned((records[0],), (records[1],), given=dict(zip((r.digest for r in records), given, strict=True)))
    tau = Estimate(TAU, STD * TAU, "s", of_controller=0.1)
    findings = (
        Finding(FILTER, {"time_constant": tau}, place="controller"),
        Finding(WEIGHT, {"weight": Estimate(0.8, 0.1, "1")}, place="controller"),
    )
    numbers = {"velocity_filters[0].time_constant": tau, "kp": Estimate(0.05, 0.01, "N m s/rad")}
    return Driving(moved, filtered(Z), AsLogged(None), findings, numbers=numbers, found=FOUND)


def test_records_are_driven_by_the_controller_with_its_new_numbers() -> None:
    before = driving()
    after = before.refound(replace(FOUND, at=Z + 0.2), np.array([[0.01**2]]))
    assert after.controller == filtered(Z + 0.2) and after.found is not None and after.found.at == pytest.approx(Z + 0.2)
    for was, now in zip((*before.driven[0], *before.driven[1]), (*after.driven[0], *after.driven[1]), strict=True):
        given = before.moved.given[was.digest]
        assert now.torque == pytest.approx(filtered(Z + 0.2).torque_of(given), abs=1e-15)
        assert was.torque is not None and np.abs(now.torque - was.torque).max() > 1e-3
        assert after.moved.given[now.digest] is given, "it is still known which record was given"
    assert after.read == before.read


def test_findings_and_numbers_of_the_same_name_have_the_new_values_and_others_stay() -> None:
    before = driving()
    after = before.refound(replace(FOUND, at=Z + 0.2), np.array([[0.01**2]]))
    tau = TAU * math.exp(0.2)
    for estimate in (after.findings[0].parameters["time_constant"], after.numbers["velocity_filters[0].time_constant"]):
        assert (estimate.value, estimate.std) == pytest.approx((tau, 0.01 * tau))
        assert estimate.unit == "s" and estimate.identifiable and estimate.of_controller == 0.1
    assert after.findings[1] == before.findings[1] and after.numbers["kp"] == before.numbers["kp"]
    wide = before.refound(FOUND, np.array([[1.5**2]]))
    assert not wide.findings[0].parameters["time_constant"].identifiable, "its deviation is larger than itself"


def test_numbers_without_names_change_no_finding() -> None:
    before = driving()
    after = before.refound(replace(FOUND, at=Z + 0.2, named=None), np.array([[0.01**2]]))
    assert after.findings == before.findings and after.numbers == before.numbers
    assert after.controller == filtered(Z + 0.2)


def test_the_note_says_how_many_deviations_the_numbers_were_moved_by() -> None:
    by_two = said(closer_numbers(FOUND, FOUND.joined().moved(np.array([-2.0 * STD]))), "rotary")
    assert "by up to 2.0 of the deviations with which that shows them" in by_two and "than the torque alone" in by_two
    unseen = FoundNumbers(filtered, Z)
    by_none = said(closer_numbers(unseen, unseen.moved(np.array([0.5]))), "rotary")
    assert by_none.endswith("they were moved."), "no torque showed them"


@pytest.mark.parametrize(("part", "noted"), [(0.75, True), (0.65, False)])
def test_where_the_controller_makes_most_of_a_deviation_that_is_said(part: float, noted: bool) -> None:
    """Half of the variance is 0.71 of the deviation."""
    std = 1e-5
    mechanics = {
        "inertia": Estimate(3e-4, std, "kg m^2", of_controller=part * std),
        "viscous_friction": Estimate(2e-3, 1e-4, "N m s/rad"),
        "resonance": Estimate(100.0, 0.0, "Hz", of_controller=0.0),
    }
    notes = [said(note, "rotary") for note in of_the_mechanics(mechanics, {}, DATA, True)]
    assert len(notes) == noted
    if noted:
        assert "Most of the deviation of inertia comes from" in notes[0], "of no other"
        assert "left open: give them" in notes[0]
        (wrong,) = of_the_mechanics(mechanics, {}, DATA, False)
        assert "as given do not fit these records" in wrong and "give them" not in wrong
    both = {**mechanics, "viscous_friction": Estimate(2e-3, 1e-4, "N m s/rad", of_controller=1e-4)}
    (note,) = of_the_mechanics(both, {}, DATA, True)
    assert ("inertia, viscous friction" in said(note, "rotary")) is noted


def test_what_the_age_of_the_velocity_makes_of_a_deviation_is_said_of_it_and_what_would_show_it() -> None:
    mechanics = {
        "inertia": Estimate(3e-4, 1e-5, "kg m^2", of_controller=0.99e-5),
        "stiffness": Estimate(20.0, 0.1, "N m/rad", of_controller=0.09),
    }
    ages = {"inertia": 0.99e-5, "stiffness": 0.01}
    numbers, age = of_the_mechanics(mechanics, ages, DATA, True)
    assert numbers.startswith("Most of the deviation of stiffness comes from the numbers")
    assert age.startswith("Most of the deviation of inertia comes from the age of the velocity")
    assert "give the period of the controller" in age
    given = replace(DATA, clocked=True)
    _, age = of_the_mechanics(mechanics, ages, given, True)
    assert "period" not in age and "log the encoder's angle" in age
    slow = replace(given, loop_follows=False, controller=ga.Cascade(PI, period=DATA.dt / 4))
    _, age = of_the_mechanics(mechanics, ages, slow, True)
    assert "give the controller that makes this torque" in age
