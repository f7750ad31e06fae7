"""Which form a controller has, from logs of the referee (servo_referee.py) with a bare PI given."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

import gaident as ga
import servo_referee as referee
from gaident.diagnosis.controller.driving import driving_of
from gaident.diagnosis.controller.form_findings import driver_of, loop_of
from gaident.diagnosis.controller.form_regression import fitted_shape, law_of
from gaident.diagnosis.controller.forms import Shown, form_shown
from gaident.diagnosis.controller.other_form import other_form
from gaident.diagnosis.controller.slow_forms import limited
from gaident.diagnosis.explain.alternatives import alternatives_of
from gaident.diagnosis.explain.verdict import verdict_of
from gaident.identification.logged_torque import not_followed
from gaident.identification.replay.driven_records import torque_driven
from gaident.identification.replay.replay import replay
from referee_logs import GIVEN, KI, KP, NOTCH, T, command, dip, log, low, slower


def shown_by(*records: ga.Record, given: ga.PI = GIVEN) -> Shown | None:
    with threadpool_limits(1, user_api="blas"):
        return form_shown(records, given)


CASES: dict[str, tuple[Any, dict[str, dict[str, float]]]] = {
    # name: what the referee is given, and what must be named with which numbers
    "backward": (lambda: {"rule": "backward"}, {"integration_rule": {}}),
    "forward": (lambda: {"rule": "forward"}, {"integration_rule": {}}),
    "IP": (lambda: {"weight": 0.0}, {"command_weight": {"weight": 0.0}}),
    "half": (lambda: {"weight": 0.5}, {"command_weight": {"weight": 0.5}}),
    "IP, backward": (lambda: {"weight": 0.0, "rule": "backward"}, {"integration_rule": {}, "command_weight": {"weight": 0.0}}),
    "low pass": (lambda: {"torque_filters": [low(4e-4)]}, {"torque_filter": {"time_constant": 4e-4}}),
    "notch": (lambda: {"torque_filters": [dip()]}, {"torque_filter": NOTCH}),
    "velocity filter": (
        lambda: {"velocity_filters": [low(1e-3)]},
        {"velocity_feedback_filter": {"time_constant": 1e-3}},
    ),
    "command filter": (lambda: {"command_filters": [low(2e-3)]}, {"command_filter": {"time_constant": 2e-3}}),
    "acceleration": (lambda: {"aff": 9e-4}, {"acceleration_feedforward": {"inertia": 9e-4}}),
    "friction": (lambda: {"fff": 0.02}, {"friction_feedforward": {"torque": 0.02}}),
    "both feedforwards": (
        lambda: {"aff": 9e-4, "fff": 0.02},
        {"acceleration_feedforward": {"inertia": 9e-4}, "friction_feedforward": {"torque": 0.02}},
    ),
    "IP with a notch": (
        lambda: {"weight": 0.0, "torque_filters": [dip()]},
        {"command_weight": {"weight": 0.0}, "torque_filter": NOTCH},
    ),
    "gains off with a low pass": (
        lambda: {"kp": 0.9 * KP, "ki": 1.1 * KI, "torque_filters": [low(6e-4)]},
        {"other_gains": {"kp": 0.9 * KP, "ki": 1.1 * KI}, "torque_filter": {"time_constant": 6e-4}},
    ),
    "backward with a feedforward": (
        lambda: {"rule": "backward", "aff": 9e-4},
        {"integration_rule": {}, "acceleration_feedforward": {"inertia": 9e-4}},
    ),
    "two filters": (
        lambda: {"torque_filters": [low(4e-4), dip()]},
        {"torque_filter": {"time_constant": 4e-4, **NOTCH}},
    ),
}


def hold(shown: Shown | None, named: dict[str, dict[str, float]]) -> None:
    """Names, and numbers within 1 % or four deviations."""
    assert shown is not None and set(shown.numbers) == set(named)
    for name, numbers in named.items():
        assert set(shown.numbers[name]) == set(numbers)
        for key, true in numbers.items():
            value, std = shown.numbers[name][key]
            assert abs(value - true) < max(0.01 * abs(true), 4.0 * std), (name, key, value, std)


@pytest.mark.long
@pytest.mark.parametrize("digits", [0, 4])
@pytest.mark.parametrize("name", CASES)
def test_each_form_is_named_with_its_numbers(name: str, digits: int) -> None:
    given, named = CASES[name]
    shown = shown_by(log(digits=digits, **given()))
    hold(shown, named)
    assert shown is not None and (digits or named == {"integration_rule": {}} or shown.rms < 1e-9 * shown.before)


@pytest.mark.long
@pytest.mark.parametrize("reads", ["counts", "more"])
@pytest.mark.parametrize("name", ["notch", "velocity filter"])
def test_a_lattice_of_speeds_is_the_encoders_or_the_logs(name: str, reads: str) -> None:
    """Speeds of an encoder's counts, that the controller reads too, written with five decimals; or 16 bits of what it reads."""
    given, named = CASES[name]
    step = 2.0 * np.pi / 2**20 / T if reads == "counts" else 100.0 / 2**15
    filters = given()
    if reads == "counts":
        filters["velocity_filters"] = [lambda w: np.round(w / step) * step, *filters.get("velocity_filters", [])]
    rec = log(**filters)
    assert rec.velocity is not None and rec.torque is not None
    counts = np.round(rec.velocity / step) * step
    shown = shown_by(
        ga.Record(
            T, command=rec.command, velocity=np.round(counts, 5) if reads == "counts" else counts, torque=np.round(rec.torque, 5)
        )
    )
    hold(shown, named)
    assert shown is not None and (shown.rms < 1e-5 or reads == "more")


@pytest.mark.parametrize("name", ["IP", "low pass", "notch", "gains off with a low pass"])
def test_noise_on_a_measured_torque_does_not_break_it(name: str) -> None:
    given, named = CASES[name]
    hold(shown_by(log(noise=0.005, **given())), named)


def test_the_right_gains_need_nothing() -> None:
    assert shown_by(log()) is None
    assert shown_by(log(digits=4)) is None
    assert driver_of([log()], [], GIVEN) is None


def test_several_records_are_one_regression() -> None:
    hold(shown_by(log(0, weight=0.0), log(1, weight=0.0)), CASES["IP"][1])


@pytest.mark.long
def test_a_torque_that_no_form_makes_is_none() -> None:
    rec = log()
    assert rec.torque is not None
    n = np.arange(len(rec))
    assert shown_by(rec.with_channels(torque=rec.torque + 0.05 * np.sin(n / 30.0))) is None
    assert shown_by(rec.with_channels(torque=rec.torque * (1.0 + 0.2 * np.sign(rec.torque)))) is None


@pytest.mark.long
def test_a_diagnosis_names_the_controller_and_no_mechanics() -> None:
    r = command()
    noise = 0.02 * np.random.default_rng(3).standard_normal(len(r))
    sensor = iter(noise)
    reads = [lambda w: w + next(sensor)]  # what the controller reads, and the log shows
    axis = referee.Axis(1e-3, 0.01)
    w, u, _ = referee.simulate(axis, r, T, kp=KP, ki=KI, weight=0.0, torque_filters=[dip()], velocity_filters=reads)
    rec = ga.Record(T, command=r, velocity=w + noise, torque=u)
    dia = ga.diagnose(rec, GIVEN)
    assert {f.effect for f in dia.causes} == {"command_weight", "torque_filter"}
    assert {f.place for f in dia.causes} == {"controller"}
    assert dia.verdict == "explained" and isinstance(dia.controller, ga.Cascade)  # as it was used
    assert dia.controller.velocity.command_weight == 0.0 and len(dia.controller.torque_filters) == 1
    assert dia.mechanics["inertia"].value == pytest.approx(1e-3, rel=0.01)
    assert "The given gains alone do not make the logged torque" in dia.summary()


@pytest.mark.parametrize(
    ("made", "named"),
    [
        ({}, {}),
        ({"weight": 0.0}, {"command_weight": {"weight": 0.0}}),
        ({"torque_filters": [low(2e-3)]}, {"torque_filter": {"time_constant": 2e-3}}),
    ],
)
def test_a_slower_log_shows_the_form_too(made: dict[str, Any], named: dict[str, dict[str, float]]) -> None:
    with threadpool_limits(1, user_api="blas"):
        loop = loop_of([slower(**made)], ga.Cascade(GIVEN, T))
    assert {f.effect for f in loop.findings} == set(named)
    assert {f.place for f in loop.findings} <= {"controller"}
    for finding in loop.findings:
        for key, true in named[finding.effect].items():
            assert finding.parameters[key].value == pytest.approx(true, rel=0.05, abs=1e-3)
    assert isinstance(loop.controller, ga.Cascade) and loop.controller.period == T


@pytest.mark.parametrize("windup", ["none", "hold"])
def test_what_the_integrator_does_at_a_limit_is_told_by_the_whole_run(windup: str) -> None:
    found = limited([slower(torque_limit=0.6, windup=windup)], ga.Cascade(GIVEN, T))
    assert found.limit == 0.6 and found.controller.velocity == ga.PI(KP, KI, torque_limit=0.6, anti_windup=windup)
    assert found.gain > 100.0
    free = limited([slower()], ga.Cascade(GIVEN, T))
    assert free.limit is None and free.controller == ga.Cascade(GIVEN, T)


@pytest.mark.long
@pytest.mark.parametrize("windup", ["none", "hold"])
def test_an_anti_windup_that_was_not_given_is_found_at_a_given_limit(windup: str) -> None:
    """At the sample time that was given, and at one that nobody gave; a given limit is no finding."""
    given, rec = ga.PI(KP, KI, torque_limit=0.6), slower(noise=0.005, torque_limit=0.6, windup=windup)
    true = ga.Cascade(replace(given, anti_windup=windup), T)
    found = limited([rec], ga.Cascade(given, T))
    assert (found.limit, found.controller, found.gain > 0.0) == (None, true, windup != "none")
    for controller in (ga.Cascade(given, T), given):
        loop = loop_of([rec], controller)
        assert loop.controller == true and [f.effect for f in loop.findings] == ["anti_windup"] * (windup == "hold")
        assert all("anti-windup 'hold'" in str(f.evidence) and f.delta_bic > 100.0 for f in loop.findings)


@pytest.mark.long
@pytest.mark.parametrize(("windup", "said"), [("none", "without its anti-windup"), ("hold", "an integrator that is held")])
@pytest.mark.parametrize("timed", [True, False])
def test_another_anti_windup_than_the_given_one_is_found_at_a_given_limit(windup: str, said: str, timed: bool) -> None:
    wrong = ga.PI(KP, KI, torque_limit=0.6, anti_windup="tracking", tracking_time=5e-3)
    true = ga.Cascade(ga.PI(KP, KI, torque_limit=0.6, anti_windup=windup), T)
    rec = slower(noise=0.005, torque_limit=0.6, windup=windup)
    assert limited([rec], ga.Cascade(wrong, T)).controller == true
    dia = ga.diagnose(rec, controller=ga.Cascade(wrong, T) if timed else wrong)
    named = ["anti_windup"] * (windup == "hold")
    assert ([f.effect for f in dia.findings], dia.controller) == (named, true)
    assert dia.verdict == ("explained" if named else "adequate"), "what a controller has too much is a note"
    notes = " ".join(map(str, dia.notes))
    assert said in notes and "torque saturation" not in notes


@pytest.mark.parametrize(("every", "exact"), [(1, 1e-6), (4, 0.02)])
def test_a_tracking_time_that_was_not_given_is_found(every: int, exact: float) -> None:
    """In a slow log the noise between its lines moves it: by 0.5 to 2.5 % with other noise, as its deviation says."""
    time = 4.2e-3
    rec = slower(every, torque_limit=0.6, windup="tracking", tracking=time)
    found = limited([rec], ga.Cascade(GIVEN, T))
    pi, std = found.controller.velocity, found.time_std
    assert pi.anti_windup == "tracking" and pi.tracking_time is not None
    assert abs(pi.tracking_time - time) < max(3.0 * std, 1e-6 * time) and std < exact * time


@pytest.mark.long
def test_a_slower_log_whose_torque_no_form_makes_names_none() -> None:
    rec = slower()
    assert rec.torque is not None
    loop = loop_of([rec.with_channels(torque=rec.torque * (1.0 + 0.2 * np.sign(rec.torque)))], ga.Cascade(GIVEN, T))
    assert loop.findings == () and loop.controller == ga.Cascade(GIVEN, T)


@pytest.mark.parametrize("every", [2, 8])
def test_the_given_controller_is_no_other_form_of_itself_in_a_slow_log(every: int) -> None:
    """A limit between the lines leaves an error of colour, in which other gains by a part in a thousand would gain BIC units."""
    rec = slower(every, noise=0.02, torque_limit=0.6)
    shown = form_shown([rec], GIVEN, (), every)
    assert shown is not None and set(shown.numbers) == {"torque_saturation"}


@pytest.mark.parametrize("form", ["command filter", "torque filter", "none"])
def test_a_form_is_found_although_an_unknown_limit_acts(form: str) -> None:
    """A limit with an anti-windup that no replay knows leaves lines that follow from no form: small torques show it."""
    made = {"command filter": {"command_filters": [low(2e-3)]}, "torque filter": {"torque_filters": [low(5e-4)]}, "none": {}}
    named = {"command filter": {"command_filter"}, "torque filter": {"torque_filter"}, "none": set()}
    shown = shown_by(log(torque_limit=0.6, windup="tracking", tracking=4e-3, **made[form]))
    assert shown is not None and set(shown.numbers) == {*named[form], "torque_saturation", "anti_windup"}
    time, std = shown.numbers["anti_windup"]["tracking_time"]
    assert abs(time - 4e-3) < max(4.0 * std, 1e-5) < 1e-3
    assert shown.numbers["torque_saturation"]["limit"][0] == pytest.approx(0.6, rel=1e-6)


def test_a_slow_log_shows_the_rule_of_integration() -> None:
    rec = slower(noise=0.002, rule="backward")
    loop = loop_of([rec], ga.Cascade(GIVEN, T))
    assert [f.effect for f in loop.findings] == ["integration_rule"] and not not_followed([rec], loop.controller)
    assert loop_of([slower(noise=0.002)], ga.Cascade(GIVEN, T)).findings == ()


def test_a_rule_of_integration_is_found_before_gains_that_differ_by_little() -> None:
    found = replay(log(rule="backward", ki=0.5), ga.PI(KP, 0.5))  # as trapezoidal: kp off by 0.12 %
    assert found.cause == "integration_rule"


@pytest.mark.long
def test_a_controller_that_is_not_the_drives_is_a_rival_of_mechanics() -> None:
    rec = slower(weight=0.5, torque_filters=[low(1e-3), dip()], command_filters=[low(3e-3)], torque_limit=0.4, windup="hold")
    assert not_followed([rec], loop_of([rec], ga.Cascade(GIVEN, T)).controller)
    assert alternatives_of("extra_resonance", [], [], False, None, True) == []
    assert "torque_filter" in alternatives_of("extra_resonance", [], [], False, None, False)
    assert alternatives_of("coulomb_friction", [], [], True, None, False) == []  # the records show its jump
    assert not {"other_gains", "torque_filter"} & {*alternatives_of("load_torque", [], [], False, None, False)}


@pytest.mark.long
def test_a_wrong_filter_that_was_given_is_not_taken_for_mechanics() -> None:
    rec = slower(4, torque_filters=[low(1e-3)])
    for tau, named in ((1e-3, []), (2e-4, ["torque_filter"])):
        dia = ga.diagnose(rec, ga.Cascade(GIVEN, T, torque_filters=(ga.LowPass(tau),)))
        assert [f.effect for f in dia.causes] == named
        assert isinstance(dia.controller, ga.Cascade)
        (used,) = dia.controller.torque_filters
        assert isinstance(used, ga.LowPass) and used.time_constant == pytest.approx(1e-3, rel=0.01)
        assert any("this one is used" in note for note in dia.notes) == bool(named)
    found = ga.diagnose(rec, ga.Cascade(GIVEN, T))
    assert [f.effect for f in found.causes] == ["torque_filter"]


def test_what_was_given_and_is_not_there_is_left_out() -> None:
    rec = slower(4, weight=0.5)
    filtered = ga.Cascade(ga.PI(KP, KI, command_weight=0.5), T, torque_filters=(ga.LowPass(1e-3),))
    with threadpool_limits(1, user_api="blas"):
        form = other_form([rec], [], filtered)
    assert form is not None and form.findings == ()  # the weight is as given
    assert form.controller.velocity.command_weight == pytest.approx(0.5, abs=1e-3) and form.controller.torque_filters == ()
    assert "without its torque filter" in str(form.notes[0])
    assert not not_followed([rec], form.controller)


@pytest.mark.long
def test_a_loop_in_doubt_explains_nothing() -> None:
    """Four things at once are no form that a slow log shows: what a wrong loop leaves looks like mechanics."""
    rec = slower(weight=0.5, torque_filters=[low(1e-3), dip()], command_filters=[low(3e-3)], torque_limit=0.4, windup="hold")
    given = ga.Cascade(GIVEN, T, torque_filters=(ga.LowPass(1e-3),))
    with threadpool_limits(1, user_api="blas"):
        assert other_form([rec], [], given) is None
    assert not_followed([rec], given)
    assert verdict_of(found=True, left=False, loop_in_doubt=True) == "partly explained"
    assert verdict_of(found=True, left=False, loop_in_doubt=False) == "explained"
    assert verdict_of(found=False, left=False, loop_in_doubt=True) == "adequate"
    assert verdict_of(found=False, left=True, loop_in_doubt=False) == "unexplained"


def test_what_a_slow_log_does_not_show_between_its_lines_counts_behind_a_filter() -> None:
    """A bare PI answers on the line; a filter also to the samples between the lines, and leaves that much more."""
    regression = law_of([slower(4, torque_filters=[dip()])], GIVEN, 4)
    assert regression is not None
    law, floor = regression
    notched = fitted_shape(law, (("torque_filters", ga.Notch),), floor)
    bare = fitted_shape(law, (), floor)
    assert law.unseen(notched) > 3.0 * law.unseen(bare) > 0.0
    every = law_of([log(torque_filters=[dip()])], GIVEN)
    assert every is not None and every[0].unseen(fitted_shape(every[0], (), 0.0)) == 0.0


def test_a_form_that_was_found_is_not_looked_for_again() -> None:
    rec = slower(4, torque_limit=0.6, windup="tracking", tracking=4e-3, weight=0.5)
    with threadpool_limits(1, user_api="blas"):
        asked = loop_of([rec], ga.Cascade(GIVEN, T))
        driven = torque_driven([rec], asked.controller)
        found = driving_of(driven.records, (), asked, driven, {driven.records[0].digest: rec})
    assert {f.effect for f in asked.findings} == {"torque_saturation", "anti_windup", "command_weight"}
    (windup,) = (f.parameters["tracking_time"] for f in asked.findings if f.effect == "anti_windup")
    assert abs(windup.value - 4e-3) < 4.0 * windup.std < 2e-3
    assert found.findings == asked.findings and found.controller == asked.controller


@pytest.mark.long
@pytest.mark.parametrize("every", [2, 4])
def test_a_rule_at_a_faster_clock_is_taken_before_gains_that_differ_by_little(every: int) -> None:
    """On the lines a rectangular integral of r samples to a line is about one of kp + ki dt/(2 r)."""
    given, dt = ga.PI(0.15, 15.0), every * T / 2
    true = ga.Cascade(replace(given, rule="backward"), T / 2)
    ramps = [0.0]
    for level in (0.0, 30.0, -30.0, 120.0, 6.0, -6.0, -150.0, 60.0, 0.0):
        for _ in range(round(0.1 / dt)):
            ramps.append(ramps[-1] + float(np.clip(level - ramps[-1], -300.0 * dt, 300.0 * dt)))
    asked = np.array(ramps)
    drive = ga.OneMass(J=4.2e-4, D=2.2e-3).model().with_effect("torque_lag", time_constant=2.5e-4)
    done = ga.run(drive, ga.Record(dt, command=asked, velocity=0.0 * asked), true)
    rec = ga.Record(dt, command=asked, velocity=done.velocity, torque=done.torque)
    assert replay(rec, given).cause == "gains"
    loop = loop_of([rec], given)
    assert [f.effect for f in loop.findings] == ["integration_rule"] and loop.controller == true
    wrong = loop_of([log()], ga.PI(0.99 * KP, KI))  # at the log's rate gains that are off are gains that are off
    assert wrong.controller == ga.PI(0.99 * KP, KI) and wrong.period_notes == ()


@pytest.mark.long
@pytest.mark.parametrize("every", [2, 4])
def test_a_form_shows_the_sample_time_that_nobody_gave(every: int) -> None:
    with threadpool_limits(1, user_api="blas"):
        loop = loop_of([slower(every, torque_filters=[dip()])], GIVEN)
        at_its_rate = loop_of([log(torque_filters=[dip()])], GIVEN)
    assert [f.effect for f in loop.findings] == ["torque_filter"]
    assert isinstance(loop.controller, ga.Cascade) and loop.controller.period == pytest.approx(T)
    assert f"samples about {every} times for each line" in loop.period_notes[0]
    assert at_its_rate.period_notes == () and at_its_rate.controller == GIVEN
