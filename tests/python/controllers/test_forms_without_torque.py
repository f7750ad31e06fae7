"""Without a logged torque: forms of controller that the given PI lacks, beside what the mechanics may be."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

DT = 1e-3
KP, KI = 0.05, 1.5
J, D = 3e-4, 2e-3
PI = ga.PI(KP, KI)


def record(controller: ga.Cascade, friction: float = 0.0) -> ga.Record:
    """One mass under a controller, noise of 0.03 rad/s in the loop, no torque in the log."""
    rng = np.random.default_rng(2)
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 90)
    noise = 0.03 * rng.standard_normal(len(levels))
    drive = ga.OneMass(J=J, D=D).model()
    drive = drive.with_effect("coulomb_friction", torque=friction) if friction else drive
    done = ga.run(drive, ga.Record(DT, command=levels - noise, velocity=np.zeros(len(levels))), controller)
    return ga.Record(DT, command=levels, velocity=done.velocity + noise)


@pytest.mark.parametrize(
    ("controller", "form", "numbers"),
    [
        (
            ga.Cascade(PI, torque_filters=(ga.Notch(60.0, numerator_damping=0.1, denominator_damping=0.7),)),
            "torque_filter",
            {"frequency": 60.0, "numerator_damping": 0.1, "denominator_damping": 0.7},
        ),
        (ga.Cascade(PI, velocity_filters=(ga.LowPass(2e-3),)), "velocity_feedback_filter", {"time_constant": 2e-3}),
    ],
)
def test_a_filter_that_was_not_given_is_found_and_is_no_mechanics(
    controller: ga.Cascade, form: str, numbers: dict[str, float]
) -> None:
    dia = ga.diagnose(record(controller), PI)
    (found,) = dia.causes
    assert (dia.verdict, found.effect, found.place) == ("explained", form, "controller"), dia.summary()
    for name, value in numbers.items():
        assert abs(found.parameters[name].value - value) < 4.0 * found.parameters[name].std < 0.1 * value
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)
    assert isinstance(dia.controller, ga.Cascade) and not dia.torque_logged
    said = " ".join(dia.summary().split())
    assert "Log the torque, which shows what the controller does" in said
    assert "nothing shows it: log the torque" in said and "The logged torque" not in said


def test_a_filter_is_found_beside_friction() -> None:
    dia = ga.diagnose(record(ga.Cascade(PI, velocity_filters=(ga.LowPass(2e-3),)), friction=0.05), PI)
    assert {f.effect for f in dia.causes} == {"velocity_feedback_filter", "coulomb_friction"}, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)
