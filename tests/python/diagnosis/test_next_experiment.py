"""The loop is closed: an ambiguous record, the proposed command, a new record of the same drive, the right single name."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from drive_cases import Truth, random_case
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.cli import main
from gaident.diagnosis.library.equivalences import EQUIVALENT
from gaident.policy.table import POLICY
from gaident.results.experiment import Proposal
from gaident.show.report.command import proposal_csv

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


@pytest.mark.long
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


@pytest.mark.long
def test_twins_get_the_missing_signal_instead_of_a_command() -> None:
    rec, _, controller, _ = random_case(0, ("torque_lag",))
    dia = ga.diagnose(rec, controller)
    assert {dia.causes[0].effect, *dia.causes[0].alternatives} == {"torque_lag", "velocity_filter"}
    assert dia.next_experiment is None
    assert any("motor current" in note and "encoder angle" in note for note in dia.notes)
    assert all("log" in e.otherwise or "repeat" in e.otherwise for e in EQUIVALENT), (
        "each class says what would tell its effects apart"
    )


@pytest.mark.parametrize(("delay", "noise"), [(6e-4, 0.05), (4e-4, 0.02)])
def test_what_no_record_tells_apart_is_told_from_a_third_explanation_as_one(delay: float, noise: float) -> None:
    """A delay of a part of a sample: an experiment tells it from a lag or a filter, but never the one from the other."""
    plant = Plant(3e-4, 2e-3, 0.03, 1.9, 1e-3)
    command = np.repeat([5.0, -5.0, 8.0, -3.0], 60)
    dia = ga.diagnose(rig(plant, command, {"transport_delay": {"delay": delay}}, Noise(white=noise)), plant.controller)
    (finding,), proposal = dia.causes, dia.next_experiment
    assert proposal is not None and {finding.effect, *finding.alternatives} >= {"torque_lag", "velocity_filter"}
    ((one, (other,)),) = proposal.alike.items()  # which of the two stands for both is chance: they fit alike
    assert {one, other} == {"torque_lag", "velocity_filter"}
    assert {one} < set(proposal.separates) <= {"transport_delay", one, "velocity_observer"}
    told = " ".join(dia.summary().split())
    first, second = (name.replace("_", " ") for name in (one, other))
    assert f"{first} or {second}" in told.partition("It tells ")[2].partition(".")[0]
    assert f"from {second}" not in told and f"not chosen for {first}" not in told
    assert Proposal.from_dict(proposal.to_dict()) == proposal


def test_without_a_controller_there_is_no_command_to_propose() -> None:
    """Torque to velocity: the ambiguous step, driven by its logged torque."""
    *_, truth, _ = ambiguous_step("coulomb_friction")
    log = rig(truth.plant, truth.command, truth.effects, truth.noise, seed=2 * truth.seed, torque_logged=True)
    dia = ga.diagnose(ga.Record(log.dt, velocity=log.velocity, torque=log.torque))
    assert statistical(dia) and dia.next_experiment is None
    (note,) = [note for note in dia.notes if "give the controller, and a log" in note]
    assert " and " in note and " apart: " in note and "a log with the velocity command" in note


def one_way(controller: ga.Cascade) -> ga.Record:
    """Runs in one direction: friction and load cannot be told apart. 0.02 rad/s of noise on the velocity."""
    n, dt = 700, 1e-3
    speed = np.convolve(np.repeat([0.0, 10.0, 25.0, 5.0, 40.0, 15.0, 30.0], 100), np.full(15, 1 / 15), "same")
    path = dt * (np.cumsum(speed) - speed)
    placed = controller.position is not None
    asked = {"position_command": path} if placed else {"command": speed}
    drive = ga.OneMass(J=4e-4, D=2e-3).model().with_effect("coulomb_friction", torque=0.15)
    done = ga.run(drive, ga.Record(dt, velocity=np.zeros(n), **asked), controller)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * dt * (done.velocity[1:] + done.velocity[:-1]))])
    noise = 0.02 * np.random.default_rng(0).standard_normal(n)
    position = angle if placed else None
    return ga.Record(dt, velocity=done.velocity + noise, torque=done.torque, position=position, **asked)


@pytest.mark.parametrize("period", [1e-3, 0.25e-3])
@pytest.mark.parametrize("placed", [True, False])
def test_the_command_is_one_that_the_loop_takes(placed: bool, period: float) -> None:
    """A path for a position loop, and never more torque than the record or the controller's limit shows to be there."""
    around = {"position": ga.P(30.0), "velocity_feedforward": 1.0, "acceleration_feedforward": 4e-4} if placed else {}
    filters = (ga.LowPass(1e-3),)
    controller = ga.Cascade(ga.PI(0.03, 1.0, torque_limit=1.0), period, torque_filters=filters, **around)  # type: ignore[arg-type]
    dia = ga.diagnose(one_way(controller), controller)
    proposal = dia.next_experiment
    assert proposal is not None and not any("Without a controller" in note for note in dia.notes)
    still = np.zeros(len(proposal.command))
    if placed:
        assert proposal.position_command is not None
        np.testing.assert_allclose(np.diff(proposal.position_command), proposal.dt * proposal.command[:-1], atol=1e-9)
        asked = ga.Record(proposal.dt, velocity=still, position_command=proposal.position_command)
    else:
        assert proposal.position_command is None
        asked = ga.Record(proposal.dt, velocity=still, command=proposal.command)
    torque = ga.run(dia.model, asked, controller.with_limits(None, None)).torque
    assert np.abs(torque).max() <= 1.0
    assert ("The position command:" in dia.summary()) == placed
    assert type(proposal).from_dict(proposal.to_dict()) == proposal


def test_a_proposed_path_is_read_and_simulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = np.sin(np.linspace(0.0, 6.0, 300))
    proposal = Proposal(np.gradient(path, 1e-3), 1e-3, ("load_torque",), 20.0, "why", path)
    Path("next.csv").write_text(proposal_csv(proposal))
    rec = ga.read("next.csv", measured=False)
    assert rec.position_command is not None and rec.command is None
    np.testing.assert_allclose(rec.position_command, path, atol=1e-8)
    Path("model.json").write_text('{"structure": "one mass", "J": 4e-4, "D": 2e-3}')
    Path("drive.toml").write_text(
        '[columns]\nposition_command = "x_soll"\nposition = "x"\n[controller]\nkp = 0.03\nki = 1.0\nposition_gain = 30\n'
    )
    assert main(["simulate", "model.json", "next.csv", "--drive", "drive.toml", "--out", "made.csv"]) == 0
    assert ga.columns("made.csv").columns[0].samples == 300
