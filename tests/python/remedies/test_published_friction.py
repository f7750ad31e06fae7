"""The friction that others published of logs slower than their loops, and what the map of held speeds has (GAIDENT_DATA).

Every figure of docs/how-to/friction-map.md, "On measured axes", is asserted here.
"""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from gaident.data.readers import read_columns
from places import ROOT

pytestmark = pytest.mark.long

RPM = np.pi / 30.0
RATED = 9.84e-3  # N m
PAGE = (ROOT / "docs/how-to/friction-map.md").read_text(encoding="utf-8")

Vector = NDArray[np.float64]

# Coulomb [N m] and viscous friction [N m s/rad]: as published, and a straight line through the held speeds.
MOTORS = {
    1: ((0.3101, 0.0867), (0.530, 0.033)),
    2: ((0.3042, 0.0453), (0.435, 0.014)),
    3: ((0.4520, 0.1088), (0.460, 0.111)),
    4: ((0.4908, 0.1092), (0.486, 0.109)),
}


@lru_cache(maxsize=12)
def actuator(folder: Path, motor: int, run: int) -> ga.Record:
    columns = {
        "time": "time",
        "velocity": "velocity",
        "torque": "torque_feedback",
        "command": "velocity_cmd",
        "position": "position",
    }
    path = folder / "joint_actuators" / f"motor_{motor:02d}_run_{run:02d}.npz"
    return ga.read(path, columns, resample=0.0208, torque_is="measured")


def up_to_6(rec: ga.Record) -> list[ga.Record]:
    """The parts of a record whose command is at most 6 rad/s, as the published regression has them."""
    assert rec.command is not None
    inside = np.concatenate([[0], (np.abs(rec.command) < 6.01).astype(int), [0]])
    ends = np.flatnonzero(np.diff(inside))
    return [rec[a:b] for a, b in zip(ends[::2], ends[1::2], strict=True) if b - a >= 20]


@lru_cache(maxsize=4)
def of_motor(folder: Path, motor: int) -> ga.remedies.FrictionMap:
    return ga.friction_map([part for run in (1, 2, 3) for part in up_to_6(actuator(folder, motor, run))])


def straight(w: Vector, torque: Vector) -> tuple[Vector, Vector]:
    """(dry friction, viscous friction, load) by plain least squares, and their deviations."""
    rows = np.column_stack([np.sign(w), w, np.ones_like(w)])
    found = np.linalg.lstsq(rows, torque, rcond=None)[0]
    variance = np.sum((torque - rows @ found) ** 2) / (len(w) - 3)
    return found, np.sqrt(variance * np.diag(np.linalg.inv(rows.T @ rows)))


def published_rows(folder: Path, motor: int, run: int) -> tuple[Vector, Vector]:
    """Velocity and torque of the published regression: the late half of each hold at a command of 0.5 to 6 rad/s."""
    log = np.load(folder / "joint_actuators" / f"motor_{motor:02d}_run_{run:02d}.npz")
    late = np.zeros(len(log["time"]), dtype=bool)
    for phase in np.unique(log["phase_name"]):
        if phase.startswith("speed_hold_train_"):
            lines = np.flatnonzero(log["phase_name"] == phase)
            late[lines[len(lines) // 2 :]] = True
    return log["velocity"][late], log["torque_feedback"][late]


@pytest.mark.parametrize("motor", MOTORS)
def test_actuators_have_the_published_friction_or_the_reason_why_not(motor: int, data_dir: Path) -> None:
    published, expected = MOTORS[motor]
    rows = [published_rows(data_dir, motor, run) for run in (1, 2, 3)]
    all_rows = np.mean([straight(*one)[0][:2] for one in rows], axis=0)
    assert all_rows == pytest.approx(published, abs=1e-4), "their rows give their numbers"
    moving = np.mean([straight(w[np.abs(w) > 0.1], u[np.abs(w) > 0.1])[0][:2] for w, u in rows], axis=0)
    stuck = sum(float(np.mean(np.abs(w) < 0.1)) for w, _ in rows) / 3
    assert (stuck > 0.15) == (motor in (1, 2)), "motors 1 and 2 stand in some of them"
    plateaus = of_motor(data_dir, motor).plateaus
    w, torque = (np.array([getattr(p, name) for p in plateaus]) for name in ("velocity", "torque"))
    found, std = straight(w, torque)
    assert found[0] == pytest.approx(expected[0], abs=1e-3) and found[1] == pytest.approx(expected[1], abs=1e-3)
    assert f"{expected[0]:.3f} +- {std[0]:.3f}, {expected[1]:.3f} +- {std[1]:.3f} |" in PAGE
    assert np.all(np.abs(w) > 0.1), "no stuck axis is in the map"
    if motor in (1, 2):
        assert moving == pytest.approx({1: (0.522, 0.034), 2: (0.440, 0.012)}[motor], abs=1e-3)
        assert np.all(np.abs(moving - found[:2]) < 3.0 * std[:2]) and abs(found[0] - published[0]) > 10.0 * std[0]
    else:
        assert found[:2] == pytest.approx(published, rel=0.03)


def test_what_a_stuck_axis_shows(data_dir: Path) -> None:
    w, torque = published_rows(data_dir, 1, 1)
    still = np.abs(w) < 0.1
    assert np.median(w[still]) == pytest.approx(-0.011, abs=1e-3), "half of the sensor's step of 0.022"
    assert np.mean(torque[still & (torque > 0.0)]) == pytest.approx(0.46, abs=0.01)
    assert np.min(torque[still]) == pytest.approx(-1.02, abs=0.04)


def test_the_law_of_each_actuator(data_dir: Path) -> None:
    laws = {motor: (of_motor(data_dir, motor).law, *of_motor(data_dir, motor).rivals) for motor in MOTORS}
    names = {motor: [set(law.effects) for law in found if law is not None] for motor, found in laws.items()}
    dry, load, drag = "coulomb_friction", "load_torque", "square_root_drag"
    assert names[1] == [{dry, load}, {"asymmetric_friction"}, {dry, drag}, {dry}]
    assert names[2] == [{dry, load}, {"asymmetric_friction"}]
    assert names[3] == [{dry, drag}] and names[4] == [{dry, drag}, {dry}]
    expected = {1: (0.529, 0.033, -0.012), 2: (0.432, 0.016, -0.011)}
    for motor in (1, 2):
        law = laws[motor][0]
        assert law is not None
        numbers = (law.effects[dry]["torque"].value, law.viscous.value, law.effects[load]["torque"].value)
        assert numbers == pytest.approx(expected[motor], abs=1e-3)
    for motor, level, coefficient, missed in ((3, 0.270, 0.327, (0.054, 0.028)), (4, 0.300, 0.324, (0.059, 0.037))):
        law = laws[motor][0]
        assert law is not None and law.viscous.at_bound
        assert law.effects[dry]["torque"].value == pytest.approx(level, abs=1e-3)
        assert law.effects[drag]["coefficient"].value == pytest.approx(coefficient, abs=1e-3)
        plateaus = of_motor(data_dir, motor).plateaus
        w, torque = (np.array([getattr(p, name) for p in plateaus]) for name in ("velocity", "torque"))
        line = np.column_stack([np.sign(w), w, np.ones_like(w)]) @ straight(w, torque)[0]
        left = [
            float(np.sqrt(np.sum((torque - line) ** 2) / (len(w) - 3))),
            float(np.sqrt(np.mean((torque - law.torque(w)) ** 2))),
        ]
        assert left == pytest.approx(missed, abs=1e-3)


def test_temperature_explains_nothing_of_the_actuators(data_dir: Path) -> None:
    for motor in MOTORS:
        records = [actuator(data_dir, motor, run) for run in (1, 2, 3)]
        heat = []
        for run, rec in zip((1, 2, 3), records, strict=True):
            path = data_dir / "joint_actuators" / f"motor_{motor:02d}_run_{run:02d}.npz"
            known = read_columns(path)["mos_temperature"]
            assert known.min() >= 31.0 and known.max() <= 34.0
            heat.append(np.interp(np.linspace(0.0, 1.0, len(rec)), np.linspace(0.0, 1.0, len(known)), known))
        slope = ga.friction_map(records, temperature=heat).temperature_slope
        assert slope is not None and abs(slope.value) < 3.0 * slope.std, motor


# Drive: (dry friction, load, more at rest) [N m] and viscous friction [N m s/rad], published; what the map has.
SCREWS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {
    1: ((2.46e-3, 0.34e-3, 0.54e-3, 30e-6), (2.59e-3, 0.36e-3, 0.49e-3, 44e-6)),
    2: ((4.91e-3, 0.31e-3, 0.0, 30e-6), (4.88e-3, 0.0, 0.0, 15e-6)),
    3: ((1.42e-3, 0.49e-3, 0.40e-3, 11.5e-6), (1.36e-3, 0.45e-3, 0.38e-3, 14.3e-6)),
}


def screw_logs(folder: Path, drive: int) -> list[ga.Record]:
    """The steady speeds. A cell "-800,,was -11.1", with a remark of the authors, has the number that was logged behind it."""
    found = []
    for path in sorted((folder / "epos_screws" / "experiments" / f"driveNo{drive}" / "steady_state").rglob("*.csv")):
        lines = [line.split(";") for line in path.read_text(encoding="latin1").splitlines() if re.match(r"-?[\d.]+;", line)]
        cells = [[float(re.sub(r".*was\s*", "", cell).strip(",") or "nan") for cell in line[:3]] for line in lines]
        time, speed, torque = np.array(cells).T
        dt = round(float(np.median(np.diff(time))) * 1e-3, 6)
        found.append(ga.Record(dt, velocity=speed * RPM, torque=torque / 100.0 * RATED, torque_is="measured", name=path.stem))
    return found


@lru_cache(maxsize=3)
def of_screw(folder: Path, drive: int) -> ga.remedies.FrictionMap:
    return ga.friction_map(screw_logs(folder, drive))


def published_torque(drive: int, w: Vector, fall: bool = True) -> Vector:
    """The published model at held speeds, its own sign of both turned.

    T = -g tan(lambda -+ rho) F + (Tb + g tan(lambda -+ rho) Fb) sign(w) + b w + g P (tan(lambda +- rho) - tan(lambda -+ rho)),
    tan(rho) = mu(w)/cos(theta), mu = mu_0 + mu_1 exp(-2 |w|/v), upper sign forwards.
    """
    lead_angle = np.radians(2.8625) if drive == 3 else np.arctan(0.002 / np.pi / 0.012)
    reach = 1.0 / 60.0 / np.tan(lead_angle) if drive == 3 else 0.0055  # m, of the worm its diameter over the wheel's
    thread = np.arctan(np.tan(np.radians(20.0 if drive == 3 else 15.0)) * np.cos(lead_angle))
    force = 9.812 * 0.096 * (0.02 if drive == 3 else 1.0)  # N, of the worm gear N m
    bearing, viscous, output, mu, more, speed, spring = {
        1: (1e-3, 3e-5, 3e-2, 0.27, 0.1, 6.4, 0.0),
        2: (2e-3, 3e-5, 2e-2, 0.20, 0.0, 1.0, 0.8),
        3: (5.5e-4, 1.15e-5, 4e-3, 0.12, 0.06, 0.688, 0.0),
    }[drive]
    v = -w
    rho = np.arctan((mu + (more * np.exp(-2.0 * np.abs(v) / speed) if fall else 0.0)) / np.cos(thread))
    along, against = np.tan(lead_angle - np.sign(v) * rho), np.tan(lead_angle + np.sign(v) * rho)
    pressed = reach * spring * (against - along)
    return np.asarray(reach * along * force - (bearing + reach * along * output) * np.sign(v) - viscous * v - pressed)


@pytest.mark.parametrize("drive", SCREWS)
def test_screw_drives_have_the_published_friction_within_what_is_told(drive: int, data_dir: Path) -> None:
    published, expected = SCREWS[drive]
    rest = np.array([1e-9, -1e-9])
    (up, down), (up_fall, down_fall) = published_torque(drive, rest, False), published_torque(drive, rest)
    level, load = 0.5 * (up - down), 0.5 * (up + down)
    made = (level, load, 0.5 * (up_fall - down_fall) - level)
    assert made == pytest.approx(published[:3], abs=0.006e-3), "what the published parameters make at the motor"
    found = of_screw(data_dir, drive)
    laws = [law for law in (found.law, *found.rivals) if law is not None and "quadratic_drag" not in law.effects]
    law = laws[0]
    name = "coulomb_friction" if drive == 2 else "stribeck_friction"
    dry = law.effects[name]
    own = (
        dry["torque"].value,
        law.effects["load_torque"]["torque"].value if drive != 2 else 0.0,
        dry["static_torque"].value - dry["torque"].value if drive != 2 else 0.0,
    )
    assert own == pytest.approx(expected[:3], abs=0.006e-3) and law.viscous.value == pytest.approx(expected[3], abs=0.6e-6)
    assert abs(law.effects[name]["torque"].value - published[0]) < 0.06 * published[0]
    if drive != 2:
        assert dry["stribeck_velocity"].value == pytest.approx({1: 3.6, 3: 0.33}[drive], abs=0.06)
    assert (found.law is law) == (drive != 3)
    if drive == 3:
        assert found.law is not None and law.bic - found.law.bic == pytest.approx(4.0, abs=0.5)


@pytest.mark.parametrize(("drive", "missed", "left"), [(1, 0.09, 0.015), (2, 0.06, 0.03), (3, 0.05, 0.02)])
def test_the_map_is_the_mean_of_each_file(drive: int, missed: float, left: float, data_dir: Path) -> None:
    found = of_screw(data_dir, drive)
    logs = {rec.name: rec for rec in screw_logs(data_dir, drive)}
    by_name = {p.record: p for p in found.plateaus if p.samples > 400}
    assert len(by_name) >= len(logs) - 6
    for name, p in by_name.items():
        torque = logs[name].torque
        assert torque is not None and abs(p.torque - float(np.mean(torque))) < p.std
    w, torque = (np.array([getattr(p, key) for p in found.plateaus]) for key in ("velocity", "torque"))
    assert found.law is not None
    off = [float(np.sqrt(np.mean((model - torque) ** 2) / np.mean(torque**2)))
           for model in (published_torque(drive, w), found.law.torque(w))]  # fmt: skip
    assert off == pytest.approx((missed, left), abs=0.006)
    if drive == 1:
        fast = published_torque(1, np.array([by_name["n200"].velocity, by_name["200"].velocity]))
        means = (by_name["n200"].torque, by_name["200"].torque)
        assert means == pytest.approx((3.92e-3, -3.21e-3), abs=0.006e-3)
        assert fast == pytest.approx((3.43e-3, -2.74e-3), abs=0.006e-3)
