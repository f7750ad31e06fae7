"""What feedforward() says the tables bring is what they bring to a drive that shares no code with the package."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaident as ga
from drive_rig import Plant, between_lines, rig, run_drive, skip_without_library
from gaident.results.json_text import json_text
from report_cases import diagnosed

skip_without_library()

T = 1e-3
EFFECTS = {
    "coulomb_friction": {"torque": 0.05},
    "unbalance": {"amplitude": 0.05, "phase": 0.4},
    "cogging": {"amplitude": 0.04, "order": 6.0, "phase": 0.7},
}
CASCADE = ga.Cascade(ga.PI(kp=0.03, ki=1.0), period=T / 4, position=ga.P(30.0), position_period=T / 2, velocity_feedforward=1.0)
BARE = Plant(J=4e-4, D=2e-3, kp=0.03, ki=1.0, dt=T)
PLACED = replace(BARE, cascade=CASCADE)
LATE = replace(BARE, cascade=replace(CASCADE, delay=3e-4, velocity_feedforward=0.5))


def ramps(*levels: float) -> np.ndarray:
    """A velocity command [rad/s] that goes from level to level in 60 ms and stays there for 140 ms."""
    starts = (0.0, *levels[:-1])
    parts = [[np.linspace(a, b, 60, endpoint=False), np.full(140, b)] for a, b in zip(starts, levels, strict=True)]
    return np.concatenate([piece for pair in parts for piece in pair])


VELOCITY = ramps(20.0, -30.0, 6.0, -4.0, 12.0, -8.0, 3.0, -15.0, 0.0)
POSITION = T * np.append(0.0, np.cumsum(VELOCITY)[:-1])


def numbers(tables: ga.FeedforwardTables) -> np.ndarray:
    """The tables as the rig's controller takes them: rows of numbers, no formula of the package."""
    half = len(tables.velocity) // 2
    speeds, levels = (np.insert(row, half, 0.0) for row in (tables.velocity, tables.friction))
    head = [tables.viscous, tables.constant, tables.inertia, 2.0 * np.pi, len(speeds), len(tables.by_angle)]
    return np.concatenate([head, speeds, levels, tables.by_angle])


def on_the_rig(plant: Plant, command: np.ndarray, table: np.ndarray | None) -> float:
    """Rms following error of the rig, without noise."""
    ticks = between_lines(plant, command)
    log = run_drive(plant, ticks, EFFECTS, table=table)
    error = (ticks - (log.position if plant.placed else log.truth))[:: plant.log_every]
    return float(np.sqrt(np.mean(error**2)))


def known(plant: Plant, command: np.ndarray) -> ga.Diagnosis:
    """A diagnosis whose model is the rig's drive itself."""
    model = ga.OneMass(J=plant.J, D=plant.D).model()
    for effect, parameters in EFFECTS.items():
        model = model.with_effect(effect, **parameters)
    rec = rig(plant, command, EFFECTS, "none", position_logged=True)
    return replace(diagnosed(), model=model, controller=plant.controller, records=(rec,))


def brought(tables: ga.FeedforwardTables) -> ga.FollowingError:
    assert tables.following is not None, tables.no_following
    return tables.following


@pytest.fixture(scope="module")
def dia() -> ga.Diagnosis:
    return known(BARE, VELOCITY)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(("plant", "command"), [(BARE, VELOCITY), (PLACED, POSITION)], ids=["PI", "cascade"])
def test_the_printed_figure_is_that_of_the_rig_with_the_tables(plant: Plant, command: np.ndarray, seed: int) -> None:
    """Diagnosed from a noisy log; the tables then act in the rig."""
    dia = ga.diagnose(rig(plant, command, EFFECTS, "white", seed, position_logged=True), plant.controller, seed=seed)
    tables = ga.feedforward(dia)
    found = brought(tables)
    assert on_the_rig(plant, command, None) == pytest.approx(found.before.rms, rel=0.01)
    assert on_the_rig(plant, command, numbers(tables)) == pytest.approx(found.after.rms, rel=0.1)
    assert found.after.rms < 0.02 * found.before.rms


@pytest.mark.parametrize("limit", [None, 0.4])
@pytest.mark.parametrize(
    ("plant", "command"),
    [
        (BARE, VELOCITY),
        (PLACED, POSITION),
        (replace(BARE, cascade=replace(CASCADE, delay=3e-4, velocity_feedforward=0.5)), POSITION),
    ],
    ids=["PI", "cascade", "late cascade"],
)
def test_of_the_true_model_the_simulation_is_the_rig(plant: Plant, command: np.ndarray, limit: float | None) -> None:
    """A limit of 0.4 N m cuts the torque of the tables as well."""
    gains = plant.controller.with_limits(limit, None)
    plant = replace(plant, cascade=gains if isinstance(gains, ga.Cascade) else ga.Cascade(gains))
    tables = ga.feedforward(known(plant, command))
    found = brought(tables)
    assert on_the_rig(plant, command, None) == pytest.approx(found.before.rms, rel=2e-3)
    assert on_the_rig(plant, command, numbers(tables)) == pytest.approx(found.after.rms, rel=0.02)
    assert limit is None or found.after.torque <= limit


def test_the_whole_velocity_feedforward_is_a_row_of_its_own(dia: ga.Diagnosis) -> None:
    lagging = replace(PLACED, cascade=replace(CASCADE, velocity_feedforward=0.0))
    tables = ga.feedforward(known(lagging, POSITION))
    found = brought(tables)
    assert found.with_velocity is not None and found.unit == "rad" and "velocity over the position gain" in found.notes[-1]
    assert on_the_rig(PLACED, POSITION, numbers(tables)) == pytest.approx(found.with_velocity.rms, rel=0.02)
    assert on_the_rig(lagging, POSITION, numbers(tables)) == pytest.approx(found.after.rms, rel=2e-3)
    assert found.after.rms == pytest.approx(found.before.rms, rel=0.1)  # the lag, which no torque takes away
    assert found.with_velocity.rms < 0.01 * found.after.rms
    assert brought(ga.feedforward(dia)).with_velocity is None


def test_what_a_controller_adds_already_is_not_added_twice() -> None:
    own = replace(CASCADE, acceleration_feedforward=4e-4, friction_feedforward=0.05)
    found = brought(ga.feedforward(known(replace(PLACED, cascade=own), POSITION)))
    plain = brought(ga.feedforward(known(PLACED, POSITION)))
    assert found.after == plain.after and found.before.rms < 0.6 * plain.before.rms
    assert found.replaced and not plain.replaced and any("own feedforward" in note for note in found.notes)


def test_measured_stands_beside_and_a_blow_is_said(dia: ga.Diagnosis) -> None:
    found = brought(ga.feedforward(dia))
    assert found.measured is not None and found.measured.rms == pytest.approx(found.before.rms, rel=2e-3)
    assert [name for name, _, _ in found.loops] == ["measured", "as it is, simulated", "with the tables"]
    assert np.sqrt(np.mean(found.error_after**2)) == pytest.approx(found.after.rms) and len(found.time) == len(VELOCITY)
    jumping = ga.Record(T, command=np.repeat([10.0, -10.0], 200), velocity=np.zeros(400))
    said = brought(ga.feedforward(dia, rec=jumping))
    assert said.after.torque > 5.0 and any("command that jumps" in note for note in said.notes)
    assert not any("command that jumps" in note for note in found.notes)
    assert said.measured is not None and np.isnan(said.measured.torque)
    assert "torque" not in said.to_dict()["measured"]


def test_summary_and_json_have_the_figures(dia: ga.Diagnosis) -> None:
    tables = ga.feedforward(dia)
    found, text = brought(tables), tables.summary()
    for value in (found.before.rms, found.after.rms, found.before.largest, found.after.largest, found.after.torque):
        assert f"{value:.4g}" in text
    less = round(100.0 * (1.0 - found.after.rms / found.before.rms))
    (row,) = [line.split() for line in text.splitlines() if line.startswith("  with the tables")]
    assert row[4] == str(less)
    data = json.loads(json_text(tables.to_dict()))
    assert data["following"]["after"]["rms"] == found.after.rms and data["no_following"] == ""
    linear = tables.summary("linear")
    assert "N m" not in linear and "rad" not in linear and "torque" not in linear


def test_where_no_loop_is_simulated_the_summary_says_why(dia: ga.Diagnosis, tmp_path: Path) -> None:
    dia.save(tmp_path / "found.json")
    loaded = ga.load(tmp_path / "found.json")
    assert isinstance(loaded, ga.Diagnosis)
    torque = ga.Record(T, torque=np.ones(50), velocity=np.zeros(50))
    wild = ga.PI(kp=30.0, ki=1.0)
    for tables, reason in (
        (ga.feedforward(replace(dia, controller=None)), "no controller is simulated in this result"),
        (ga.feedforward(replace(dia, loop_follows=False)), "does not follow from the controller"),
        (ga.feedforward(replace(dia, controller=ga.PI(0.03, 1.0, loop="continuous"))), "the continuous loop of the paper"),
        (ga.feedforward(dia, rec=torque), "no command"),
        (ga.feedforward(dia, controller=wild), "runs away"),
        (ga.feedforward(loaded, speed=30.0), "has no records"),
    ):
        assert tables.following is None and reason in tables.no_following, reason
        text = " ".join(tables.summary().split())
        assert f"What the tables bring is not simulated: {tables.no_following}." in text
        assert tables.to_dict()["following"] is None


def test_a_torque_by_angle_that_does_not_settle_is_said(dia: ga.Diagnosis, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaident.remedies.following.simulated.MOST_RUNS", 2)
    tables = ga.feedforward(dia)
    assert tables.following is None and tables.no_following == "the torque by angle does not settle in the simulated loop"


def test_a_record_and_a_controller_may_be_given(dia: ga.Diagnosis, tmp_path: Path) -> None:
    dia.save(tmp_path / "found.json")
    loaded = ga.load(tmp_path / "found.json")
    assert isinstance(loaded, ga.Diagnosis)
    own = brought(ga.feedforward(dia))
    assert brought(ga.feedforward(loaded, rec=dia.records[0])).after == own.after
    unlogged = replace(dia, controller=None, loop_follows=False)
    assert brought(ga.feedforward(unlogged, controller=ga.PI(0.03, 1.0))).after == own.after
    stiff = brought(ga.feedforward(dia, controller=ga.PI(0.06, 4.0)))
    assert stiff.before.rms < 0.5 * own.before.rms


def test_wrong_use_is_told(dia: ga.Diagnosis) -> None:
    with pytest.raises(ga.GaidentError, match=r"rec is int: give the gaident\.Record"):
        ga.feedforward(dia, rec=3)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="controller is 3"):
        ga.feedforward(dia, controller=3)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="controller has kp=None: give a number"):
        ga.feedforward(dia, controller=ga.PI(None, 1.0))
