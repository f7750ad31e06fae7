"""What a slow log lost between its lines looks like a number of the controller: the model of the axis tells it apart.

Industrial drives, whose shaft rings near the end of what such a log shows.
"""

from __future__ import annotations

import pytest

import gaident as ga
from drive_rig import skip_without_library
from gaident.diagnosis.controller.as_read import outliers_of_the_log
from gaident.diagnosis.controller.form_findings import loop_of
from loop_cases import industrial_case

skip_without_library()

SEED = 1601000


def given(controller: ga.Cascade) -> ga.Cascade:
    """What is known of it: its gains and its sample time."""
    pi = controller.velocity
    return ga.Cascade(ga.PI(pi.kp, pi.ki), period=controller.period)


@pytest.mark.long
def test_the_given_controller_stays_a_candidate_where_the_torque_follows_from_it_too() -> None:
    rec, _, controller, _ = industrial_case("backward", 4, "", SEED)
    loop = loop_of([rec], given(controller))
    assert [f.effect for f in loop.findings] == ["command_weight"]  # of 0.98, which is not there
    assert loop.simpler and loop.simpler[0].controller == given(controller) and loop.simpler[0].findings == ()


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["hold", "tracking"])
def test_what_the_integrator_does_at_a_limit_is_told_by_the_model(scheme: str) -> None:
    rec, validation, controller, truth = industrial_case(scheme, 8, "", SEED)
    dia = ga.diagnose(rec, given(controller), validation=validation)
    assert dia.verdict == "explained", dia.summary()
    form = {f.effect: f.parameters for f in dia.findings if f.place == "controller"}
    assert set(form) == {"torque_saturation", "anti_windup"}
    if scheme == "tracking":
        time = form["anti_windup"]["tracking_time"]
        assert abs(time.value - controller.velocity.tracking_time) < 3.0 * time.std < 0.01 * time.value
    inertia = dia.mechanics["inertia"]
    assert abs(inertia.value - (truth.plant.J + truth.plant.JL)) < 3.0 * inertia.std < 1e-3 * inertia.value


def test_a_torque_at_its_limit_does_not_tell_an_outlier_of_the_log() -> None:
    rec, _, controller, _ = industrial_case("hold", 8, "", SEED)
    for known in (given(controller), controller):
        (read,), (lines,) = outliers_of_the_log([rec], known)
        assert read is rec and not len(lines)


@pytest.mark.long
@pytest.mark.parametrize("loop", ["ip", "torque low pass"])
def test_a_form_is_found_beside_gains_that_are_not_known(loop: str) -> None:
    rec, _, controller, _ = industrial_case(loop, 4, "", SEED)
    unknown = ga.Cascade(ga.PI(None, None), period=controller.period)
    found = loop_of([rec], unknown)
    assert {f.effect for f in found.findings} & {"command_weight", "torque_filter"} and found.estimates
