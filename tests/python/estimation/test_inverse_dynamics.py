"""Inverse-dynamics regression: simulated axes come back, measured ones come to the published figures, wrong use is refused.

The records are simulated by the rig (drive_rig.py), which shares no code with the library.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from drive_rig import Plant, run_drive
from gaident.estimation.criterion import effective_samples
from gaident.estimation.regression.regression import covariance, solve
from measured import FILES, emps_record, folder

Vector = NDArray[np.float64]

PLANT = Plant(J=3e-3, D=0.02, kp=0.3, ki=6.0, dt=1e-3)


def command(n: int = 12_000, turns: float = 3.0) -> Vector:
    """Slow and fast sines: speeds of both signs, a travel of some turns."""
    t = PLANT.dt * np.arange(n)
    return np.asarray(turns * (6.0 * np.sin(2.0 * np.pi * 0.5 * t) + 4.0 * np.sin(2.0 * np.pi * 1.7 * t)))


def record(effects: dict[str, dict[str, float]], seed: int = 0, noise: float = 0.0, encoder: float = 1e-4) -> ga.Record:
    """A run with an encoder and, on the logged torque, noise of `noise` of its rms: a measured torque."""
    rng = np.random.default_rng(seed)
    log = run_drive(PLANT, command(), effects, encoder=encoder)
    torque = log.torque + noise * float(np.std(log.torque)) * rng.standard_normal(len(log.torque))
    position = encoder * np.round(log.position / encoder)
    return ga.Record(PLANT.dt, velocity=np.gradient(position, PLANT.dt), torque=torque, position=position, name=f"run {seed}")


def near(found: ga.InverseDynamics, name: str, truth: float, share: float = 0.03) -> None:
    assert found.parameters[name].value == pytest.approx(truth, rel=share), found.parameters


FRICTION = {"coulomb_friction": {"torque": 0.08}}
ASYMMETRIC = {
    "asymmetric_friction": {
        "torque_positive": 0.08,
        "torque_negative": 0.05,
        "viscous_positive": 0.01,
        "viscous_negative": 0.0,
    }
}


def test_inertia_and_friction_of_a_simulated_axis() -> None:
    found = ga.inverse_dynamics(record(FRICTION))
    assert found.terms == ("inertia", "viscous", "coulomb")
    near(found, "inertia", PLANT.J)
    near(found, "viscous", PLANT.D)
    near(found, "coulomb", 0.08)
    assert found.force_error < 0.03 and found.force_error_held_out < 0.03


def test_friction_by_direction_and_the_signs_of_its_parts() -> None:
    found = ga.inverse_dynamics(record(ASYMMETRIC))
    assert found.terms == ("inertia", "viscous_by_direction", "coulomb_by_direction")
    near(found, "coulomb_positive", 0.08)
    near(found, "coulomb_negative", 0.05)
    near(found, "viscous_positive", PLANT.D + 0.01)
    near(found, "viscous_negative", PLANT.D)


def test_a_drag_beside_dry_friction() -> None:
    """Dry friction is concave in the velocity and a drag convex: together they are nearly a line, and each alone pays little."""
    drag = {"quadratic_drag": {"coefficient": 8e-4}}
    found = ga.inverse_dynamics(record(FRICTION | drag))
    assert found.terms == ("inertia", "viscous", "coulomb", "drag")
    near(found, "coulomb", 0.08, 0.05)
    near(found, "drag", 8e-4, 0.05)
    near(found, "viscous", PLANT.D, 0.05)
    assert ga.inverse_dynamics(record(drag)).terms == ("inertia", "viscous", "drag")


def test_gravity_has_the_sign_and_phase_of_the_effect() -> None:
    found = ga.inverse_dynamics(record(FRICTION | {"unbalance": {"amplitude": 0.3, "phase": 0.7}}))
    assert found.terms == ("inertia", "viscous", "coulomb", "gravity")
    near(found, "gravity_amplitude", 0.3)
    assert found.parameters["gravity_phase"].value == pytest.approx(0.7, abs=0.02)


def test_a_constant_load_is_the_offset() -> None:
    found = ga.inverse_dynamics(record(FRICTION | {"load_torque": {"torque": 0.2}}))
    assert "offset" in found.terms
    near(found, "offset", 0.2)


def test_a_spring_to_ground_beats_gravity() -> None:
    t = 1e-3 * np.arange(8000)
    angle = 0.9 * np.sin(3.0 * t) + 0.3 * np.sin(11.0 * t)
    w, a = np.gradient(angle, 1e-3), np.gradient(np.gradient(angle, 1e-3), 1e-3)
    torque = 2e-3 * a + 0.01 * w + 0.05 * np.sign(w) + 0.4 * (angle - 0.2)
    noise = 1e-3 * np.random.default_rng(0).standard_normal(len(t))
    found = ga.inverse_dynamics(ga.Record(1e-3, velocity=w, position=angle, torque=torque + noise))
    assert "spring" in found.terms and "gravity" not in found.terms
    near(found, "spring", 0.4)
    near(found, "offset", -0.08)


@pytest.mark.parametrize("noise", [0.05, 0.1])
def test_noise_on_a_measured_torque_does_not_move_the_inertia(noise: float) -> None:
    inertias = [ga.inverse_dynamics(record(FRICTION, seed, noise)).parameters["inertia"] for seed in range(6)]
    assert np.mean([e.value for e in inertias]) == pytest.approx(PLANT.J, rel=0.01)


@pytest.mark.long
def test_deviations_are_those_of_the_scatter() -> None:
    found = [ga.inverse_dynamics(record(FRICTION, seed, 0.1), terms=("inertia", "viscous", "coulomb")) for seed in range(30)]
    for name in ("inertia", "viscous", "coulomb"):
        scatter = np.std([f.parameters[name].value for f in found], ddof=1)
        said = np.median([f.parameters[name].std for f in found])
        assert 0.6 < said / scatter < 2.5, name


def test_newey_west_and_the_effective_samples_see_the_colour() -> None:
    """AR(1) residuals with pole 0.9: n_eff = n (1 - 0.9)/(1 + 0.9), the deviation of a mean is sqrt(19) times larger."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(3)
    means, said, n_eff = [], [], []
    for _ in range(40):
        r = lfilter([1.0], [1.0, -0.9], rng.standard_normal(4000))
        X = np.ones((len(r), 1))
        theta, rank = solve(X, r)
        assert rank == 1
        means.append(theta[0])
        said.append(np.sqrt(covariance([X], [r - theta[0]])[0, 0]))
        n_eff.append(effective_samples(r - theta[0]))
    assert np.median(n_eff) == pytest.approx(4000 / 19, rel=0.25)
    assert np.median(said) == pytest.approx(np.std(means), rel=0.25)
    assert effective_samples(rng.standard_normal(4000)) > 3000


def test_columns_that_a_record_does_not_show_have_no_deviation() -> None:
    X = np.column_stack([np.ones(100), 2.0 * np.ones(100), np.arange(100.0)])
    r = np.random.default_rng(0).standard_normal(100)
    assert solve(X, r)[1] == 2
    assert np.isinf(np.diag(covariance([X], [r]))[:2]).all() and np.isfinite(covariance([X], [r])[2, 2])


def test_without_a_reversal_friction_and_load_stay_together() -> None:
    t = 1e-3 * np.arange(6000)
    w = 5.0 + 3.0 * np.sin(4.0 * t)
    torque = 2e-3 * np.gradient(w, 1e-3) + 0.01 * w + 0.3
    rec = ga.Record(1e-3, velocity=w, torque=torque)
    found = ga.inverse_dynamics(rec)
    assert "coulomb" not in found.terms
    near(found, "offset", 0.3)
    assert any("cannot be told apart" in text for text in found.not_tried)
    with pytest.raises(ga.errors.RecordError, match="cannot be told apart"):
        ga.inverse_dynamics(rec, terms=("inertia", "coulomb"))


def test_several_records_share_their_parameters_and_order_does_not_count() -> None:
    records = [record(FRICTION, seed, 0.05) for seed in range(3)]
    one, other = ga.inverse_dynamics(records), ga.inverse_dynamics(records[::-1])
    assert one.samples > 2.9 * ga.inverse_dynamics(records[0]).samples
    for name, e in one.parameters.items():
        assert e.value == pytest.approx(other.parameters[name].value, rel=1e-9)


def test_the_torque_of_a_motion_and_a_validation_record() -> None:
    rec, other = record(FRICTION, 0), record(FRICTION, 1, 0.05)
    found = ga.inverse_dynamics(rec, validation=other)
    assert found.held_out == "validation records"
    assert found.force_error_held_out == found.error(other) < 0.06
    torque = found.torque(rec)
    assert torque.shape == rec.velocity.shape and rec.torque is not None
    assert np.linalg.norm(torque - rec.torque) < 0.15 * np.linalg.norm(rec.torque)  # with the samples at reversals
    with pytest.raises(ga.errors.RecordError, match="one that is fitted"):
        ga.inverse_dynamics(rec, validation=rec)


def test_the_summary_says_what_was_found_and_how() -> None:
    text = ga.inverse_dynamics(record(FRICTION)).summary()
    assert "Inverse-dynamics regression" in text and "inertia" in text and "kg m^2" in text
    assert "Butterworth filter of order 4" in text and "standstill" in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"cutoff_hz": 600.0}, "half the sample rate"),
        ({"cutoff_hz": "100"}, "is no number"),
        ({"order": 0}, "order=0"),
        ({"decimation": 0}, "decimation=0"),
        ({"standstill": -1.0}, "standstill=-1.0"),
        ({"terms": ("inertia", "wind")}, "terms="),
        ({"terms": ("offset", "coulomb_by_direction")}, "the same columns"),
        ({"axis": "round"}, "axis is 'round'"),
    ],
)
def test_settings_are_checked(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ga.errors.SettingsError, match=message):
        ga.inverse_dynamics(record(FRICTION), **arguments)


def test_records_are_checked() -> None:
    rec = record(FRICTION)
    w = rec.velocity
    with pytest.raises(ga.errors.RecordError, match="has no torque"):
        ga.inverse_dynamics(ga.Record(1e-3, command=w, velocity=w))
    with pytest.raises(ga.errors.RecordError, match="one sample time"):
        ga.inverse_dynamics([rec, rec.decimate(2)])
    with pytest.raises(ga.errors.RecordError, match="give a Record"):
        ga.inverse_dynamics([])
    with pytest.raises(ga.errors.RecordError, match="are left in motion"):
        ga.inverse_dynamics(ga.Record(1e-3, velocity=np.zeros(5000), torque=np.ones(5000)))
    with pytest.raises(ga.errors.SettingsError, match="too slow for the filter"):
        ga.inverse_dynamics(rec).torque(rec.decimate(10))


# Measured axes


def published_emps(data_dir: object, terms: tuple[str, ...]) -> tuple[ga.InverseDynamics, float]:
    """The publication takes the torque at its lines, as that of a measured one is taken."""
    given = (emps_record(folder(data_dir, "emps") / f) for f in FILES)  # type: ignore[arg-type]
    training, other = (rec.with_channels(torque_is="measured") for rec in given)
    found = ga.inverse_dynamics(training, terms=terms, standstill=0.0, axis="linear")
    assert (found.cutoff_hz, found.order, found.decimation) == (100.0, 4, 10)  # chosen, and as published
    return found, found.error(other)


def test_emps_comes_to_the_published_parameters(data_dir: object) -> None:
    """Janot, Gautier, Brunot 2019: M 95.1089, Fv 203.5034, Fc 20.3935, offset -3.1648; 4.0834 % and 5.9824 %."""
    found, pulses = published_emps(data_dir, ("inertia", "viscous", "coulomb", "offset"))
    p = {name: e.value for name, e in found.parameters.items()}
    assert p["inertia"] == pytest.approx(95.109, abs=0.1)
    assert p["viscous"] == pytest.approx(203.5, abs=0.6)
    assert p["coulomb"] == pytest.approx(20.39, abs=0.06)
    assert p["offset"] == pytest.approx(-3.165, abs=0.03)
    assert found.force_error == pytest.approx(0.0408, abs=0.001) and pulses == pytest.approx(0.0598, abs=0.001)
    assert found.parameters["viscous"].unit == "N s/m" and "mass" in found.summary()


def test_emps_comes_to_the_published_parameters_by_direction(data_dir: object) -> None:
    """Published: M 95.1540, Fv+ 166.7061, Fc+ 20.1440, Fv- 240.4236, Fc- 20.6277; 3.1117 %."""
    found, _ = published_emps(data_dir, ("inertia", "viscous_by_direction", "coulomb_by_direction"))
    values = [e.value for e in found.parameters.values()]
    assert values == pytest.approx([95.154, 166.71, 240.42, 20.144, 20.628], rel=2e-3)
    assert found.force_error == pytest.approx(0.0311, abs=0.001)


def test_emps_by_the_rules_of_the_regression(data_dir: object) -> None:
    """A commanded force is held over each sample: so taken, the regression leaves less of it than where its lines are taken."""
    for file, share, most in ((FILES[0], 0.9, 0.026), (FILES[1], 0.65, 0.029)):
        rec = emps_record(folder(data_dir, "emps") / file)  # type: ignore[arg-type]
        found = ga.inverse_dynamics(rec, axis="linear")
        assert found.terms == ("inertia", "viscous_by_direction", "coulomb_by_direction")
        at_lines = ga.inverse_dynamics(rec.with_channels(torque_is="measured"), axis="linear")
        assert found.force_error_held_out < share * at_lines.force_error_held_out and found.force_error_held_out < most
        if file == FILES[0]:
            values = [e.value for e in found.parameters.values()]
            assert values == pytest.approx([95.154, 166.71, 240.42, 20.144, 20.628], rel=0.03)
            assert found.force_error < 0.026


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_commanded_torque_is_held_and_so_is_the_inertia_right(friction: float) -> None:
    """Taken at its lines a held torque leads the motion by half a sample: J is too large by B dt/2, here 0.25 %."""
    dt, steps, J, B = 1e-3, 40, 2e-3, 0.01
    torque = np.repeat(1.5 * np.random.default_rng(0).uniform(-1.0, 1.0, 40), 200)
    speed, rows = 0.0, []
    for u in torque:
        rows.append(speed)
        for _ in range(steps):
            drive = u - B * speed
            if speed == 0.0 and abs(drive) <= friction:
                continue
            way = np.sign(speed) if speed else np.sign(drive)
            after = speed + dt / steps / J * (drive - friction * way)
            speed = 0.0 if speed * after < 0.0 else after
    velocity = np.array(rows) + 1e-3 * np.random.default_rng(1).standard_normal(len(rows))
    found = ga.inverse_dynamics(ga.Record(dt, velocity=velocity, torque=torque)).parameters
    assert found["inertia"].value == pytest.approx(J, rel=7e-4) and found["viscous"].value == pytest.approx(B, rel=7e-4)
    assert ("coulomb" in found) is (friction > 0.0)
    at_lines = ga.inverse_dynamics(ga.Record(dt, velocity=velocity, torque=torque, torque_is="measured")).parameters["inertia"]
    assert at_lines.value == pytest.approx(J + 0.5 * B * dt, rel=2e-3)


# Joint -> gain [N m/A], and what another least squares gave: inertia, viscous, Coulomb, gravity (README of the recorded data).
JOINTS = {1: (10.0, 5.5, 22.1, 13.5, 0.0), 2: (10.6956, 17.0, 20.2, 14.7, 113.0), 6: (10.1232, 0.43, 3.34, 2.40, 0.0)}


@pytest.mark.parametrize("joint", JOINTS)
def test_robot_joints(data_dir: object, joint: int) -> None:
    gain, inertia, viscous, coulomb, gravity = JOINTS[joint]
    path = folder(data_dir, "robot_joints") / f"joint_{joint}.csv"  # type: ignore[arg-type]
    columns = {"time": "time", "position": "position", "velocity": "velocity", "torque": "current"}
    found = ga.inverse_dynamics(ga.read(path, columns, {"torque": gain}, resample=0.01, torque_is="measured"))
    p = {name: e.value for name, e in found.parameters.items()}
    assert p["inertia"] == pytest.approx(inertia, rel=0.08)
    near_viscous = p.get("viscous", 0.5 * (p.get("viscous_positive", 0.0) + p.get("viscous_negative", 0.0)))
    near_coulomb = p.get("coulomb", 0.5 * (p.get("coulomb_positive", 0.0) + p.get("coulomb_negative", 0.0)))
    assert near_viscous == pytest.approx(viscous, rel=0.12) and near_coulomb == pytest.approx(coulomb, rel=0.05)
    assert ("gravity" in found.terms) == (gravity > 0.0)
    if gravity:
        assert p["gravity_amplitude"] == pytest.approx(gravity, rel=0.03)
    assert found.force_error_held_out < 0.07


@pytest.mark.parametrize("channel", [4, 5], ids=["commanded", "measured"])
def test_hsm150_in_both_directions(data_dir: object, channel: int) -> None:
    """Catalogue J 1.2e-4; dry friction with the measured torque 0.041 and 0.027 N m."""
    from scipy.io import loadmat

    records = []
    for path in sorted(folder(data_dir, "hsm150").glob("*.mat")):  # type: ignore[arg-type]
        log = loadmat(path)["data"].T
        records.append(ga.Record(1e-3, velocity=log[3], torque=log[channel], position=log[2], name=path.stem))
    found = ga.inverse_dynamics(records, terms=("inertia", "viscous", "coulomb_by_direction"))
    p = {name: e.value for name, e in found.parameters.items()}
    assert 0.85e-4 < p["inertia"] < 1.41e-4 and 6.2e-5 < p["viscous"] < 1.1e-4
    if channel == 5:
        assert p["coulomb_positive"] == pytest.approx(0.041, abs=0.002)
        assert p["coulomb_negative"] == pytest.approx(0.027, abs=0.002)
    by_criterion = ga.inverse_dynamics(records)
    assert {"coulomb", "offset"} <= set(by_criterion.terms) or "coulomb_by_direction" in by_criterion.terms
    assert "spring" not in by_criterion.terms and "gravity" not in by_criterion.terms


def test_a_saved_regression_comes_back_as_it_was() -> None:
    t = 1e-3 * np.arange(4000)
    motion = {"position": 1.0 - np.cos(5.0 * t), "velocity": 5.0 * np.sin(5.0 * t)}
    rec = ga.Record(1e-3, torque=2e-3 * 25.0 * np.cos(5.0 * t) + 0.1 * np.sign(motion["velocity"]), **motion)
    found = ga.inverse_dynamics(rec)
    back = ga.InverseDynamics.from_dict(json.loads(json.dumps(found.to_dict())))
    assert back.to_dict() == found.to_dict()
    assert back.parameters == found.parameters and back.rivals == found.rivals
    np.testing.assert_array_equal(back.torque(rec), found.torque(rec))
    with pytest.raises(ga.GaidentError, match="damaged"):
        ga.InverseDynamics.from_dict({"terms": 1})


@pytest.mark.parametrize("gravity", [0.5, 5.0])
def test_gravity_on_one_sine_is_found_where_it_bends(gravity: float) -> None:
    """Acceleration and angle go together, but a sine of the angle is no line, and with little noise both are known."""
    t, rng = 0.002 * np.arange(6000), np.random.default_rng(2)
    angle, w, a = 0.6 * np.sin(3.0 * t), 1.8 * np.cos(3.0 * t), -5.4 * np.sin(3.0 * t)
    torque = 0.5 * a + 0.3 * w + 0.5 * np.sign(w) + gravity * np.sin(angle) + 0.02 * rng.standard_normal(len(t))
    found = ga.inverse_dynamics(ga.Record(0.002, velocity=w, position=angle, torque=torque))
    assert "gravity" in found.terms
    inertia, amplitude = found.parameters["inertia"], found.parameters["gravity_amplitude"]
    assert abs(inertia.value - 0.5) < 3.0 * inertia.std < 0.05 and abs(amplitude.value - gravity) < 3.0 * amplitude.std
