"""The check of a diagnosis by a second method: it agrees with the truth, contradicts what is wrong, else keeps silent."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, rig, skip_without_library
from gaident.axis import said
from gaident.diagnosis.check import Check, _contradicts, _of_the_filter, _smaller_sentence, checked
from gaident.diagnosis.gains import Gains
from gaident.diagnosis.inertia_and_angle import inertia_rests_on
from gaident.estimation.dataset import DataSet
from gaident.estimation.regression.force_error import FilteredRecords
from gaident.results.diagnosis import Fitness
from gaident.results.fitness import Comparison
from gaident.show.wording import with_std

skip_without_library()

PLANT = Plant(J=3e-4, D=1.5e-3, kp=0.03, ki=1.9, dt=1e-3)
TIME = 1e-3 * np.arange(6000)
COMMAND = 30.0 * np.sin(2.0 * np.pi * 1.3 * TIME) + 10.0 * np.sin(2.0 * np.pi * 3.1 * TIME)
FRICTION = {"torque": 0.05}
SWING = {"amplitude": 0.08, "phase": 0.4}


def record(**effects: dict[str, float]) -> ga.Record:
    rec = rig(PLANT, COMMAND, effects, noise="white", seed=3, position_logged=True)
    return ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque, position=rec.position)


def estimates(effects: dict[str, dict[str, float]]) -> dict[str, dict[str, ga.Estimate]]:
    units = {
        "torque": "N m",
        "amplitude": "N m",
        "phase": "rad",
        "width": "N m",
        "limit": "N m",
        "static_torque": "N m",
        "stribeck_velocity": "rad/s",
    }
    return {e: {n: ga.Estimate(v, 0.01 * v, units[n]) for n, v in p.items()} for e, p in effects.items()}


def check_of(
    rec: ga.Record, inertia: float = 3e-4, share: float = 0.01, driven: bool = False, **effects: dict[str, float]
) -> Check:
    """The check of a diagnosis that says this."""
    bare = ga.OneMass(inertia, PLANT.D).model()
    model = bare
    for name, values in effects.items():
        model = model.with_effect(name, **values)
    fitness = Fitness(1.0, 0.0, 0.1)
    gains = Gains(fitness, fitness, (0.0, 0.0), "the rest", {}, ((rec, 4200),), bare, model)
    mechanics = {"inertia": ga.Estimate(inertia, share * inertia, "kg m^2")}
    data = DataSet.of([rec], None if driven else PLANT.controller)
    return checked(data, gains, model, mechanics, estimates(effects))


def rows(check: Check) -> dict[str, Any]:
    return {c.name: c for c in check.comparisons}


def test_at_the_truth_both_agree_and_nothing_is_noted() -> None:
    check = check_of(record(coulomb_friction=FRICTION, unbalance=SWING), coulomb_friction=FRICTION, unbalance=SWING)
    assert set(rows(check)) == {"inertia", "dry friction", "gravity"}
    assert not any(c.differs for c in check.comparisons) and check.notes == ()
    assert check.regression is not None and set(check.regression.terms) >= {"inertia", "coulomb", "gravity"}
    assert check.before.force_error > 5.0 * check.after.force_error > 5.0 * 0.7 * check.after.force_floor
    assert check.after.force_error < check.force_error < 0.02 * check.after.torque_rms
    assert check.after.force_percent == pytest.approx(100.0 * check.after.force_error / check.after.torque_rms)
    assert "gravity" in check.reason


def test_what_the_filter_leaves_of_a_right_model_is_no_error_of_it() -> None:
    """Without any noise friction alone leaves a force error at its reversals; a wrong inertia leaves more than that."""
    rec = rig(PLANT, COMMAND, {"coulomb_friction": FRICTION}, noise="none", position_logged=True)
    rec = ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque, position=rec.position)
    right, wrong = (check_of(rec, inertia=J, coulomb_friction=FRICTION).after for J in (3e-4, 3.6e-4))
    assert right.force_error is not None and right.force_floor is not None and right.torque_rms is not None
    assert right.force_error > 1e-4 * right.torque_rms
    assert 0.5 < right.force_error / right.force_floor < 1.5
    assert wrong.force_error > 5.0 * wrong.force_floor  # type: ignore[operator]


def test_what_the_filter_leaves_is_judged_at_the_angle_that_the_effects_turned_with() -> None:
    """A torque that is 2 % too large carries the model's own angle away from the logged one, with which its gravity turns."""
    rec = rig(PLANT, COMMAND, {"unbalance": SWING}, noise="none", position_logged=True)
    assert rec.torque is not None
    effects = {"unbalance": SWING}
    right, larger = (
        check_of(ga.Record(rec.dt, velocity=rec.velocity, torque=k * rec.torque, position=rec.position), **effects).after
        for k in (1.0, 1.02)
    )
    assert right.force_floor is not None and larger.force_floor is not None and larger.force_error is not None
    assert larger.force_floor < 2.0 * right.force_floor + 1e-6 and larger.force_floor < 0.2 * larger.force_error


def test_a_run_that_misses_the_motion_measures_no_filter() -> None:
    """A pendulum under its own torque falls another way: what its model leaves there says nothing of the record."""
    rec = record(unbalance=SWING)
    model = ga.OneMass(3e-4, PLANT.D).model().with_effect("unbalance", amplitude=10.0, phase=0.4)
    assert _of_the_filter(model, FilteredRecords((rec,), (0,), 20.0)) == 0.0


def test_a_wrong_inertia_is_contradicted_with_both_numbers() -> None:
    check = check_of(record(coulomb_friction=FRICTION), inertia=9e-4, coulomb_friction=FRICTION)
    (note,) = check.notes
    assert rows(check)["inertia"].differs and not rows(check)["dry friction"].differs
    by_regression = rows(check)["inertia"].regression
    assert "the inertia of the diagnosis is (9.000 +- 0.090)e-04 kg m^2" in note
    assert f"says {with_std(by_regression.value, by_regression.std)} kg m^2" in note
    assert by_regression.value == pytest.approx(3e-4, rel=0.01)
    assert "Likely: a delay between the channels" in note and "the regression leaves less of the torque" in note


def test_a_friction_that_the_diagnosis_has_not_is_contradicted() -> None:
    check = check_of(record(coulomb_friction=FRICTION))
    (note,) = check.notes
    by_regression = rows(check)["dry friction"].regression
    assert "the diagnosis has no dry friction" in note
    assert f"says {with_std(by_regression.value, by_regression.std)} N m" in note
    assert by_regression.value == pytest.approx(0.05, rel=0.01)


def test_gravity_that_the_diagnosis_has_and_the_motion_has_not_is_contradicted() -> None:
    check = check_of(record(coulomb_friction=FRICTION), coulomb_friction=FRICTION, unbalance=SWING)
    assert rows(check)["gravity"].differs
    assert any("finds none of it" in note for note in check.notes)


def test_behind_an_actuator_the_logged_torque_is_not_comparable() -> None:
    width = {"width": 0.05}
    check = check_of(record(torque_dead_band=width), torque_dead_band=width)
    assert check.notes == () and not any(c.differs for c in check.comparisons)
    assert check.after.force_error < 0.2 * check.before.force_error
    wrong = check_of(record(torque_dead_band=width), inertia=9e-4, torque_dead_band=width)
    c = rows(wrong)["inertia"]
    assert c.differs and c.of_model is not None and c.of_model.value > 2.0 * c.regression.value


def test_a_model_that_loses_to_the_regression_is_told_so_whatever_its_deviations() -> None:
    """Inertia and friction so uncertain that they contradict nothing, and a model that leaves most of the torque."""
    rec = record(coulomb_friction=FRICTION)
    check = check_of(rec, inertia=6e-3, share=0.9, coulomb_friction=FRICTION)
    (note,) = check.notes
    assert not any(c.differs for c in check.comparisons)
    assert "the diagnosed model leaves" in note and "trust those of the regression" in note


def test_a_difference_that_does_not_matter_is_no_disagreement() -> None:
    """A model that leaves 1.6 % of the torque where the regression leaves 0.5 %: far beyond both deviations, and nothing."""
    rec = rig(PLANT, COMMAND, {"coulomb_friction": FRICTION}, noise="none", seed=3, position_logged=True)
    rec = ga.Record(rec.dt, velocity=rec.velocity, torque=rec.torque, position=rec.position)
    check = check_of(rec, inertia=3.1e-4, share=0.9, coulomb_friction=FRICTION)
    own, second, torque = check.after.force_error, check.force_error, check.after.torque_rms
    assert check.regression_better and own > 2.0 * max(second, check.after.force_floor)
    assert own - second < 0.05 * torque and check.notes == ()


def test_a_small_difference_is_said_where_the_regression_of_a_right_model_has_it_not() -> None:
    """An inertia that is 3 % wrong at 0.2 %; of the right one the regression is off by more than its deviation, too.

    A measured torque is compared at its lines, and this one is held: half a sample between them and the motion.
    """
    rec = record(coulomb_friction=FRICTION).with_channels(torque_is="measured")
    sizes = ((3e-4, 1e-4), (3.09e-4, 2e-3))
    right, wrong = (check_of(rec, inertia=J, share=share, coulomb_friction=FRICTION) for J, share in sizes)
    c = rows(right)["inertia"]
    assert abs(c.diagnosis.value - c.regression.value) > 3.0 * np.hypot(c.diagnosis.std, c.regression.std) and right.notes == ()
    (note,) = wrong.notes
    assert not any(c.differs for c in wrong.comparisons)
    assert note.startswith("The inertia of the diagnosis is (3.0900 +- 0.0062)e-04 kg m^2, the inverse-dynamics regression")
    assert "times both deviations" in note and re.search(r"2\.\d % apart", note)
    assert re.search(r"made it says \(3\.09\d\d \+- 0\.00\d\d\)e-04 kg m\^2", note)
    assert said(note, "linear").startswith("The mass of the diagnosis is (3.0900 +- 0.0062)e-04 kg, ")
    behind = check_of(rec, inertia=3.09e-4, share=2e-3, coulomb_friction=FRICTION, torque_dead_band={"width": 1e-4})
    assert behind.notes == ()


def test_a_spring_matters_by_the_torque_that_it_makes_over_the_travel() -> None:
    """As friction and gravity do: 5 % of the torque's rms, whatever the stiffness is in N m/rad."""
    none, found = ga.Estimate(0.0, 0.0, "N m/rad"), ga.Estimate(3.55, 0.1, "N m/rad")
    spring = Comparison("ground stiffness", none, found, False)
    assert not _contradicts(spring, 50.0, 0.123) and _contradicts(spring, 50.0, 1.23)
    load = Comparison("gravity", ga.Estimate(0.0, 0.0, "N m"), ga.Estimate(3.55, 0.1, "N m"), False)
    assert _contradicts(load, 50.0, 0.0) and not _contradicts(load, 100.0, 10.0)
    note = _smaller_sentence(spring, ga.Estimate(0.5, 0.1, "N m/rad"))
    assert "has no ground stiffness" in note and "35.5 times both deviations" in note and "% apart" not in note


def test_friction_that_falls_with_the_speed_is_no_contradiction() -> None:
    """The regression has one level for all speeds: of the right model it says the same as of the record."""
    falling = {"torque": 0.04, "static_torque": 0.12, "stribeck_velocity": 12.0}
    check = check_of(record(stribeck_friction=falling), stribeck_friction=falling)
    c = rows(check)["dry friction"]
    assert c.regression.value > 1.2 * c.diagnosis.value and c.of_model is not None
    assert c.of_model.value == pytest.approx(c.regression.value, rel=0.03)
    assert not c.differs and check.notes == ()
    wrong = check_of(record(stribeck_friction=falling), coulomb_friction={"torque": 0.04})
    assert rows(wrong)["dry friction"].differs


def test_friction_of_two_levels_is_compared_by_its_mean() -> None:
    levels = {"torque_positive": 0.04, "torque_negative": 0.06, "viscous_positive": 0.0, "viscous_negative": 0.0}
    rec = record(asymmetric_friction=levels)
    check = check_of(rec)
    assert rows(check)["dry friction"].regression.value == pytest.approx(0.05, rel=0.05)


def test_without_a_torque_there_is_no_check() -> None:
    rec = rig(PLANT, COMMAND, {}, noise="white", seed=3, torque_logged=False)
    check = check_of(rec)
    assert check.regression is None and check.comparisons == () and check.after.force_error is None


def test_a_model_that_diverges_along_the_motion_has_no_force_error() -> None:
    """A pole far in the right half plane: the loop that leads it along the motion does not hold it."""
    rec = record(coulomb_friction=FRICTION)
    runs_away = ga.Model(1.0 / 3e-4, [2e4])
    axis = ga.OneMass(3e-4, PLANT.D).model().with_effect("coulomb_friction", **FRICTION)
    fitness = Fitness(1.0, 0.0, 0.1)
    gains = Gains(fitness, fitness, (0.0, 0.0), "the rest", {}, ((rec, 4200),), runs_away, axis)
    check = checked(DataSet.of([rec], PLANT.controller), gains, axis, {}, estimates({"coulomb_friction": FRICTION}))
    assert check.before.force_error is None and check.after.force_error < 0.1 * check.after.torque_rms


def test_what_does_not_move_has_no_regression_and_no_force_error() -> None:
    rng = np.random.default_rng(0)
    rec = ga.Record(1e-3, velocity=1e-3 * rng.standard_normal(5000), torque=1e-3 * rng.standard_normal(5000))
    check = check_of(rec, driven=True)
    assert check.notes == ()


def test_a_diagnosis_carries_it_and_its_file_too(tmp_path: Any) -> None:
    rec = record(coulomb_friction=FRICTION)
    dia = ga.diagnose(rec)
    assert [f.effect for f in dia.findings] == ["coulomb_friction"]
    assert dia.regression is not None and dia.regression.digests
    assert dia.before.force_error > 5.0 * dia.after.force_error and not any("disagree" in note for note in dia.notes)
    text = dia.summary()
    assert "Torque error, on the last 30 %" in text and "figure to go by here" in " ".join(text.split())
    assert "Check by inverse-dynamics regression" in text
    dia.save(tmp_path / "dia.json")
    back = ga.load(tmp_path / "dia.json")
    assert isinstance(back, ga.Diagnosis)
    assert back.comparisons == dia.comparisons and back.after == dia.after and back.force_reason == dia.force_reason
    assert back.regression_force_error == dia.regression_force_error
    assert back.regression.to_dict() == dia.regression.to_dict()
    assert replace(back, seconds=0.0).summary() == replace(dia, seconds=0.0).summary()


@pytest.mark.parametrize(("axis", "term"), [("rotary", "gravity"), ("linear", "a spring to ground")])
def test_one_sine_leaves_the_inertia_open_to_a_torque_of_the_angle(axis: Any, term: str):
    # a = -omega^2 theta on one sine, so that an inertia and a spring, or a small part of a turn of gravity, are one torque
    def notes(*omegas: float) -> list[str]:
        t, rng = 0.01 * np.arange(4000), np.random.default_rng(3)
        angle, w, a = (sum(f(x, t) for x in omegas) for f in (_angle, _velocity, _acceleration))
        torque = 0.5 * a + 3.0 * w + 2.5 * np.sign(w) + 0.2 * rng.standard_normal(len(t))
        rec = ga.Record(0.01, velocity=w, torque=torque, position=angle)
        return [said(n, axis) for n in inertia_rests_on(ga.inverse_dynamics(rec, axis=axis), [rec])]

    (told,) = notes(0.6)
    thing = "mass" if axis == "linear" else "inertia"
    assert f"With {term} left open the inverse-dynamics regression finds the {thing} as " in told
    assert not notes(0.6, 2.1)


def _angle(omega: float, t: np.ndarray) -> np.ndarray:
    return -0.48 / omega * np.cos(omega * t)


def _velocity(omega: float, t: np.ndarray) -> np.ndarray:
    return 0.48 * np.sin(omega * t)


def _acceleration(omega: float, t: np.ndarray) -> np.ndarray:
    return 0.48 * omega * np.cos(omega * t)
