"""Diagnoses of measured drives; skipped where the recorded data are not at hand (`data_dir` in conftest.py).

Sources of the records, and what is published about them: docs/diagnosis.md, real drives.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.diagnosis.gains import start_state
from gaident.models.drive_torque import as_old_as_its_velocity
from measured import EMPS_GAIN, FILES, emps_record, folder
from places import ROOT

Vector = NDArray[np.float64]


@pytest.fixture(scope="module")
def emps(data_dir: Path) -> ga.Diagnosis:
    training, other = (emps_record(folder(data_dir, "emps") / f) for f in FILES)
    return ga.diagnose(training, validation=other, axis="linear")


def filtered(path: Path) -> tuple[Vector, Vector, Vector]:
    """(velocity, acceleration, force) as inverse identification takes them: 100 Hz both ways, central differences."""
    from scipy.signal import butter, filtfilt

    rec = emps_record(path)
    assert rec.torque is not None and rec.position is not None
    b, a = butter(4, 100.0 * 2.0 * rec.dt)
    q, force = filtfilt(b, a, rec.position), filtfilt(b, a, rec.torque)
    v = np.gradient(q, rec.dt)
    kept = slice(50, -50)
    return v[kept], np.gradient(v, rec.dt)[kept], force[kept]


def decimated(x: Vector) -> Vector:
    from scipy.signal import decimate

    return np.asarray(decimate(x, 10))


def relative(model: Vector, force: Vector) -> float:
    """Error of a force [%]."""
    y = decimated(force)
    return float(100.0 * np.linalg.norm(decimated(model) - y) / np.linalg.norm(y))


def emps_force(dia: ga.Diagnosis, v: Vector, a: Vector) -> Vector:
    """The force that the diagnosed model needs for a motion."""
    (cause,) = dia.causes
    p = {name: e.value for name, e in cause.parameters.items()}
    mass = 1.0 / dia.model.gain
    viscous = -dia.model.poles[0].real * mass
    positive = p["torque_positive"] + p["viscous_positive"] * v
    negative = -p["torque_negative"] + p["viscous_negative"] * v
    return np.asarray(mass * a + viscous * v + np.where(v > 0.0, positive, np.where(v < 0.0, negative, 0.0)))


@pytest.mark.long
def test_emps_dry_and_direction_dependent_friction_are_the_cause(emps: ga.Diagnosis) -> None:
    (cause,) = emps.causes
    assert cause.effect == "asymmetric_friction" and cause.named
    p = {name: e.value for name, e in cause.parameters.items()}
    assert 19.0 < p["torque_positive"] < 22.0 and 19.0 < p["torque_negative"] < 22.0  # published 20.1 and 20.6 N
    assert p["viscous_positive"] == 0.0 and 60.0 < p["viscous_negative"] < 90.0  # published 166.7 and 240.4 N s/m
    assert emps.model.p == 1 and emps.model.q == 0 and 93.0 < 1.0 / emps.model.gain < 97.0
    before, after = emps.base_shift["pole"]
    assert after < 0.6 * before  # the linear model took dry friction for viscous friction


def test_emps_a_remainder_is_said_and_does_not_take_the_name_away(emps: ga.Diagnosis) -> None:
    assert emps.verdict == "partly explained" and emps.driver == "position"
    assert emps.left["position"] < emps.left_needed
    assert "No single signal explains what is left; what comes closest depends on the position." in " ".join(
        emps.summary("linear").split()
    )


def test_emps_the_published_offset_is_mostly_the_asymmetry(emps: ga.Diagnosis) -> None:
    (cause,) = emps.causes
    assert "offset is mostly viscous friction that depends on the direction" in cause.evidence
    left = 0.5 * (cause.parameters["torque_positive"].value - cause.parameters["torque_negative"].value)
    assert abs(left) < 0.1 * 3.1648  # N, of the published offset


@pytest.mark.parametrize(("file", "most"), list(zip(FILES, (3.7, 5.4), strict=True)))
def test_emps_force_error_of_the_free_run_fit(emps: ga.Diagnosis, data_dir: Path, file: str, most: float) -> None:
    v, a, force = filtered(folder(data_dir, "emps") / file)
    assert relative(emps_force(emps, v, a), force) < most


def test_emps_force_error_of_the_same_structure_by_inverse_least_squares(emps: ga.Diagnosis, data_dir: Path) -> None:
    """Published for this structure: 3.11 %; for even friction with an offset 4.08 and 5.98 %."""
    assert [f.effect for f in emps.causes] == ["asymmetric_friction"]

    def columns(v: Vector, a: Vector) -> tuple[Vector, ...]:
        forward, backward = v > 0.0, v < 0.0
        return (a, v * forward, v * backward, 1.0 * forward, -1.0 * backward)

    v, a, force = filtered(folder(data_dir, "emps") / FILES[0])
    A = np.column_stack([decimated(c) for c in columns(v, a)])
    theta = np.linalg.lstsq(A, decimated(force), rcond=None)[0]
    for file, most in zip(FILES, (3.1, 5.4), strict=True):
        v, a, force = filtered(folder(data_dir, "emps") / file)
        model = np.column_stack(columns(v, a)) @ theta
        assert relative(model, force) < most, file
    assert 93.0 < theta[0] < 97.0


def test_emps_nothing_is_accepted_that_makes_the_other_record_worse(emps: ga.Diagnosis, data_dir: Path) -> None:
    assert emps.held_out == "validation records" and emps.gain_interval[0] > 0.5
    # Its velocity is the difference of its positions: half a sample old, so that the force that drives it is late by that.
    other = as_old_as_its_velocity(emps.as_used(emps_record(folder(data_dir, "emps") / FILES[1])), 1)
    start = start_state(emps.model, other, None)  # its first velocity is not that of rest
    whole = float(np.sqrt(np.mean((other.velocity - ga.simulate(emps.model, other, initial_state=start)) ** 2)))
    assert whole == pytest.approx(emps.after.rmse, rel=1e-9) and whole < 0.4 * emps.before.rmse
    # Position-periodic torque gains on the training record alone (2 periods per 5 mm), and is not in the model.
    assert [e.name for e in emps.model.effects] == ["asymmetric_friction"]


def test_emps_is_searched_in_bounded_work(emps: ga.Diagnosis) -> None:
    assert emps.samples == 24841 and emps.simulations < 45_000  # 8 s of one core; on all samples throughout it were 60


@pytest.mark.long
def test_emps_following_error_with_the_tables(emps: ga.Diagnosis, data_dir: Path) -> None:
    """The loop of EMPS, its own gains from the file, simulated on its command; the page has the figures."""
    from scipy.io import loadmat

    path = folder(data_dir, "emps") / FILES[0]
    file = loadmat(path)
    kp, kv, gain = (float(file[name].item()) for name in ("kp", "kv", "gtau"))
    measured = emps_record(path)
    position, asked = measured.position, file["qg"].ravel()
    assert gain == EMPS_GAIN and position is not None and measured.torque is not None
    # The law, without a model: u = kv (kp (q* - q) - w), w the difference of the angle over two lines.
    velocity = (position[2:] - position[:-2]) / (2.0 * measured.dt)
    left = gain * kv * (kp * (asked - position)[2:] - velocity) - measured.torque[2:]
    assert np.std(left) < 0.0025 * np.std(measured.torque)  # the steps of the log, 0.13 N
    # (1 + z^-1)/2 behind a difference over one line is a notch at half the sampling frequency.
    edge = 0.499 / measured.dt
    mean = ga.Notch(edge, 0.0, 0.5 * np.tan(np.pi * edge * measured.dt))
    loop = ga.Cascade(ga.PI(kp=kv * gain, ki=0.0), position=ga.P(kp), velocity_filters=(mean,))
    rest = 2662  # the first standstill: the log begins in motion, the simulation does not
    rec = measured.with_channels(position_command=asked)[rest:]
    found = ga.feedforward(emps, rec=rec, controller=loop).following
    assert found is not None and found.measured is not None and found.with_velocity is not None
    assert found.before.rms == pytest.approx(found.measured.rms, rel=2e-3)
    assert found.before.largest == pytest.approx(found.measured.largest, rel=5e-3)
    assert not [name for name, value in found.to_dict().items() if value is None]
    page = (ROOT / "docs/how-to/feedforward.md").read_text(encoding="utf-8")
    for name, one, fall in found.loops:
        less = "" if fall is None else f"{100.0 * fall:.0f} %"
        row = f"| {name} | {1e6 * one.rms:.4g} | {less} | {1e6 * one.largest:.4g} | {one.torque:.3g} |"
        print(row)
        assert row in page, row


@pytest.mark.long
def test_hsm150_inertia_dry_friction_and_the_encoder(data_dir: Path) -> None:
    """Commanded torque, one direction: dry friction is found, and what it cannot be told from is said with it."""
    from scipy.io import loadmat

    records = []
    for name in ("idf_pos_0.06_1", "idf_pos_0.065_1"):
        _, _, angle, velocity, torque, *_ = loadmat(folder(data_dir, "hsm150") / f"{name}.mat")["data"].T
        records.append(ga.Record(1e-3, velocity=velocity, torque=torque, position=angle, name=name))
    dia = ga.diagnose(records)
    friction = dia.causes[0]
    assert friction.effect == "coulomb_friction" and "load_torque" in friction.alternatives
    assert 0.025 < friction.parameters["torque"].value < 0.05  # of 0.06 N m that keep it turning, damping takes the rest
    assert 1.1e-4 < 1.0 / dia.model.gain < 1.3e-4  # catalogue 1.2e-4 kg m^2; the linear fit has 2.6e-4
    (step,) = [f for f in dia.findings if f.effect == "velocity_quantisation"]
    assert step.is_noise and step.parameters["step"].value == pytest.approx(2.0 * np.pi / 10_000 / 1e-3, rel=1e-3)
    assert "asymmetric_friction" in dia.not_testable


@pytest.mark.long
def test_rack_and_pinion_friction_and_load_are_not_separable(data_dir: Path) -> None:
    """The speed never changes its sign."""
    path = folder(data_dir, "rack_pinion") / "a3MR.csv"
    log = np.genfromtxt(path, delimiter=",", skip_header=5, usecols=(0, 1, 2), encoding="latin1")
    log = log[np.isfinite(log).all(axis=1)]
    rec = ga.Record(log[1, 0] * 1e-3, velocity=log[:, 1] * np.pi / 30.0, torque=log[:, 2] / 100.0)
    dia = ga.diagnose(rec)
    together = {"coulomb_friction", "load_torque"}
    assert any(together <= {f.effect, *f.alternatives} for f in dia.causes)
    assert not together & {f.effect for f in dia.causes if f.named}


@pytest.mark.parametrize("record", ["11", "12"])
def test_coupled_drives_say_what_the_sensor_prevents(data_dir: Path, record: str) -> None:
    """The pulse counter shows the speed without its sign."""
    from scipy.io import loadmat

    data = loadmat(folder(data_dir, "ced") / "DATAUNIF.MAT")
    rec = ga.Record(0.02, velocity=data[f"z{record}"].ravel(), torque=data[f"u{record}"].ravel())
    dia = ga.diagnose(rec)
    assert dia.causes == () and dia.verdict == "unexplained"
    assert "speed without its sign" in dia.not_testable["coulomb_friction"]
    assert "the sensor shows the speed without its sign" in " ".join(dia.summary().split())
