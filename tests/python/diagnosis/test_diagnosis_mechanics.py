"""Mechanics of a diagnosed model: exact for the drive that a model was made from, with shaft damping too."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Plant, run_drive, skip_without_library
from fine_integrator import FineCase, integrate
from gaident.diagnosis.mechanics import MECHANICS, moved
from gaident.diagnosis.selection.mechanisms import (
    balanced_on_a_spring,
    evenly_damped,
    is_mechanism,
    on_no_shaft,
    reduced,
    rigid,
)
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Fit, Hypothesis
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.term import Scales
from gaident.identification.space import derive_space

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
    assert list(found) == [name for name in MECHANICS if not name.startswith("ground")]
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


@pytest.mark.parametrize("damping", [1e-3, 0.2])
def test_one_mass_on_a_spring(damping: float) -> None:
    """J dw/dt = u - D w - k theta, from 1/(J s + D + k/s); the second damping makes its poles real."""
    J, k = 5e-4, 0.8
    model = ga.Model(1.0 / J, np.roots([1.0, damping / J, k / J]), [0.0])
    found = {name: after for name, (_, after) in moved(fit(model), fit(model)).items()}
    assert list(found) == ["inertia", "viscous_friction", "ground_stiffness", "ground_resonance"]
    assert list(found.values()) == pytest.approx([J, damping, k, math.sqrt(k / J) / math.tau], rel=1e-9)


def test_the_parameters_of_a_mass_on_a_spring_simulate_its_model() -> None:
    model = ga.Model(2000.0, [-3.0 + 40.0j, -3.0 - 40.0j], [0.0])
    parameters = Parameterisation.of(model, SCALES, [False])
    x = parameters.start(model)
    assert parameters.kind == "one mass on a spring" and parameters.base == 3 and parameters.starts == (0,)
    assert parameters.linear(x).poles == pytest.approx(model.poles) and parameters.linear(x).zeros == (0.0,)
    rec = ga.Record(1e-3, velocity=np.zeros(400), torque=np.sin(0.05 * np.arange(400)))
    simulated = OpenLoop(DataSet.of([rec], None)).velocities(parameters, x[None, :])[0]
    np.testing.assert_allclose(simulated, ga.simulate(model, rec), rtol=0.0, atol=1e-9 * np.abs(simulated).max())


def test_no_start_makes_an_inertia_negative() -> None:
    for model in (ga.Model(-2000.0, [-4.0]), ga.Model(-2000.0, [-3.0 + 40.0j, -3.0 - 40.0j], [0.0])):
        parameters = Parameterisation.of(model, SCALES, [False])
        assert parameters.linear(parameters.start(model)).gain == pytest.approx(2000.0)
    assert rigid(ga.Model(-2000.0, [-4.0, -9.0], [-7.0])) == [] and reduced(ga.Model(-2000.0, [-4.0])) == []


def test_a_spring_that_pushes_is_no_mechanism() -> None:
    model = ga.Model(2000.0, [-3.0 + 40.0j, -3.0 - 40.0j], [0.0])
    parameters = Parameterisation.of(model, SCALES, [False])
    x = parameters.base_vector(model)
    assert is_mechanism(parameters, x) and not is_mechanism(parameters, x * [1.0, 1.0, -1.0])


def swung(stiffness: float, friction: float = 0.0) -> DataSet:
    """A mass on a spring, driven far below its resonance, where its velocity falls while the torque rises."""
    model = ga.Model(1.0 / 5e-4, np.roots([1.0, 4.0, stiffness / 5e-4]), [0.0])
    model = model.with_effect("coulomb_friction", torque=friction) if friction else model
    torque = 0.2 * np.sin(2.0 * np.pi * np.arange(4000) * 1e-3) + 0.1 * np.sin(14.0 * np.arange(4000) * 1e-3)
    rec = ga.Record(1e-3, velocity=np.zeros(4000), torque=torque)
    return DataSet.of([ga.Record(1e-3, velocity=ga.simulate(model, rec), torque=torque)], None)


@pytest.mark.parametrize("friction", [0.0, 0.01])
def test_the_balance_of_momentum_finds_a_spring_and_the_sign_of_the_inertia(friction: float) -> None:
    data = swung(0.8, friction)
    found = balanced_on_a_spring(data)
    assert found is not None and found.zeros == (0.0,) and found.gain > 0.0
    c = float(np.prod(found.poles).real)
    assert c / found.gain == pytest.approx(0.8, rel=0.05)
    assert found.gain == pytest.approx(2000.0, rel=1e-2) or (0.5 * 2000.0 < found.gain < 2000.0 and friction > 0.0)
    space = derive_space(data.records, None)
    assert space.gain[0] < 2000.0 < space.gain[1]


def test_a_torque_of_the_wrong_sign_is_still_refused() -> None:
    rec = swung(0.0).records[0]
    with pytest.raises(ga.errors.SpaceError, match="reverse the sign"):
        derive_space([ga.Record(rec.dt, velocity=rec.velocity, torque=-rec.torque)], None)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 3, 8, 10])
def test_a_pendulum_in_open_loop_has_no_wrong_sign(seed: int) -> None:
    """It swings so far that it is on no spring, and its velocity often falls when the torque rises."""
    plant = Plant(J=0.01, D=0.02, kp=0.0, ki=0.0, dt=2e-3)
    torque = np.repeat(np.random.default_rng(seed).uniform(-0.7, 0.7, 40), 250)
    effects = {"coulomb_friction": {"torque": 0.05}, "unbalance": {"amplitude": 1.0, "phase": 0.0}}
    log = run_drive(plant, None, effects, torque=torque)
    noise = 0.02 * np.random.default_rng(seed).standard_normal(len(torque))
    rec = ga.Record(plant.dt, velocity=log.velocity + noise, torque=torque)
    space = derive_space([rec], None)
    assert space.gain[0] < 100.0 < space.gain[1]
    if seed == 1:
        dia = ga.diagnose(rec)
        assert dia.verdict == "explained"
        found = {f.effect: f.parameters for f in dia.findings}
        assert set(found) == set(effects)
        assert found["unbalance"]["amplitude"].value == pytest.approx(1.0, rel=0.01)
        assert found["coulomb_friction"]["torque"].value == pytest.approx(0.05, rel=0.03)


def test_a_hanging_mass_moved_slowly_against_friction_has_no_wrong_sign() -> None:
    """0.19 turns: the sums of momentum of gravity alone lack what dry friction does at the reversals."""
    rng, t = np.random.default_rng(5), 1e-3 * np.arange(6000)
    orders = np.array([1.0, 1.7, 2.9, 4.3])[:, None]
    omega = 2.0 * np.pi * 0.3 * orders
    phase = omega * t + rng.uniform(0.0, 6.28, 4)[:, None]
    size = 2.0 * np.pi * 0.19 / np.ptp((np.sin(phase) / orders).sum(axis=0))
    angle, w, a = (
        size * (wave / orders).sum(axis=0) for wave in (np.sin(phase), omega * np.cos(phase), -(omega**2) * np.sin(phase))
    )
    angle -= angle[0]
    torque = 1e-3 * a + 2e-3 * w + 0.02 * np.sign(w) + 0.3 * np.sin(angle + 0.3)
    velocity = w + 0.005 * rng.standard_normal(len(t))
    space = derive_space([ga.Record(1e-3, velocity=velocity, torque=torque, position=angle, torque_is="measured")], None)
    assert space.gain[0] < 1000.0 < space.gain[1]


def test_two_masses_whose_motor_is_driven_are_on_no_shaft() -> None:
    """(D_M + D_G)/J_M = a + e1 - f1: an antiresonance that is damped more than resonance and motor together."""
    shaft = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1.5e-3, KG=60.0, DG=2e-3).model()
    overdamped = ga.TwoMass(JM=2e-4, DM=1e-3, JL=3e-4, DL=1.5e-3, KG=60.0, DG=0.3).model()
    zeros = tuple(complex(-0.3 * abs(z), z.imag) for z in shaft.zeros)
    models = {
        "shaft": shaft,
        "overdamped": overdamped,
        "driven": replace(shaft, zeros=zeros),
        "one": ga.OneMass(5e-4, 1e-3).model(),
    }
    found = {}
    for name, model in models.items():
        parameters = Parameterisation.of(model, SCALES, [False])
        hypothesis = Hypothesis(parameters, OpenLoop(swung(0.5)))
        found[name] = on_no_shaft(Fit(hypothesis, parameters.base_vector(model), WHITE, 1.0, 0.0))
    assert found == {"shaft": False, "overdamped": True, "driven": True, "one": False}


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


@pytest.mark.long
@pytest.mark.parametrize("side", ["motor", "load"])
def test_dry_friction_is_found_at_its_end_of_the_shaft(side: str) -> None:
    """Against the independent integrator, which shares no code with the library."""
    JM, JL, K, dt = 2e-4, 4e-4, 3.0, 1e-3
    rng = np.random.default_rng(3)
    command = np.repeat(rng.uniform(-60.0, 60.0, 10), 150)
    friction = {"coulomb_friction": {"torque": 0.05}}
    case = FineCase(dt, "sampled", command, (JM, 0.002), (JL, 0.003), (K, 2e-3), 0.01, 0.08)
    case = replace(case, **{"effects" if side == "motor" else "at_load": friction})  # type: ignore[arg-type]
    run = integrate([case], fine=60)
    velocity = run.velocity[:, 0] + 2e-3 * rng.standard_normal(len(command))
    rec = ga.Record(dt, command=command, velocity=velocity, torque=run.torque[:, 0])
    dia = ga.diagnose(rec, controller=ga.PI(case.kp, case.ki))
    (found,) = dia.causes
    assert (found.effect, found.alternatives, found.sides) == ("coulomb_friction", (), (side,))
    assert found.parameters["torque"].value == pytest.approx(0.05, rel=0.02)
    assert [e.side for e in dia.model.effects] == [side]
    assert f"Cause: coulomb friction at the {side}." in " ".join(dia.summary().split())
    assert f"at the {side}: beyond doubt" in found.evidence
    assert ga.Diagnosis.from_dict(json.loads(json.dumps(dia.to_dict()))).findings == dia.findings


@pytest.mark.long
def test_an_offset_at_the_load_is_told_from_viscous_friction_that_depends_on_the_direction() -> None:
    """Two levels that are even, and two viscous parts: no constant load is as good, so that friction is named alone."""
    rng = np.random.default_rng(3)
    command = np.repeat(rng.uniform(-60.0, 60.0, 10), 150)
    levels = {"torque_positive": 0.05, "torque_negative": 0.05, "viscous_positive": 0.001, "viscous_negative": 0.004}
    drive = ga.TwoMass(2e-4, 0.001, 4e-4, 0.001, 3.0, DG=2e-3).model()
    drive = drive.with_effect("asymmetric_friction", side="load", **levels)
    ctl = ga.PI(0.01, 0.08)
    run = ga.run(drive, ga.Record(1e-3, command=command, velocity=np.zeros(len(command))), ctl)
    velocity = run.velocity + 2e-3 * rng.standard_normal(len(command))
    dia = ga.diagnose(ga.Record(1e-3, command=command, velocity=velocity, torque=run.torque), controller=ctl)
    (found,) = dia.causes
    assert (found.effect, found.alternatives, found.sides) == ("asymmetric_friction", (), ("load",))
    assert "what looks like an offset is mostly viscous friction that depends on the direction" in found.evidence


def test_in_one_mass_both_ends_are_the_same_place() -> None:
    rng = np.random.default_rng(4)
    command = np.repeat(rng.uniform(-60.0, 60.0, 6), 100)
    ctl = ga.PI(0.03, 0.3)
    still = ga.Record(1e-3, command=command, velocity=np.zeros(len(command)))
    run = ga.run(ga.OneMass(5e-4, 0.004).model().with_effect("coulomb_friction", torque=0.05), still, ctl)
    velocity = run.velocity + 2e-3 * rng.standard_normal(len(command))
    dia = ga.diagnose(ga.Record(1e-3, command=command, velocity=velocity, torque=run.torque), controller=ctl)
    assert [(f.effect, f.sides) for f in dia.causes] == [("coulomb_friction", ("motor", "load"))]
    assert "end of the shaft" not in dia.summary()


@pytest.mark.parametrize(("seed", "noise"), [(131000000, "white"), (131000002, "coloured")])
def test_a_narrow_resonance_between_the_frequencies_of_the_starts_is_found(seed: int, noise: str) -> None:
    """On a step of 250 samples a start as far away as the coarse grid allows promises nothing."""
    skip_without_library()
    rec, validation, controller, truth = random_case(seed, "extra_resonance", "step", noise, True)
    (found,) = ga.diagnose(rec, controller, validation=validation).causes
    assert "extra_resonance" in (found.effect, *found.alternatives)
    true = truth.effects["extra_resonance"]["frequency"]
    assert found.parameters["frequency"].value == pytest.approx(true, rel=0.01)
