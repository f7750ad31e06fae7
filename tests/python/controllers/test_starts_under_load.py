"""Records that begin under a load that the integrator stored before, as on a vertical axis: any controller, any clock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from test_servo import KI, KP, T

import gaident as ga
from drive_rig import AT_LOAD, Noise, Plant, rig, skip_without_library
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records.sizes import scales_of
from gaident.diagnosis.selection.bases import Task
from gaident.estimation.dataset import DataSet
from gaident.estimation.noise_model import WHITE
from gaident.estimation.objective import Objective
from gaident.identification.replay.driven_records import torque_driven
from gaident.identification.replay.replay import replay
from gaident.models.drive_torque import driven_by
from gaident.models.made_torque import stored_torque

skip_without_library()

LOAD = 0.3
LOOPS: dict[str, dict[str, Any]] = {
    "bare": {},
    "IP": {"velocity": {"command_weight": 0.0}},
    "limit": {"velocity": {"torque_limit": 1.2, "anti_windup": "hold"}},
    "low pass": {"torque_filters": ga.LowPass(time_constant=0.4e-3)},
    "slow low pass": {"torque_filters": ga.LowPass(time_constant=2.5e-3)},
    "notch": {"torque_filters": ga.Notch(frequency=200.0, numerator_damping=0.1, denominator_damping=0.7)},
    "velocity filter": {"velocity_filters": ga.LowPass(time_constant=0.5e-3)},
    "delay": {"delay": T},
    "position": {"position": ga.P(30.0), "position_period": 2 * T},
}


def case(loop: str, every: int, load: float = LOAD) -> tuple[ga.Record, ga.Cascade]:
    """A log, with noise, of one mass that has stood under the load for 0.4 s."""
    given = dict(LOOPS[loop])
    cascade = ga.Cascade(ga.PI(KP, KI, **given.pop("velocity", {})), period=T, **given)
    plant = Plant(J=1e-3, D=0.01, kp=KP, ki=KI, dt=every * T, cascade=cascade)
    n = np.arange(1600)
    speeds = np.array([0.0, 20.0, -15.0, 5.0, -30.0, 10.0, 30.0, -5.0])[n // 200]
    line = 5.0 * np.sin(2 * np.pi * n / 1600) if plant.placed else speeds
    rec = rig(plant, line, {"load_torque": {"torque": load}}, Noise(white=0.005), seed=1, position_logged=plant.placed,
              settle=round(0.4 / plant.dt))  # fmt: skip
    return rec, cascade


@pytest.mark.parametrize("every", [1, 4])
@pytest.mark.parametrize("loop", LOOPS)
def test_what_the_integrator_stored_is_read_from_the_torque(loop: str, every: int) -> None:
    rec, cascade = case(loop, every)
    assert stored_torque(driven_by(rec, cascade), cascade) == pytest.approx(LOAD, rel=0.03)
    assert stored_torque(rec, cascade, driven=False) == pytest.approx(LOAD, rel=0.03)
    empty, _ = case(loop, every, 0.0)
    assert stored_torque(driven_by(empty, cascade), cascade) == stored_torque(empty, cascade, driven=False) == 0.0


def test_nothing_shows_it_without_a_torque_or_what_the_controller_reads() -> None:
    rec, cascade = case("position", 4)
    assert stored_torque(rec.with_channels(torque=None), cascade) == 0.0
    assert stored_torque(rec.with_channels(position=None), cascade) == 0.0


def test_a_constant_beside_the_torque_is_no_doubt_of_the_controller() -> None:
    rec, cascade = case("IP", 1)
    assert torque_driven([rec], cascade).doubts == ()
    (doubt,) = torque_driven([rec], replace(cascade, velocity=ga.PI(2.0 * KP, KI))).doubts
    assert "does not follow" in str(doubt)


@pytest.mark.parametrize("loop", LOOPS)
def test_the_simulated_loop_begins_as_the_drive_did(loop: str) -> None:
    rec, cascade = case(loop, 4)
    driven = torque_driven([rec], cascade).records
    data = DataSet.of(driven, cascade)
    assert data.fits_in_loop and data.stored[0] == pytest.approx(LOAD, rel=0.03)
    model = ga.OneMass(J=1e-3, D=0.01).model().with_effect("load_torque", torque=LOAD)
    state = np.append(np.zeros(model.mechanism.order), data.stored[0])
    off = ga.simulate(model, rec, cascade, state) - rec.velocity
    assert np.sqrt(np.mean(off**2)) < 0.1  # the noise, which acts in the loop as well
    assert np.sqrt(np.mean((ga.simulate(model, rec, cascade) - rec.velocity)[:200] ** 2)) > 0.3


@pytest.mark.parametrize("load", [LOAD, -LOAD])
@pytest.mark.parametrize("loop", [name for name in LOOPS if name != "position"])
def test_the_replay_begins_under_the_load(loop: str, load: float) -> None:
    """Behind a limit or a filter no constant makes up for it; the position loop's log has an angle of its own start.

    From rest the controller reaches its limit earlier, or where it does not under the load.
    """
    rec, cascade = case(loop, 1, load)
    said = replay(rec, cascade)
    assert said.follows and said.cause == "initial_integral" and said.value == pytest.approx(load, rel=1e-3), said.sentence
    assert not replay(rec, replace(cascade, velocity=replace(cascade.velocity, kp=1.1 * KP))).follows


def test_a_torque_is_made_with_what_the_integrator_stored() -> None:
    """Under a limit it is more than a constant; before the first sample the filters behind it stand in it."""
    rec, cascade = case("limit", 1)
    assert np.abs(rec.torque).max() == 1.2, "the limit acts"
    assert np.abs(cascade.torque_of(rec, stored=LOAD) - rec.torque).max() < 1e-5  # the noise before the record is in it, too
    assert np.abs(cascade.torque_of(rec) + LOAD - rec.torque).max() > 0.1
    still = ga.Record(T, command=np.zeros(20), velocity=np.zeros(20))
    for loop in ("low pass", "notch", "velocity filter"):
        assert case(loop, 1)[1].torque_of(still, stored=LOAD) == pytest.approx(np.full(20, LOAD), rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(("loop", "every"), [("IP", 4), ("notch", 4), ("limit", 4), ("delay", 1)])
def test_the_load_is_named(loop: str, every: int) -> None:
    rec, cascade = case(loop, every)
    dia = ga.diagnose(rec, cascade)
    (found,) = [f for f in dia.findings if not f.is_noise]
    assert "load_torque" in (found.effect, *found.alternatives)
    assert dia.verdict == "explained" and "does not follow" not in " ".join(dia.summary().split())
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize(
    ("loop", "form"), [("IP", ["command_weight"]), ("limit", ["torque_saturation", "anti_windup"]), ("notch", ["torque_filter"])]
)
def test_a_form_that_was_not_given_is_named_under_a_load(loop: str, form: list[str]) -> None:
    rec, _ = case(loop, 4)
    dia = ga.diagnose(rec, ga.Cascade(ga.PI(KP, KI), period=T))
    assert [f.effect for f in dia.findings if not f.is_noise] == [*form, "load_torque"], dia.summary()
    assert dia.verdict == "explained" and dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)


def test_under_a_bare_pi_the_loop_says_whether_a_model_with_the_load_leaves_little() -> None:
    """Driven by the torque a model integrates what disturbs it; the loop holds that, and hides a load where a model has none."""
    rng = np.random.default_rng(5)
    levels = np.repeat([0.0, 20.0, -30.0, 10.0, 40.0, -10.0], 200)
    drive = ga.OneMass(J=1e-3, D=0.01).model()
    pi = ga.PI(KP, KI)
    noise = 0.03 * rng.standard_normal(len(levels))
    still = ga.Record(1e-3, command=levels - noise, velocity=np.zeros(len(levels)))
    done = ga.run(drive.with_effect("load_torque", torque=LOAD), still, pi, np.append(np.zeros(drive.order), LOAD))
    disturbed = done.torque + 0.005 * lfilter([1.0], [1.0, -0.98], rng.standard_normal(len(levels)))
    rec = ga.Record(1e-3, command=levels, velocity=done.velocity + noise, torque=disturbed)
    data = DataSet.of([rec], pi)
    assert data.stored[0] == pytest.approx(LOAD, rel=0.1)
    assert data.simulates_loop and not data.fits_in_loop
    assert not DataSet.of([rec.with_channels(command=None)], pi).simulates_loop
    load = LIBRARY["load_torque"]
    task = Task(Objective(data, np.ones(len(rec))), scales_of(data), drive, (load,), lambda message: None)
    space, without = task.space(), task.one_mass()
    hypothesis, at_hand = without.hypothesis.extended(load), load.coordinates({"torque": LOAD})
    true = without.parameters.start(drive)
    there = replace(without, hypothesis=hypothesis, x=without.parameters.inserted(true, at_hand))
    assert space.small_unwhitened(there) and not space.small_unwhitened(without)
    limit = len(rec) * (space.policy.free_run_ratio * space.noise_beside(there)) ** 2
    assert space.objective.costs(hypothesis, there.x[None, :], WHITE)[0] > limit, "driven by the torque it leaves much"


@pytest.mark.long
@pytest.mark.parametrize("end", ["", AT_LOAD])
def test_where_on_the_shaft_a_load_acts_that_was_there_before_is_not_said(end: str) -> None:
    """It twists the shaft all the time, and turns the motor the same from either end."""
    plant = Plant(J=4e-4, D=4e-3, kp=0.05, ki=2.0, dt=1e-3, JL=9e-4, DL=6e-3, KG=60.0, DG=0.02)
    speeds = np.repeat([0.0, 20.0, -15.0, 5.0, -30.0, 10.0, 30.0, -5.0], 200)
    rec = rig(plant, speeds, {"load_torque" + end: {"torque": LOAD}}, Noise(white=0.005), seed=1, settle=600)
    dia = ga.diagnose(rec, plant.controller)
    (load,) = dia.causes
    assert load.effect == "load_torque" and load.sides == ("motor", "load"), dia.summary()
    assert load.parameters["torque"].value == pytest.approx(LOAD, rel=0.01)
    assert "at the motor or at the load (these data do not say which)" in " ".join(dia.summary().split())
