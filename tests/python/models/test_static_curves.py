"""The curve of an effect over the velocity, which reports draw, is the torque that the simulated effect has at a steady speed.

The axis is so heavy that it keeps its speed while the effect brakes or drives it; J dw/dt is then the effect's torque.
Friction that depends on the place as well is meant as its mean over a turn, one that drifts as it is when the record begins,
one that depends on a load as without it.
"""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from effect_sizes import SIZES
from gaident.diagnosis.library.sides import name_of
from gaident.diagnosis.library.terms import LIBRARY

DT, J = 1e-3, 1e3  # s, kg m^2
SETTLED = 2.0  # s; by then a bristle is bent by ten times what it takes to break away
WITH_CURVE = [key for name, row in LIBRARY.items() if row.curve is not None for key in (name, row.other_side) if key]


def torque_at(key: str, speed: float) -> float:
    """Mean torque of an effect over a whole turn at a speed; of one that changes in time the first 20 ms [N m]."""
    name, row = name_of(key), LIBRARY[key]
    drive = (ga.TwoMass(0.5 * J, 0.0, 0.5 * J, 0.0, 1e9, 1e6) if row.at_load else ga.OneMass(J, 0.0)).model()
    model = drive.with_effect(name, side="load", **SIZES[name]) if row.at_load else drive.with_effect(name, **SIZES[name])
    first = 0 if row.time_varying else round(SETTLED / DT)
    length = 20 if row.time_varying else round(2.0 * np.pi / abs(speed) / DT)
    still = np.zeros(first + length + 1)
    start = ga.initial_state(drive, ga.Record(DT, torque=still[:20], velocity=np.full(20, speed)))
    w = ga.run(model, ga.Record(DT, torque=still, velocity=still), initial_state=start).velocity
    assert np.ptp(w) < 1e-3, "it keeps its speed"
    return float(J * (w[first + length] - w[first]) / (length * DT))


def test_every_friction_has_a_curve() -> None:
    assert {key for key, row in LIBRARY.items() if row.levels} <= set(WITH_CURVE) and len(WITH_CURVE) > 10


@pytest.mark.parametrize("key", WITH_CURVE)
def test_the_curve_is_the_torque_at_steady_speeds(key: str) -> None:
    curve = LIBRARY[key].curve
    assert curve is not None
    for speed in (0.5, 2.0, 5.0, 60.0):
        for w in (speed, -speed):
            expected = float(curve(np.array([w]), SIZES[name_of(key)])[0])
            assert torque_at(key, w) == pytest.approx(expected, rel=3e-3), w
