"""Laws of an integral that `PI` has no word for, from slow logs of a controller that has them."""

from __future__ import annotations

import gc
import weakref
import zlib
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from drive_rig import Plant
from gaident.diagnosis.controller.form_findings import loop_of
from gaident.diagnosis.controller.other_form import other_scheme
from gaident.diagnosis.diagnose import _Prepared
from gaident.identification.replay.integral_schemes import scheme_shown
from loop_cases import BAND, DECAY, PERIOD, loop_kind, loop_noise, loop_plant, scheme_log

GIVEN = ga.Cascade(ga.PI(0.03, 2.0), PERIOD)


@cache
def log(scheme: str, every: int = 4, seed: int = 1) -> ga.Record:
    """6000 samples of one mass under levels with reversals, some at rest, a line for each of `every`; even seed: an encoder."""
    rng = np.random.default_rng(5)
    axis = Plant(J=2.5e-4, D=1.5e-3, kp=0.03, ki=2.0, dt=every * PERIOD, cascade=GIVEN)
    levels = rng.uniform(5.0, 60.0, 15) * np.resize([1.0, -1.0, 0.0], 15)
    command = np.repeat(levels, 100) + np.repeat(rng.choice([-1.0, 1.0], 150), 10)
    command[:20] = 0.0
    return scheme_log(axis, np.repeat(command, 4), scheme, seed)


@pytest.mark.long
def test_a_decay_for_each_limited_sample() -> None:
    rec = log("decay")
    shown = scheme_shown([rec], GIVEN)
    assert shown is not None and shown.scheme.kind == "decay"
    assert abs(shown.scheme.number - DECAY) < 4.0 * shown.std < 0.01
    driver = other_scheme([rec], [], GIVEN, ())
    assert driver is not None and not driver.simulated
    named = {f.effect: f.parameters for f in driver.findings}
    assert {"torque_saturation", "anti_windup"} <= set(named) and "kept" in named["anti_windup"]
    assert all(f.place == "controller" for f in driver.findings)


def test_a_decay_is_told_from_an_integral_that_is_held() -> None:
    """It differs by a hundredth in each limited sample: the torques follow from both within what the log lost."""
    limit = float(np.abs(log("decay").torque).max())
    held = replace(GIVEN, velocity=replace(GIVEN.velocity, rule="forward", torque_limit=limit, anti_windup="hold"))
    shown = scheme_shown([log("decay")], held)
    assert shown is not None and shown.closer and abs(shown.scheme.number - DECAY) < 4.0 * shown.std
    limit = float(np.abs(log("hold").torque).max())
    assert scheme_shown([log("hold")], replace(held, velocity=replace(held.velocity, torque_limit=limit))) is None


def test_numbers_that_were_not_given_stay_beside_a_decay_and_the_rule_that_was_is_no_finding() -> None:
    limit = float(np.abs(log("decay").torque).max())
    held = replace(GIVEN, velocity=ga.PI(None, 2.0, rule="forward", torque_limit=limit, anti_windup="hold"))
    driving = _Prepared.of(loop_of([log("decay")], held), [log("decay")], []).driving()
    assert [f.effect for f in driving.findings] == ["anti_windup"] and "kept" in driving.findings[0].parameters
    assert driving.numbers["velocity.kp"].value == pytest.approx(0.03, rel=1e-3)


def test_where_no_limit_is_reached_no_decay_is_looked_for() -> None:
    held = replace(GIVEN, velocity=replace(GIVEN.velocity, torque_limit=50.0, anti_windup="hold"))
    assert scheme_shown([log("")], held) is None


def test_a_clamp_of_integral_and_output_alike() -> None:
    found = loop_of([log("clamps")], GIVEN)
    assert {f.effect for f in found.findings} == {"torque_saturation", "integrator_clamp"}
    limit, clamp = (f.parameters["limit"].value for f in found.findings)
    assert limit == clamp == pytest.approx(float(np.abs(log("clamps").torque).max()))


def test_a_dead_band_on_the_error() -> None:
    rec = log("dead band")
    driver = other_scheme([rec], [rec], GIVEN, ())
    assert driver is not None and [f.effect for f in driver.findings] == ["error_dead_band"]
    width = driver.findings[0].parameters["width"]
    true = BAND * float(np.abs(rec.command).max())  # no error at a line lies between it and what is found
    assert abs(width.value - true) < 4.0 * width.std < 0.1 * true
    assert "counts as 0" in driver.findings[0].evidence and len(driver.records) == len(driver.validation) == 1


def test_an_integral_that_is_reset() -> None:
    driver = other_scheme([log("reset")], [], GIVEN, ())
    assert driver is not None and [f.effect for f in driver.findings] == ["integral_reset"]
    assert "begins at 0 wherever the command changes its sign" in driver.findings[0].evidence


AT_RATE = {"decay": "anti_windup", "hold": "anti_windup", "dead band": "error_dead_band", "reset": "integral_reset"}


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("scheme", AT_RATE)
def test_of_a_log_with_every_sample_the_law_makes_the_torque_to_its_rounding(scheme: str, seed: int) -> None:
    rec = log(scheme, 1, seed)
    driving = _Prepared.of(loop_of([rec], GIVEN.velocity), [rec], []).driving()
    assert not driving.simulated and not driving.doubts
    named = {f.effect: f.parameters for f in driving.findings}
    at_limit = {"torque_saturation", "integration_rule"} if scheme in ("decay", "hold") else set()
    assert set(named) == {AT_RATE[scheme]} | at_limit
    shown = scheme_shown([rec], ga.Cascade(GIVEN.velocity))
    assert shown is not None and shown.left < 1e-6 * float(np.abs(rec.torque).max())
    if scheme in ("decay", "hold"):
        kept = named["anti_windup"]["kept"]
        assert kept.value == pytest.approx(DECAY if scheme == "decay" else 1.0, abs=1e-7)
    if scheme == "dead band":
        assert named["error_dead_band"]["width"].value == pytest.approx(BAND * float(np.abs(rec.command).max()), rel=0.02)


def test_of_a_rounded_log_the_law_is_found_too() -> None:
    """Four decimals of the velocity, as a text log has them."""
    exact = log("decay", 1)
    rec = exact.with_channels(velocity=np.round(exact.velocity, 4), torque=np.round(exact.torque, 5))
    shown = scheme_shown([rec], ga.Cascade(GIVEN.velocity))
    assert shown is not None and abs(shown.scheme.number - DECAY) < 4.0 * shown.std < 1e-3


@pytest.mark.parametrize(("seed", "velocity", "torque"), [(22, 0.1, 0.01), (35, 0.02, 0.002), (36, 0.1, 0.01), (44, 0.02, 0.002)])
def test_an_integral_that_is_held_is_no_decay_in_a_coarse_log(seed: int, velocity: float, torque: float) -> None:
    """Rounding decides some samples at the limit otherwise; a decay of 0.9999 would fit what comes of that."""
    command = np.repeat(np.random.default_rng(seed).choice([-20.0, 20.0], 200), 10)
    command[:20] = 0.0
    axis = ga.OneMass(J=2e-4, D=1e-3).model().with_effect("coulomb_friction", torque=0.05)
    held = ga.PI(0.04, 2.0, torque_limit=0.5, anti_windup="hold")
    run = ga.run(axis, ga.Record(1e-3, command=command, velocity=0.0 * command), held)
    seen = velocity * np.round(run.velocity / velocity), torque * np.round(run.torque / torque)
    rec = ga.Record(1e-3, command=command, velocity=seen[0], torque=seen[1])
    assert scheme_shown([rec], ga.Cascade(ga.PI(0.04, 2.0))) is None


def test_what_is_kept_of_an_answer_goes_with_its_record() -> None:
    """Whatever the order in which the same records are asked for."""
    alive = []
    for seed in range(2):
        one, other = log("", 1), log("", 1).with_channels(torque=log("", 1).torque * (1.0 + 0.01 * (seed + 1)))
        one = one.with_channels(torque=one.torque * 1.5)
        for pair in ([one, other], [other, one]):
            scheme_shown(pair, ga.Cascade(GIVEN.velocity))
        alive += [weakref.ref(one), weakref.ref(other)]
    del one, other, pair
    gc.collect()
    assert not any(ref() for ref in alive)


def test_of_a_log_with_every_sample_nothing_is_found_where_the_controller_makes_the_torque_or_another_one_does() -> None:
    assert scheme_shown([log("", 1)], ga.Cascade(GIVEN.velocity)) is None
    assert scheme_shown([log("dead band", 1)], ga.Cascade(ga.PI(0.045, 3.0))) is None


@pytest.mark.long
@pytest.mark.parametrize("given", [GIVEN, GIVEN.velocity])
def test_a_bare_pi_with_such_a_law_at_the_rate_of_the_log_is_no_faster_one(given: ga.Cascade | ga.PI) -> None:
    """Where the law was not known, a sample time of a quarter of a line came closer, with a false delay of half of one."""
    dia = ga.diagnose(log("decay", 1), given)
    assert {f.effect for f in dia.causes} == {"integration_rule", "torque_saturation", "anti_windup"}
    assert dia.verdict == "explained" and dia.mechanics["inertia"].value == pytest.approx(2.5e-4, rel=1e-3)
    assert not any("samples about" in note or "Is this the controller" in note for note in dia.notes)


def test_nothing_is_found_where_the_controller_is_another_one() -> None:
    assert scheme_shown([log("dead band")], replace(GIVEN, torque_filters=(ga.LowPass(5e-4),))) is None
    assert scheme_shown([log("dead band")], replace(GIVEN, velocity=ga.PI(0.045, 3.0))) is None
    rec = log("")  # the given controller itself
    assert scheme_shown([rec], GIVEN) is None


@pytest.mark.long
def test_a_diagnosis_names_the_law_and_no_mechanics() -> None:
    dia = ga.diagnose(log("dead band"), GIVEN)
    assert [f.effect for f in dia.causes] == ["error_dead_band"] and dia.verdict == "explained"
    assert dia.mechanics["inertia"].value == pytest.approx(2.5e-4, rel=5e-3) and not dia.loop_follows
    assert any("the torque that it makes between the lines drives the models" in note for note in dia.notes)
    assert "error dead band" in dia.summary()


@pytest.mark.long
@pytest.mark.parametrize(("every", "noise"), [(8, "white"), (4, "encoder")])
def test_what_noise_makes_of_a_held_integral_between_the_lines_is_no_decay_and_no_load(every: int, noise: str) -> None:
    """One sample more before the limit is a step of the integral, which comes back wherever the torque leaves its limit."""
    number = 3031000000
    rng = np.random.default_rng([number, zlib.crc32(f"hold {every}".encode())])
    plant = loop_plant("hold", every, rng, None, None)
    record, validation, controller, _ = random_case(number, (), loop_kind("hold"), loop_noise(noise, number), True, plant=plant)
    dia = ga.diagnose(record, controller=controller, validation=validation)
    assert dia.verdict == "adequate" and not dia.causes, dia.summary()
