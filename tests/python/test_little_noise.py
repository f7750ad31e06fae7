"""Records of next to no noise: whitened errors are then never noise, and the model that explains them stays all the same."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga

CONTROLLER = ga.PI(0.0232, 1.367)


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-2])
def test_two_causes_are_found_however_little_noise_there_is(noise: float) -> None:
    """Without a logged torque output errors are those of the closed loop, which shows friction and gravity little."""
    truth = ga.OneMass(J=3e-4, D=1e-3).model().with_effect("coulomb_friction", torque=0.05)
    truth = truth.with_effect("unbalance", amplitude=0.03, phase=0.4)
    command = np.repeat([20.0, -10.0, 40.0, 0.0, -30.0, 15.0, 25.0, -5.0], 100)
    still = ga.Record(1e-3, command=command, velocity=np.zeros(800))
    velocity = ga.simulate(truth, still, controller=CONTROLLER) + noise * np.random.default_rng(1).normal(size=800)
    dia = ga.diagnose(ga.Record(1e-3, command=command, velocity=velocity), CONTROLLER)
    assert {f.effect for f in dia.causes} == {"coulomb_friction", "unbalance"} and dia.verdict == "explained"
    sizes = {f.effect: next(iter(f.parameters.values())).value for f in dia.causes}
    assert sizes["coulomb_friction"] == pytest.approx(0.05, rel=0.05) and sizes["unbalance"] == pytest.approx(0.03, rel=0.05)
