"""A model that loses on held-out data names nothing that no second method sees; what is printed is what is judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import skip_without_library
from gaident.axis import Text
from gaident.diagnosis.check import Check
from gaident.diagnosis.explain.held_out import standing
from gaident.diagnosis.gains import Gains, interval_of_fall
from gaident.diagnosis.held_parts import held_out_from, held_parts
from gaident.diagnosis.linear_part import linear_of_part
from gaident.errors import RecordError
from gaident.policy.table import POLICY
from gaident.results.fitness import IN_SAMPLE, Fitness

MODEL = ga.OneMass(3e-4, 1e-3).model()
RNG = np.random.default_rng(1)


def gains(low: float, high: float, held_out: str = "the rest") -> Gains:
    """Gains of this interval, the error of the model behind being in the middle of it."""
    before, after = Fitness(1.0, 0.0, 0.1), Fitness(1.0 - 0.5 * (low + high), 0.0, 0.1)
    return Gains(before, after, (low, high), held_out, {}, (), MODEL, MODEL)


def check(
    before: float | None, after: float | None, better: bool = False, terms: tuple[str, ...] = (), loses: bool = False
) -> Check:
    regression = None
    if terms:
        t = 1e-3 * np.arange(4000)
        w = 5.0 * np.sin(5.0 * t)
        rec = ga.Record(1e-3, velocity=w, torque=2e-3 * 25.0 * np.cos(5.0 * t) + 0.01 * w + 0.1 * np.sign(w))
        regression = ga.inverse_dynamics(rec, terms=terms)
    force = [Fitness(1.0, 0.0, 0.1, force_error=x, torque_rms=1.0, force_floor=0.0) for x in (before, after)]
    return Check(regression, None, (), force[0], force[1], (), Text("the torque drives the simulation"), better, loses)


def alone(effect: str) -> set[str]:
    """Records that tell every effect from every other."""
    return set()


@pytest.mark.parametrize(
    ("low", "high", "before", "after", "better", "stands"),
    [
        (0.1, 0.5, 0.2, 0.1, True, True),  # the free run gains: what the regression leaves does not matter
        (-0.5, -0.1, 0.2, 0.3, False, False),  # both figures are worse
        (-0.5, -0.1, None, None, False, False),  # no torque to go by
        (-0.02, -0.01, 0.2, 0.3, False, True),  # surely worse, by less than matters
        (-0.5, 0.1, 0.2, 0.3, False, True),  # a lower error within its variation decides nothing
        (-0.5, 0.1, 0.2, 0.3, True, False),  # no gain, and the regression leaves less
    ],
)
def test_what_stands(low: float, high: float, before: float | None, after: float | None, better: bool, stands: bool) -> None:
    causes, why = standing(["torque_dead_band"], gains(low, high), check(before, after, better), alone)
    assert (causes == ["torque_dead_band"], why == ()) == (stands, stands)


def test_a_cause_that_the_regression_holds_has_a_second_witness() -> None:
    seen = check(0.2, 0.3, terms=("inertia", "viscous", "coulomb"))
    causes, why = standing(["torque_dead_band", "stribeck_friction"], gains(-0.5, -0.1), seen, alone)
    assert causes == ["stribeck_friction"] and len(why) == 1 and "no explanation" in why[0]
    causes, why = standing(["stribeck_friction"], gains(-0.5, -0.1), seen, alone)
    assert causes == ["stribeck_friction"] and len(why) == 1
    assert "no explanation by itself. Stribeck friction stands: the regression finds the same" in why[0]
    # No gain, and a regression that is surely the better one, by less than matters: nothing is said of a cause that it has, too.
    seen = check(0.2, 0.3, True, terms=("inertia", "viscous", "coulomb"))
    assert standing(["stribeck_friction"], gains(-0.5, 0.1), seen, alone) == (["stribeck_friction"], ())
    # What the records cannot tell from it is the same witness.
    assert standing(["torque_dead_band"], gains(-0.5, -0.1), seen, lambda e: {"coulomb_friction"})[0] == ["torque_dead_band"]


def test_a_name_that_stands_by_the_torque_says_so() -> None:
    """The free run is worse and the force error smaller: gravity, or an axis that integrates."""
    causes, why = standing(["unbalance", "coulomb_friction"], gains(-0.5, -0.1), check(0.2, 0.1), alone)
    assert causes == ["unbalance", "coulomb_friction"] and len(why) == 1
    assert "worse than that of the linear model" in why[0] and "stand by the torque" in why[0]
    assert "falls from 0.2 to 0.1 N m, and the torque drives the simulation." in why[0]
    causes, why = standing(["unbalance"], gains(-0.5, -0.1), check(None, 0.1), alone)
    assert causes == ["unbalance"] and "the model without effects diverges" in why[0]


def test_a_name_whose_model_leaves_far_more_of_the_torque_than_the_regression_is_none() -> None:
    """Also where its free run is better than that of the linear model; what the regression has, too, stands."""
    lost = check(0.4, 0.3, True, terms=("inertia", "viscous", "coulomb"), loses=True)
    causes, why = standing(["torque_dead_band", "coulomb_friction"], gains(0.1, 0.5), lost, alone)
    assert causes == ["coulomb_friction"] and "better than the linear one in free run, but leaves more of the torque" in why[0]
    assert standing(["torque_dead_band"], gains(0.1, 0.5), lost, alone)[0] == []


def moving(count: int, still: int = 0, before: int = 0, seed: int = 1, size: float = 20.0) -> ga.Record:
    """Samples in motion between samples at rest, with noise of 0.03 rad/s."""
    rng = np.random.default_rng(seed)
    w = np.concatenate([np.zeros(before), size * np.sin(0.05 * np.arange(count)), np.zeros(still)])
    return ga.Record(1e-3, velocity=w + 0.03 * rng.standard_normal(len(w)), torque=np.ones(len(w)))


@pytest.mark.parametrize(
    ("count", "still", "before", "at"),
    [
        (3000, 0, 0, 2100),  # of the time
        (1800, 1200, 0, 1265),  # the end at rest: of the path
        (1000, 0, 2000, 2702),  # the beginning at rest
        (600, 2400, 0, None),  # too little is left to fit
        (200, 0, 2800, None),  # too little is left to hold out
    ],
)
def test_what_is_held_out_holds_motion(count: int, still: int, before: int, at: int | None) -> None:
    rec = moving(count, still, before)
    found = held_out_from(rec)
    assert found is None if at is None else abs(found - at) < 30
    if found is None:
        assert held_parts([rec], [], None)[1:3] == (IN_SAMPLE, None)
        return
    parts = rec.velocity[:found], rec.velocity[found:]
    assert all(np.sqrt(np.mean(w**2)) > 1.0 for w in parts)
    paths = [np.sum(np.abs(w)) for w in parts]
    assert paths[0] == pytest.approx(0.7 * sum(paths), rel=0.03)
    words = held_parts([rec], [], None).words
    assert words.startswith("the last 30 % of the record," if not still + before else "the last 30 % of its path,")


def test_words_and_cut_have_the_share_of_the_policy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaident.diagnosis.held_parts.POLICY", replace(POLICY, fitted_share=0.6))
    held = held_parts([moving(3000)], [], None)
    assert held.words == "the last 40 % of the record, parameters fitted to the first 60 %" and held.part == (1800,)


def test_a_record_for_validation_at_rest_judges_nothing() -> None:
    rec, still, other = moving(3000), moving(0, 1500, seed=2), moving(1500, seed=3)
    held = held_parts([rec], [still], None)
    assert held.part == (2100,) and held.scored == [(rec, 2100)]
    assert (
        "1 of the records for validation holds no motion" in held.notes[0] and "records that were given to fit" in held.notes[0]
    )
    held = held_parts([rec], [still, other], None)
    assert held.scored == [(other, 0)] and held.words == "validation records" and len(held.notes) == 1
    slow = moving(1500, seed=4, size=0.5)  # 1/40 of the speed, and 12 times the noise
    assert held_parts([rec], [slow], None) == ([(slow, 0)], "validation records", None, ())


@pytest.mark.long
def test_a_fall_of_the_error_at_standstill_is_none_and_is_said() -> None:
    """Friction holds what the linear model lets drift: at rest the error falls by 99 %, and shows nothing."""
    rec, still = friction_record(3000, 0), friction_record(0, 1500)
    dia = ga.diagnose(rec, validation=still)
    assert dia.held_out.startswith("the last 30 % of the record") and any("hold" in n and "no motion" in n for n in dia.notes)
    dia = ga.diagnose(friction_record(600, 2400))
    assert dia.in_sample and "too little motion, to hold any out" in dia.summary()


def friction_record(count: int, still: int) -> ga.Record:
    """An axis with dry friction under torques that change, and at rest under torques that it holds."""
    rng = np.random.default_rng(5)
    torque = np.append(np.repeat(rng.uniform(-0.2, 0.2, count // 100), 100), 0.03 * np.sin(0.01 * np.arange(still)))
    drive = ga.OneMass(1e-3, 3e-3).model().with_effect("coulomb_friction", torque=0.05)
    w = ga.simulate(drive, ga.Record(1e-3, torque=torque, velocity=0.0 * torque))
    return ga.Record(1e-3, velocity=w + 0.03 * rng.standard_normal(len(w)), torque=torque)


def test_the_linear_model_is_one_of_the_samples_that_are_fitted() -> None:
    """The end of this record has another inertia: what was identified on the whole record has seen it."""
    rng = np.random.default_rng(2)
    torque = np.repeat(rng.uniform(-0.2, 0.2, 30), 100)
    w, parts = np.zeros(0), (torque[:2100], torque[2100:])
    for J, u in zip((1e-3, 1.5e-3), parts, strict=True):
        w = np.append(w, ga.simulate(ga.OneMass(J, 3e-3), ga.Record(1e-3, torque=u, velocity=0.0 * u)))
    rec = ga.Record(1e-3, velocity=w + 0.03 * rng.standard_normal(len(w)), torque=torque)
    idn = ga.identify(rec, seed=1)
    first, notes = linear_of_part(idn, [rec], None, (2100,))
    assert notes == () and 1.0 / first.gain == pytest.approx(1e-3, rel=0.01) and 1.0 / idn.model.gain > 1.05e-3
    assert linear_of_part(idn, [rec], None, None) == (idn.model, ())


def coasting() -> ga.Record:
    """An axis that slows down by itself for 2100 samples, and is driven for 900."""
    rng = np.random.default_rng(5)
    torque = np.concatenate([np.full(300, 0.3), np.zeros(2100), np.repeat(rng.uniform(-0.2, 0.2, 9), 100)])
    drive = ga.OneMass(1e-3, 3e-3).model().with_effect("coulomb_friction", torque=0.004)
    w = ga.simulate(drive, ga.Record(1e-3, torque=torque, velocity=0.0 * torque))
    return ga.Record(1e-3, torque=torque, velocity=w + 0.03 * rng.standard_normal(len(w)))[300:]


def test_a_linear_model_that_has_seen_what_is_held_out_is_said_to_have() -> None:
    dia = ga.diagnose(coasting())
    said = [n for n in dia.notes if "identify no linear model by themselves" in n]
    assert dia.held_out.startswith("the last 30 % of the record") and len(said) == 1, dia.notes
    assert "(no torque drives them)" in said[0] and "the held-out part included" in said[0]
    assert "(no force drives them)" in said[0].linear  # type: ignore[attr-defined]
    # The model of all samples, not one that nothing determines.
    assert dia.before.rmse < 5.0


def test_what_identify_refuses_is_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    rec = moving(3000)
    idn = ga.identify(rec, seed=1)

    def refused(*args: object, **options: object) -> None:
        raise RecordError("too short")

    monkeypatch.setattr("gaident.diagnosis.linear_part.identify", refused)
    model, notes = linear_of_part(idn, [rec], None, (2100,))
    assert model is idn.model and len(notes) == 1 and "by themselves (too short)" in notes[0]


def test_noise_of_a_torque_is_no_floor_beyond_the_motion_and_is_that_of_the_extended_model() -> None:
    rng = np.random.default_rng(3)
    torque = np.sin(0.05 * np.arange(4000)) + 0.05 * rng.standard_normal(4000)
    rec = ga.Record(1e-3, velocity=10.0 * np.sin(0.05 * np.arange(4000)), torque=torque, torque_is="measured")
    fit = Fitness(1.0, 0.0, 0.1)

    def floor(mechanism: ga.Model, extended: ga.Model) -> float:
        return Gains(fit, fit, (0.0, 0.0), "the rest", {}, ((rec, 2800),), mechanism, extended).floor

    absurd, axis = ga.OneMass(1e-7, 1e-9).model(), ga.OneMass(1e-2, 1e-1).model()
    assert 0.1 < floor(absurd, axis) == floor(axis, axis) < 0.2
    assert floor(axis, absurd) == 0.1


def test_in_sample_figures_take_no_name() -> None:
    causes, why = standing(["backlash"], gains(-0.5, -0.1, IN_SAMPLE), check(0.2, 0.3), alone)
    assert causes == ["backlash"] and "Even on the samples that were fitted" in why[0] and "not all that there is" in why[0]
    assert standing(["backlash"], gains(-0.5, 0.1, IN_SAMPLE), check(0.2, 0.3, True), alone) == (["backlash"], ())


def test_the_interval_of_a_fall_is_wide_where_errors_are_slow() -> None:
    white = [RNG.standard_normal(4000)]
    slow = [np.repeat(RNG.standard_normal(8), 500)]
    low, high = interval_of_fall(white, [0.9 * white[0][RNG.permutation(4000)]])
    assert 0.05 < low < 0.1 < high < 0.15
    assert interval_of_fall(slow, [0.9 * slow[0][::-1]])[0] < 0.0


def test_a_load_that_the_integrator_carries_before_the_record_is_named() -> None:
    skip_without_library()
    rec, validation, controller, truth = random_case(10, "load_torque", settle=1500)
    assert abs(rec.torque[0]) > 0.5 * truth.effects["load_torque"]["torque"] and rec.command[0] == 0.0
    dia = ga.diagnose(rec, controller, validation=validation)
    assert [{f.effect, *f.alternatives} >= {"load_torque"} for f in dia.causes] == [True], dia.summary()
    assert dia.verdict == "explained" and dia.after.rmse < dia.before.rmse
