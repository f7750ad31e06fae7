"""Logs of every second to eighth controller sample, all of the controller given: limits and what spoils the log alone.

The drives are those of the blind tests, on the independent rig.
"""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
import pytest

import gaident as ga
from drive_cases import random_case
from gaident.diagnosis.controller.as_read import outliers_of_the_log
from gaident.diagnosis.controller.form_findings import loop_of
from gaident.diagnosis.controller.slow_forms import limited
from gaident.identification.logged_torque import not_followed
from loop_cases import loop_kind, loop_noise, loop_plant

SEED = 951000000


def case(loop: str, every: int, noise: str, *effects: str, seed: int = SEED) -> tuple[Any, Any, Any, Any]:
    """Record, validation record, controller and truth of such a drive."""
    rng = np.random.default_rng([seed, zlib.crc32(" ".join((loop, str(every), *effects)).encode())])
    plant = loop_plant(loop, every, rng, True if "backlash" in effects else None)
    return random_case(seed, effects, loop_kind(loop), loop_noise(noise, seed), True, None, plant, plant.placed)


@pytest.mark.long
def test_one_limit_goes_before_a_form_of_several_numbers_that_explains_less() -> None:
    rec, _, controller, truth = case("bare", 4, "encoder", "integrator_clamp")
    assert loop_of([rec], controller).findings == ()
    dia = ga.diagnose(rec, controller)
    limit = dia.causes[0].parameters["limit"]
    assert [f.effect for f in dia.causes] == ["integrator_clamp"] and dia.verdict == "explained"
    assert abs(limit.value - truth.effects["integrator_clamp"]["limit"]) < 3.0 * limit.std < 0.03 * limit.value


@pytest.mark.long
@pytest.mark.parametrize("noise", ["white", "encoder"])
def test_the_flat_top_of_a_swing_is_no_limit_where_the_torque_follows_without(noise: str) -> None:
    rec, later, controller, truth = case("bare", 2, noise, "backlash", seed=953)
    assert limited([rec], controller).limit is None and loop_of([rec], controller).findings == ()
    dia = ga.diagnose(rec, controller, validation=later)
    assert [f.effect for f in dia.causes] == ["backlash"] and dia.verdict == "explained"
    assert dia.causes[0].parameters["gap"].value == pytest.approx(truth.effects["backlash"]["gap"], rel=0.05)


def test_an_integral_held_at_a_limit_is_open_by_what_it_moves_between_two_lines() -> None:
    """Noise on samples that were not logged decides whether it is held there: the torque follows all the same."""
    rec, later, controller, _ = case("hold", 2, "white")
    assert not_followed([rec, later], controller) == ()
    other = ga.Cascade(
        ga.PI(controller.velocity.kp, controller.velocity.ki, torque_limit=controller.velocity.torque_limit), 125e-6
    )
    assert not_followed([rec], other)
    assert not_followed([rec.with_channels(torque=rec.torque + 0.01 * (rec.time > 0.5 * rec.time[-1]))], controller)


@pytest.mark.long
@pytest.mark.parametrize(("loop", "noise"), [("backward", "white"), ("velocity filter", "encoder")])
def test_outliers_of_a_slow_log_are_not_what_its_controller_read(loop: str, noise: str) -> None:
    rec, _, controller, truth = case(loop, 4, noise, "outliers")
    (read,), (lines,) = outliers_of_the_log([rec], controller)
    assert len(lines) == round(truth.effects["outliers"]["fraction"] * len(rec))
    assert not_followed([rec], controller) and not not_followed([read], controller)
    dia = ga.diagnose(rec, controller)
    assert (dia.verdict, [f.effect for f in dia.findings]) == ("adequate", ["outliers"])


def test_an_outlier_that_the_controller_read_stays() -> None:
    rec, _, controller, _ = case("bare", 4, "white")
    spoiled = rec.velocity + 20.0 * (np.arange(len(rec)) == 1000)
    answered = rec.torque - 20.0 * controller.velocity.kp * (np.arange(len(rec)) == 1000)
    (read,), (lines,) = outliers_of_the_log([rec.with_channels(velocity=spoiled, torque=answered)], controller)
    assert lines.tolist() == [] and read.velocity[1000] == spoiled[1000]
