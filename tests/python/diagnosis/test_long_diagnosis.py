"""What real drives need of a diagnosis, on records made for it: coarse grids, a floor on the noise, speeds without a sign."""

from __future__ import annotations

import importlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.folded import folded
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.selection import select
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.decimated import blocks_of, decimated_record
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import ShaftNoise, autoregression
from gaident.estimation.objective import Hypothesis, Objective, OutputErrors
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop

DT = 1e-3


def axis(samples: int, seed: int = 0, mass: float = 90.0, low: float = 0.0, noise: float = 1e-6) -> ga.Record:
    """A linear axis under steps of force, with friction that depends on the direction; low: what is missing of it near rest.

    f = Tp + (b + bp) v forwards, -(Tn + (b + bn) |v|) backwards, each times 1 - low exp(-|v|/0.02); 8 Euler steps a sample.
    """
    rng = np.random.default_rng(seed)
    levels = rng.uniform(60.0, 160.0, -(-samples // 250)) * np.tile([1.0, -1.0], samples)[: -(-samples // 250)]
    force = np.repeat(levels, 250)[:samples]
    h, v, out = DT / 8.0, 0.0, np.empty(samples)
    for n, f in enumerate(force.tolist()):
        out[n] = v
        for _ in range(8):
            direction = np.sign(v) if v else np.sign(f)
            level, viscous = (20.0, 160.0) if direction > 0.0 else (21.0, 230.0)
            friction = (level + viscous * abs(v)) * (1.0 - low * np.exp(-abs(v) / 0.02))
            moved = v + h / mass * (f - direction * friction)
            v = 0.0 if v and moved * v < 0.0 else moved
    return ga.Record(DT, velocity=out + noise * rng.standard_normal(samples), torque=force, name="axis")


def test_a_coarse_grid_leaves_a_mass_what_it_is() -> None:
    """W(m+1) - W(m) = k dt/J U(m), to the last digit."""
    u = np.random.default_rng(0).standard_normal(2003)
    w = np.concatenate([[0.0], np.cumsum(u)[:-1]]) * DT / 0.3
    coarse = decimated_record(ga.Record(DT, velocity=w, torque=u, position=np.cumsum(w) * DT), 7)
    assert len(coarse) == 2003 // 7 and coarse.dt == pytest.approx(7 * DT)
    assert coarse.torque is not None
    np.testing.assert_allclose(np.diff(coarse.velocity), coarse.torque[:-1] * 7 * DT / 0.3, rtol=0.0, atol=1e-14)


def test_the_grid_is_as_coarse_as_what_is_wrong_allows() -> None:
    n = 28_000
    t = np.arange(n) * DT
    rec = ga.Record(DT, velocity=np.sin(t), torque=np.cos(t))
    data = DataSet.of([rec], None)
    assert blocks_of(data, 0.1 * np.sin(2.0 * t)) == 8, "3500 samples are left"
    assert 1 < blocks_of(data, 0.1 * np.sin(2.0 * np.pi * 20.0 * t)) < 8
    assert blocks_of(data, 0.1 * np.sin(2.0 * np.pi * 400.0 * t)) == 1
    closed_loop = ga.Record(DT, command=np.sin(t), velocity=np.sin(t))
    assert blocks_of(DataSet.of([closed_loop], ga.PI(1.0, 1.0)), 0.1 * np.sin(2.0 * t)) == 1, "a controller samples as it does"


def test_a_floor_bounds_what_a_filter_makes_of_a_smooth_error() -> None:
    """The floor is as if white noise of that variance were on the error, without the noise."""
    t = np.arange(4000) * DT
    e = np.sin(9.0 * t) + 0.3 * np.sin(23.0 * t)
    noisy = e + 0.1 * np.random.default_rng(3).standard_normal(len(e))
    bare, floored, drawn = autoregression([e]), autoregression([e], floor=0.01), autoregression([noisy])
    assert bare @ bare > 1.5 and floored @ floored < 0.5
    assert float(np.sum(floored)) == pytest.approx(float(np.sum(drawn)), abs=0.05)


def test_the_power_of_a_noise_filter_is_that_of_its_impulse_response() -> None:
    plant = ga.OneMass(J=1e-3, D=1e-3).model()
    noise = ShaftNoise(plant, DT, None).filters([(4, 7)])[0]
    assert noise is not None
    v = noise.of(np.random.default_rng(0).standard_normal((1, 200_000)), (200_000,))[0]
    assert float(np.mean(v**2)) == pytest.approx(noise.power, rel=0.03)


def test_a_speed_without_its_sign_is_recognised_and_a_speed_in_one_direction_is_not() -> None:
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1.0, 1.0, 60), 20)
    w = np.zeros(len(u))
    for n in range(1, len(u)):
        w[n] = 0.97 * w[n - 1] + 0.05 * u[n - 1]
    w += 2e-3 * rng.standard_normal(len(w))
    assert not folded(ga.Record(0.02, velocity=w, torque=u))
    assert folded(ga.Record(0.02, velocity=np.abs(w), torque=u))
    assert not folded(ga.Record(0.02, velocity=w - w.min(), torque=u))
    dia = ga.diagnose(ga.Record(0.02, velocity=np.abs(w), torque=u))
    assert dia.causes == () and "without its sign" in dia.not_testable["torque_dead_band"]
    assert "speed without its sign" in " ".join(dia.summary().split())


@pytest.mark.long
def test_a_long_record_names_its_cause_beside_a_small_remainder() -> None:
    """Friction that depends on the direction, and a little of it missing near rest, which is not in the library."""
    rec = axis(10_000, low=0.15)
    dia = ga.diagnose(rec, validation=axis(4000, seed=1, low=0.15))
    (cause,) = dia.causes
    assert cause.effect == "asymmetric_friction" and cause.named
    assert "viscous friction that depends on the direction" in cause.evidence
    assert cause.parameters["viscous_negative"].value == pytest.approx(70.0, rel=0.2)
    assert 1.0 / dia.model.gain == pytest.approx(90.0, rel=0.02)
    assert dia.gain_interval[0] > 0.5 and dia.samples == 10_000


@pytest.mark.long
def test_output_errors_are_weighed_anew_on_all_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """The prefilter of a coarse grid ends at a tenth of its sample rate: what it removes is what that grid could not show."""
    rec = axis(8000, noise=1e-4)
    assert rec.torque is not None
    torque = rec.torque + 2.0 * np.random.default_rng(2).standard_normal(len(rec))
    found: list[select.Selection] = []

    def kept(*arguments: Any, **named: Any) -> select.Selection:
        found.append(select.selected(*arguments, **named))
        return found[-1]

    monkeypatch.setattr(importlib.import_module("gaident.diagnosis.work"), "selected", kept)
    rec = ga.Record(DT, velocity=rec.velocity, torque=torque, torque_is="measured")
    dia = ga.diagnose(rec)
    assert [f.effect for f in dia.causes] == ["asymmetric_friction"]
    family = found[0].space.objective.family
    assert (
        isinstance(family, OutputErrors)
        and family.prefilter is not None
        and family.prefilter.dt == DT
        and family.inertia is not None
    )
    assert family.prefilter.cutoff == ga.inverse_dynamics(rec).cutoff_hz > 0.1 / (2 * DT)
    assert 10.0 < family.samples < 0.2 * len(rec)


@pytest.mark.long
def test_an_effect_that_makes_held_out_data_worse_is_refused() -> None:
    """The load is in the training record alone, as if it had been taken off before the other one was made."""
    t = np.arange(3000) * DT
    u = np.sign(np.sin(2.0 * np.pi * t)) * (1.0 + 0.5 * np.sin(7.0 * t))

    def made(load: float, seed: int) -> ga.Record:
        model = ga.OneMass(J=0.05, D=0.1).model().with_effect("load_torque", torque=load)
        w = ga.simulate(model, ga.Record(DT, velocity=np.zeros(len(u)), torque=u))
        return ga.Record(DT, velocity=w + 0.02 * np.random.default_rng(seed).standard_normal(len(u)), torque=u)

    kept = ga.diagnose(made(0.2, 0), validation=made(0.2, 1))
    assert [f.effect for f in kept.causes] == ["load_torque"]
    refused = ga.diagnose(made(0.2, 0), validation=made(0.0, 1))
    assert refused.causes == ()
    assert any("makes the held-out data worse" in note for note in refused.notes)


@pytest.mark.long
def test_a_lag_within_a_step_of_the_coarse_grid_is_no_second_mass() -> None:
    """A clean axis of one mass and a current loop: the grid of 0.5 ms shows its lag of 0.2 ms as a shaft of 370 Hz."""
    skip_without_library()
    dt, w = 0.25e-3, 0.0
    command = []
    for level in np.random.default_rng(3).uniform(-70.0, 70.0, 14):
        for _ in range(500):
            w += float(np.clip(level - w, -3000.0 * dt, 3000.0 * dt))
            command.append(w)
    plant, lag = Plant(J=9e-4, D=0.004, kp=0.12, ki=6.0, dt=dt), {"torque_lag": {"time_constant": 0.2e-3}}
    encoder = Noise(white=0.0, encoder=2.0 * np.pi / 2**17, differenced=True)
    log = rig(plant, np.array(command), lag, encoder, seed=3)
    dia = ga.diagnose(ga.Record(dt, velocity=log.velocity, torque=log.torque))
    (cause,) = dia.causes
    assert {cause.effect, *cause.alternatives} == {"torque_lag", "velocity_filter"} and dia.verdict == "explained"
    assert cause.parameters["time_constant"].value == pytest.approx(0.2e-3, rel=1e-3)
    assert dia.mechanics["inertia"].value == pytest.approx(9e-4, rel=1e-6) and "load_inertia" not in dia.mechanics


@pytest.mark.long
def test_a_gap_in_a_long_record_is_found_in_the_loop_under_any_controller() -> None:
    """A rattling shaft of 160 Hz behind a current loop, 20 bits differenced: on a coarse grid the errors of the model grow.

    The age of the velocity is told once the gap is in the model, and the last valley of the cost is the deepest near by.
    """
    skip_without_library()
    dt, w = 125e-6, 0.0
    command = []
    for rpm in (0, 400, -50, 50, -700, 300, -20, 20, 600, -10):
        for _ in range(750):
            w += float(np.clip(rpm * np.pi / 30.0 - w, -4000.0 * dt, 4000.0 * dt))
            command.append(w)
    controller = ga.PI(0.1, 5.0, rule="backward")
    cascade = ga.Cascade(controller, period=dt)
    plant = Plant(J=2.8e-4, D=0.0015, JL=4.5e-4, DL=0.001, KG=180.0, DG=0.012, kp=0.1, ki=5.0, dt=dt, cascade=cascade)
    effects = {"backlash": {"gap": 6e-3}, "torque_lag": {"time_constant": 0.1e-3}}
    rec = rig(plant, np.array(command), effects, Noise(white=0.0, encoder=2.0 * np.pi / 2**20, differenced=True), seed=3)
    dia = ga.diagnose(rec, controller)
    gap, lag = dia.causes
    assert gap.effect == "backlash" and gap.parameters["gap"].value == pytest.approx(6e-3, rel=5e-3)
    assert {lag.effect, *lag.alternatives} == {"torque_lag", "velocity_filter"} and dia.verdict == "explained"
    assert lag.parameters["time_constant"].value == pytest.approx(0.1e-3, rel=0.03)
    assert dia.mechanics["motor_inertia"].value == pytest.approx(2.8e-4, rel=5e-3)
    assert dia.mechanics["load_inertia"].value == pytest.approx(4.5e-4, rel=5e-3)


def test_what_changes_less_than_the_steps_of_the_simulation_is_no_effect() -> None:
    """Friction behind a lag of half a line, simulated with 64 steps a line; the usual 8 are off by 0.5 us of delay."""
    still = ga.Record(DT, velocity=np.zeros(4000), torque=np.repeat(np.random.default_rng(3).uniform(-1.0, 1.0, 20), 200))
    truth = {"coulomb_friction": {"torque": 0.2}, "torque_lag": {"time_constant": 0.5e-3}}
    drive = ga.OneMass(J=2e-3, D=0.01).model()
    model = drive
    for name, values in truth.items():
        model = model.with_effect(name, **values)
    noise = 1e-4 * np.random.default_rng(4).standard_normal(4000)
    data = DataSet.of([still.with_channels(velocity=ga.simulate(model, still, substeps=64) + noise)], None)
    task = Task(Objective(data, np.ones(4000)), scales_of(data), drive, (), lambda message: None)
    space, fit = task.space(), task.one_mass()
    x, hypothesis = fit.parameters.start(drive), fit.hypothesis
    for name, values in truth.items():
        x, hypothesis = np.append(x, LIBRARY[name].coordinates(values)), hypothesis.extended(LIBRARY[name])
    simpler = space.refitted(hypothesis, x)
    delay = LIBRARY["transport_delay"]
    for size, counts in ((1e-7, False), (1e-5, True)):
        hypothesis, x = simpler.hypothesis.extended(delay), np.append(simpler.x, delay.coordinates({"delay": size}))
        fuller = replace(simpler, hypothesis=hypothesis, x=x, bic=simpler.bic - 1e3)
        assert space.beyond_steps(simpler, fuller) is counts
        assert counts or not space.worth(fuller, simpler), "however much better it fits"


def test_beside_impacts_steps_speak_against_another_effect_of_a_class_only() -> None:
    """A gap of 0.02 rad: steps move the times of the impacts by more than a friction of 0.002 N m does, which is there."""
    drive = ga.TwoMass(JM=3e-4, DM=2e-3, JL=5e-4, DL=2e-3, KG=200.0, DG=0.01).model()
    torque = np.repeat(np.random.default_rng(2).uniform(-1.0, 1.0, 20), 200)
    still = ga.Record(DT, velocity=np.zeros(4000), torque=torque)
    model = drive.with_effect("backlash", gap=0.02).with_effect("coulomb_friction", torque=0.002)
    noise = 0.01 * np.random.default_rng(4).standard_normal(4000)
    data = DataSet.of([still.with_channels(velocity=ga.simulate(model, still, substeps=64) + noise)], None)
    space = Task(Objective(data, np.ones(4000), OutputErrors(4000.0)), scales_of(data), drive, (), lambda message: None).space()
    parameters = Parameterisation.of(drive, scales_of(data), data.moving)
    hypothesis = Hypothesis(parameters, OpenLoop(data)).extended(LIBRARY["backlash"])
    simpler = space.refitted(hypothesis, np.append(parameters.base_vector(drive), LIBRARY["backlash"].coordinates({"gap": 0.02})))
    friction = LIBRARY["coulomb_friction"]
    fuller = space.refitted(simpler.hypothesis.extended(friction), np.append(simpler.x, friction.coordinates({"torque": 0.002})))
    assert not space.beyond_steps(simpler, fuller) and space.worth(fuller, simpler)


def test_half_a_step_is_one_where_the_velocity_is_a_mean_too() -> None:
    """A mean over a sample takes two steps at least, so that twice as many are four."""
    data = DataSet.of([axis(2000)], None)
    means = replace(data, age=0.5)
    assert data.steps_of(data.substeps(None)) == 8 and replace(data, finer=2).substeps(None) == 16
    fast = replace(means, finest=1.0)
    assert [replace(fast, finer=k).substeps(None) for k in (1, 2)] == [2, 4]
    assert [replace(fast, finer=k).steps_of(replace(fast, finer=k).substeps(None)) for k in (1, 2)] == [1, 2]
