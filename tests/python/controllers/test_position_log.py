"""A log of position command and position alone: read, drafted, identified and diagnosed.

The drive of these logs is written out here: one mass between two samples by its closed form, with dry friction that comes to
exact rest, under a position and a velocity controller that read the counts of an encoder and the difference of the last two.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from drive_rig import Plant, run_drive, skip_without_library
from gaident.cli.main import main
from gaident.data.signals.difference import (
    backward_difference,
    difference_at_clock,
    is_difference_at_clock,
    is_difference_of_lines,
)
from gaident.identification.replay.replay import replay

DT = 0.5e-3
J, D, FRICTION = 3e-4, 2e-3, 0.05
KP, KI, KV = 0.03, 1.9, 25.0
COUNTS = 1 << 17
CASCADE = ga.Cascade(ga.PI(KP, KI), position=ga.P(KV), velocity_feedforward=1.0)


def command() -> NDArray[np.float64]:
    """Moves back and forth with dwells [rad]."""
    ramp, hold, dwell = np.linspace(0.0, 1.0, 50), np.ones(140), np.zeros(120)
    move = np.convolve(np.concatenate([ramp, hold, ramp[::-1], np.zeros(16)]), np.ones(17) / 17, "same")
    speeds = np.concatenate([part for s in (60, -60, 30, -45, 80, -65) for part in (dwell, s * move)])
    return np.round(np.cumsum(speeds) * DT, 7)


def counts(friction: float) -> NDArray[np.int_]:
    """What the encoder showed."""
    line, step, rate = command(), 2.0 * np.pi / COUNTS, D / J
    q = w = integral = error = 0.0
    last, shown = 0, np.empty(len(line), dtype=int)
    for n, wanted in enumerate(line):
        shown[n] = now = int(np.floor(q / step))
        slope = (line[n + 1] - wanted) / DT if n + 1 < len(line) else 0.0
        newest = KV * (wanted - now * step) + slope - (now - last) * step / DT
        integral, error, last = integral + KI * DT * (newest + error) / 2.0, newest, now
        u, left = KP * newest + integral, DT
        while left > 0.0 and (w != 0.0 or abs(u) > friction):
            end = (u - friction * np.sign(w or u)) / D
            after, passed = end + (w - end) * np.exp(-rate * left), left
            if after * w < 0.0:  # it comes to rest on the way
                after, passed = 0.0, np.log((w - end) / -end) / rate
            q += end * passed + (w - end) * (1.0 - np.exp(-rate * passed)) / rate
            w, left = after, left - passed
    return shown


def log_of(folder: Path, friction: float = 0.0) -> Path:
    path = folder / "axis.csv"
    rows = [f"{n * DT:.4f},{r:.7f},{q}" for n, (r, q) in enumerate(zip(command(), counts(friction), strict=True))]
    path.write_text("\n".join(["t [s],pos_cmd [rad],pos [counts]", *rows]))
    return path


def read(path: Path) -> ga.Record:
    return ga.read(
        path, columns={"time": "t", "position_command": "pos_cmd", "position": "pos"}, counts_per_turn=COUNTS, name="axis"
    )


def test_the_velocity_is_the_difference_that_the_drive_forms_and_the_note_says_what_is_not_known(tmp_path: Path) -> None:
    rec = read(log_of(tmp_path))
    assert rec.position is not None and rec.torque is None and rec.command is None
    assert is_difference_at_clock(rec.velocity, rec.position, rec.dt, 1)
    assert not is_difference_at_clock(ga.differentiate(rec.position, rec.dt), rec.position, rec.dt, 1)
    assert not is_difference_at_clock(rec.velocity, None, rec.dt, 1)
    assert is_difference_of_lines(ga.differentiate(rec.position, rec.dt), rec.position, rec.dt)
    assert not is_difference_of_lines(ga.differentiate(rec.position, rec.dt, cutoff_hz=200.0), rec.position, rec.dt)
    np.testing.assert_allclose(backward_difference(np.array([0.0, 1.0, 3.0]), 0.5), [2.0, 2.0, 4.0])
    assert any("Neither velocity nor torque is logged" in note and "filters" in note for note in rec.notes)


def test_init_asks_for_the_gains_of_the_loop_and_for_no_torque(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    log_of(tmp_path)
    assert main(["init", "axis.csv", "--out", "drive.toml"]) == 0
    asked = capsys.readouterr().out
    assert all(f"controller.{name}" in asked for name in ("kp", "ki", "position_gain"))
    assert "torque:" not in asked and "command:" not in asked
    text = Path("drive.toml").read_text()
    for mark, value in (("# counts_per_turn = 4096", f"counts_per_turn = {COUNTS}"), ("# kp = 0.0232", f"kp = {KP}"),
                        ("# ki = 1.367", f"ki = {KI}"), ("# position_gain = 40.0", f"position_gain = {KV}")):  # fmt: skip
        assert mark in text
        text = text.replace(mark, value)
    Path("drive.toml").write_text(text.replace("[controller]\n", "[controller]\nvelocity_feedforward = 1.0\n"))
    assert main(["identify", "axis.csv", "--drive", "drive.toml"]) == 0
    assert "one mass; the linear model stands" in capsys.readouterr().out


def test_the_mechanics_come_out_of_position_and_its_command(tmp_path: Path) -> None:
    """The torque is what the given controller makes of them; half a sample of age is no second mass."""
    idn = ga.identify(read(log_of(tmp_path)), CASCADE, seed=1)
    assert (idn.p, idn.q) == (1, 0) and isinstance(idn.mechanics, ga.OneMass)
    assert abs(idn.mechanics.J - J) < 1e-3 * J


def test_friction_is_found_without_velocity_and_torque(tmp_path: Path) -> None:
    dia = ga.diagnose(read(log_of(tmp_path, FRICTION)), CASCADE, seed=1)
    assert dia.verdict == "explained", dia.summary()
    assert [(f.effect, f.alternatives) for f in dia.causes] == [("coulomb_friction", ())]
    assert dia.causes[0].parameters["torque"].value == pytest.approx(FRICTION, rel=1e-3)
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=1e-3)
    said = " ".join(dia.summary().split())
    assert "half a sample old" in said and "nothing shows it: log the torque" in said
    assert not dia.torque_logged and "The logged torque" not in said


@pytest.mark.long
@pytest.mark.parametrize("torque", [False, True])
def test_a_second_mass_is_found_whose_friction_is_at_the_load(torque: bool) -> None:
    """With the friction at the motor a shaft explains nothing, so that neither of the two helps alone.

    The position of 2^22 counts a turn is the only measured signal, or the torque is logged beside it.
    """
    skip_without_library()
    loop = ga.Cascade(ga.PI(0.08, 4.0), position=ga.P(20.0))
    axis = Plant(J=4e-4, D=1e-3, JL=6e-4, DL=1e-3, KG=60.0, DG=0.02, kp=0.08, ki=4.0, dt=1e-3, cascade=loop, name="axis")
    levels = np.repeat([0.0, 30.0, 60.0, 12.0, -24.0, -60.0, -18.0, 6.0, 42.0, 0.0, -42.0, 21.0, 0.0], 150)
    speed = np.zeros(len(levels))
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(levels[n] - speed[n - 1], -1.0, 1.0)
    path = np.cumsum(speed) * 1e-3
    log = run_drive(axis, path, {"coulomb_friction@load": {"torque": 0.15}}, encoder=2.0 * np.pi / 2**22, differenced=True)
    position = np.cumsum(log.velocity) * 1e-3
    shown = {"torque": log.torque} if torque else {}
    rec = ga.Record(1e-3, position_command=path, position=position, velocity=backward_difference(position, 1e-3), **shown)
    dia = ga.diagnose(rec, loop)
    assert [(f.effect, f.sides, f.alternatives) for f in dia.causes] == [("coulomb_friction", ("load",), ())], dia.summary()
    assert dia.causes[0].parameters["torque"].value == pytest.approx(0.15, rel=1e-3)
    found = {name: dia.mechanics[name].value for name in ("motor_inertia", "load_inertia", "stiffness")}
    assert found == pytest.approx({"motor_inertia": 4e-4, "load_inertia": 6e-4, "stiffness": 60.0}, rel=0.01)
    assert dia.verdict == "explained"


def test_rounded_positions_are_no_other_controller() -> None:
    """Differences of positions with the decimals of a log, through a feedforward, in the torque."""
    dt, degree = 0.25e-3, np.pi / 180.0
    cascade = ga.Cascade(ga.PI(0.7, 30.0), period=dt, position=ga.P(60.0), velocity_feedforward=1.0)
    n = np.arange(4000)
    source = 8.0 * (1.0 - np.cos(2 * np.pi * n / 2000))
    noise = 1e-3 * np.random.default_rng(1).standard_normal(4000)
    still = ga.Record(dt, velocity=noise, position=0.0 * source, position_command=source)
    moved = ga.run(ga.OneMass(J=1.5e-3, D=2e-3).model(), still, cascade)
    w = moved.velocity + noise
    log = ga.Record(dt, velocity=w, torque=np.zeros(4000), position=np.cumsum(w) * dt, position_command=source)
    log = log.with_channels(torque=cascade.torque_of(log))
    rounded = {c: np.round(getattr(log, c) / degree, 6) * degree for c in ("position", "position_command")}
    off = log.torque - cascade.torque_of(log.with_channels(**rounded))
    assert 1e-6 < np.abs(off).max() < 1e-2
    assert replay(log.with_channels(**rounded), cascade).follows
    other = ga.Cascade(ga.PI(0.7, 30.0), period=dt, position=ga.P(60.0), velocity_feedforward=0.98)
    assert not replay(log.with_channels(**rounded), other).follows


@pytest.mark.parametrize(("kp", "kd"), [(40.0, 1.2), (0.5, 0.03)])
def test_the_law_of_a_robots_joint_is_a_cascade_without_an_integral(kp: float, kd: float) -> None:
    """u = kp (q* - q) + kd (v* - w), v* the slope of q* over the coming sample, as docs/controllers.md says."""
    dt = 1e-3
    target = 0.3 * np.sin(np.arange(400) * 0.02) ** 2
    slope = np.append(np.diff(target), 0.0) / dt
    joint = ga.Cascade(ga.PI(kp=kd, ki=0.0), position=ga.P(kp / kd), velocity_feedforward=1.0)
    rec = ga.Record(dt, position_command=target, velocity=np.zeros(400), position=np.zeros(400))
    run = ga.run(ga.OneMass(J=0.02, D=0.05), rec, joint)
    expected = kp * (target - run.position) + kd * (slope - run.velocity)
    np.testing.assert_allclose(run.torque[:-1], expected[:-1], atol=1e-9 * np.abs(expected).max())
    assert np.abs(run.velocity).max() > 0.1


# Position command, position and torque: the velocity is that which the drive formed at its own clock.
T, SERVO = 250e-6, ga.Cascade(ga.PI(0.3, 15.0), 250e-6, position=ga.P(30.0), velocity_feedforward=1.0)
LSB = 2.0 * np.pi / 2**20


def moves(seconds: float) -> NDArray[np.float64]:
    """Trapezoids of the velocity at the controller's samples [rad]."""
    speeds = np.repeat([0.0, 60.0, 120.0, 25.0, -50.0, -120.0, -35.0, 0.0, 40.0, 0.0], round(seconds / T / 10.0))
    speed, slope = np.zeros(len(speeds)), 1500.0 * T
    for n in range(1, len(speed)):
        speed[n] = speed[n - 1] + np.clip(speeds[n] - speed[n - 1], -slope, slope)
    return np.concatenate([[0.0], np.cumsum(speed[:-1])]) * T


def servo_log(every: int, effects: dict[str, dict[str, float]], **load: float) -> ga.Record:
    skip_without_library()
    axis = Plant(J=1.5e-3, D=2e-3, kp=0.3, ki=15.0, dt=every * T, cascade=SERVO, **load)
    command = moves(2.0)
    log = run_drive(axis, command, effects, encoder=LSB, differenced=True)
    position, wanted, torque = (
        x[::every] for x in (LSB * np.floor(np.asarray(log.position) / LSB), command, np.asarray(log.torque))
    )
    velocity = ga.differentiate(position, every * T)
    return ga.Record(every * T, velocity=velocity, position=position, position_command=wanted, torque=torque)


@pytest.mark.parametrize("every", [1, 4, 8])
def test_a_velocity_made_of_the_position_is_that_which_the_drive_read(every: int) -> None:
    t = T * np.arange(2000)
    position = 3.0 * np.sin(40.0 * t) + 0.5 * np.sin(170.0 * t)
    read = backward_difference(position, T)[::every]
    made = difference_at_clock(position[::every], every * T, every)
    lines = backward_difference(position[::every], every * T)
    inside = slice(5, -5)
    assert every == 1 or np.abs(made - read)[inside].max() < 1e-3 * np.abs(lines - read)[inside].max()
    assert is_difference_at_clock(made, position[::every], every * T, every)
    outlier = np.arange(len(made)) == 40
    moved = np.where(outlier, made + 1.0, made)
    assert not is_difference_at_clock(moved, position[::every], every * T, every)
    assert is_difference_at_clock(moved, position[::every], every * T, every, ~outlier)


@pytest.mark.long
@pytest.mark.parametrize("every", [1, 4])
def test_friction_of_a_log_of_position_and_torque_is_named_alone(every: int) -> None:
    """A mean over the line before it, or over two, is no velocity of this drive: names of couplings and resonances followed."""
    rec = servo_log(every, {"coulomb_friction": {"torque": 0.3}})
    dia = ga.diagnose(rec, SERVO)
    assert dia.verdict == "explained" and [f.effect for f in dia.findings if f.place != "controller"] == ["coulomb_friction"]
    assert dia.causes[0].alternatives == () and dia.causes[0].parameters["torque"].value == pytest.approx(0.3, rel=2e-3)
    assert dia.mechanics["inertia"].value == pytest.approx(1.5e-3, rel=1e-3) and "load_inertia" not in dia.mechanics
    assert any("half a sample" in note and "old (0.125 ms)" in note for note in dia.notes)
    assert dia.digests == (rec.digest,) and dia.records == (rec,)


@pytest.mark.long
def test_two_masses_of_such_a_log_are_no_finding() -> None:
    rec = servo_log(4, {}, JL=1e-3, DL=1e-3, KG=300.0, DG=0.02)
    dia = ga.diagnose(rec, SERVO)
    assert dia.verdict == "adequate" and not dia.causes
    for name, value in {"motor_inertia": 1.5e-3, "load_inertia": 1e-3, "stiffness": 300.0}.items():
        assert dia.mechanics[name].value == pytest.approx(value, rel=2e-3)


def test_an_identification_knows_a_log_again_whose_velocity_it_made_anew() -> None:
    rec = servo_log(1, {}).with_channels(position_command=None)
    idn = ga.identify(rec, settings=ga.Settings(generations=3, population=20))
    used = idn.as_used(rec)
    assert used != rec and idn.digests == (used.digest,) and idn.records == (used,) and idn.as_used(used) is used
    assert pytest.approx(1.5e-3, rel=1e-3) == idn.mechanics.J


@pytest.mark.parametrize("controller", [None, ga.PI(0.3, 15.0)], ids=["open", "loop"])
def test_the_residual_is_that_of_the_fit_whichever_difference_was_given(controller: ga.PI | None) -> None:
    skip_without_library()
    axis = Plant(J=1.5e-3, D=2e-3, kp=0.3, ki=15.0, dt=T, cascade=ga.Cascade(ga.PI(0.3, 15.0), T))
    command = np.repeat([20.0, -15.0, 25.0, -10.0, 18.0], 400)
    log = run_drive(axis, command, {}, encoder=LSB)
    position = LSB * np.floor(np.asarray(log.position) / LSB)
    found = []
    for velocity in (backward_difference(position, T), ga.differentiate(position, T)):
        rec = ga.Record(T, command=command, velocity=velocity, position=position, torque=log.torque)
        space = ga.SearchSpace(gain=(100.0, 5e3), real=(0.1, 100.0), imaginary=(0.0, 300.0), p=(1, 1), q=(0, 0))
        idn = ga.identify(rec, controller=controller, space=space)
        used = idn.as_used(rec)
        spread = float(np.sqrt(np.mean((used.velocity - used.velocity.mean()) ** 2)))
        left = float(np.sqrt(np.mean(idn.residual(rec) ** 2)))
        assert np.array_equal(idn.residual(idn.records[0]), idn.residual(rec))
        assert 100.0 * (1.0 - left / spread) == pytest.approx(idn.fit_percent, abs=0.01)
        assert isinstance(idn.mechanics, ga.OneMass)
        found.append(idn.mechanics.J)
    assert found[0] == pytest.approx(found[1], rel=1e-6) and found[0] == pytest.approx(1.5e-3, rel=2e-3)
