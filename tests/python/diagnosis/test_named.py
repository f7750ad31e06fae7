"""Records of next to no noise, and waves of the angle and of the time hidden by the fine integrator: each cause is named."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Noise, Plant, rig, run_drive
from fine_integrator import FineCase, integrate

CONTROLLER = ga.PI(0.0232, 1.367)
STIFF = ga.PI(kp=0.03, ki=0.45)
DT = 1e-3


@pytest.mark.long
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


@pytest.mark.long
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


@pytest.mark.long
@pytest.mark.parametrize("profile", ["ramps", "sines", "one direction"])
def test_dry_friction_beside_a_drag(profile: str) -> None:
    """Alone each of them pays little, as both together are nearly viscous friction: the regression tries them together.

    Of a fan that never turns back the regression has an offset, which stands for dry friction too.
    """
    effects = {"coulomb_friction": {"torque": 0.1}, "quadratic_drag": {"coefficient": 4e-4}}
    dia = ga.diagnose(moved(effects, profile, 40.0, 0.02))
    found = {f.effect: f.parameters for f in dia.causes}
    assert set(found) == set(effects) and dia.verdict == "explained"
    assert found["coulomb_friction"]["torque"].value == pytest.approx(0.1, rel=0.1)
    assert found["quadratic_drag"]["coefficient"].value == pytest.approx(4e-4, rel=0.1)


@pytest.mark.long
def test_friction_that_falls_up_to_a_fifth_of_the_speed() -> None:
    """Beside dry friction of one size it is a damping below 0, from which no fit came to it: a drag was named.

    Where friction falls the motion answers more to the noise of the torque than the linear draws of it say, so that a torque of
    a hundredth of the friction may be named beside it.
    """
    truth = {"torque": 0.2, "static_torque": 0.4, "stribeck_velocity": 2.0}
    dia = ga.diagnose(moved({"stribeck_friction": truth}, "sines", 10.0, 0.05))
    assert dia.causes[0].effect == "stribeck_friction" and dia.verdict == "explained"
    assert "quadratic_drag" not in {f.effect for f in dia.causes}
    for name, value in truth.items():
        assert dia.causes[0].parameters[name].value == pytest.approx(value, rel=0.15)


@pytest.mark.long
def test_an_unbalance_on_an_elastic_shaft_behind_the_noise_of_a_measured_torque() -> None:
    """Linear models leave slow errors, of nine independent samples, beside which nothing was worth its cost.

    The true model leaves noise. Nothing was named, and the inertia was half.
    """
    rec, _, _, truth = random_case(611000000, ("unbalance",), "multi", Noise(white=0.05), torque_logged=True)
    assert rec.torque is not None and truth.plant.JL
    noise = 0.05 * float(np.sqrt(np.mean(rec.torque**2))) * np.random.default_rng(1).standard_normal(len(rec))
    dia = ga.diagnose(ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque + noise, torque_is="measured"))
    assert [f.effect for f in dia.causes] == ["unbalance"] and dia.verdict == "explained"
    found = dia.causes[0].parameters["amplitude"]
    assert abs(found.value - truth.effects["unbalance"]["amplitude"]) < 4.0 * found.std
    assert dia.mechanics["inertia"].value == pytest.approx(truth.plant.J + truth.plant.JL, rel=0.02)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 3])
def test_a_lag_that_is_not_in_the_library_is_no_second_mass(seed: int) -> None:
    """A first-order filter of the velocity that works at the controller's samples, 2 per time constant.

    Two masses came closer than a lag, with an inertia 50 % too large and, once, "explained": a resonance beside an antiresonance
    that was damped a hundred times more, or both overdamped.
    """
    dia = ga.diagnose(filtered_at_its_samples(seed), ga.PI(0.06, 0.6))
    assert {"coulomb_friction", "velocity_filter"} <= {e for f in dia.causes for e in (f.effect, *f.alternatives)}
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01) and "load_inertia" not in dia.mechanics


@pytest.mark.long
def test_dry_friction_that_the_regression_has_not_is_found_where_the_velocity_is_late() -> None:
    """Steps: behind the regression's filter the friction is less than its deviation. Nothing was named."""
    rec = filtered_at_its_samples(7, lag=0.0)
    late = np.concatenate([rec.velocity[:1], rec.velocity[:-1]])
    dia = ga.diagnose(ga.Record(rec.dt, velocity=late, torque=rec.torque, torque_is="measured"))
    friction = next(f for f in dia.causes if f.effect == "coulomb_friction")
    assert friction.parameters["torque"].value == pytest.approx(0.05, rel=0.02)
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)


def filtered_at_its_samples(seed: int, lag: float = 2e-3) -> ga.Record:
    """One mass of 1e-3 kg m^2 with 0.05 N m of dry friction under steps; its PI and the log have the filtered velocity."""
    dt, fine, n = 1e-3, 20, 2500
    rng = np.random.default_rng(seed)
    command, at = np.zeros(n), 0
    while at < n:
        command[at:] = rng.uniform(-60.0, 60.0)
        at += int(rng.uniform(100.0, 500.0))
    w = seen = integral = error = 0.0
    rows = np.empty((2, n))
    for k, r in enumerate(command):
        seen += (1.0 - (np.exp(-dt / lag) if lag else 0.0)) * (w + 0.02 * rng.standard_normal() - seen)
        integral, error = integral + 0.5 * 0.6 * dt * (r - seen + error), r - seen
        rows[:, k] = seen, 0.06 * error + integral
        for _ in range(fine):
            after = w + dt / fine / 1e-3 * (rows[1, k] - 2e-3 * w - 0.05 * np.sign(w or rows[1, k]))
            w = 0.0 if w * after < 0.0 else after
    return ga.Record(dt, command=command, velocity=rows[0], torque=rows[1])


def moved(effects: dict[str, dict[str, float]], profile: str, speed: float, torque_noise: float) -> ga.Record:
    """One mass in a loop that is not given, its torque measured with noise, as a share of its deviation."""
    plant = Plant(J=0.01, D=0.005, kp=0.5, ki=5.0, dt=2e-3)
    t = plant.dt * np.arange(6000)
    rng = np.random.default_rng(2)
    if profile == "sines":
        command = sum(
            np.sin(2.0 * np.pi * f * t + p) for f, p in zip(np.geomspace(0.1, 3.0, 8), rng.uniform(0.0, 6.28, 8), strict=True)
        )
        command *= speed / np.max(np.abs(command))
    else:
        levels = np.repeat(rng.uniform(-speed if profile == "ramps" else 0.0, speed, 20), 300)
        levels[:300] = 0.0 if profile == "one direction" else levels[:300]
        command = np.convolve(levels, np.full(100, 0.01), "same")
    log = run_drive(plant, command, effects, velocity_noise=0.02 * rng.standard_normal(len(t)))
    torque = log.torque + torque_noise * float(np.std(log.torque)) * rng.standard_normal(len(t))
    return ga.Record(plant.dt, velocity=log.velocity, torque=torque, torque_is="measured")


def hidden(effects: dict[str, dict[str, float]], noise: float = 0.02) -> ga.Record:
    """One mass under ramps between levels; noise: white, of the velocity [rad/s], which the controller does not read."""
    levels = np.repeat([0.0, 30.0, -20.0, 45.0, 10.0, -50.0, 25.0, -8.0], 250)
    command = np.zeros_like(levels)
    for i in range(1, len(levels)):
        command[i] = command[i - 1] + np.clip(levels[i] - command[i - 1], -1.5, 1.5)
    case = FineCase(DT, "sampled", command, motor=(5e-4, 2e-3), kp=STIFF.kp, ki=STIFF.ki, effects=effects)
    try:
        run = integrate([case], fine=100)
    except RuntimeError as missing:
        pytest.skip(str(missing))
    velocity = run.velocity[:, 0] + noise * np.random.default_rng(3).normal(size=len(command))
    return ga.Record(DT, command=command, velocity=velocity, torque=run.torque[:, 0])


CASES = {
    "torque_hum": {"amplitude": 0.02, "frequency": 43.7, "phase": 0.9},
    "position_inertia": {"amplitude": 0.25, "order": 2.0, "phase": -0.7},
    "velocity_observer": {"bandwidth": 600.0},
    "cogging": {"amplitude": 0.02, "order": 4.0, "phase": 0.4},
}


@pytest.mark.long
@pytest.mark.parametrize("effect", CASES)
def test_it_is_named_with_its_numbers(effect: str) -> None:
    found = ga.diagnose(hidden({effect: CASES[effect]}), STIFF)
    (cause,) = found.causes
    assert (cause.effect, cause.alternatives, found.verdict) == (effect, (), "explained"), found.summary()
    for name, value in CASES[effect].items():
        assert cause.parameters[name].value == pytest.approx(value, rel=0.05, abs=0.05 if name == "phase" else 0.0), name


def test_a_changing_inertia_is_of_the_mechanism_and_has_no_side() -> None:
    row = next(row for row in ga.effects.table() if row.name == "position_inertia")
    assert row.place == "mechanism" and row.sides == ()
    with pytest.raises(ga.GaidentError, match="no other side"):
        ga.OneMass(J=1e-3, D=0.0).model().with_effect("position_inertia", side="load", **CASES["position_inertia"])
    two = ga.TwoMass(JM=1e-4, DM=0.003, JL=5.8e-4, DL=0.008, KG=2.6).model()
    resonance = {"frequency": 900.0, "damping": 0.02, "zero_frequency": 800.0, "zero_damping": 0.02}
    with pytest.raises(ga.GaidentError, match="cannot be simulated together"):
        two.with_effect("position_inertia", **CASES["position_inertia"]).with_effect("extra_resonance", **resonance)


@pytest.mark.long
def test_a_clean_drive_has_none_of_them() -> None:
    assert ga.diagnose(hidden({}), STIFF).causes == ()


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "shape"),
    [
        ("quadratic_drag", ("coefficient", {})),
        ("unbalance", ("amplitude", {"phase": 0.7})),
        ("transport_delay", ("delay", {})),
        ("cogging", ("amplitude", {"order": 7.0, "phase": 0.7})),
    ],
)
def test_what_is_not_there_is_below_its_bound_and_what_is_far_above_it_is_found(
    effect: str, shape: tuple[str, dict[str, float]]
) -> None:
    command = np.repeat(np.random.default_rng(5).uniform(-40.0, 40.0, 20), 150)
    plant, name, others = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.9, dt=DT), *shape

    def found(seed: int, **hidden: dict[str, float]) -> ga.Diagnosis:
        effects = {"coulomb_friction": {"torque": 0.05}, **hidden}
        rec = rig(plant, command, effects, noise="white", seed=seed, position_logged=True)
        return ga.diagnose(rec, ga.PI(plant.kp, plant.ki))

    bound = found(1).not_there[effect]
    assert bound.parameter == name
    small, large = 0.2 * bound.at_most, 4.0 * bound.at_most
    hidden = found(2, **{effect: {name: small, **others}})
    assert [f.effect for f in hidden.causes] == ["coulomb_friction"]
    assert small < hidden.not_there[effect].at_most < 4.0 * bound.at_most
    there = found(3, **{effect: {name: large, **others}})
    named = [{f.effect, *f.alternatives} for f in there.causes]
    assert len(named) == 2 and effect in named[1] and effect not in there.not_there, (named, there.not_there)


def test_nothing_is_bounded_where_something_is_left() -> None:
    """What is left may hide an effect, or stand for it."""
    t = DT * np.arange(3000)
    command = 20.0 * np.sin(9.0 * t) + 10.0 * np.sin(23.0 * t)
    plant = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.9, dt=DT)
    rec = rig(plant, command, {"thermal_gain": {"share": 0.5, "time_constant": 1.0}}, noise="white", seed=4)
    dia = ga.diagnose(rec, ga.PI(plant.kp, plant.ki))
    assert dia.driver is not None and dia.not_there == {}
