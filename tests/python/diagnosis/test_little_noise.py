"""Records of next to no noise: whitened errors are then never noise, and the model that explains them stays all the same."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Noise

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


def test_what_whitened_errors_find_is_offered_to_output_errors_before_these_decide() -> None:
    """A drag is not tried beside a friction, of whose family it is, and leaves far more than noise, so that output errors decide.

    The torque is not logged, and the closed loop shows the unbalance so little that their own search ends with friction alone, at
    four times the error of the free run. Whitened errors find the unbalance; judged by output errors it is better by 58 units.
    """
    causes = "coulomb_friction", "unbalance"
    rec, _, controller, truth = random_case(600100, (*causes, "square_root_drag"), "move", Noise(white=1e-6), torque_logged=False)
    dia = ga.diagnose(rec[:1500], controller)
    assert tuple(f.effect for f in dia.causes) == causes and dia.verdict == "partly explained"
    assert any("least output error" in note for note in dia.notes), "output errors decide"
    assert dia.after.rmse < 0.2 * dia.before.rmse
    unbalance = dia.causes[1].parameters
    for name, value in truth.effects["unbalance"].items():
        assert abs(unbalance[name].value - value) < 3.0 * unbalance[name].std
