"""Drag at one speed is viscous friction there: where a record says so, and where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.diagnosis import work
from gaident.diagnosis.experiments.excitation import excitation

DT = 1e-3
DRIVE = ga.OneMass(J=3e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.02)
STEEP = np.concatenate([np.linspace(0.0, 60.0, 800), np.linspace(60.0, -60.0, 1600), np.linspace(-60.0, 0.0, 800)])


def run(command: NDArray[np.float64], ki: float) -> ga.Record:
    """A run under the command; ki 0.2 N m/rad does not overshoot, 1.9 N m/rad by a fifth."""
    noise = 0.02 * np.random.default_rng(1).standard_normal(len(command))
    done = ga.run(DRIVE, ga.Record(DT, command=command - noise, velocity=noise), ga.PI(0.03, ki))
    return ga.Record(DT, command=command, velocity=done.velocity + noise, torque=done.torque)


def said(rec: ga.Record) -> str:
    return excitation(rec).not_testable.get("quadratic_drag", "")


@pytest.mark.parametrize("command", [np.full(1500, 40.0), np.repeat([40.0, -40.0] * 2, 400), np.repeat([40.0, 0.0] * 2, 400)],
                         ids=["a step", "both directions", "with rests"])  # fmt: skip
def test_one_speed_is_said(command: NDArray[np.float64]) -> None:
    rec = run(command, 0.2)
    top = float(np.abs(rec.velocity).max())
    assert 30.0 < top < 44.0
    why = said(rec)
    assert why.startswith("one speed only (") and why.endswith(" rad/s): its drag is viscous friction there")
    assert float(why.split("(")[1].split()[0]) == pytest.approx(top, rel=0.01)


@pytest.mark.parametrize("command", [np.repeat([40.0, 20.0] * 2, 400), np.repeat([40.0, -25.0] * 2, 400), STEEP,
                                     60.0 * np.sin(np.arange(3000) * DT * np.pi * 2.0)],
                         ids=["two speeds", "one in each direction", "a triangle", "a sine"])  # fmt: skip
def test_several_speeds_are_not_one(command: NDArray[np.float64]) -> None:
    assert said(run(command, 0.2)) == ""


def test_an_overshoot_of_more_than_a_tenth_is_another_speed() -> None:
    """The share of the time at the highest speed counts, and that is the overshoot's: the drag is tried."""
    rec = run(np.full(1500, 40.0), 1.9)
    assert rec.velocity.max() > 1.1 * 40.0 and said(rec) == ""


def held(command: NDArray[np.float64], friction: float, seed: int) -> ga.Record:
    """A run under the command, with white noise of 0.1 rad/s; the torque drives the model."""
    drive = ga.OneMass(J=3e-4, D=2e-3).model()
    if friction:
        drive = drive.with_effect("coulomb_friction", torque=friction)
    noise = 0.1 * np.random.default_rng(seed).standard_normal(len(command))
    done = ga.run(drive, ga.Record(DT, command=command - noise, velocity=noise), ga.PI(0.03, 1.9))
    return ga.Record(DT, velocity=done.velocity + noise, torque=done.torque)


@pytest.mark.long
@pytest.mark.parametrize(("friction", "seeds"), [(0.02, range(4)), (0.002, range(8))])
def test_the_viscous_friction_of_a_step_contains_the_dry_one_and_its_deviation_says_so(
    friction: float, seeds: range, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.02 N m at 40 rad/s are 0.0005 N m s/rad: a quarter of the viscous friction, and not named in 120 samples.

    A tenth of it is below what the noise makes of a friction: with some seeds the fit beside one ends at 0.
    """
    excess = friction / 40.0
    for seed in seeds:
        rec = held(np.full(120, 40.0), friction, seed)
        dia = ga.diagnose(rec)
        assert dia.verdict == "adequate" and not dia.causes
        viscous = dia.mechanics["viscous_friction"]
        off = viscous.value - 2e-3
        assert 0.7 * excess < off < 1.2 * excess and off < 2.0 * viscous.std < 2e-3
        said = any("do not tell viscous friction from coulomb friction" in note for note in dia.notes)
        assert said == (friction > 0.01), "a deviation of less than a tenth is not worth a sentence"
        with monkeypatch.context() as alone:
            alone.setattr(work, "friction_beside", lambda objective, fit: (np.zeros((len(fit.x), len(fit.x))), []))
            assert off > 10.0 * ga.diagnose(rec).mechanics["viscous_friction"].std


def test_where_a_record_excludes_dry_friction_nothing_is_said_of_it() -> None:
    levels = np.repeat([40.0, -25.0, 10.0, 60.0, -60.0, 5.0, -5.0, 30.0, 0.0, 20.0], 300)
    dia = ga.diagnose(held(levels, 0.0, 1))
    viscous = dia.mechanics["viscous_friction"]
    assert dia.verdict == "adequate" and not any("do not tell viscous" in note for note in dia.notes)
    assert abs(viscous.value - 2e-3) < 3.0 * viscous.std < 2e-5


def test_an_impossible_damping_is_not_excused_by_a_friction_that_is_not_there() -> None:
    """A motor that drives itself, -2e-4 N m s/rad: unexplained, as before friction beside it was asked for."""
    t, w = np.arange(120) * DT, 0.0
    velocity, torque = np.zeros(120), 0.05 * (t < 0.08)
    for n in range(120):
        velocity[n] = w
        for _ in range(20):
            w += DT / 20 * (torque[n] + 2e-4 * w) / 3e-4
    rec = ga.Record(DT, velocity=velocity + 0.01 * np.random.default_rng(0).standard_normal(120), torque=torque)
    dia = ga.diagnose(rec)
    assert dia.mechanics["viscous_friction"].value == pytest.approx(-2e-4, rel=0.05)
    assert dia.verdict == "unexplained" and not any("do not tell viscous" in note for note in dia.notes)


AXIS = Plant(J=3e-4, D=2e-3, kp=0.03, ki=1.0, dt=DT)
TORQUES = {
    "torque_hum": {"amplitude": 0.05, "frequency": 100.0 / np.pi, "phase": 0.4},  # at 40 rad/s the fifth order
    "cogging": {"amplitude": 0.05, "order": 5.0, "phase": 0.4},
}


def at_one_speed(effects: dict[str, dict[str, float]], cut: int) -> ga.Diagnosis:
    """A step to 40 rad/s from rest, or a part of it in which that speed is held."""
    skip_without_library()
    rec = rig(AXIS, np.append(np.zeros(20), np.full(700, 40.0)), effects, Noise(white=0.05), seed=3)
    return ga.diagnose(rec[cut:], ga.PI(AXIS.kp, AXIS.ki))


@pytest.mark.long
@pytest.mark.parametrize("effects", [{}, {"coulomb_friction": {"torque": 0.05}}], ids=["clean", "dry friction"])
def test_a_record_that_holds_one_speed_has_nothing_wrong(effects: dict[str, dict[str, float]]) -> None:
    """Nothing but noise moves it: no inertia that counts, and no cause."""
    dia = at_one_speed(effects, 200)
    assert dia.verdict == "adequate" and not dia.causes, dia.summary()
    assert dia.after.rmse == pytest.approx(0.05, rel=0.1)


@pytest.mark.long
def test_without_a_torque_and_a_change_of_speed_nothing_is_named() -> None:
    """A limit that does not act is no reason to begin a free run at rest; a ripple of an axis that nothing moves is no cause."""
    skip_without_library()
    command = np.append(np.zeros(20), np.full(700, 40.0))
    clean, cogging = (
        rig(AXIS, command, effects, Noise(white=0.05), seed=3, torque_logged=False)[200:]
        for effects in ({}, {"cogging": TORQUES["cogging"]})
    )
    dia = ga.diagnose(clean, ga.PI(AXIS.kp, AXIS.ki, torque_limit=0.6))
    assert dia.verdict == "adequate" and dia.after.rmse == pytest.approx(0.05, rel=0.1), dia.summary()
    dia = ga.diagnose(cogging, ga.PI(AXIS.kp, AXIS.ki))
    assert not dia.causes and dia.verdict == "unexplained", dia.summary()
    assert any("do not show what the torque does to this axis" in note for note in dia.notes)


@pytest.mark.long
@pytest.mark.parametrize("name", list(TORQUES))
def test_a_hum_and_a_cogging_of_one_held_speed_are_one_class_and_an_experiment_separates_them(name: str) -> None:
    assert [(f.effect, f.alternatives) for f in at_one_speed({name: TORQUES[name]}, 0).causes] == [(name, ())]  # the run up
    dia = at_one_speed({name: TORQUES[name]}, 200)
    (found,) = dia.causes
    assert {"torque_hum", "cogging"} <= {found.effect, *found.alternatives} and dia.verdict == "explained"
    assert dia.next_experiment is not None and {"torque_hum", "cogging"} <= {*dia.next_experiment.separates}
