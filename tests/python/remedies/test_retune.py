"""retune(): what it proposes, of whom, and what it says where the model is not to be trusted."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaident as ga
from gaident.axis import said
from gaident.remedies import nonlinear
from gaident.remedies.doubts import doubts_of, no_gains
from gaident.remedies.draws import age_of, drawn_models
from gaident.remedies.loops import Loops, frequencies_of
from gaident.remedies.nonlinear import simulated_with, without_each
from gaident.remedies.plants import sampled_plants
from gaident.results.json_text import json_text
from gaident.results.store import schema

T = 1e-3
LAGGED = ga.TwoMass(JM=2e-4, DM=1e-3, JL=4e-4, DL=1e-3, KG=40.0, DG=4e-3).model().with_effect("torque_lag", time_constant=1e-3)
GIVEN = ga.PI(0.02, 0.5)


def log_of(model: ga.Model, controller: Any, seed: int = 1, noise: float = 0.05) -> ga.Record:
    """Steps with reversals, with noise that the controller reads."""
    rng = np.random.default_rng(seed)
    command = np.repeat(rng.permutation([20.0, -30.0, 10.0, -5.0, 40.0, -20.0, 3.0, 0.0]), 75)
    v = noise * rng.standard_normal(len(command))
    run = ga.run(model, ga.Record(T, command=command - v, velocity=v), controller)
    return ga.Record(T, command=command, velocity=run.velocity + v, torque=run.torque)


@pytest.fixture(scope="module")
def found() -> ga.Diagnosis:
    return ga.diagnose(log_of(LAGGED, GIVEN), GIVEN, seed=1)


@pytest.fixture(scope="module")
def tuned(found: ga.Diagnosis) -> ga.Retuning:
    return ga.retune(found, phase_margin=50.0, gain_margin=9.0)


def margins_of(model: ga.Model, cascade: ga.Cascade) -> tuple[float, float, bool]:
    plants = sampled_plants([model.linear], T, cascade.delay, False)
    loops = Loops(plants, cascade, plants.responses(frequencies_of(plants, 600, 81)))
    return float(loops.phase_margins[0]), float(loops.gain_margins[0]), bool(loops.stable[0])


@pytest.mark.long
def test_the_true_drive_keeps_the_margins_and_is_stiffer(tuned: ga.Retuning) -> None:
    assert isinstance(tuned.controller, ga.PI) and tuned.controller != GIVEN and tuned.given == GIVEN
    phase, gain, stable = margins_of(LAGGED, ga.Cascade(tuned.controller))
    assert stable and phase >= 49.5 and gain >= 8.9
    assert tuned.keeps and tuned.missed == () and tuned.holds >= 0.95 and tuned.drives == 200 and not tuned.doubts
    assert tuned.after.stiffness.value > 1.5 * tuned.before.stiffness.value
    assert tuned.after.phase_margin.low <= tuned.after.phase_margin.value <= tuned.after.phase_margin.high
    assert {s.name for s in tuned.starts} >= {"symmetrical optimum", "magnitude optimum", "two masses, equally damped"}
    assert tuned.rule in {s.name for s in tuned.starts}


def test_the_covariance_is_that_of_the_numbers(found: ga.Diagnosis) -> None:
    models = drawn_models(found, 300, seed=3)
    assert len(models) == 301 and models[0] == found.model
    lags = [m.effects[0].values[0] for m in models[1:]]
    lag = found.findings[0].parameters["time_constant"]
    assert found.findings[0].effect == "torque_lag"
    assert float(np.std(lags)) == pytest.approx(lag.std, rel=0.15) and float(np.mean(lags)) == pytest.approx(lag.value, rel=0.01)
    inertias = [1.0 / m.gain for m in models[1:]]
    assert float(np.std(inertias)) == pytest.approx(found.mechanics["motor_inertia"].std, rel=0.5)
    assert drawn_models(replace(found, covariance=None), 10, seed=0) == [found.model]


def test_a_step_asks_for_no_more_torque_than_allowed(found: ga.Diagnosis, tuned: ga.Retuning) -> None:
    free = tuned.after.step_torque.value
    limited = ga.retune(replace(found, covariance=None), ga.PI(0.02, 0.5, torque_limit=0.6 * free))
    assert limited.torque_limit == 0.6 * free and limited.controller.limits[0] == 0.6 * free
    assert limited.after.step_torque.value <= 0.6 * free and limited.keeps
    assert limited.controller.gains.kp < tuned.controller.gains.kp


def test_filters_are_added_to_a_cascade_where_they_pay(found: ga.Diagnosis, tuned: ga.Retuning) -> None:
    cascade = ga.retune(replace(found, covariance=None), ga.Cascade(GIVEN), phase_margin=50.0, gain_margin=9.0)
    assert isinstance(cascade.controller, ga.Cascade)
    added = len(cascade.controller.torque_filters)
    paid = any("Added" in note for note in cascade.notes)
    assert (added > 0) == paid == any("would be" in note for note in tuned.notes)
    assert not paid or cascade.after.stiffness.value > 1.1 * tuned.after.stiffness.value
    phase, gain, stable = margins_of(LAGGED, cascade.controller)
    assert stable and phase >= 49.5 and gain >= 8.9


@pytest.mark.long
def test_the_gain_of_a_position_controller_is_proposed_too(found: ga.Diagnosis) -> None:
    cascade = ga.Cascade(GIVEN, position=ga.P(5.0), position_period=2e-3, velocity_feedforward=1.0)
    result = ga.retune(found, cascade, filters=False)
    proposal = result.controller
    assert isinstance(proposal, ga.Cascade) and proposal.position is not None
    assert proposal.position.gain > 5.0 and proposal.velocity_feedforward == 1.0
    assert result.after.position_phase_margin is not None and result.after.position_phase_margin.low >= 44.0
    assert result.after.overshoot.value < 5.0 and result.after.settling_time.value < result.before.settling_time.value
    assert "position gain" in result.summary()


def test_a_proportional_loop_stays_one(found: ga.Diagnosis) -> None:
    result = ga.retune(replace(found, covariance=None), ga.Cascade(ga.PI(0.02, 0.0), position=ga.P(5.0)), filters=False)
    proposal = result.controller
    assert isinstance(proposal, ga.Cascade) and proposal.position is not None
    assert proposal.velocity.ki == 0.0 and proposal.velocity.kp > 0.02 and proposal.position.gain > 5.0 and result.keeps
    assert result.after.stiffness.value > 2.0 * result.before.stiffness.value
    assert "None is added, because none was asked for." in result.notes[0] and "A PI has no filter" not in result.notes[0]


def test_where_no_gains_are_stable_the_given_ones_stay(found: ga.Diagnosis) -> None:
    spring = ga.Model(2500.0, [-5.0 + 60.0j, -5.0 - 60.0j], [0.0])
    result = ga.retune(replace(found, model=spring, covariance=None))
    assert result.controller == GIVEN and not result.keeps and "stable" in result.missed
    assert "The given ones stay" in result.notes[0] and "zero at 0, as of an axis on a spring" in result.notes[0]
    assert "NOT STABLE" in result.summary() and "Missed: stability" in " ".join(result.summary().split())
    assert "force that grows with the position" in said(result.notes[0], "linear")


def test_a_zero_that_may_be_at_0_is_one_of_a_spring() -> None:
    def axis(zero: float) -> ga.Model:
        return ga.Model(2500.0, [-5.0 + 60.0j, -5.0 - 60.0j], [zero])

    assert "on a spring" in no_gains([axis(-3e-4), axis(2e-4), axis(-1e-3)]) and "on a spring" in no_gains([axis(0.0)])
    for others in ([axis(-3.0), axis(-2.0)], [ga.Model(2500.0, [-5.0])], [LAGGED.mechanism]):
        assert no_gains(others).endswith("in the velocity loop: the given ones stay.")


def test_a_falsified_model_is_said_so_first(found: ga.Diagnosis) -> None:
    hidden = LAGGED.with_effect("coulomb_friction", torque=0.3)
    idn = ga.identify(log_of(hidden, GIVEN), controller=GIVEN)
    assert idn.falsified
    assert age_of(idn, GIVEN) == 0.0 and age_of(replace(found, velocity_age=0.5), GIVEN) == 0.5
    made = tuple(r.with_channels(position=T * np.cumsum(r.velocity)) for r in idn.records)
    assert age_of(replace(idn, records=made), GIVEN) == 0.5
    assert age_of(replace(idn, records=made), ga.Cascade(GIVEN, period=T / 4)) == 0.125
    late = replace(idn, model=idn.model.with_effect("transport_delay", delay=2.0 * T), covariance=None)
    result = ga.retune(idn, filters=False)
    delayed = ga.retune(late, filters=False)
    assert delayed.controller.gains.kp < 0.8 * result.controller.gains.kp
    assert ga.Retuning.from_dict(delayed.to_dict()) == delayed
    assert result.summary().startswith("Warning: The data contradict this model: the linear model is falsified.")
    assert "in doubt" in repr(result)
    doubts = doubts_of(replace(found, verdict="partly explained", loop_follows=False))
    assert "the verdict of the diagnosis is partly explained" in doubts[0]
    assert len(doubts) == 2 and "The logged force does not follow" in said(doubts[1], "linear")


def test_effects_that_are_not_linear_are_simulated(tuned: ga.Retuning) -> None:
    friction = {"torque": 0.05, "static_torque": 0.4, "stribeck_velocity": 0.5}
    sticking = LAGGED.with_effect("stribeck_friction", **friction)
    told = simulated_with(sticking, GIVEN, tuned.controller, T, 20.0, tuned.after)
    assert any("stick-slip" in s for s in told)
    ((name, now, then),) = without_each(sticking, tuned.controller, T, 20.0, tuned.after)
    assert name == "stribeck_friction" and then < now
    shown = replace(tuned, mended=((name, now, then),), simulated=told).summary()
    assert "if mended" in shown and "stick-slip" in shown
    told = simulated_with(LAGGED, GIVEN, ga.PI(0.06, 3.0, torque_limit=0.5), T, 60.0, tuned.after)
    assert any("reaches the limit" in s for s in told)
    assert not simulated_with(LAGGED, GIVEN, tuned.controller, T, 20.0, tuned.after)


@pytest.mark.parametrize(("kp", "ki", "gap", "cycle"), [(0.02, 50.0, 0.02, True), (0.2, 60.0, 0.2, False)])
def test_a_swing_at_rest_is_a_limit_cycle_where_it_does_not_die_out(
    tuned: ga.Retuning, kp: float, ki: float, gap: float, cycle: bool
) -> None:
    """In a wide gap it takes seconds to die out, a hundred times longer than the linear loop takes to settle."""
    shaft = ga.TwoMass(JM=2e-4, DM=1e-4, JL=4e-4, DL=1e-4, KG=40.0, DG=4e-3).model().with_effect("backlash", gap=gap)
    told = simulated_with(shaft, GIVEN, ga.PI(kp, ki), T, 2.0, tuned.after)
    assert any("limit cycle" in s for s in told) is cycle, told
    command = np.repeat([0.0, 2.0, 0.0], [1, 4000, 16000])
    velocity = ga.run(shaft, ga.Record(T, command=command, velocity=0.0 * command), ga.PI(kp, ki)).velocity
    assert (float(np.ptp(velocity[-2000:])) > 1.0) is cycle


def test_what_a_limit_does_is_told_beside_what_it_does_under_the_given_gains(tuned: ga.Retuning) -> None:
    """Behind a limit a position loop that is stable without it may swing for ever, where the given gains come to rest."""
    drive = ga.OneMass(J=1e-3, D=2e-3).model()

    def loop(kp: float, ki: float, gain: float) -> ga.Cascade:
        return ga.Cascade(ga.PI(kp, ki, torque_limit=0.4), position=ga.P(gain), velocity_feedforward=0.5)

    told = simulated_with(drive, loop(0.05, 1.0, 10.0), loop(0.0473, 3.06, 24.6), T, 60.0, tuned.after)
    said = re.search(r"back at 0 the velocity still moves by \+-(\S+) rad/s, under the given gains by \+-(\S+)\.$", str(told[0]))
    assert said is not None and float(said[1]) > 100.0 and float(said[2]) < 1e-3, told
    assert any(re.search(r"beyond it, under the given gains 68\.8 %\.$", str(s)) for s in told), told


def test_a_limit_of_which_no_record_shows_the_step_is_noted(found: ga.Diagnosis) -> None:
    position = ga.Record(T, position_command=np.zeros(200), velocity=np.zeros(200))
    for records in ((), (position,)):
        notes = ga.retune(replace(found, records=records, covariance=None), ga.PI(0.02, 0.5, torque_limit=9.0), dt=T).notes
        assert any("No record shows the steps of a velocity command: one of 1 rad/s is taken" in s for s in notes), notes


def test_of_given_gains_that_cannot_be_simulated_nothing_is_said(tuned: ga.Retuning, monkeypatch: pytest.MonkeyPatch) -> None:
    sticking = LAGGED.with_effect("stribeck_friction", torque=0.05, static_torque=0.4, stribeck_velocity=0.5)
    (told,) = simulated_with(sticking, GIVEN, tuned.controller, T, 20.0, tuned.after)
    assert "stick-slip), under the given gains for" in told
    tried = nonlinear._tried

    def refused(model: ga.Model, controller: ga.PI, *more: Any) -> Any:
        if controller is GIVEN:
            raise ga.GaidentError("too large")
        return tried(model, controller, *more)

    monkeypatch.setattr(nonlinear, "_tried", refused)
    (told,) = simulated_with(sticking, GIVEN, tuned.controller, T, 20.0, tuned.after)
    assert "stick-slip)." in told


@pytest.mark.long
def test_an_integral_that_winds_up_behind_a_limit_is_named_with_its_remedy_and_is_no_limit_cycle() -> None:
    drive, given = ga.OneMass(J=1e-3, D=2e-3).model(), ga.PI(0.05, 1.0, torque_limit=0.4)
    command = 2.0 * np.repeat([20.0, -30.0, 10.0, -5.0, 40.0, -20.0, 3.0, 0.0], 300)
    noise = 0.02 * np.random.default_rng(7).standard_normal(len(command))
    run = ga.run(drive, ga.Record(T, command=command - noise, velocity=noise), given)
    rec = ga.Record(T, command=command, velocity=run.velocity + noise, torque=run.torque)
    found = ga.diagnose(rec, given, seed=1)
    tuned = ga.retune(found)
    # A limit that the given gains exceed by themselves is no reason for a soft loop.
    assert tuned.after.stiffness.value > 0.99 * tuned.before.stiffness.value
    assert tuned.torque_limit == tuned.before.step_torque.value > 6.0
    notes = " ".join(tuned.notes)
    assert "asks for 6.06 N m, more than the limit of 0.4 N m" in notes and "times as stiff as it is" not in notes
    # A larger integral winds up further, and a position loop overshoots: not where the integral is held.
    assert tuned.controller.gains.ki <= given.ki and "with ki no larger than given" in notes
    held = ga.retune(found, replace(given, anti_windup="hold"))
    assert held.controller.gains.ki > 2.0 * given.ki and "no larger than given" not in " ".join(held.notes)
    placed = ga.Cascade(given, position=ga.P(5.0))
    wound = ga.retune(found, placed).controller
    assert isinstance(wound, ga.Cascade) and wound.position is not None and wound.position.gain <= 5.0
    told = " ".join(ga.retune(found, torque_limit=100.0, most_times=3.0).simulated)
    up = np.repeat([0.0, 120.0], [1, 3000])
    loop = ga.PI(0.15, 3.0, torque_limit=0.4)
    beyond = 100.0 * (
        float(np.max(ga.run(found.model, ga.Record(T, command=up, velocity=0.0 * up), loop).velocity)) / 120.0 - 1.0
    )
    assert f"the velocity then goes {beyond:.3g} % beyond it" in told and beyond > 40.0
    assert 'held there, anti_windup="hold", the velocity goes 0 % beyond the step' in told and "limit cycle" not in told
    low = ga.retune(found, torque_limit=0.4)
    assert low.torque_limit == 0.4 and low.after.step_torque.value <= 0.4 * 1.001
    assert "times as stiff as it is: a step of 120 rad/s may ask for 0.4 N m" in " ".join(low.notes)
    saved = ga.retune(ga.Diagnosis.from_dict(found.to_dict()), dt=T)
    assert "one of 1 rad/s is taken" in " ".join(saved.notes)


def test_it_is_saved_drawn_and_told(tuned: ga.Retuning, tmp_path: Path) -> None:
    tuned.save(tmp_path / "tuned.json")
    assert ga.load(tmp_path / "tuned.json") == tuned
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.Draft202012Validator(schema()).validate(json.loads(json_text(tuned.to_dict())))
    assert len(tuned.plot().axes) == 3
    text = tuned.summary()
    assert "phase margin" in text and "N m/rad" in text and "hold in" in text
    assert "N/m" in tuned.summary(axis="linear") and "N m" not in tuned.summary(axis="linear")


def test_noise_and_the_position_loop_count_among_what_is_missed(tuned: ga.Retuning) -> None:
    noise = tuned.after.torque_noise.value
    quiet = replace(tuned, torque_noise=0.5 * noise)
    assert quiet.missed == ("torque_noise",) and replace(tuned, torque_noise=2.0 * noise).keeps
    told = " ".join(quiet.summary().split())
    assert "does not keep what was asked for" in told and "of torque noise" in told and "Missed: torque noise, rms." in told
    assert ga.Retuning.from_dict(quiet.to_dict()) == quiet
    before = {name: value for name, value in tuned.to_dict().items() if name != "torque_noise"}
    assert ga.Retuning.from_dict(before) == tuned
    low, high = ga.Spread(40.0, 39.0, 41.0, "deg"), ga.Spread(12.0, 12.0, 12.0, "dB")
    placed = replace(tuned, after=replace(tuned.after, position_phase_margin=low, position_gain_margin=high))
    assert placed.missed == ("position_phase_margin",) and "margins of the position loop" in " ".join(placed.summary().split())
    assert "force noise" in replace(quiet, axis="linear").summary()


def test_a_difference_over_samples_is_late_in_the_loop(found: ga.Diagnosis) -> None:
    """Over 8 samples it is 4 samples late: gains that do not know of it would leave no margin."""
    slow = replace(found, model=LAGGED.with_effect("velocity_difference", samples=8.0), covariance=None)
    known, plain = (ga.retune(one, phase_margin=50.0) for one in (slow, replace(found, model=LAGGED, covariance=None)))
    delayed = LAGGED.with_effect("transport_delay", delay=4.0 * T)
    phase, _, stable = margins_of(delayed, ga.Cascade(known.controller))
    assert stable and phase >= 49.5
    assert known.controller.gains.kp < 0.7 * plain.controller.gains.kp


def test_a_changing_inertia_is_said(found: ga.Diagnosis) -> None:
    turning = replace(found, model=LAGGED.with_effect("position_inertia", amplitude=0.5, order=1.0, phase=0.0), covariance=None)
    assert any("inertia changes with the angle" in note for note in ga.retune(turning).notes)
    assert any("inertia changes with the angle" in note for note in ga.feedforward(turning).notes)


def test_one_clock(found: ga.Diagnosis) -> None:
    with pytest.raises(ga.GaidentError, match=r"dt is 0.0001 and the controller's period 0.001"):
        ga.retune(found, ga.Cascade(GIVEN, period=T), dt=1e-4)


def test_a_loaded_result_needs_the_sample_time_and_the_same_seed_gives_the_same(
    found: ga.Diagnosis, tuned: ga.Retuning, tmp_path: Path
) -> None:
    found.save(tmp_path / "found.json")
    loaded = ga.load(tmp_path / "found.json")
    assert isinstance(loaded, ga.Diagnosis)
    with pytest.raises(ga.GaidentError, match=r"give dt="):
        ga.retune(loaded)
    again = ga.retune(loaded, phase_margin=50.0, gain_margin=9.0, dt=T, step=tuned.step)
    assert again == tuned


@pytest.mark.parametrize(
    ("named", "message"),
    [({"phase_margin": 95.0}, "phase_margin is 95"), ({"gain_margin": 0.0}, "gain_margin is 0"), ({"step": -1.0}, "step is -1"),
     ({"torque_limit": 0.0}, "torque_limit is 0"), ({"torque_noise": "x"}, "torque_noise"), ({"seed": -1}, "seed is -1"),
     ({"dt": 0.0}, "dt is 0"), ({"filters": 1}, "filters is 1"), ({"controller": 3}, "controller is 3"),
     ({"controller": ga.PI(0.02, None)}, "ki=None"), ({"controller": ga.PI(0.02, 0.5, loop="continuous")}, "continuous loop")],
)  # fmt: skip
def test_wrong_use_is_told(found: ga.Diagnosis, named: dict[str, Any], message: str) -> None:
    with pytest.raises(ga.GaidentError, match=message):
        ga.retune(found, **named)
    with pytest.raises(ga.GaidentError, match="result is str"):
        ga.retune("found")  # type: ignore[arg-type]


def test_gains_are_raised_no_further_than_asked(found: ga.Diagnosis, tuned: ga.Retuning) -> None:
    given = tuned.given.gains
    free = max(tuned.controller.gains.kp / given.kp, tuned.controller.gains.ki / given.ki)
    assert free > 1.5, "the margins would allow more"
    times = 1.0 + 0.4 * (free - 1.0)
    held = ga.retune(found, phase_margin=50.0, most_times=times)
    own = held.controller.gains
    assert own.kp <= times * given.kp * (1.0 + 1e-12) and own.ki <= times * given.ki * (1.0 + 1e-12)
    assert held.keeps and any(f"more than {times:g} times the given one" in note for note in held.notes)
    assert not any("times the given one" in note for note in tuned.notes)
    for wrong in (0.5, float("nan"), "3"):
        with pytest.raises(ga.GaidentError, match="most_times"):
            ga.retune(found, most_times=wrong)  # type: ignore[arg-type]


def test_a_lag_that_the_model_does_not_contain_has_to_be_in_the_controller(found: ga.Diagnosis) -> None:
    lag = ga.Finding("torque_filter", {"time_constant": ga.Estimate(8e-4, 1e-5, "s")}, place="controller")
    driven = replace(found, controller=None, findings=(*found.findings, lag))
    with pytest.raises(ga.GaidentError, match=r"low pass of 0.8 ms .* give it, .*LowPass\(0.0008\)"):
        ga.retune(driven, ga.Cascade(GIVEN))
