"""A log of torques that are means since the line before: what is made of it, and what a model and its controller make of that."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import gaident as ga
from drive_rig import Noise, Plant, between_lines, disturbances, run_drive, skip_without_library
from gaident.cli.main import main
from gaident.control.between import at_lines
from gaident.data.signals.decimation import decimated
from gaident.diagnosis.controller.form_regression import law_of
from gaident.errors import ReadError, RecordError
from gaident.models.drive_torque import driven_by
from gaident.models.held_torque import held_torque

PERIOD = 125e-6
PI = ga.PI(0.08, 4.0)
TOTAL = 1e-3
LEVELS = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 100)


def logged(cascade: ga.Cascade, every: int, effects: Any = None, mean: bool = True) -> tuple[ga.Record, np.ndarray]:
    """(the log of a drive of two masses with every r-th sample of the velocity, the torque at all samples of the controller)."""
    skip_without_library()
    plant = Plant(4e-4, 1e-3, 0.08, 4.0, every * PERIOD, 6e-4, 1e-3, 60.0, 0.02, cascade=cascade)
    ticks = between_lines(plant, LEVELS)
    made = run_drive(plant, ticks, effects or {}, **disturbances(Noise(white=0.03), len(ticks), np.random.default_rng(3)))
    means = np.concatenate([np.zeros(every - 1), made.torque])[: len(ticks)].reshape(-1, every).mean(axis=1)
    torque, kind = (means, "mean") if mean else (made.torque[::every], "sample")
    return ga.Record(
        plant.dt, command=ticks[::every], velocity=made.velocity[::every], torque=torque, torque_log=kind
    ), made.torque


def some(**more: Any) -> ga.Record:
    n = np.arange(300)
    return ga.Record(1e-3, **{"velocity": np.sin(n / 9), "torque": np.cos(n / 9), "torque_log": "mean", **more})


def test_whatever_is_made_of_a_record_keeps_what_its_lines_contain(tmp_path: Path) -> None:
    rec = some(name="run")
    rec.save(tmp_path / "rec.json")
    same = [pickle.loads(pickle.dumps(rec)), ga.load(tmp_path / "rec.json"), ga.Record.from_dict(rec.to_dict())]
    made = [rec[10:200], rec.between(0.01, 0.2), rec.shifted(torque=1), rec.with_channels(velocity=rec.velocity + 1.0), *same]
    assert {r.torque_log for r in made} == {"mean"} and all(r == rec for r in same)
    assert rec != rec.with_channels(torque_log="sample") and rec.digest != rec.with_channels(torque_log="sample").digest
    assert "(mean)" in repr(rec) and "(measured, mean)" in repr(some(torque_is="measured"))
    early = {key: value for key, value in rec.to_dict().items() if key != "torque_log"}
    assert ga.Record.from_dict(early).torque_log == "sample"
    assert rec.with_channels(torque=None, command=rec.velocity).torque_log == "sample"


def test_wrong_use_is_named() -> None:
    with pytest.raises(RecordError, match="torque_log"):
        some(torque_log="average")
    with pytest.raises(RecordError, match="torque_log='mean', but the record has no torque"):
        ga.Record(1e-3, command=np.zeros(50), velocity=np.zeros(50), torque_log="mean")


def test_a_decimated_mean_is_no_longer_late() -> None:
    """The mean since the line before is half a line old: of a sine, the torque comes out in its place."""
    n = np.arange(4000)
    slow = 2 * np.pi / 400
    rec = ga.Record(1e-3, velocity=np.sin(slow * n), torque=np.sin(slow * (n - 0.5)), torque_log="mean").decimate(10)
    assert rec.torque_log == "smooth" and rec.torque is not None
    assert np.abs(rec.torque - np.sin(slow * n[::10]))[30:-30].max() < 1e-3


def axis_under_steps(dt: float, hold: int) -> tuple[ga.Record, float, float]:
    """(record, J, B) of one mass under a torque that is held over each sample and jumps every `hold` samples; exact."""
    J, B = 2e-3, 0.02
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 12_000 // hold), hold)
    stays = np.exp(-B / J * dt)
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(u))
    return ga.Record(dt, velocity=np.append(0.0, lfilter([(1.0 - stays) / B], [1.0, -stays], u)[:-1]) + noise, torque=u), J, B


@pytest.mark.parametrize("factor", [2, 5, 10])
def test_a_torque_that_is_decimated_goes_on_without_steps(factor: int) -> None:
    """Held over the new samples it would be half of one late: J too small by M B dt/2. No step of the old ones is left."""
    dt = 5e-4
    whole, J, B = axis_under_steps(dt, 200)
    rec = whole.decimate(factor)
    assert rec.torque_log == "smooth" and rec.torque is not None
    regressed = ga.inverse_dynamics(rec).parameters
    assert regressed["inertia"].value == pytest.approx(J, rel=3e-4 * factor)
    late = ga.inverse_dynamics(rec.with_channels(torque_log="held")).parameters
    assert late["inertia"].value == pytest.approx(J - 0.5 * B * dt * factor, rel=2e-3)


def test_the_means_of_a_smooth_torque_are_those_of_the_signal_between_its_lines() -> None:
    """What a simulation holds over each line; 5 lines a period: the value in the middle would be 7 % larger."""
    x = np.arange(0.0, 200.0, 1.0 / 64.0)
    fine = np.sin(2.0 * np.pi * x / 5.0) + 0.3 * np.cos(2.0 * np.pi * x / 17.0)
    rec = ga.Record(1e-3, velocity=np.zeros(200), torque=fine[::64], torque_log="smooth")
    true = np.mean([np.append(fine, fine[-1])[k : k + len(fine) : 64][:200] for k in range(65)], axis=0)
    assert np.abs(held_torque(rec) - true)[30:-30].max() < 0.01


@pytest.mark.parametrize("factor", [2, 5, 10])
def test_the_mean_of_a_decimated_torque_drives_a_rigid_axis_as_the_steps_did(factor: int) -> None:
    """J (v(n+1) - v(n)) = dt u(n) on the old lines; on the new ones u(n) is the mean over the line."""
    u = np.repeat(np.random.default_rng(0).uniform(-1.0, 1.0, 600), 20)
    rec = ga.Record(5e-4, velocity=5e-4 / 2e-3 * np.append(0.0, np.cumsum(u)[:-1]), torque=u).decimate(factor)
    change = np.diff(rec.velocity) * 2e-3 / rec.dt
    within = slice(30, -30)
    assert np.std((change - held_torque(rec)[:-1])[within]) < 3e-3 * np.std(change)
    late = rec.with_channels(torque=decimated(u, factor))  # as it was: half of an old sample early
    assert np.std((change - held_torque(late)[:-1])[within]) > 2e-2 * np.std(change)


def test_only_a_torque_that_was_held_moves_when_it_is_decimated() -> None:
    """A sample of a torque that goes on between the lines has the phase of the velocity beside it."""
    whole, _, _ = axis_under_steps(5e-4, 20)
    assert whole.torque is not None
    for kind, line, held in (("commanded", "sample", True), ("measured", "sample", False), ("measured", "held", True)):
        rec = whole.with_channels(torque_is=kind, torque_log=line).decimate(5)
        assert rec.torque is not None and rec.torque_is == kind and rec.torque_log == "smooth"
        assert np.array_equal(rec.torque, decimated(whole.torque, 5, held))
    assert whole.decimate(1).torque_log == "sample"
    assert whole.with_channels(command=whole.velocity, torque=None).decimate(5).torque_log == "sample"


def test_a_held_torque_on_another_time_axis_is_the_mean_over_each_line(tmp_path: Path) -> None:
    """Drawn straight between its values, as the velocity is, it would act half a line early."""
    whole, J, _ = axis_under_steps(1e-3, 10)
    assert whole.torque is not None
    rows = np.column_stack([whole.time, whole.velocity, whole.torque])[:6000]
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t [s],w [rad/s],u [Nm]", comments="", fmt="%.12g")
    columns = {"time": "t [s]", "velocity": "w [rad/s]", "torque": "u [Nm]"}
    rec = ga.read(tmp_path / "log.csv", columns=columns, resample=5e-4)
    assert rec.torque is not None
    assert np.allclose(rec.torque[:-1:2], whole.torque[:6000][:-1]) and np.allclose(rec.torque[1::2], whole.torque[:6000][:-1])
    assert ga.inverse_dynamics(rec).parameters["inertia"].value == pytest.approx(J, rel=1e-3)


def test_a_torque_of_another_clock_goes_straight_between_the_lines() -> None:
    whole, J, _ = axis_under_steps(1e-3, 200)
    coarse = ga.Record(1e-2, velocity=whole.decimate(10).velocity, command=np.zeros(len(whole) // 10))
    aligned = ga.align(coarse, whole, on="velocity", take=["torque"], within=(-0.01, 0.01)).record
    assert aligned.torque_log == "smooth" and aligned.torque_is == "commanded"
    assert ga.inverse_dynamics(aligned).parameters["inertia"].value == pytest.approx(J, rel=1e-2)


@pytest.mark.parametrize(("kind", "line", "held"), [
    ("commanded", "sample", True), ("measured", "sample", False), ("measured", "held", True), ("commanded", "smooth", False),
])  # fmt: skip
def test_how_a_torque_goes_on_is_said_by_its_kind_or_by_the_log(kind: str, line: str, held: bool) -> None:
    """A held torque is simulated as it stands and acts half a sample later at the lines; a straight one the other way round."""
    whole, J, B = axis_under_steps(1e-3, 200)
    assert whole.torque is not None
    rec = whole.with_channels(torque_is=kind, torque_log=line)
    found = ga.inverse_dynamics(rec).parameters["inertia"].value
    assert found == pytest.approx(J if held else J + 0.5 * B * 1e-3, rel=7e-4)
    assert np.array_equal(held_torque(rec), whole.torque) is (line != "smooth")


def test_a_file_says_it(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    rec, _ = logged(ga.Cascade(PI, period=PERIOD), 4)
    rows = np.column_stack([rec.time, rec.command, rec.velocity, rec.torque])
    head = "time [s],command [rad/s],velocity [rad/s],torque [N m]"
    np.savetxt("log.csv", rows, delimiter=",", header=head, comments="", fmt="%.17g")
    assert ga.read("log.csv", torque_log="mean").torque_log == "mean" and ga.read("log.csv").torque_log == "sample"
    with pytest.raises(ReadError, match="torque_log"):
        ga.read("log.csv", torque_log="now")
    with pytest.raises(ReadError, match="cannot be read with decimate or resample"):
        ga.read("log.csv", torque_log="mean", decimate=2)
    with pytest.raises(ReadError, match="no such column is read"):
        ga.read("log.csv", columns={"command": 1, "velocity": 2, "torque": None}, torque_log="mean")
    Path("drive.toml").write_text(f'torque_log = "mean"\n[controller]\nkp = 0.08\nki = 4.0\nperiod = {PERIOD}\n')
    options = ["--json"]
    assert main(["diagnose", "log.csv", "--drive", "drive.toml", *options]) == 0
    by_file = json.loads(capsys.readouterr().out)
    assert by_file["verdict"] == "adequate"
    Path("drive.toml").write_text(f"[controller]\nkp = 0.08\nki = 4.0\nperiod = {PERIOD}\n")
    assert main(["diagnose", "log.csv", "--drive", "drive.toml", "--torque-log", "mean", *options]) == 0
    assert json.loads(capsys.readouterr().out)["mechanics"] == by_file["mechanics"]


def test_lines_of_means_end_with_their_own_sample() -> None:
    made = np.arange(12.0)
    assert np.array_equal(at_lines(made, 4, False), [0.0, 4.0, 8.0])
    assert np.array_equal(at_lines(made, 4, True), [0.0, 2.5, 6.5])  # the first: three values of 0 before it
    assert np.array_equal(at_lines(made, 4, True, before=2.0), [1.5, 2.5, 6.5])
    assert np.array_equal(at_lines(np.stack([made, -made]), 4, True)[1], -at_lines(made, 4, True))


@pytest.mark.parametrize("every", [2, 8])
def test_the_torque_over_each_line_follows_from_the_means(every: int) -> None:
    """What drives a model is the mean over the line ahead: of the controller's samples it is known to 0.1 % of the torque."""
    controller = ga.Cascade(PI, period=PERIOD)
    rec, torque = logged(controller, every)
    true = torque.reshape(-1, every).mean(axis=1)
    driven = driven_by(rec, controller)
    assert driven.torque is not None and driven.torque_log == "held"
    size = np.sqrt(np.mean(true**2))
    # Between the lines the velocity has noise that nobody logged: kp times it, beside the sample at the line.
    left = np.sqrt(np.mean((driven.torque - true)[:-1] ** 2))
    assert left < 2.0 * PI.kp * 0.03 / every + 1e-3 * size
    as_sample, _ = logged(controller, every, mean=False)
    assert left < 0.6 * np.sqrt(np.mean((driven_by(as_sample, controller).torque - true)[:-1] ** 2))


def test_without_a_controller_a_mean_is_held_over_the_line_that_it_is_of() -> None:
    """A torque that changes at the lines only: the model is driven by it as it was, also where the log is too slow to hold it."""
    for dt, kind in ((1e-3, "commanded"), (0.01, "measured")):
        torque = np.repeat([0.0, 1.0, -0.5, 0.3, 0.0], 40)
        still = ga.Record(dt, torque=torque, velocity=np.zeros(200))
        speed = ga.simulate(ga.OneMass(J=0.01, D=0.05), still)
        late = np.append(0.0, torque[:-1])
        rec = ga.Record(dt, torque=late, velocity=speed, torque_log="mean", torque_is=kind)
        assert np.array_equal(held_torque(rec), np.append(late[1:], late[-1]))
        assert np.abs(ga.simulate(ga.OneMass(J=0.01, D=0.05), rec) - speed)[:-1].max() < 1e-12
        noise = 0.01 * np.random.default_rng(1).standard_normal(200)
        found = ga.identify(rec.with_channels(velocity=speed + noise), seed=1)
        assert isinstance(found.mechanics, ga.OneMass) and pytest.approx(0.01, rel=5e-3) == found.mechanics.J


def test_under_a_controller_at_the_rate_of_the_log_a_mean_is_a_sample() -> None:
    rec, _ = logged(ga.Cascade(PI, period=PERIOD), 1)
    sample = rec.with_channels(torque_log="sample")
    assert np.array_equal(driven_by(rec, ga.Cascade(PI, period=PERIOD)).torque, sample.torque)
    means, samples = (ga.identify(r, PI, seed=1) for r in (rec, sample))
    assert means.model == samples.model and any("mean is taken for a sample" in w for w in means.warnings)


@pytest.mark.long
@pytest.mark.parametrize("every", [4, 8])
@pytest.mark.parametrize(
    ("true", "given", "named"),
    [
        (PI, PI, []),
        (PI, ga.PI(None, None), []),
        (PI, ga.PI(0.088, 4.4), ["other_gains"]),
        (replace(PI, torque_limit=3.0), replace(PI, torque_limit=3.0), []),
    ],
)
def test_a_log_of_means_is_diagnosed(every: int, true: ga.PI, given: ga.PI, named: list[str]) -> None:
    rec, _ = logged(ga.Cascade(true, period=PERIOD), every)
    dia = ga.diagnose(rec, ga.Cascade(given, period=PERIOD))
    assert [f.effect for f in dia.causes] == named and dia.verdict == ("explained" if named else "adequate"), dia.summary()
    inertia = dia.mechanics["inertia"]
    assert abs(inertia.value - TOTAL) < min(3.5 * inertia.std, 5e-4 * TOTAL)
    pi = dia.controller.velocity if isinstance(dia.controller, ga.Cascade) else dia.controller
    assert isinstance(pi, ga.PI) and pi.kp == pytest.approx(0.08, rel=2e-3) and pi.ki == pytest.approx(4.0, rel=5e-3)


@pytest.mark.long
def test_friction_and_a_torque_filter_are_named_of_means() -> None:
    true = ga.Cascade(PI, period=PERIOD, torque_filters=(ga.LowPass(0.5e-3),))
    rec, _ = logged(true, 8, {"coulomb_friction": {"torque": 0.05}})
    dia = ga.diagnose(rec, ga.Cascade(PI, period=PERIOD))
    assert {f.effect for f in dia.causes} == {"torque_filter", "coulomb_friction"} and dia.verdict == "explained", dia.summary()
    found = {f.effect: f.parameters for f in dia.causes}
    assert found["torque_filter"]["time_constant"].value == pytest.approx(0.5e-3, rel=0.01)
    assert found["coulomb_friction"]["torque"].value == pytest.approx(0.05, rel=0.02)


def test_a_regression_reads_a_mean_at_its_place() -> None:
    """A smooth torque with 40 samples to a line: its means are half a line old, which changes a damping by tau J w^2."""
    fine, every, J, D = 5e-5, 40, 0.01, 0.05
    t = fine * np.arange(200 * 400)
    speed = 20.0 * np.sin(2 * np.pi * 1.3 * t) + 8.0 * np.sin(2 * np.pi * 4.1 * t)
    torque = J * np.gradient(speed, fine) + D * speed
    means = np.concatenate([np.zeros(every - 1), torque])[: len(t)].reshape(-1, every).mean(axis=1)
    rec = ga.Record(fine * every, velocity=speed[::every], torque=means, torque_log="mean")
    found, late = (
        ga.inverse_dynamics(r, terms=("inertia", "viscous")).parameters for r in (rec, rec.with_channels(torque_log="sample"))
    )
    assert found["inertia"].value == pytest.approx(J, rel=1e-3)
    assert abs(found["viscous"].value - D) < 0.005 * D < 0.02 * D < abs(late["viscous"].value - D)


def test_records_of_means_do_not_mix_at_their_ends() -> None:
    """What a controller makes of a record does not depend on the record before it, nor on the kind of its log."""
    rec, _ = logged(ga.Cascade(PI, period=PERIOD), 8)
    samples, _ = logged(ga.Cascade(PI, period=PERIOD), 8, mean=False)

    def columns(*records: ga.Record) -> np.ndarray:
        found = law_of(records, PI, 8)
        assert found is not None
        return replace(found[0], rho=0.0).columns((), np.zeros(0))[:, :3]

    part = rec[250:1150]  # under torque where it begins
    for before in (rec, samples):
        alone, both = columns(part), columns(before, part)
        assert np.allclose(both[-len(alone) :], alone, rtol=0.0, atol=1e-12 * np.abs(alone).max())


def test_a_force_error_compares_a_mean_with_a_mean() -> None:
    torque = np.repeat([0.0, 1.0, -0.5, 0.3, 0.0], 200)
    true = ga.OneMass(J=0.01, D=0.05).model()
    speed = ga.simulate(true, ga.Record(1e-3, torque=torque, velocity=np.zeros(1000)))
    rec = ga.Record(1e-3, torque=np.append(0.0, torque[:-1]), velocity=speed, torque_log="mean")
    good, late = (ga.force_error(true, r).percent for r in (rec, rec.with_channels(torque_log="sample")))
    assert good < 0.1 and late > 1.0


def test_an_identification_knows_its_records_of_means() -> None:
    rec = some(torque_is="measured")
    assert ga.identify(rec, seed=1).digests == (rec.digest,)


def test_a_mean_from_another_log_is_put_at_its_lines() -> None:
    n = np.arange(4000)
    sine = np.sin(2 * np.pi * n / 800)
    other = ga.Record(1e-3, velocity=sine, torque=np.sin(2 * np.pi * (n - 0.5) / 800), torque_log="mean")
    rec = ga.Record(4e-3, command=sine[::4], velocity=sine[::4])
    joined = ga.align(rec, other, take=["torque"], within=(-0.01, 0.01)).record
    assert joined.torque is not None and joined.torque_log == "smooth"
    assert np.abs(joined.torque - joined.velocity)[30:-30].max() < 2e-3, "half a line of the other log would make 4e-3"
    assert rec.decimate(1).torque_log == "sample" and other.decimate(1) == other


def test_means_over_lines_do_not_depend_on_where_the_time_begins(tmp_path: Path) -> None:
    """Seconds since 1970 resolve 2.4e-7 s; a log of two lines is refused as too short."""
    whole, _, _ = axis_under_steps(1e-4, 10)
    for first in (0.0, 1.7e9):
        rows = np.column_stack([whole.time + first, whole.velocity, whole.torque])[:6000]
        np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t [s],w [rad/s],u [Nm]", comments="", fmt="%.7f")
        rec = ga.read(tmp_path / "log.csv", columns={"time": "t [s]", "velocity": "w [rad/s]", "torque": "u [Nm]"}, resample=1e-4)
        assert rec.torque is not None
        n = min(len(rec), 5990)
        same = np.polyfit(rows[:n, 2], rec.torque[:n], 1)[0]
        assert same == pytest.approx(1.0, abs=1e-4 if first else 1e-6)
    np.savetxt(tmp_path / "two.csv", rows[:2], delimiter=",", header="t [s],w [rad/s],u [Nm]", comments="", fmt="%.7f")
    with pytest.raises(RecordError, match="at least 20"):
        ga.read(tmp_path / "two.csv", columns={"time": "t [s]", "velocity": "w [rad/s]", "torque": "u [Nm]"}, resample=1.4e-4)


def stairs_and_motion(rec: ga.Record, finer: int) -> tuple[ga.Record, np.ndarray]:
    """(the motion of a record on a finer axis, the held torque there)."""
    t = rec.dt / finer * np.arange((len(rec) - 1) * finer + 1)
    assert rec.torque is not None
    return ga.Record(t[1], velocity=np.interp(t, rec.time, rec.velocity), command=0.0 * t), np.repeat(rec.torque, finer)[: len(t)]


@pytest.mark.parametrize("finer", [1, 2, 4])
def test_a_held_torque_stays_held_on_a_finer_clock(finer: int) -> None:
    """Drawn straight it would act up to half a line early."""
    whole, _, _ = axis_under_steps(1e-3, 10)
    motion, stairs = stairs_and_motion(whole, finer)
    aligned = ga.align(motion, whole, on="velocity", take=["torque"], within=(-1e-5, 1e-5))
    torque = aligned.record.torque
    assert torque is not None and abs(aligned.offset) < 2e-6
    part = slice(100, len(torque) - 100)
    # Where the torque jumps, a line contains the offset's part of the other level.
    assert np.sqrt(np.mean((torque - stairs[: len(torque)])[part] ** 2)) < 0.01 * np.std(stairs)


@pytest.mark.parametrize(("line", "straight"), [("held", False), ("sample", True)])
def test_a_torque_that_is_said_to_be_held_is_held_beside_faster_channels(line: str, straight: bool, tmp_path: Path) -> None:
    """Where nothing is said, values between those of a slower channel are more likely than a hold of several lines."""
    whole, _, _ = axis_under_steps(1e-3, 5)
    fine, stairs = stairs_and_motion(whole, 4)
    rows = [f"{t:.9g},{w:.9g},{u:.9g}" if i % 4 == 0 else f"{t:.9g},{w:.9g},"
            for i, (t, w, u) in enumerate(zip(fine.time, fine.velocity, stairs, strict=True))][:4000]  # fmt: skip
    (tmp_path / "log.csv").write_text("\n".join(["t [s],w [rad/s],u [Nm]", *rows]))
    columns = {"time": "t [s]", "velocity": "w [rad/s]", "torque": "u [Nm]"}
    rec = ga.read(tmp_path / "log.csv", columns=columns, resample=2.5e-4, torque_log=line)
    assert rec.torque is not None and rec.torque_log == line
    assert bool(np.abs(rec.torque - stairs[: len(rec)]).max() > 0.1) is straight
