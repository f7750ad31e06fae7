"""A controller with a wrong number, in a log of every fourth sample: which it is, and a verdict that does not rest on it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import gaident as ga

TRUE = ga.Cascade(
    ga.PI(0.03, 1.0),
    period=0.25e-3,
    torque_filters=(ga.LowPass(0.5e-3),),
    position=ga.P(30.0),
    position_period=1e-3,
    velocity_feedforward=1.0,
    acceleration_feedforward=4e-4,
)
WRONG: dict[str, tuple[ga.Cascade, str]] = {
    "feedforward of the wrong sign": (
        replace(TRUE, acceleration_feedforward=-4e-4),
        "With acceleration feedforward 0.0004 kg m^2 (given: -0.0004) it does",
    ),
    "a gain ten times too high": (replace(TRUE, position=ga.P(300.0)), "1/s (given: 300) it does"),
    "an unstable loop": (replace(TRUE, position=ga.P(3000.0)), "1/s (given: 3000) it does"),
}
TWO_WRONG = replace(TRUE, position=ga.P(300.0), velocity=ga.PI(0.06, 3.0))


@lru_cache
def log() -> ga.Record:
    """A position loop over one mass with 0.05 N m of dry friction, noise of 0.02 rad/s on the logged velocity."""
    n, dt = 1600, 1e-3
    levels = np.repeat([0, 10.0, -25, 5, -5, 40, -40, 15, -2, 2, -15, 30, -30, 8, -8, 0], 100)
    speed = np.convolve(levels, np.full(25, 1 / 25), "same")
    path = dt * (np.cumsum(speed) - speed)
    drive = ga.OneMass(J=4e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.05)
    done = ga.run(drive, ga.Record(dt, position_command=path, velocity=np.zeros(n)), TRUE)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * dt * (done.velocity[1:] + done.velocity[:-1]))])
    noise = 0.02 * np.random.default_rng(0).standard_normal(n)
    return ga.Record(dt, position_command=path, position=angle, velocity=done.velocity + noise, torque=done.torque)


@pytest.mark.parametrize("case", WRONG)
def test_the_wrong_number_is_named_and_the_right_one_used(case: str) -> None:
    given, words = WRONG[case]
    dia = ga.diagnose(log(), given)
    (note,) = (note for note in dia.notes if "(given:" in note)
    assert words in note and "all simulations use this" in note
    assert any("does not follow from command and velocity through this controller" in note for note in dia.notes)
    assert isinstance(dia.controller, ga.Cascade) and dia.controller.position is not None
    assert dia.controller.position.gain == pytest.approx(30.0, rel=1e-2)
    assert dia.controller.acceleration_feedforward == pytest.approx(4e-4, rel=1e-2)
    assert dia.controller_numbers and dia.loop_follows
    (cause,) = dia.causes
    assert cause.effect == "coulomb_friction" and cause.parameters["torque"].value == pytest.approx(0.05, rel=0.01)
    assert dia.verdict == "explained" and dia.after.rmse < 1.1 * dia.after.noise_floor


def test_a_loop_that_is_not_the_drives_is_not_simulated() -> None:
    """Two numbers are wrong and no single one helps: the torque drives the models."""
    dia = ga.diagnose(log(), TWO_WRONG)
    assert not dia.loop_follows
    assert any("So no loop is closed over this controller" in note for note in dia.notes)
    assert "the logged torque drives these models, no loop is closed" in " ".join(dia.summary().split())
    friction = next(cause for cause in dia.causes if cause.effect == "coulomb_friction")
    assert friction.parameters["torque"].value == pytest.approx(0.05, rel=0.01)
    assert dia.mechanics["inertia"].value == pytest.approx(4e-4, rel=0.01)
    # Between the lines the logged torque goes straight: 1.6 times the noise; 2.3 as a controller with two wrong numbers makes it.
    assert dia.after.rmse < 2.0 * dia.after.noise_floor
