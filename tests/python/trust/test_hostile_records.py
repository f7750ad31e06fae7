"""Records that are legal and say little: a channel that is constant, a command that is 0 throughout."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

PI = ga.PI(kp=0.02, ki=0.5)


@pytest.fixture(scope="module")
def channels() -> dict[str, np.ndarray]:
    """One mass with dry friction under levels of a command, torque logged."""
    drive = ga.OneMass(J=2e-4, D=3e-3).model().with_effect("coulomb_friction", torque=0.02)
    command = np.repeat([0.0, 20.0, -5.0, 60.0, -40.0, 3.0, -80.0, 10.0], 100)
    noise = 0.05 * np.random.default_rng(0).standard_normal(len(command))
    run = ga.run(drive, ga.Record(1e-3, command=command - noise, velocity=noise), PI)
    return {"command": command, "velocity": run.velocity + noise, "torque": run.torque}


@pytest.mark.parametrize("controller", [PI, None])
def test_a_position_that_is_constant_explains_nothing(channels: dict[str, np.ndarray], controller: ga.PI | None) -> None:
    given = channels if controller else {"velocity": channels["velocity"], "torque": channels["torque"]}
    dia = ga.diagnose(ga.Record(1e-3, position=np.ones(len(given["velocity"])), **given), controller)
    assert dia.driver != "position"
    assert dia.summary()


@pytest.mark.long
def test_a_loop_whose_command_is_0_throughout(channels: dict[str, np.ndarray]) -> None:
    part = {name: values[:250] for name, values in channels.items()}
    rec = ga.Record(1e-3, **{**part, "command": np.zeros(250)})
    dia = ga.diagnose(rec, PI)
    # The torque follows another command, and no limit of a slope that does not exist is said to be the reason.
    assert dia.verdict != "adequate"
    assert all(f.effect != "command_rate_limit" for f in dia.causes)


@pytest.mark.long
def test_a_loop_that_grows_beyond_all_numbers_has_no_torque_of_one_frequency() -> None:
    n = np.arange(800)
    command = (n % 50).astype(float)
    dia = ga.diagnose(ga.Record(1e-3, command=command, velocity=command, torque=(n % 7).astype(float)), PI)
    assert dia.line is None or np.isfinite(dia.line).all()
    assert dia.summary()
