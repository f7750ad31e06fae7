"""The loop is closed: an ambiguous record, the proposed command, a new record of the same drive, the right single name."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

import gaident as ga
from drive_cases import Truth, random_case
from drive_rig import rig, skip_without_library
from gaident.diagnosis.library.equivalences import EQUIVALENT
from gaident.policy.table import POLICY

skip_without_library()

AMBIGUOUS_SEEDS = (1, 3, 0, 5, 8)  # one step each; the first that leaves a choice is taken


def statistical(dia: ga.Diagnosis) -> bool:
    """Whether a finding has a rival that is no equivalent effect."""
    return any(not any({f.effect, a} <= e.effects for e in EQUIVALENT) for f in dia.causes for a in f.alternatives)


@lru_cache
def ambiguous_step(effect: str) -> tuple[ga.Record, ga.PI, Truth, ga.Diagnosis]:
    for seed in AMBIGUOUS_SEEDS:
        rec, _, controller, truth = random_case(seed, (effect,), "step")
        dia = ga.diagnose(rec, controller)
        if statistical(dia):
            return rec, controller, truth, dia
    pytest.fail(f"no step record of {AMBIGUOUS_SEEDS} leaves a choice about {effect}")


@pytest.mark.parametrize("effect", ["coulomb_friction", "stribeck_friction"])
def test_the_proposed_experiment_names_what_a_step_could_not(effect: str) -> None:
    rec, controller, truth, dia = ambiguous_step(effect)
    proposal = dia.next_experiment
    assert proposal is not None and dia.verdict == "explained"
    (finding,) = dia.causes
    assert finding.effect in proposal.separates and set(proposal.separates) <= {finding.effect, *finding.alternatives}
    assert proposal.margin > POLICY.told_apart / 2 and proposal.reason.endswith(".") and proposal.dt == rec.dt
    assert np.abs(proposal.command).max() <= np.abs(rec.command).max() * (1 + 1e-12)
    new = rig(truth.plant, proposal.command, truth.effects, truth.noise, seed=99)
    after = ga.diagnose(new, controller)
    assert [f.effect for f in after.causes] == [effect] and after.causes[0].named, after.summary()
    assert after.next_experiment is None


def test_twins_get_the_missing_signal_instead_of_a_command() -> None:
    rec, _, controller, _ = random_case(0, ("torque_lag",))
    dia = ga.diagnose(rec, controller)
    assert {dia.causes[0].effect, *dia.causes[0].alternatives} == {"torque_lag", "velocity_filter"}
    assert dia.next_experiment is None
    assert any("motor current" in note and "encoder angle" in note for note in dia.notes)
    assert all("log" in e.otherwise or "repeat" in e.otherwise for e in EQUIVALENT), (
        "each class says what would tell its effects apart"
    )


def test_without_a_controller_there_is_no_command_to_propose() -> None:
    """Torque to velocity: the ambiguous step, driven by its logged torque."""
    *_, truth, _ = ambiguous_step("coulomb_friction")
    log = rig(truth.plant, truth.command, truth.effects, truth.noise, seed=2 * truth.seed, torque_logged=True)
    dia = ga.diagnose(ga.Record(log.dt, velocity=log.velocity, torque=log.torque))
    assert statistical(dia) and dia.next_experiment is None
    (note,) = [note for note in dia.notes if "give the controller, and a log" in note]
    assert " and " in note and " apart: " in note and "a log with the velocity command" in note
