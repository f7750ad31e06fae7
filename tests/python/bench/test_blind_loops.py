"""The quick set of the groups `loops` and `ramps` of bench/blind.py: drives in the loops that servo drives have, wholly known."""

from __future__ import annotations

import importlib
from collections import Counter
from typing import Any

import numpy as np
import pytest

import gaident as ga
from blind_judge import Judgement, judge
from drive_cases import RAMPS, random_case
from drive_rig import skip_without_library
from gaident.identification.replay.command_timing import timed
from gaident.identification.replay.driven_records import torque_driven
from gaident.identification.replay.timed_record import TimedRecord
from loop_cases import EVERY, LOOPS, loop_effects, loop_kind, loop_noise, loop_plant
from places import BENCH

skip_without_library()


def diagnosed(loop: str, every: int, effects: tuple[str, ...], seed: int, noise: str = "white") -> Judgement:
    plant = loop_plant(loop, every, np.random.default_rng(seed))
    record, validation, controller, truth = random_case(
        seed, effects, loop_kind(loop), loop_noise(noise, seed), plant=plant, position_logged=plant.placed
    )
    assert isinstance(controller, ga.Cascade) and controller.log_every(record.dt) == every
    return judge(ga.diagnose(record, controller=controller, validation=validation), truth.effects)


def test_a_clean_drive_with_every_fourth_sample_is_adequate() -> None:
    judged = diagnosed("torque low pass", 4, (), 1)
    assert judged.verdict == "adequate" and not judged.sets, judged


def test_a_clean_drive_is_judged_by_the_mechanism_in_its_loop() -> None:
    """The model of the identification, from a torque that misses what came between the lines, is ten times as far off."""
    judged = diagnosed("notch", 4, (), 1, noise="encoder")
    assert judged.verdict == "adequate" and not judged.sets, judged


def test_the_torque_of_a_position_loop_follows_from_its_log() -> None:
    """From position command, position and velocity, without a velocity command."""
    plant = loop_plant("position", 1, np.random.default_rng(3))
    record, _, controller, _ = random_case(3, (), "move", "encoder", plant=plant, position_logged=True)
    driven = torque_driven([record], controller)
    assert record.command is None
    assert not any("does not follow" in note for note in driven.notes)


@pytest.mark.long
def test_friction_is_named_from_every_fourth_sample() -> None:
    judged = diagnosed("notch", 4, ("coulomb_friction",), 1)
    assert judged.exact and judged.verdict == "explained", judged
    assert judged.parameter_errors["coulomb_friction.torque"] < 0.02


@pytest.mark.parametrize("loop", LOOPS)
def test_every_kind_of_loop_has_a_stable_drive_and_a_record(loop: str) -> None:
    plant = loop_plant(loop, 8, np.random.default_rng(2))
    record, validation, controller, _ = random_case(2, (), loop_kind(loop), plant=plant)
    assert record.dt == pytest.approx(1e-3) and record.torque is not None and validation is not None
    assert (record.position_command is not None) is (loop == "position")
    assert isinstance(controller, ga.Cascade)
    if controller.velocity.torque_limit is not None and not controller.torque_filters:
        limit = controller.velocity.torque_limit
        assert np.abs(record.torque).max() == limit  # drawn so that it is reached


@pytest.fixture
def blind(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCH))
    return importlib.import_module("blind")


def test_the_cells_take_every_loop_clean_and_the_effects_in_turn(blind: Any) -> None:
    cells = list(blind.cells("loops", len(loop_effects("bare")), 1))
    assert len({cell.key for cell in cells}) == len(cells)
    clean = Counter((cell.loop, cell.every) for cell in cells if not cell.effects)
    assert set(clean) == {(loop, every) for loop in LOOPS for every in EVERY} and len(set(clean.values())) == 1
    hidden = {(cell.loop, cell.every, *cell.effects) for cell in cells if cell.effects}
    assert hidden == {(loop, every, effect) for loop in LOOPS for every in EVERY for effect in loop_effects(loop)}


def test_ramps_take_every_loop_both_shapes_and_both_noises(blind: Any) -> None:
    cells = list(blind.cells("ramps", 4, 1))
    assert len({cell.key for cell in cells}) == len(cells)
    assert {cell.group for cell in cells} == {"ramps"}
    for effects in (True, False):
        some = [cell for cell in cells if bool(cell.effects) is effects]
        assert {(cell.loop, cell.every) for cell in some} == {(loop, every) for loop in LOOPS for every in EVERY}
        kinds = {(kind, noise) for kind in RAMPS for noise in ("white", "differenced")}
        assert {(cell.kind, cell.noise) for cell in some} == kinds


@pytest.mark.long
@pytest.mark.parametrize("loop", ["hold", "position"])
def test_ramps_begin_and_end_between_the_lines(blind: Any, loop: str) -> None:
    """On a line of the log an eighth of them would; the log has the lines alone, and the same key gives the same record."""
    cells = [cell for cell in blind.cells("ramps", 4, 1) if cell.loop == loop and cell.every == 8 and not cell.effects]
    assert {cell.kind for cell in cells} == set(RAMPS)
    for cell in cells:
        record, validation, controller, truth = blind.case_of(cell)
        logged = record.command if record.position_command is None else record.position_command
        assert validation is not None and np.array_equal(logged, truth.command[::8])
        speed = np.diff(truth.command, prepend=0.0) / 125e-6 if truth.plant.placed else truth.command
        moves = np.abs(np.diff(speed)) > 1e-6
        begins, ends = (np.flatnonzero(np.diff(moves.astype(int)) == way) + 1 for way in (1, -1))
        assert len(begins) == len(ends) > 15
        assert all(np.mean(each % 8 != 0) > 0.6 and len(set(each % 8)) > 4 for each in (begins, ends))
        limit = controller.velocity.torque_limit
        assert limit is None or np.abs(record.torque).max() == limit
        again = blind.case_of(cell)[0]
        assert again.digest == record.digest and again.digest != validation.digest


def test_a_limit_that_hides_under_ramps_is_reached(blind: Any) -> None:
    hidden = ("torque_saturation",)
    cells = [cell for cell in blind.cells("ramps", 25, 1) if cell.effects == hidden and cell.every == 4]
    assert len(cells) > 3
    for cell in cells[:4]:
        record, *_, truth = blind.case_of(cell)
        assert np.mean(np.abs(record.torque) >= truth.effects["torque_saturation"]["limit"]) > 2e-3


@pytest.mark.long
def test_a_filter_of_the_velocity_is_found_under_jumps_between_the_lines_where_a_bare_pi_is_given(blind: Any) -> None:
    """Beside it a second mass of no effect was a candidate in the place of a gap, which ended with an IndexError."""
    cells = [c for c in blind.cells("jumps", 1, 2051) if (c.loop, c.every, c.effects) == ("velocity filter", 4, ())]
    record, validation, controller, _ = blind.case_of(cells[0])
    pi = controller.velocity
    dia = ga.diagnose(record, controller=ga.Cascade(ga.PI(pi.kp, pi.ki), controller.period), validation=validation)
    assert [f.effect for f in dia.findings if f.place == "controller"] == ["velocity_feedback_filter"]


@pytest.mark.parametrize("loop", ["notch", "position", "hold"])
def test_jumps_fall_between_the_lines(blind: Any, loop: str) -> None:
    (cell,) = (c for c in blind.cells("jumps", 1, 1) if c.loop == loop and c.every == 8 and not c.effects)
    *_, truth = blind.case_of(cell)
    speed = np.diff(truth.command, prepend=0.0) / 125e-6 if truth.plant.placed else truth.command
    begins = np.flatnonzero(np.abs(np.diff(speed)) > 1e-6) + 1
    assert len(begins) > 15 and np.mean(begins % 8 != 0) > 0.6


@pytest.fixture
def forms(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(BENCH))
    monkeypatch.syspath_prepend(str(BENCH / "loops"))
    return importlib.import_module("loop_forms")


LAGS = {"torque_lag", "velocity_filter"}


def test_jumps_on_the_lines_stay_there_where_the_velocity_rings_between_them(forms: Any) -> None:
    """138 Hz in a line each millisecond: 11 of 335 jumps looked early, and all then fell between the lines."""
    _, validation, whole, _ = forms.Case("backward", 8, "", 1301000, "whole").drawn()
    (found,) = timed([validation], whole)
    assert not isinstance(found, TimedRecord)


@pytest.mark.long
def test_friction_does_not_hide_a_lag_beside_a_fast_resonance(forms: Any) -> None:
    """479 Hz in a line each millisecond: without the lag a resonance of 389 Hz made up for it, "partly explained"."""
    record, validation, whole, truth = forms.Case("bare", 8, "coulomb_friction", 1301000, "whole").drawn()
    dia = ga.diagnose(record, whole, validation=validation)
    found = {frozenset({f.effect, *f.alternatives}): f for f in dia.causes}
    assert found.keys() == {frozenset({"coulomb_friction"}), frozenset(LAGS)} and dia.verdict == "explained"
    assert dia.mechanics["inertia"].value == pytest.approx(truth.plant.J + truth.plant.JL, rel=1e-3)
    friction = found[frozenset({"coulomb_friction"})].parameters["torque"].value
    assert friction == pytest.approx(truth.effects["coulomb_friction"]["torque"], rel=0.02)


def test_a_lag_is_found_beside_a_resonance_that_the_log_does_not_show(forms: Any) -> None:
    """442 Hz in a line each millisecond: a delay beside a wrong resonance was named, and the inertia 0.83 % off."""
    record, validation, whole, truth = forms.Case("bare", 8, "", 1102000, "whole").drawn()
    dia = ga.diagnose(record, whole, validation=validation)
    (cause,) = dia.causes
    assert {cause.effect, *cause.alternatives} == LAGS and dia.verdict == "explained"
    lag = cause.parameters["time_constant"].value
    assert lag == pytest.approx(truth.effects["torque_lag"]["time_constant"], rel=0.02)
    assert dia.mechanics["inertia"].value == pytest.approx(truth.plant.J + truth.plant.JL, rel=2e-3)
    assert dia.velocity_age == 0.5 / 8
