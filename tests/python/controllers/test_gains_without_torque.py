"""Without a logged torque: gains that are not the drive's, beside what the mechanics may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from gaident.diagnosis.controller.controller_place import as_logged

DT = 1e-3
TRUE = ga.PI(kp=0.05, ki=1.5)
J, FRICTION = 3e-4, 0.05


def record(friction: float = 0.0, logged: bool = False) -> ga.Record:
    """One mass under TRUE, noise of 0.03 rad/s in the loop."""
    rng = np.random.default_rng(2)
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 90)
    noise = 0.03 * rng.standard_normal(len(levels))
    drive = ga.OneMass(J=J, D=2e-3).model()
    drive = drive.with_effect("coulomb_friction", torque=friction) if friction else drive
    done = ga.run(drive, ga.Record(DT, command=levels - noise, velocity=np.zeros(len(levels))), TRUE)
    return ga.Record(DT, command=levels, velocity=done.velocity + noise, torque=done.torque if logged else None)


def test_right_gains_cost_a_clean_record_nothing_and_what_cannot_show_is_said() -> None:
    for factor in (1.0, 1.15):
        dia = ga.diagnose(record(), ga.PI(factor * TRUE.kp, factor * TRUE.ki))
        assert dia.verdict == "adequate" and not dia.findings
        # A common factor of both gains is one of every inertia: nothing shows it.
        assert dia.mechanics["inertia"].value == pytest.approx(factor * J, rel=5e-3)
        assert any("wrong by that factor, and nothing shows it: log the torque" in note for note in dia.notes)
    assert not any("nothing shows it" in note for note in ga.diagnose(record(logged=True), TRUE).notes)


@pytest.mark.long
@pytest.mark.parametrize("friction", [0.0, FRICTION])
@pytest.mark.parametrize("wrong", [0.85, 1.15])
def test_a_wrong_ratio_of_the_gains_is_found_and_is_no_mechanics(wrong: float, friction: float) -> None:
    dia = ga.diagnose(record(friction), ga.PI(TRUE.kp, wrong * TRUE.ki))
    assert dia.verdict == "explained"
    names = ["other_gains", *["coulomb_friction"] * bool(friction)]
    assert [(f.effect, f.alternatives) for f in dia.causes] == [(name, ()) for name in names]
    gains = dia.causes[0]
    ki = gains.parameters["ki"]
    assert gains.place == "controller" and list(gains.parameters) == ["ki"]
    assert abs(ki.value - TRUE.ki) < 4.0 * ki.std < 0.02 * TRUE.ki
    assert isinstance(dia.controller, ga.PI) and dia.controller.ki == ki.value
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)
    assert "Log the torque, which shows both gains" in " ".join(dia.summary().split())
    if friction:
        assert dia.causes[1].parameters["torque"].value == pytest.approx(FRICTION, rel=0.01)


@pytest.mark.long
def test_a_given_identification_is_not_replaced_in_silence() -> None:
    """And the gain of a second round counts against the model under the given gains, not against that of the first round."""
    rec, given = record(), ga.PI(TRUE.kp, 0.85 * TRUE.ki)
    idn = ga.identify(rec, given)
    dia = ga.diagnose(rec, given, idn)
    assert dia.identification.controller != given and any(
        "another one, under that controller, is in its place" in n for n in dia.notes
    )
    assert dia.causes[0].delta_bic > 100.0
    right = ga.identify(rec, TRUE)
    assert not any("another one" in n for n in ga.diagnose(rec, TRUE, right).notes)


def test_what_gains_would_explain_as_well_has_them_beside_its_name() -> None:
    """Gains that are both a tenth too low, and a limit that is given, are the same as a lower limit."""
    free, rng = record(), np.random.default_rng(3)
    true = replace(TRUE, torque_limit=1.0)
    noise = 0.03 * rng.standard_normal(len(free))
    assert free.command is not None
    drive = ga.OneMass(J=J, D=2e-3).model()
    done = ga.run(drive, ga.Record(DT, command=free.command - noise, velocity=np.zeros(len(free))), true)
    rec = ga.Record(DT, command=free.command, velocity=done.velocity + noise)
    dia = ga.diagnose(rec, replace(true, kp=0.9 * true.kp, ki=0.9 * true.ki))
    (limit,) = dia.causes
    assert (limit.effect, limit.alternatives) == ("torque_saturation", ("other_gains",))
    assert any("Other gains than the given ones would explain these records as well" in note for note in dia.notes)


@pytest.mark.long
def test_a_cause_that_gains_cannot_imitate_stays_a_sole_name() -> None:
    """A search under other gains comes to the cause as well; under the given ones it explains as much."""
    rec, validation, controller, truth = random_case(21, "stribeck_friction", torque_logged=False)
    dia = ga.diagnose(rec, controller, validation=validation)
    assert [(f.effect, f.alternatives) for f in dia.causes] == [("stribeck_friction", ())]
    assert dia.controller == controller and dia.verdict == "explained"
    assert dia.mechanics["inertia"].value == pytest.approx(truth.plant.J + truth.plant.JL, rel=0.02)


def test_a_position_loop_without_a_logged_torque_is_diagnosed() -> None:
    cascade = ga.Cascade(ga.PI(0.04, 1.0), period=1e-3, position=ga.P(30.0), position_period=1e-3)
    command = 3.0 * np.sin(4.0 * np.pi * 1e-3 * np.arange(2500)) + 0.5 * np.sin(21.0 * np.pi * 1e-3 * np.arange(2500))
    drive = ga.OneMass(J=4e-4, D=4e-3).model().with_effect("coulomb_friction", torque=0.1)
    run = ga.run(drive, ga.Record(1e-3, position_command=command, position=command, velocity=0.0 * command), cascade)
    noise = 1e-3 * np.random.default_rng(1).standard_normal(len(command))
    rec = ga.Record(1e-3, position_command=command, position=run.position, velocity=run.velocity + noise)
    dia = ga.diagnose(rec, cascade)
    assert any("coulomb_friction" in (f.effect, *f.alternatives) for f in dia.causes), dia.summary()


@pytest.mark.long
def test_a_record_with_a_torque_shows_the_gains_of_those_without() -> None:
    logged, unlogged = record(FRICTION, logged=True), record(FRICTION)
    given = ga.PI(0.9 * TRUE.kp, 1.15 * TRUE.ki)
    for records in ([logged, unlogged], [unlogged, logged]):
        shown = as_logged(records, given)
        assert shown.controller is not None
        assert (shown.controller.kp, shown.controller.ki) == pytest.approx((TRUE.kp, TRUE.ki), rel=1e-6)
        assert [f.effect for f in shown.findings] == ["other_gains"]
    assert as_logged([logged, unlogged], TRUE).controller == TRUE
    assert as_logged([unlogged], given).controller == given
    dia = ga.diagnose([logged, unlogged], given)
    assert dia.verdict == "explained" and [f.effect for f in dia.causes] == ["other_gains", "coulomb_friction"]
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)
