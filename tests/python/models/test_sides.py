"""Effects at the load of two masses: accuracy against an independent integrator, and what models with sides are."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import numpy as np
import pytest
from test_effects import TWO, controller_of, integrated, record, rms, staircase

import gaident as ga
from effect_sizes import SIZES
from fine_integrator import Array, FineCase
from gaident.models import FactorCounts, factor_parameters, simulate_values

SHAFT = tuple(row.name for row in ga.effects.table() if row.place == "shaft" and not row.own)
DRY = tuple(name for name in SHAFT if "friction" in name)
# Drives of an inertia ratio of 0.3 to 10, the load behind a shaft that a servo's log resolves.
DRIVES = {
    "small load": ga.TwoMass(3e-4, 0.003, 1e-4, 0.002, 3.0, 0.001),
    "table": TWO,
    "large load": ga.TwoMass(1e-4, 0.002, 1e-3, 0.008, 6.0, 0.002),
}
Truth = dict[tuple[float, str, str, str], Array]


def sizes_at(name: str, side: str) -> dict[str, float]:
    """As they show, at the load a little other than at the motor."""
    larger = {"torque": 1.15, "static_torque": 1.15, "amplitude": 1.15, "coefficient": 8.0} if side == "load" else {}
    return {k: v * larger.get(k, 1.0) for k, v in SIZES[name].items()}


def effects_of(case: str) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """(at the motor, at the load) of "name@load" or "name+name@load"."""
    at: tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]] = ({}, {})
    for key in filter(None, case.split("+")):
        name, _, side = key.partition("@")
        at[side == "load"][name] = sizes_at(name, side or "motor")
    return at


def model_of(drive: ga.TwoMass, case: str) -> ga.Model:
    model = drive.model()
    for side, effects in zip(("motor", "load"), effects_of(case), strict=True):
        for name, values in effects.items():
            model = model.with_effect(name, side=side, **values)
    return model


AT_LOAD = [f"{name}@load" for name in SHAFT]
AT_BOTH = [f"{name}+{name}@load" for name in DRY] + [
    "coulomb_friction+stribeck_friction@load",
    "stribeck_friction+lugre_friction@load",
    "cogging+coulomb_friction+unbalance@load+coulomb_friction@load",
    "load_dependent_friction@load+unbalance@load+load_torque@load",
    "load_dependent_friction+unbalance+load_dependent_friction@load+cogging@load+load_torque@load",
    "backlash+coulomb_friction@load",
    "backlash+coulomb_friction+coulomb_friction@load",
]


@pytest.fixture(scope="module")
def reference() -> Truth:
    """Velocity of the fine integrator for every drive, sample time, loop and set of effects."""
    cases, keys = [], []
    for dt in (0.444e-3, 1e-3):
        for drive_name, drive in DRIVES.items():
            for loop in ("open", "sampled", "continuous"):
                for case in ("", *AT_LOAD, *AT_BOTH):
                    ctl = controller_of(loop, True)
                    gains = {} if ctl is None else {"kp": ctl.kp, "ki": ctl.ki}
                    source = record(dt, loop).torque if loop == "open" else staircase()
                    assert source is not None
                    motor, load = effects_of(case)
                    masses: dict[str, Any] = {"motor": (drive.JM, drive.DM), "load": (drive.JL, drive.DL)}
                    cases.append(
                        FineCase(dt, loop, source, **masses, shaft=(drive.KG, drive.DG), **gains, effects=motor, at_load=load)
                    )
                    keys.append((dt, drive_name, loop, case))
    out = integrated(cases, fine=150)
    return {key: out.velocity[:, i] for i, key in enumerate(keys)}


def deviation(reference: Truth, dt: float, drive: str, loop: str, case: str) -> float:
    """rms deviation as a share of what the effects change: with minus without, on both sides."""
    rec, ctl = record(dt, loop), controller_of(loop, True)
    ours = ga.simulate(model_of(DRIVES[drive], case), rec, ctl) - ga.simulate(DRIVES[drive].model(), rec, ctl)
    truth = reference[dt, drive, loop, case] - reference[dt, drive, loop, ""]
    assert rms(truth) > 0.02
    return rms(ours - truth) / rms(truth)


@pytest.mark.long
@pytest.mark.parametrize("case", [*AT_LOAD, *AT_BOTH])
@pytest.mark.parametrize("loop", ["open", "sampled", "continuous"])
def test_effects_at_the_load_agree_with_the_fine_integrator(reference: Truth, case: str, loop: str) -> None:
    for dt in (0.444e-3, 1e-3):
        for drive in DRIVES:
            off = deviation(reference, dt, drive, loop, case)
            assert off < 0.005, f"{case}, dt {dt}, {drive}: {off:.4f}"


def test_many_equal_one_by_one() -> None:
    models = [model_of(drive, case) for drive in DRIVES.values() for case in (*AT_LOAD, *AT_BOTH)]
    for loop in ("open", "sampled", "continuous"):
        rec, ctl = record(1e-3, loop, n=100), controller_of(loop, True)
        many = ga.simulate_many(models, rec, ctl, workers=2)
        for row, model in zip(many, models, strict=True):
            assert np.array_equal(row, ga.simulate(model, rec, ctl))


def test_simulate_values_take_effects_at_the_load_by_their_key() -> None:
    rec, ctl = record(1e-3, "sampled"), controller_of("sampled", True)
    model = model_of(TWO, "coulomb_friction+cogging@load")
    values = [*factor_parameters(model)[1], *(v for e in model.effects for v in e.values)]
    keys = [e.key for e in model.effects]
    assert keys == ["coulomb_friction", "cogging@load"]
    found = simulate_values(FactorCounts.of(model), keys, [values], rec, ctl)[0]
    np.testing.assert_allclose(found, ga.simulate(model, rec, ctl), rtol=0, atol=1e-8)


def test_gravity_at_the_load_has_the_load_s_angle() -> None:
    """At rest on a soft shaft the load hangs deeper than the motor: A sin(theta - x) = K x, the motor at rest by friction."""
    soft = ga.TwoMass(1e-4, 0.002, 5e-4, 0.02, 0.3, 0.002)
    amplitude, start = 0.1, 0.8
    model = soft.model().with_effect("unbalance", side="load", amplitude=amplitude, phase=0.0)
    model = model.with_effect("coulomb_friction", torque=10.0)
    n = 3000
    rec = ga.Record(1e-3, torque=np.zeros(n), velocity=np.zeros(n), position=np.full(n, start))
    assert np.array_equal(ga.simulate(model, rec), np.zeros(n))
    # Without friction the motor follows: both end below, where sin is 0, at an angle of 0.
    free = soft.model().with_effect("unbalance", side="load", amplitude=amplitude, phase=start)
    end = ga.run(free, ga.Record(1e-3, torque=np.zeros(n), velocity=np.zeros(n))).position[-1]
    assert end == pytest.approx(-start, abs=0.02)


def test_a_model_carries_an_effect_at_either_side_or_at_both() -> None:
    plain = TWO.model()
    load = plain.with_effect("coulomb_friction", side="load", torque=0.05)
    motor = plain.with_effect("coulomb_friction", torque=0.05)
    assert load != motor
    assert motor == plain.with_effect("coulomb_friction", side="motor", torque=0.05)
    assert [e.side for e in load.effects] == ["load"]
    assert repr(load.effects[0]) == "Effect('coulomb_friction', {'torque': 0.05}, side='load')"
    both = load.with_effect("coulomb_friction", torque=0.02).with_effect("backlash", gap=0.01)
    assert [(e.name, e.side) for e in both.effects] == [
        ("coulomb_friction", "motor"),
        ("backlash", ""),
        ("coulomb_friction", "load"),
    ]
    again = both.with_effect("coulomb_friction", side="load", torque=0.07)
    assert [e.values for e in again.effects] == [(0.02,), (0.01,), (0.07,)]
    assert both.without_effect("coulomb_friction", side="motor").effects == (both.effects[1], both.effects[2])
    assert [e.name for e in both.without_effect("coulomb_friction").effects] == ["backlash"]
    with pytest.raises(ga.GaidentError, match="has no effect"):
        motor.without_effect("coulomb_friction", side="load")
    for model in (load, motor, both):
        assert ga.Model.from_dict(json.loads(json.dumps(model.to_dict()))) == model
        assert eval(repr(model), {"Model": ga.Model, "Effect": ga.Effect}) == model
        for same in (copy.deepcopy(model), pickle.loads(pickle.dumps(model))):
            assert same == model
            assert hash(same) == hash(model)
    assert motor.to_dict()["effects"] == [{"name": "coulomb_friction", "parameters": {"torque": 0.05}}]
    assert load.to_dict()["effects"][0]["side"] == "load"


@pytest.mark.parametrize(
    ("drive", "name", "side", "message"),
    [
        (TWO, "coulomb_friction", "gear", "side of coulomb_friction is 'gear': it must be one of motor, load"),
        (TWO, "backlash", "load", "side of backlash is 'load': it is in the coupling and has no other side; leave side out"),
        (TWO, "torque_lag", "load", "it is in the actuator"),
        (ga.OneMass(5e-4, 0.005), "coulomb_friction", "load", "coulomb_friction at the load needs two masses"),
    ],
)
def test_refusals_name_the_remedy(drive: ga.OneMass | ga.TwoMass, name: str, side: str, message: str) -> None:
    with pytest.raises(ga.GaidentError) as caught:
        drive.model().with_effect(name, side=side, **SIZES[name])
    assert message in str(caught.value)


def test_what_does_not_go_together() -> None:
    with pytest.raises(ga.GaidentError, match="coulomb_friction at the load and extra_resonance cannot be simulated together"):
        TWO.model().with_effect("coulomb_friction", side="load", torque=0.05).with_effect(
            "extra_resonance", **SIZES["extra_resonance"]
        )


def test_what_is_constant_has_no_end() -> None:
    """F(0) = 1: where the shaft has come to rest, a load acts alike at either end, and one at the other cancels it."""
    ctl = controller_of("sampled", True)
    still = ga.Record(1e-3, command=np.full(3000, 20.0), velocity=np.zeros(3000))
    ends = [ga.simulate(TWO.model().with_effect("load_torque", side=side, torque=0.1), still, ctl) for side in ("motor", "load")]
    without = ga.simulate(TWO.model(), still, ctl)
    assert rms(ends[0] - without) > 0.1
    assert np.max(np.abs(ends[0] - ends[1])[-500:]) < 1e-3 * np.max(np.abs(ends[0] - without))
    both = TWO.model().with_effect("load_torque", torque=0.1).with_effect("load_torque", side="load", torque=-0.1)
    assert np.max(np.abs(ga.simulate(both, still, ctl) - without)[-500:]) < 1e-3 * np.max(np.abs(ends[0] - without))


def test_a_viscous_part_has_no_end_on_a_stiff_shaft() -> None:
    rec = record(1e-3, "open")

    def changed(stiffness: float) -> float:
        """What the end of a viscous part changes, beside what it changes itself."""
        plain = {"JM": 2e-4, "JL": 5e-4, "KG": stiffness, "DG": 1e-3}
        w = [ga.simulate(ga.TwoMass(DM=a, DL=b, **plain).model(), rec) for a, b in ((1e-3, 1e-3), (3e-3, 1e-3), (1e-3, 3e-3))]
        return rms(w[1] - w[2]) / rms(w[1] - w[0])

    assert changed(1e4) < 0.01
    assert changed(1.0) > 0.5
