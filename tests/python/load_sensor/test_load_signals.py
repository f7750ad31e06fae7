"""How a sensor at the load is read: scale, offset, noise, and the criterion of motor and load together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.hypothesis import Hypothesis
from gaident.estimation.load_sensor.joint import JointObjective
from gaident.estimation.load_sensor.signals import LoadSensor
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.uncertainty import covariance_of

DT, N = 1e-3, 1500
DRIVE = ga.TwoMass(JM=1e-3, DM=1e-3, JL=2e-3, DL=1e-3, KG=80.0, DG=0.02)
TORQUE = np.repeat([0.0, 0.3, -0.5, 0.4, -0.2], N // 5)
SCALE, OFFSET = -0.125, 3.0


def record(channel: str, noise: float, motor_noise: float = 0.0, position: bool = False) -> ga.Record:
    """A torque-driven log of the drive, with a sensor of its load."""
    rng = np.random.default_rng(11)
    plain = ga.Record(DT, torque=TORQUE, velocity=np.zeros(N))
    run = ga.run(DRIVE, plain, load=True)
    at_load = SCALE * getattr(run, channel) + OFFSET + noise * rng.standard_normal(N)
    velocity = run.velocity + motor_noise * rng.standard_normal(N)
    return plain.with_channels(velocity=velocity, position=run.position if position else None, **{channel: at_load})


def bench(rec: ga.Record) -> tuple[Objective, LoadSensor, Hypothesis, np.ndarray]:
    """The objective of the motor, the sensor, and the true drive as a hypothesis."""
    data = DataSet.of([rec], None)
    objective = Objective(data, np.ones(N))
    channel = "load_position" if rec.load_position is not None else "load_velocity"
    sensor = LoadSensor.of(data, channel, [getattr(rec, channel)], objective.counted)
    parameters = Parameterisation.of(DRIVE.model(), scales_of(data), data.moving)
    return objective, sensor, Hypothesis(parameters, OpenLoop(data)), parameters.base_vector(DRIVE.model())


@pytest.mark.parametrize(("channel", "noise"), [("load_position", 1e-4), ("load_velocity", 0.01)])
def test_scale_and_offset_are_those_of_the_sensor(channel: str, noise: float) -> None:
    _, sensor, truth, x = bench(record(channel, noise, position=True))
    read = sensor.reading(truth, x)
    assert read.scale == pytest.approx(SCALE, abs=4.0 * read.scale_std) and read.scale_std < 1e-4
    assert read.offsets[0] == pytest.approx(OFFSET, abs=4.0 * read.offset_stds[0])
    assert float(np.std(read.errors)) == pytest.approx(noise, rel=0.1)
    assert sensor.noise == pytest.approx(noise, rel=0.1)


def test_deviations_of_scale_and_offset_are_those_of_repeats() -> None:
    _, sensor, truth, x = bench(record("load_velocity", 0.0))
    clean, rng = sensor.measured, np.random.default_rng(3)

    reads = [replace(sensor, measured=clean + 0.01 * rng.standard_normal(N)).reading(truth, x) for _ in range(60)]
    assert float(np.std([r.scale for r in reads])) == pytest.approx(reads[0].scale_std, rel=0.3)
    assert float(np.std([r.offsets[0] for r in reads])) == pytest.approx(reads[0].offset_stds[0], rel=0.3)


def test_an_angle_that_is_integrated_leaves_a_random_walk_which_is_whitened() -> None:
    """Integrated velocity noise of 0.05 rad/s, and an encoder of 1e-5 rad: the errors of the true drive are white."""
    _, sensor, truth, x = bench(record("load_position", 1e-5, motor_noise=0.05))
    errors = sensor.errors(truth, x[None, :])[0][50:]
    assert float(np.std(errors)) == pytest.approx(sensor.noise, rel=0.15)
    for k in (1, 2, 5):
        correlation = float(np.corrcoef(errors[k:], errors[:-k])[0, 1])
        assert abs(correlation) < 4.0 / np.sqrt(N), k
    logged = bench(record("load_position", 1e-5, motor_noise=0.05, position=True))[1]
    assert logged.whitens is WHITE and logged.noise == pytest.approx(1e-5, rel=0.15)


def test_one_mass_has_no_load_that_moves_against_the_motor() -> None:
    rec = record("load_position", 1e-4, position=True)
    _, sensor, _, _ = bench(rec)
    data = DataSet.of([rec], None)
    parameters = Parameterisation.of(ga.OneMass(J=3e-3, D=2e-3).model(), scales_of(data), data.moving)
    rigid = Hypothesis(parameters, OpenLoop(data))
    x = parameters.base_vector(ga.OneMass(J=3e-3, D=2e-3).model())
    assert not np.any(sensor.follows(rigid, x[None, :]))
    assert float(np.std(sensor.errors(rigid, x[None, :])[0])) > 3.0 * sensor.noise


def test_the_joint_cost_is_that_of_its_slopes_and_its_parts() -> None:
    objective, sensor, truth, x = bench(record("load_position", 1e-4, motor_noise=0.02, position=True))
    start = objective.fitted(truth, x, WHITE, float(objective.costs(truth, x[None, :], WHITE)[0]))
    joint = JointObjective.of(objective, sensor, start)
    v, J = joint.linearised(truth, x, WHITE)
    cost = float(joint.costs(truth, x[None, :], WHITE)[0])
    fit = joint.fitted(truth, x, WHITE, cost)
    at_load = joint.at_load(fit) * sensor.count
    assert cost == pytest.approx(float(v @ v), rel=1e-12) == pytest.approx(0.5 * (start.cost + joint.share * at_load), rel=1e-12)
    assert len(v) == 2 * N == J.shape[1] and joint.count == objective.count and joint.sensors == 2
    np.testing.assert_array_equal(joint.whitened_at(truth, x, WHITE), v)
    parts = objective.bic(start.cost, WHITE, truth.parameters.size) + joint.samples * np.log(joint.at_load(fit))
    assert fit.bic == pytest.approx(parts, rel=1e-9)
    moved = np.flatnonzero(truth.parameters.steps() > 0.0)
    for i in moved:  # central differences of the whole row
        h = 1e-5 * truth.parameters.steps()[i]
        ahead, back = (joint.whitened_at(truth, x + s * h * np.eye(len(x))[i], WHITE) for s in (1.0, -1.0))
        slope = (ahead - back) / (2.0 * h)
        assert np.linalg.norm(J[i] - slope) < 1e-3 * np.linalg.norm(slope)


def test_the_motor_s_noise_does_not_count_twice() -> None:
    """Beside the errors of the motor those at the load are the noise of their own sensor, and tell nothing of the motor's."""
    objective, sensor, truth, x = bench(record("load_velocity", 1e-3, motor_noise=0.05))
    start = objective.fitted(truth, x, WHITE, float(objective.costs(truth, x[None, :], WHITE)[0]))
    joint = JointObjective.of(objective, sensor, start)
    alone = sensor.errors(truth, x[None, :])[0]
    v = joint.whitened_at(truth, x, WHITE)
    at_motor, at_load = np.sqrt(2.0) * v[:N], np.sqrt(2.0 / joint.share) * v[N:]
    assert float(np.std(alone)) == pytest.approx(abs(SCALE) * 0.05, rel=0.1)
    assert abs(float(np.corrcoef(at_motor, alone)[0, 1])) > 0.9
    assert float(np.std(at_load)) == pytest.approx(1e-3, rel=0.1)
    assert abs(float(np.corrcoef(at_motor, at_load)[0, 1])) < 0.1


def test_the_motor_alone_is_what_it_was() -> None:
    objective, sensor, truth, x = bench(record("load_velocity", 1e-3, motor_noise=0.02))
    start = objective.fitted(truth, x, WHITE, float(objective.costs(truth, x[None, :], WHITE)[0]))
    joint = JointObjective.of(objective, sensor, start)
    alone, fit = joint.of_the_motor(joint.fitted(truth, x, WHITE, float(joint.costs(truth, x[None, :], WHITE)[0])))
    assert alone is objective and fit.bic <= objective.fitted(truth, x, WHITE, start.cost).bic + 1e-9
    half = np.repeat([1.0, 0.0], N // 2)
    assert joint.weighted(half).count == pytest.approx(joint.count / 2.0, rel=0.05)
    assert joint.weighted(half).sensor.count == pytest.approx(sensor.count / 2.0, rel=0.05)


@pytest.mark.long
def test_deviations_of_the_drive_are_those_of_repeats() -> None:
    """The stiffness from 60 draws of the noise, where the motor's is in both errors; it is said with their spread."""
    found, said = [], []
    for k in range(60):
        rng, rec = np.random.default_rng(k), record("load_velocity", 0.0)
        noise = 0.05 * rng.standard_normal(N)
        at_load = rec.load_velocity + 5e-4 * rng.standard_normal(N)
        objective, sensor, truth, x = bench(rec.with_channels(velocity=rec.velocity + noise, load_velocity=at_load))
        fit = ls.fit(objective, truth, x, WHITE, 10)
        for _ in range(2):
            joint = JointObjective.of(objective, sensor, ls.fit(objective, truth, fit.x, WHITE, 0))
            fit = ls.fit(joint, truth, fit.x, WHITE, 20)
        slope = [stiffness(fit.parameters, fit.x + h) for h in 1e-6 * np.eye(len(x))]
        slope = (np.array(slope) - stiffness(fit.parameters, fit.x)) / 1e-6
        found.append(stiffness(fit.parameters, fit.x))
        said.append(float(np.sqrt(slope @ covariance_of(joint, fit) @ slope)))
    assert float(np.std(found)) == pytest.approx(float(np.median(said)), rel=0.3)
    assert float(np.mean(found)) == pytest.approx(DRIVE.KG, abs=4.0 * float(np.std(found)) / np.sqrt(60))


def stiffness(parameters: Parameterisation, x: np.ndarray) -> float:
    return ga.TwoMass.from_model(parameters.linear(x), free_shaft_damping=True).KG
