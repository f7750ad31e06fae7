"""Long records, whose model is searched in windows: what is found there is that of the whole record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
import pytest

import gaident as ga
from gaident.diagnosis.library.terms import LIBRARY
from gaident.diagnosis.records import windows
from gaident.diagnosis.records.sizes import scales_of
from gaident.estimation.dataset import DataSet
from gaident.estimation.objective import Hypothesis, Objective
from gaident.estimation.parameterisation import Parameterisation
from gaident.estimation.prediction import OpenLoop
from gaident.estimation.records.parted import parted
from gaident.estimation.records.places import Place
from gaident.estimation.uncertainty import _walk_over
from gaident.policy.table import POLICY

DT, SAMPLES, SEARCHED = 1e-3, 120_000, 1 << 14
AXIS = ga.OneMass(J=2e-3, D=4e-3)
CONTROLLER = ga.PI(kp=0.1, ki=1.0)
NOISE = 0.02


def record(model: ga.Model, seed: int = 0, samples: int = SAMPLES, **kept: bool) -> ga.Record:
    """Ramps to drawn speeds, from rest, in the loop; the controller reads the noise; torque logged, no position."""
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(-30.0, 30.0, -(-samples // 800)), 800)[:samples]
    command = np.convolve(np.concatenate([np.zeros(300), steps]), np.ones(200) / 200.0)[:samples]
    noise = NOISE * rng.standard_normal(samples)
    run = ga.run(model, ga.Record(DT, command=command - noise, velocity=noise), CONTROLLER)
    torque = run.torque if kept.get("torque", True) else None
    return ga.Record(DT, command=command, velocity=run.velocity + noise, torque=torque, name="long")


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A smaller number of lines that a search works on."""
    monkeypatch.setattr(windows, "POLICY", replace(POLICY, diagnosed_samples=SEARCHED, whole_samples=2 * SEARCHED))
    return


OF_ANGLE_OR_TIME: Mapping[str, Mapping[str, float]] = {
    "cogging": {"amplitude": 0.03, "order": 6.0, "phase": 0.4},
    "unbalance": {"amplitude": 0.03, "phase": 0.4},
    "velocity_ripple": {"amplitude": 0.02, "order": 3.0, "phase": 0.4},
    "position_friction": {"torque": 0.05, "amplitude": 0.02, "order": 1.0, "phase": 0.4},
    "position_inertia": {"amplitude": 0.1, "order": 2.0, "phase": 0.4},
    "torque_hum": {"amplitude": 0.03, "frequency": 17.3, "phase": 0.4},
    "friction_drift": {"torque": 0.05, "rate": 0.01},
}


def test_every_effect_of_angle_and_time_is_among_these() -> None:
    built_in = {row.name for row in ga.effects.table()}
    assert {t.name for t in LIBRARY.values() if t.harmonic or t.in_time or t.time_varying} & built_in == {*OF_ANGLE_OR_TIME}
    assert all(LIBRARY[name].later is not None for name in ("torque_hum", "friction_drift"))


def left(rec: ga.Record, places: tuple[Place, ...], effect: str, own_angle: bool, placed: bool = True) -> np.ndarray:
    """The error of the true model in windows of a record under fitted start states [rad/s]; placed: they know where they lie."""
    whole = DataSet.of([rec], CONTROLLER)
    data = parted(whole, places) if placed else DataSet.of([rec[p.start : p.stop] for p in places], CONTROLLER)
    term = LIBRARY[effect]
    parameters = Parameterisation.of(AXIS.model(), scales_of(whole), data.moving, data.begun).extended(term)
    natural = term.coordinates(OF_ANGLE_OR_TIME[effect])
    x = np.concatenate([parameters.base_vector(AXIS.model()), natural, np.zeros(sum(parameters.starts))])
    hypothesis, objective = Hypothesis(parameters, OpenLoop(data, own_angle)), Objective(data, np.ones(sum(data.lengths)))
    for _ in range(4):
        E = np.array(
            [objective.errors(hypothesis, (x + step)[None, :])[0] for step in (0.0, *(1e-2 * np.eye(len(x))[-len(places) :]))]
        )
        slopes = (E[1:] - E[0]) / 1e-2
        x[-len(places) :] -= np.linalg.lstsq(slopes.T, E[0], rcond=None)[0]
    return np.asarray(objective.errors(hypothesis, x[None, :])[0])


@pytest.mark.parametrize("own_angle", [False, True])
@pytest.mark.parametrize("effect", OF_ANGLE_OR_TIME)
def test_the_angle_and_the_time_of_a_window_are_those_of_its_record(effect: str, own_angle: bool) -> None:
    """The true model leaves noise in windows, as it does in the record; of windows that begin anew at 0 it leaves far more."""
    model = AXIS.model().with_effect(effect, **OF_ANGLE_OR_TIME[effect])
    rec, places = record(model, samples=30_000), (Place(0, 9_000, 13_000), Place(0, 22_500, 26_000))
    known = left(rec, places, effect, own_angle)
    # Under a ripple the integral of the measured velocity is the angle to within what a window leaves.
    assert np.std(known) < (2.5 if effect == "velocity_ripple" else 1.1) * NOISE
    assert np.std(left(rec, places, effect, own_angle, placed=False)) > 1.5 * np.std(known)


def found(dia: ga.Diagnosis, effect: str) -> dict[str, ga.Estimate]:
    (cause,) = dia.causes
    assert cause.effect == effect, dia.summary()
    return dict(cause.parameters)


@pytest.mark.long
@pytest.mark.parametrize("effect", ["unbalance", "position_friction", "position_inertia", "torque_hum", "friction_drift"])
def test_effects_of_angle_and_time_are_found_in_windows(effect: str, short: None) -> None:
    dia = ga.diagnose(record(AXIS.model().with_effect(effect, **OF_ANGLE_OR_TIME[effect])), CONTROLLER)
    assert dia.verdict == "explained", dia.summary()
    for name, estimate in found(dia, effect).items():
        truth, of_angle = OF_ANGLE_OR_TIME[effect][name], name == "phase"
        assert abs(estimate.value - truth) < 4.0 * estimate.std + (0.0 if of_angle else 0.01 * truth), (name, estimate)
    assert any("of 120000 lines" in str(note) for note in dia.notes), dia.notes


def test_the_walk_of_an_angle_over_windows_is_that_of_drawn_walks() -> None:
    places = (Place(0, 3000, 4000), Place(0, 0, 500), Place(1, 2000, 3000))
    walks = np.random.default_rng(0).standard_normal((2, 4000, 1500)).cumsum(axis=1)
    means = np.concatenate([walks[p.at, p.start : p.stop] for p in places]).mean(axis=0)
    assert _walk_over(places) == pytest.approx(float(np.var(means)), rel=0.1)
    assert _walk_over((Place(0, 0, 900),)) == pytest.approx(300.0)


@pytest.mark.long
def test_two_masses_with_friction_are_not_missed_where_a_block_begins_in_motion(short: None) -> None:
    """Friction makes the way to a block's start state a longer one than that of a linear model."""
    model = ga.Model(500.0, [-1.0, -20 + 150j, -20 - 150j], [-10 + 100j, -10 - 100j])
    dia = ga.diagnose(record(model.with_effect("coulomb_friction", torque=0.03), seed=201), CONTROLLER)
    assert dia.verdict == "explained" and not any("not searched" in str(note) for note in dia.notes), dia.summary()


@pytest.mark.long
def test_the_result_is_about_the_record_given(short: None) -> None:
    """Digest, records, held-out part, number of samples; a log that wrote the torque late is moved as a whole."""
    rec = record(AXIS.model().with_effect("coulomb_friction", torque=0.05))
    assert rec.torque is not None
    late = rec.with_channels(torque=np.append(rec.torque[:1], rec.torque[:-1]))
    dia, moved = ga.diagnose(rec, CONTROLLER), ga.diagnose(late, CONTROLLER)
    assert dia.digests == (rec.digest,) and dia.records == (rec,) and dia.samples == len(rec)
    assert dia.held_out.startswith("the last 30 % of the record")
    assert dia.log_shifts == {} and moved.log_shifts == {late.digest: {"torque": -1}}
    for one in (dia, moved):
        assert one.verdict == "explained" and found(one, "coulomb_friction")["torque"].value == pytest.approx(0.05, rel=0.01)


@pytest.mark.long
def test_what_happens_between_the_windows_is_not_passed_over(short: None) -> None:
    """A load that acts for three seconds: it is searched too, or said."""
    model, at = AXIS.model().with_effect("coulomb_friction", torque=0.05), slice(40_000, 43_000)
    rng = np.random.default_rng(3)
    push = np.zeros(SAMPLES)
    push[at] = 0.2 * np.repeat(rng.uniform(-1.0, 1.0, 30), 100)
    rec = record(model)
    assert rec.command is not None
    # The torque that acts is that of the log and the push.
    run = ga.run(model, rec.with_channels(command=None, torque=rec.torque + push))
    seen = rec.with_channels(command=None, velocity=run.velocity + NOISE * rng.standard_normal(SAMPLES))
    dia = ga.diagnose(seen)
    assert dia.verdict in ("partly explained", "unexplained"), dia.summary()
    (note,) = [str(note) for note in dia.notes if "not searched" in str(note)] or [""]
    assert "40" in note or dia.driver is not None, dia.notes


@pytest.mark.long
def test_a_log_without_torque_is_searched_from_its_beginning(short: None) -> None:
    rec = record(AXIS.model().with_effect("coulomb_friction", torque=0.05), torque=False)
    dia = ga.diagnose(rec, CONTROLLER)
    assert found(dia, "coulomb_friction")["torque"].value == pytest.approx(0.05, rel=0.05)
    assert any("from the beginning" in str(note) for note in dia.notes)


@pytest.mark.long
def test_what_begins_behind_the_searched_lines_of_a_log_without_torque_is_said(short: None) -> None:
    """No friction at the beginning, and friction later: that is not adequate."""
    free, rough = (
        record(AXIS.model(), torque=False),
        record(AXIS.model().with_effect("coulomb_friction", torque=0.1), torque=False),
    )
    both = np.concatenate([free.velocity[:60_000], rough.velocity[60_000:]])
    dia = ga.diagnose(free.with_channels(velocity=both), CONTROLLER)
    assert dia.verdict not in ("adequate", "explained"), dia.summary()


@pytest.mark.long
def test_the_order_of_records_and_a_record_given_twice_change_nothing(short: None) -> None:
    model = AXIS.model().with_effect("coulomb_friction", torque=0.05)
    one, two = record(model, 1, 40_000), record(model, 2, 40_000)
    dia, other = ga.diagnose([one, two], CONTROLLER), ga.diagnose([two, one], CONTROLLER)
    assert dia.findings == other.findings and dia.model == other.model and dia.notes == other.notes
    assert found(dia, "coulomb_friction")["torque"].value == pytest.approx(0.05, rel=0.01)


def slow_log(later: float) -> tuple[ga.Record, ga.Cascade]:
    """A line for each fourth sample of the controller, and dry friction that is another one in the second half [N m]."""
    rng, controller = np.random.default_rng(0), ga.Cascade(CONTROLLER, period=DT / 4)
    steps = np.repeat(rng.uniform(-30.0, 30.0, 125), 800)
    command = np.convolve(np.concatenate([np.zeros(300), steps]), np.ones(200) / 200.0)[: len(steps)]
    asked = ga.Record(DT, command=command, velocity=np.zeros(len(steps)))
    runs = [ga.run(AXIS.model().with_effect("coulomb_friction", torque=level), asked, controller) for level in (0.05, later)]
    half = len(steps) // 2
    velocity, torque = (np.concatenate([getattr(runs[0], x)[:half], getattr(runs[1], x)[half:]]) for x in ("velocity", "torque"))
    noise = 1e-3 * rng.standard_normal(len(steps))
    return ga.Record(DT, command=command, velocity=velocity + noise, torque=torque), controller


@pytest.mark.long
@pytest.mark.parametrize("later", [0.05, 0.1])
def test_a_log_slower_than_its_controller_is_searched_from_its_beginning(later: float, short: None) -> None:
    """There the loop can be simulated; the model is compared with all lines."""
    dia = ga.diagnose(*slow_log(later))
    assert any("from the beginning" in str(note) for note in dia.notes)
    if later == 0.05:
        assert dia.verdict == "explained" and found(dia, "coulomb_friction")["torque"].value == pytest.approx(0.05, rel=0.01)
    else:
        assert dia.verdict not in ("adequate", "explained"), dia.summary()


def test_arguments_are_checked_before_anything_is_searched(short: None) -> None:
    rec = record(AXIS.model(), samples=60_000)
    with pytest.raises(ga.GaidentError, match="progress is 5"):
        ga.diagnose(rec, CONTROLLER, progress=5)  # type: ignore[arg-type]
    with pytest.raises(ga.GaidentError, match="different sample times"):
        ga.diagnose([rec, rec[:1000].with_channels(dt=2 * DT)], CONTROLLER)
    with pytest.raises(ga.GaidentError, match="no command"):
        ga.diagnose([rec, rec[:1000].with_channels(command=None)], CONTROLLER)
