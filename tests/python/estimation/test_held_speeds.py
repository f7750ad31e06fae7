"""Speeds that are only held contain no acceleration beyond its noise: they show friction all the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.selection.attribution import friction_shown
from gaident.diagnosis.selection.bases import _axis
from gaident.estimation.dataset import DataSet

DT = 12.8e-3
COULOMB, VISCOUS = 2.8e-3, 3e-5
SPEEDS = (-10.0, -6.0, -3.0, 3.0, 6.0, 10.0)


def records(speeds: Sequence[float] = SPEEDS, coulomb: float = COULOMB) -> list[ga.Record]:
    """Speeds that a disturbance of the torque moves by 0.1 rad/s, a velocity with 0.05 rad/s of noise on it."""
    rng = np.random.default_rng(2)
    found = []
    for speed in speeds:
        ripple = np.convolve(rng.standard_normal(420), np.ones(20) / 20.0, "valid")[:400]
        w = speed + 0.4 * ripple
        torque = 2e-4 * np.gradient(w, DT) + VISCOUS * w + coulomb * np.sign(w) + 1e-4 * rng.standard_normal(400)
        seen = w + 0.05 * rng.standard_normal(400)
        found.append(ga.Record(DT, velocity=seen, torque=torque, torque_is="measured"))
    return found


def test_the_regression_of_the_diagnosis_goes_up_to_where_there_is_an_inertia() -> None:
    with pytest.raises(ga.errors.RecordError, match="rows are left"):
        ga.inverse_dynamics(records())
    axis = _axis(DataSet.of(records(), None))
    assert axis is not None
    assert axis.parameters["coulomb"].value == pytest.approx(COULOMB, rel=0.1)
    assert axis.parameters["inertia"].value > 2.0 * axis.parameters["inertia"].std


@pytest.mark.parametrize("speeds", [SPEEDS, SPEEDS[3:]], ids=["both directions", "one"])
def test_a_torque_that_does_not_fall_with_the_speed_is_friction(speeds: Sequence[float]) -> None:
    model = ga.OneMass(2e-4, 1e-4).model()
    for coulomb, shown in ((COULOMB, True), (0.0, False)):
        data = DataSet.of(records(speeds, coulomb), None)
        assert not friction_shown(data, model)
        assert friction_shown(data, model, _axis(data)) == shown
