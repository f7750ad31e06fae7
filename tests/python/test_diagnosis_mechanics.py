"""Mechanics of a diagnosed model: exact for the drive that a model was made from, with shaft damping too."""

from __future__ import annotations

import math

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.mechanics import MECHANICS, moved
from gaident.diagnosis.selection.mechanisms import evenly_damped
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Scales

NAN = math.nan
SCALES = Scales(1e-3, 1.0, 50.0, 1.0, 1e3, 10.0, 0.02, NAN, NAN, True, 1.0)
DATA = DataSet.of([ga.Record(1e-3, velocity=np.zeros(20), torque=np.zeros(20))], None)


def fit(model: ga.Model) -> Fit:
    parameters = Parameterisation.of(model, SCALES, [False])
    return Fit(Hypothesis(parameters, OpenLoop(DATA)), parameters.base_vector(model), WHITE, 0.0, 0.0)


@pytest.mark.parametrize("DG", [0.0, 0.02])
def test_two_masses_come_back(DG: float) -> None:
    true = ga.TwoMass(JM=1.02e-4, DM=0.003, JL=5.815e-4, DL=0.008, KG=2.59, DG=DG)
    found = {name: after for name, (_, after) in moved(fit(true.model()), fit(true.model())).items()}
    assert list(found) == list(MECHANICS)
    assert found["inertia"] == pytest.approx(true.J, rel=1e-9) and found["viscous_friction"] == pytest.approx(true.D, rel=1e-9)
    for name, value in (("motor_inertia", true.JM), ("load_inertia", true.JL), ("stiffness", true.KG)):
        assert found[name] == pytest.approx(value, rel=1e-9), name
    pole, zero = (next(r for r in roots if r.imag > 0.0) for roots in (true.model().poles, true.model().zeros))
    assert found["resonance"] == pytest.approx(abs(pole) / math.tau) and found["resonance_damping"] == pytest.approx(
        -pole.real / abs(pole)
    )
    assert found["antiresonance"] == pytest.approx(abs(zero) / math.tau)


def test_one_mass_and_pairs_that_do_not_swing() -> None:
    one = ga.OneMass(J=5e-4, D=2e-3).model()
    found = moved(fit(one), fit(one))
    assert list(found) == ["inertia", "viscous_friction"]
    assert found["inertia"] == pytest.approx((5e-4, 5e-4)) and found["viscous_friction"] == pytest.approx((2e-3, 2e-3))
    overdamped = ga.Model(2000.0, [-4.0, -100.0, -3000.0], [-90.0, -2000.0])
    found = moved(fit(overdamped), fit(overdamped))
    assert list(found) == ["inertia", "viscous_friction"]
    assert found["viscous_friction"][1] == pytest.approx(4.0 * 100.0 * 3000.0 / (2000.0 * 90.0 * 2000.0))


def test_even_damping_leaves_a_drive_of_even_bearings_alone_and_mends_one_that_is_driven() -> None:
    """D_M/J_M = D_L/J_L = a: f1 = a + (e1 - a) f0/e0 is what the shaft's damping makes of the zeros."""
    model = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1.5e-3, KG=60.0, DG=2e-3).model()
    parameters = Parameterisation.of(model, SCALES, [False])
    x = parameters.base_vector(model)
    assert evenly_damped(parameters, x) == pytest.approx(x, rel=1e-4)
    spoiled = x.copy()
    spoiled[4] *= 3.0
    assert evenly_damped(parameters, spoiled) == pytest.approx(x, rel=1e-4)


def test_poles_below_the_zeros_are_no_two_masses() -> None:
    """e0 + a e1 < f0: an undamped shaft between them would push."""
    below = ga.Model(2000.0, [-1.0, -2.0 + 60.0j, -2.0 - 60.0j], [-2.0 + 90.0j, -2.0 - 90.0j])
    found = moved(fit(below), fit(below))
    assert list(found) == ["inertia", "viscous_friction"]
    assert found["viscous_friction"][1] == pytest.approx(1.0 * (60.0**2 + 4.0) / (2000.0 * (90.0**2 + 4.0)))
