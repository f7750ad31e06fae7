"""A velocity that is the difference of an encoder's angle: a mean over its sample, and no finding."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.data.signals.lattice import encoder_lines, encoder_step
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.hygiene import unexplained
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.selection.bases import Task
from gaident.diagnosis.selection.mechanisms import on_a_shaft, resonance
from gaident.diagnosis.selection.sensor_age import _encoder
from gaident.estimation import least_squares as ls
from gaident.estimation.dataset import DataSet
from gaident.estimation.mean_velocity import means, with_middles
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Objective
from gaident.models.made_torque import late
from gaident.reporting.runs import run_of

T, LINES = 0.5e-3, 2**20
DRIVE = Plant(J=3e-4, D=1.5e-3, kp=0.06, ki=3.0, dt=T, name="one mass")


def command(seed: int) -> np.ndarray:
    """Levels with reversals, 150 samples each, with a random binary signal on every other one [rad/s]."""
    rng = np.random.default_rng(seed)
    levels = np.repeat(rng.permutation([5.0, -10.0, 20.0, -40.0, 60.0, -60.0, 30.0, -3.0, 0.0, 15.0]), 150)
    return levels + np.where(np.arange(len(levels)) // 150 % 2, 1.0, 0.0) * np.repeat(
        rng.choice([-1.0, 1.0], len(levels) // 3), 3
    )


def record(seed: int, effects: dict[str, dict[str, float]], differenced: bool = True, drive: Plant = DRIVE) -> ga.Record:
    skip_without_library()
    noise = Noise(white=0.0, encoder=2.0 * np.pi / LINES, differenced=differenced)
    return rig(drive, command(seed), effects, noise, seed)


def test_lines_of_an_encoder_are_whole() -> None:
    angle = np.cumsum(np.random.default_rng(1).uniform(-1.0, 1.0, 400)) * 0.01
    w = np.diff(np.round(angle / (2.0 * np.pi / LINES))) * (2.0 * np.pi / LINES) / T
    assert encoder_lines(w, T, 2.0 * np.pi) == LINES
    assert encoder_lines(1.0003 * w, T, 2.0 * np.pi) == 0
    assert encoder_lines(angle, T, 2.0 * np.pi) == 0
    for decimals, seen in ((4, LINES), (3, LINES), (1, 0)):  # of rpm: a line is not known from them, a power of two is
        assert encoder_lines(np.round(w * 30.0 / np.pi, decimals) * np.pi / 30.0, T, 2.0 * np.pi) == seen
    rpm = np.pi / 30.0 * np.round(angle / angle.max() * 900.0)
    beside = LINES + 1.004  # what five decimals of rpm leave of 2^20 lines: no encoder has one line more
    assert encoder_lines(w * LINES / beside, T, 2.0 * np.pi) == LINES
    assert encoder_lines(rpm, 1e-3, 2.0 * np.pi) == 0  # not 60000 lines


@pytest.mark.parametrize(("axis", "pitch", "lead", "said"), [
    ("linear", None, 0.01, (2**19, "in 5 mm")),
    ("linear", 0.012, 0.012, (2**20, "in 12 mm")),
    ("linear", None, 0.012, (2**18, "in 3 mm")),
    ("linear", None, 0.0137, (0, "")),
    ("linear", 0.0137, 0.0137, (2**20, "in 13.7 mm")),
    ("rotary", None, 2.0 * np.pi, (2**20, "a turn")),
])  # fmt: skip
def test_lines_of_a_screws_encoder_are_counted_on_its_lead(
    axis: str, pitch: float | None, lead: float, said: tuple[int, str]
) -> None:
    angle = np.cumsum(np.random.default_rng(1).uniform(-1.0, 1.0, 400)) * 0.01
    exact = np.diff(np.round(angle / (2.0 * np.pi / LINES))) * (lead / LINES) / T
    rounded = np.round(1e3 * exact, 4) / 1e3 if axis == "linear" else exact  # mm/s in a log of four decimals
    rec = ga.Record(T, velocity=rounded, torque=np.ones(len(rounded)))
    lines, words = _encoder(DataSet.of([rec], None, axis=axis, pitch=pitch), rounded, T)
    assert (lines, str(words)) == said


def test_the_step_of_an_encoder_is_seen_behind_the_rounding_of_a_log() -> None:
    q = 2.0 * np.pi / LINES / 125e-6
    true = 70.0 * np.sin(np.linspace(0.0, 20.0, 4000)) + np.random.default_rng(1).normal(size=4000)
    rpm = np.round(true / q) * q * 30.0 / np.pi + 1e-9 * np.random.default_rng(2).normal(size=4000)
    for decimals in (4, 3, 2):
        assert encoder_step(np.round(rpm, decimals) * np.pi / 30.0) == pytest.approx(q, rel=1e-5)
    scale = np.round(true / 0.1) * 1e-4  # m/s, of a linear scale of 0.1 micrometres read each millisecond
    assert encoder_step(scale, linear=True) == pytest.approx(1e-4) and encoder_step(scale) == 0.0
    assert encoder_step(true) == encoder_step(np.round(true, 2)) == encoder_step(np.round(rpm) * np.pi / 30.0) == 0.0


def test_a_differenced_angle_in_a_log_of_few_decimals_is_no_finding() -> None:
    rec = record(1, {})
    rpm = np.round(rec.velocity * 30.0 / np.pi, 4)
    dia = ga.diagnose(rec.with_channels(velocity=rpm * np.pi / 30.0), DRIVE.controller)
    assert any("half a sample old" in note for note in dia.notes), dia.summary()
    assert dia.causes == (), dia.summary()


@pytest.mark.long
@pytest.mark.parametrize("lines", [2**20, 1031703])
def test_half_a_period_of_a_controller_faster_than_the_log_is_no_delay(lines: int) -> None:
    """Four things differ from the given controller, so that the logged torque drives the model; it is straight between lines.

    How many output errors are independent, the search with the age and the one without say differently: the scores of the two
    are compared under the errors of one.
    """
    skip_without_library()
    pi, dt, every = ga.PI(0.06, 3.0, command_weight=0.5), 1e-3, 4
    filters = (ga.LowPass(0.5e-3), ga.Notch(150.0, 0.1, 0.7))
    loop = ga.Cascade(pi, period=dt / every, torque_filters=filters, command_filters=(ga.LowPass(3e-3),))
    drive = Plant(J=3e-4, D=1.5e-3, kp=0.06, ki=3.0, dt=dt, cascade=loop)
    noise = Noise(white=0.0, encoder=2.0 * np.pi / lines, differenced=True)
    rec = rig(drive, command(1), {"coulomb_friction": {"torque": 0.05}}, noise, 1)
    rec = rec.with_channels(velocity=np.round(rec.velocity * 30.0 / np.pi, 3) * np.pi / 30.0)
    given = ga.Cascade(ga.PI(0.06, 3.0), period=dt / every, torque_filters=(ga.LowPass(1e-3),))
    dia = ga.diagnose(rec, given)
    assert any("half a sample old (0.125 ms)" in note for note in dia.notes), dia.summary()
    assert {f.effect: f.alternatives for f in dia.causes} == {"coulomb_friction": ()}, dia.summary()


def test_the_mean_over_a_sample_is_exact_behind_a_current_loop() -> None:
    """J dw/dt = u - tau u', from rest under one step: theta(t) = u/J (t^2/2 - tau t + tau^2 (1 - exp(-t/tau)))."""
    J, tau, n = 1e-3, 0.3e-3, 40
    rec = ga.Record(T, torque=np.ones(n), velocity=np.zeros(n))
    model = ga.OneMass(J=J, D=0.0).model().with_effect("torque_lag", time_constant=tau)
    t = T * np.arange(n)
    theta = (t**2 / 2.0 - tau * t + tau**2 * -np.expm1(-t / tau)) / J
    exact = np.diff(theta, prepend=0.0) / T
    shown = means(ga.simulate(model, with_middles(rec))[None, :])[0]
    ends = ga.simulate(model, rec.with_channels(torque=late(rec.torque, 0.5, 0.0)))
    assert np.abs(shown - exact).max() < 0.02 * np.abs(ends - exact).max()


@pytest.mark.long
@pytest.mark.parametrize("lag", [0.0, 0.4e-3])
def test_a_differenced_angle_is_no_finding(lag: float) -> None:
    effects = {"torque_lag": {"time_constant": lag}} if lag else {}
    dia = ga.diagnose(record(1, effects), DRIVE.controller, validation=record(2, effects))
    assert any(f"({LINES} lines a turn)" in note for note in dia.notes), dia.summary()
    if not lag:
        assert dia.causes == (), dia.summary()
        return
    (found,) = dia.causes
    assert {found.effect, *found.alternatives} == {"torque_lag", "velocity_filter"}, dia.summary()
    assert found.parameters["time_constant"].value == pytest.approx(lag, rel=0.01)


@pytest.mark.long
def test_a_differenced_angle_without_a_logged_torque_is_no_finding() -> None:
    with_effect, bare = (record(1, effects).with_channels(torque=None) for effects in ({"torque_saturation": {"limit": 0.5}}, {}))
    dia = ga.diagnose(bare, DRIVE.controller)
    assert any(f"({LINES} lines a turn)" in note for note in dia.notes) and dia.causes == (), dia.summary()
    dia = ga.diagnose(with_effect, DRIVE.controller)
    assert any("torque_saturation" in (f.effect, *f.alternatives) for f in dia.causes), dia.summary()


@pytest.mark.long
@pytest.mark.parametrize(
    ("effect", "logged"), [("", True), ("stribeck_friction", True), ("torque_lag", True), ("cogging", True), ("cogging", False)]
)
def test_the_search_finds_the_age_where_the_lines_of_a_turn_are_no_whole_number(effect: str, logged: bool) -> None:
    """With cogging also the angle, which is integrated from the velocity, is half a sample old."""
    skip_without_library()
    rec, validation, controller, truth = random_case(314, effect or None, noise="differenced", torque_logged=logged)
    dia = ga.diagnose(rec, controller, validation=validation)
    assert any("half a sample old" in note for note in dia.notes), dia.summary()
    assert [effect in {f.effect, *f.alternatives} for f in dia.causes] == [True] * len(truth.effects), dia.summary()


# Resonance at 290 Hz, damped by 0.02; the zeros at 190 Hz.
SHAFT = Plant(J=2e-4, D=7e-4, JL=2.7e-4, DL=7e-4, KG=381.0, DG=0.0084, kp=0.06, ki=3.0, dt=T, name="shaft")
LAG = {"torque_lag": {"time_constant": 0.4e-3}}


@pytest.mark.long
def test_the_age_is_told_behind_a_lag_beside_a_resonance() -> None:
    """A mechanism that was fitted without the lag has its resonance elsewhere: neither age fits from there."""
    dia = ga.diagnose(record(1, LAG, drive=SHAFT), SHAFT.controller, validation=record(2, LAG, drive=SHAFT))
    assert any(f"({LINES} lines a turn)" in note for note in dia.notes), dia.summary()
    (found,) = dia.causes
    assert {found.effect, *found.alternatives} == {"torque_lag", "velocity_filter"}, dia.summary()
    assert found.parameters["time_constant"].value == pytest.approx(0.4e-3, rel=0.01)
    assert dia.mechanics["motor_inertia"].value == pytest.approx(SHAFT.J, rel=0.01)


def test_a_resonance_is_found_beside_the_lag_that_hides_it() -> None:
    rec = record(1, LAG, drive=SHAFT)
    data = DataSet.of([rec], None).aged(0.5)
    objective, scales = Objective(data, np.ones(len(rec))), scales_of(data)
    one = Task(objective, scales, ga.OneMass(J=4.7e-4, D=1.4e-3).model(), (), lambda message: None).one_mass()
    lag = LIBRARY["torque_lag"]
    longer = one.hypothesis.extended(lag)
    late = ls.fit(objective, longer, one.parameters.inserted(one.x, lag.coordinates({"time_constant": 0.3e-3})), WHITE, 12)
    fits = [ls.fit(objective, hypothesis, x, WHITE, 12) for hypothesis, x in on_a_shaft(objective, late)]
    best = min(fits, key=lambda f: f.cost)
    own = np.sqrt(SHAFT.KG * (1.0 / SHAFT.J + 1.0 / SHAFT.JL))
    assert best.parameters.kind == "two masses" and best.effects == ("torque_lag",)
    assert resonance(best) == pytest.approx(own, rel=0.01)
    assert best.cost < 0.01 * late.cost


def test_a_rounded_velocity_that_is_no_difference_is_not_taken_for_one() -> None:
    dia = ga.diagnose(record(1, {}, differenced=False), DRIVE.controller, validation=record(2, {}, differenced=False))
    assert dia.causes == () and not any("lines a turn" in note for note in dia.notes), dia.summary()


def test_an_extra_resonance_swings() -> None:
    class Scale:
        duration, dt = 1.0, 1e-3

    limits = LIBRARY["extra_resonance"].limits(Scale())  # type: ignore[arg-type]
    assert limits[1][1] == limits[3][1] == 0.5


def test_a_peak_that_the_found_model_follows_is_no_outlier() -> None:
    w = np.zeros(20)
    w[10] = 5.0
    weight = np.ones(20)
    weight[10] = 0.0
    assert unexplained(w, w, weight) == 1
    assert unexplained(w, 0.1 * w, weight) == 0


@pytest.mark.long
def test_a_linear_scale_has_decimal_lines_and_a_load_beside_it_is_no_friction() -> None:
    """A vertical axis whose brake opens on a held load: 25 N of friction, 250 N of load, a scale of 0.1 micrometres."""
    skip_without_library()
    axis = Plant(J=60.0, D=150.0, kp=6000.0, ki=2.4e5, dt=1e-3, name="vertical")
    speeds = np.repeat([0.0, 0.05, -0.08, 0.15, -0.02, 0.02, -0.2, 0.1, -0.01, 0.01, 0.0], 200)
    effects = {"load_torque": {"torque": 250.0}, "coulomb_friction": {"torque": 25.0}}
    rec = rig(axis, speeds, effects, Noise(white=0.0, encoder=1e-7, differenced=True), 1)
    dia = ga.diagnose(rec, axis.controller, axis="linear", seed=1)
    assert {f.effect: f.alternatives for f in dia.causes} == {"load_torque": (), "coulomb_friction": ()}


@pytest.mark.parametrize("controller", [ga.PI(0.06, 3.0), None])
def test_what_is_drawn_has_the_age_and_the_error_of_the_table(controller: ga.PI | None) -> None:
    rec = record(3, {"torque_lag": {"time_constant": 0.4e-3}})
    dia = ga.diagnose(rec, controller)
    assert dia.velocity_age == 0.5 == ga.Diagnosis.from_dict(dia.to_dict()).velocity_age
    view = run_of(dia, rec)
    assert view.extended is not None and view.held_out_from is not None
    # The curve has the parameters of the whole record, the table those of its first 70 %.
    error = (view.measured - view.extended)[view.held_out_from :]
    assert float(np.sqrt(np.mean(error**2))) == pytest.approx(dia.after.rmse, rel=0.05)


@pytest.mark.parametrize(("hertz", "every", "shaft"), [(500.0, 1, True), (900.0, 1, False), (900.0, 2, True)])
def test_a_resonance_faster_than_the_samples_show_is_no_shaft(hertz: float, every: int, shaft: bool) -> None:
    """0.8 of half the sampling frequency, that of the controller: 800 Hz at 0.5 ms, 1600 Hz at 0.25 ms."""
    rec = record(1, LAG, drive=SHAFT)
    controller = ga.Cascade(ga.PI(0.06, 3.0), period=T / every)
    data = DataSet.of([rec], controller)
    task = Task(
        Objective(data, np.ones(len(rec))), scales_of(data), ga.OneMass(J=4.7e-4, D=1.4e-3).model(), (), lambda message: None
    )
    stiffness = (2.0 * np.pi * hertz) ** 2 / (1.0 / SHAFT.J + 1.0 / SHAFT.JL)
    two = task.start(ga.TwoMass(JM=SHAFT.J, DM=1e-3, JL=SHAFT.JL, DL=1e-3, KG=stiffness, DG=1e-3 * stiffness / 1e3).model(), 0)
    assert resonance(two) == pytest.approx(2.0 * np.pi * hertz, rel=0.05)
    assert task.space().swings(two) is shaft
