"""What a diagnosis hands out: the summary word for word, the file, the picture; and what wrong use is told."""

from __future__ import annotations

import io
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaident as ga
from friction_drive import CONTROLLER, DRIVE, DT, drive_record
from gaident.axis import say
from gaident.diagnosis.explain.evidence import velocity_curve
from gaident.diagnosis.explain.wording import evidence_of
from gaident.errors import GaidentError, RecordError, SettingsError
from gaident.results.diagnosis import Comparison, Fitness
from gaident.results.finding import Bound, Finding
from gaident.results.relevance import Relevance
from gaident.show.report.diagnosis import headline
from gaident.show.wording import certainty, step_words
from places import GOLDEN

SUMMARY = GOLDEN / "diagnosis.txt"


@pytest.fixture(scope="module")
def rec() -> ga.Record:
    return drive_record()


@pytest.fixture(scope="module")
def dia(rec: ga.Record) -> ga.Diagnosis:
    return ga.diagnose(rec, CONTROLLER, validation=drive_record(1))


def fake() -> Any:
    """What a summary looks at, with the figures of a drive that never was."""
    torque = ga.Estimate(0.04123, 0.00035, "N m")
    return SimpleNamespace(
        verdict="partly explained",
        findings=(
            Finding(
                "outliers", {"fraction": ga.Estimate(0.001, 1e-4, "1")}, evidence="4 of 4000 samples are left out.", is_noise=True
            ),
            Finding(
                "coulomb_friction",
                {"torque": torque},
                (),
                0.43,
                812.4,
                0.01,
                "Dry friction of constant size: beyond doubt (the model without it is 812 BIC units worse).",
            ),
            Finding(
                "cogging",
                {
                    "amplitude": ga.Estimate(0.012, 2e-4, "N m"),
                    "order": ga.Estimate(12.0, 0.0, "1/turn"),
                    "phase": ga.Estimate(0.31, 0.02, "rad"),
                },
                ("velocity_ripple",),
                0.2,
                55.0,
                None,
                say(
                    "{Torque} ripple n times {per turn}, or velocity ripple: one of these is there, beyond doubt (the model "
                    "without it is 55 BIC units worse); these data do not say which."
                ),
            ),
        ),
        not_testable={"backlash": say("the {torque} never changes its sign: the coupling stays on one flank")},
        one_sided={
            "torque_saturation": say("a limit above {} {N m} would not have shown: no more {torque} was asked for", 1.25),
            "command_rate_limit": say("a limit above {} {rad/s^2} would not have shown: no command rises faster", "2e+04"),
        },
        model=SimpleNamespace(effects=("coulomb_friction", "cogging"), poles=(-1.0, -1.0 + 2.0j, -1.0 - 2.0j), p=1, q=2),
        before=Fitness(0.5, 97.1, 0.1, 0.0511, 0.184, 0.0021),
        after=Fitness(0.2, 98.84, 0.1, 0.0123, 0.184, 0.0021),
        regression=SimpleNamespace(
            terms=("inertia", "viscous", "coulomb"),
            parameters={
                "inertia": ga.Estimate(6.91e-4, 4e-6, "kg m^2"),
                "viscous": ga.Estimate(0.0108, 0.0003, "N m s/rad"),
                "coulomb": ga.Estimate(0.0522, 0.0006, "N m"),
            },
            cutoff_hz=12.34,
            order=4,
            samples=812,
        ),
        regression_force_error=0.0119,
        comparisons=(
            Comparison("inertia", ga.Estimate(6.88e-4, 1.2e-6, "kg m^2"), ga.Estimate(6.91e-4, 4e-6, "kg m^2"), False),
            Comparison("dry friction", torque, ga.Estimate(0.0522, 0.0006, "N m"), True),
        ),
        force_reason="the torque drives the simulation, and a free run adds up what is small in every sample",
        driver="time",
        left={"velocity": -20.0, "time": 60.0},
        left_needed=47.0,
        expected={},
        not_there={"cogging": Bound("amplitude", 0.0042, "N m")},
        next_experiment=ga.Proposal(np.zeros(2000), DT, ("cogging", "velocity_ripple"), 412.3, "Slow speeds: several turns."),
        gain_interval=(0.55, 0.64),
        held_out="validation records",
        in_sample=False,
        controller_numbers={},
        relevance=None,
        base_shift={
            "gain": (9000.0, 9790.0),
            "inertia": (7.4935e-4, 6.88e-4),
            "viscous_friction": (0.014987, 0.011),
            "resonance": (27.103, 27.414),
            "resonance_damping": (0.088083, 0.0836),
        },
        notes=(say("The closest description leaves an error of {} {rad/s} at {} {N m}.", 0.1, 0.02),),
        controller=CONTROLLER,
        seed=3,
        seconds=1.234,
        simulations=4321,
        samples=4000,
        digests=("c0ffee" * 4, "beef" * 4),
        version="0.1.0",
        bootstrap=99,
        torque_logged=True,
        loop_follows=True,
        line=(37.0, 0.0512),
        load_sensor={},
        mechanics={
            "inertia": ga.Estimate(6.88e-4, 1.2e-6, "kg m^2"),
            "viscous_friction": ga.Estimate(0.011, 0.0002, "N m s/rad"),
            "motor_inertia": ga.Estimate(1.02e-4, 3e-7, "kg m^2"),
            "load_inertia": ga.Estimate(5.86e-4, 1.3e-6, "kg m^2"),
            "stiffness": ga.Estimate(2.581, 0.012, "N m/rad"),
            "resonance": ga.Estimate(27.414, 0.033, "Hz"),
            "resonance_damping": ga.Estimate(0.0836, 0.0011, "1"),
            "antiresonance": ga.Estimate(10.563, 0.014, "Hz"),
            "antiresonance_damping": ga.Estimate(0.0565, 0.07, "1", identifiable=False),
        },
    )


def summary(result: Any, axis: str = "rotary") -> str:
    from gaident.show.diagnosis_summary import diagnosis_summary

    return diagnosis_summary(result, axis)


@pytest.mark.parametrize(("left", "needed"), [({"position": -5.0, "time": -3.0}, 47.0), ({"position": 40.0, "time": 30.0}, 47.0)])
def test_a_driver_that_does_not_count_is_only_the_closest(left: dict[str, float], needed: float) -> None:
    dia = SimpleNamespace(**{**vars(fake()), "driver": "position", "left": left, "left_needed": needed, "line": None})
    text = " ".join(summary(dia).split())
    assert "No single signal explains what is left; what comes closest depends on the position." in text
    assert "What is left depends" not in text


def test_the_share_of_the_closest_is_said_where_it_is_known() -> None:
    left = Relevance(0.2, 0.1, shares={"position": 0.043, "time": 0.002})
    more = {"driver": "position", "left": {"position": -5.0, "time": -3.0}, "line": None, "relevance": left}
    text = " ".join(summary(SimpleNamespace(**{**vars(fake()), **more})).split())
    assert "depends on the position. A free function of it takes 4.3 % of the squared error away." in text


def test_what_the_noise_of_a_measured_torque_leaves_stands_beside_that_of_the_velocity() -> None:
    def rows(**more: Any) -> list[list[str]]:
        return [line.split() for line in summary(SimpleNamespace(**{**vars(fake()), **more})).splitlines()]

    own, both = ["noise", "of", "the", "measured", "velocity", "0.1"], ["with", "that", "of", "the", "torque", "0.17"]
    assert own in rows(relevance=Relevance(0.2, 0.17)) and both in rows(relevance=Relevance(0.2, 0.17))
    for same in (rows(relevance=Relevance(0.2, 0.1)), rows()):
        assert own in same and not any(row[:2] == ["with", "that"] for row in same)


def test_a_cause_with_which_the_error_grows_as_long_as_another_is_missing() -> None:
    text = "One cause alone may make the error of a free run larger, as long as another one is missing: judge by all together."
    noise, first, second, *_ = fake().findings
    for gain, told in ((-0.09, True), (0.09, False)):
        findings = [noise, replace(first, gain=gain), replace(second, gain=0.9)]
        assert (text in " ".join(summary(SimpleNamespace(**{**vars(fake()), "findings": findings})).split())) == told


def test_a_number_that_was_zero_within_its_deviation_moved_by_no_share() -> None:
    damping = ga.Estimate(0.0836, 0.0011, "1")
    for old, moved in ((-0.00043, ""), (0.0, ""), (0.05, "+67.2 %")):
        dia = SimpleNamespace(**{**vars(fake()), "mechanics": {"resonance_damping": damping}})
        dia.base_shift = {"resonance_damping": (old, 0.0836)}
        table = summary(dia).split("How far the effects had biased the linear model")[1].split("\n\n")[0]
        assert f"{old:.5g}" in table and ("%" in table) == bool(moved) and moved in table


def test_the_summary_reads_as_agreed() -> None:
    """Word for word; after a change that is meant, write the new text into golden/diagnosis.txt."""
    assert summary(fake()) + "\n" == SUMMARY.read_text()
    assert max(map(len, summary(fake()).splitlines())) <= 100


def test_a_linear_axis_is_spoken_of_in_metres_and_newtons() -> None:
    text = summary(fake(), "linear")
    assert "0.1 m/s at 0.02 N." in text and "motor mass" in text and " kg\n" in text and "N s/m" in text
    assert "rad/s" not in text and "N m" not in text and "turn " not in text.replace("per turn", "")
    assert "force saturation: a limit above 1.25 N would not have shown: no more force was asked for" in text
    assert "a limit above 2e+04 m/s^2 would not have shown" in text
    assert f"{12.0 / math.tau:.5g}" in text  # 12 per turn are 12/(2 pi) per metre


def flat(text: str) -> str:
    return " ".join(text.split())


def test_a_gain_that_is_none_is_not_called_one() -> None:
    result = fake()
    result.after = Fitness(0.501, 97.0, 0.1)
    assert "hardly changes (+0.2 %): the loop's integrator hides this effect in the velocity, the torque shows it." in flat(
        summary(result)
    )
    assert "the force shows it" in flat(summary(result, "linear"))
    result.torque_logged = False
    assert "in the velocity." in flat(summary(result)) and "shows it" not in summary(result)
    result.before = Fitness(0.5, 97.0, 0.49)
    assert "it is at the noise with and without" in flat(summary(result))
    result.in_sample = True
    assert "IN-SAMPLE: too little data, or too little motion, to hold any out" in flat(summary(result))


def test_a_mechanism_that_diverges_along_the_motion_has_no_force_error() -> None:
    result = fake()
    assert "diverges" not in summary(result)
    result.before = replace(result.before, force_error=None, torque_rms=None)
    assert "mechanism without effects diverges" in flat(summary(result))


def test_what_an_encoder_makes_of_the_noise_is_said_where_the_free_run_leaves_less() -> None:
    """A difference of two rounding errors, each even over a step q, has the deviation q/sqrt(6)."""
    result = fake()
    steps = Finding("velocity_quantisation", {"step": ga.Estimate(0.024, 0.0, "rad/s")}, is_noise=True)
    result.findings, result.noise = (steps, *result.findings), None
    assert "third differences" not in summary(result)
    result.after = replace(result.after, rmse=0.0097, noise_floor=0.016)
    text = flat(summary(result))
    assert "Steps of 0.024 rad/s make 0.00693 rad/s rms where the velocity itself is rounded, and 0.0098 rad/s where" in text
    assert "the difference of two rounded positions" in flat(summary(result, "linear"))
    e = np.random.default_rng(0).uniform(-0.5, 0.5, 100_000)
    assert 0.024 * np.diff(e).std() == pytest.approx(0.0098, rel=0.01)
    result.noise = 0.016
    assert "third differences" not in summary(result)


def test_a_free_run_that_diverges_has_no_percentage() -> None:
    result = fake()
    result.after = Fitness(1e150, -1e155, 0.1)
    assert "In free run the extended model diverges, the linear one does not." in flat(summary(result))
    result.before = Fitness(1e150, -1e155, 0.1)
    assert "In free run the extended model diverges, so does the linear one." in flat(summary(result))
    result.after = fake().after
    assert "In free run the linear model diverges, the extended one does not." in flat(summary(result))


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (0.834, "-83 %"),
        (-0.002, "0 %"),
        (-0.53, "+53 %"),
        (-4e187, "the free run diverges"),
    ],
)
def test_what_a_step_makes_of_the_error_is_said_in_words(gain: float, words: str) -> None:
    result = fake()
    noise, friction, ripple = result.findings
    result.findings = (noise, replace(friction, gain=gain), ripple)
    assert f"against that before it: coulomb friction {words}, cogging -20 %." in flat(summary(result))


def test_a_parameter_that_moved_by_more_than_ten_times_says_how_many() -> None:
    result = fake()
    result.base_shift = {"inertia": (6.88e-4 / 15.7, 6.88e-4)}
    assert "15.7 times as large" in summary(result)


@pytest.mark.parametrize(
    ("effect", "parameters", "words"),
    [
        (
            "integration_rule",
            {},
            "The controller has another integration rule than the one given or assumed; with it nothing significant is left.",
        ),
        (
            "other_gains",
            {"kp": ga.Estimate(0.52, 1e-4, "N m s/rad"), "ki": ga.Estimate(20.7, 0.1, "N m/rad")},
            "The controller has other gains than the given ones (kp 0.52 N m s/rad, ki 20.7 N m/rad); with it nothing",
        ),
    ],
)
def test_what_differs_in_the_controller_is_no_lack_of_the_model(
    effect: str, parameters: dict[str, ga.Estimate], words: str
) -> None:
    result = fake()
    result.verdict = "explained"
    of_controller = Finding(effect, parameters, place="controller")
    result.findings = (of_controller,)
    assert headline(result, "rotary").startswith(words)
    found = "The model was wrong, the cause is found, and with it nothing significant is left."
    assert flat(summary(result)).startswith(f"Verdict: explained {found} {words.partition(';')[0]}. ")
    result.findings = (of_controller, fake().findings[1])
    assert headline(result, "rotary").startswith("The model lacks coulomb friction (0.0412 N m); the ")
    if parameters:
        assert "kp 0.52 N s/m, ki 20.7 N/m" in headline(result, "linear")


def test_an_error_that_grows_is_said_to_and_not_to_be_compared() -> None:
    result = fake()
    result.after = Fitness(1.5, 80.0, 0.1)
    text = flat(summary(result))
    assert "In free run the extended model is worse than the linear one: the error of the velocity grows by 200 %, within" in text
    assert "within its variation over the record: the effects were found on" in text and "hardly" not in text
    assert "closed over this controller" in text
    result.controller = None
    text = flat(summary(result))
    assert "the record: the effects, as fitted, do not hold on these data." in text and "not the drive's" not in text
    result.after = replace(result.after, force_error=0.0123, torque_rms=0.184)
    result.gain_interval = (-3.0, -1.0)
    text = flat(summary(result))
    assert "grows by 200 %, beyond its variation over the record; that of the torque falls (was 0.0511, is 0.0123 N m)" in text
    assert "that of the force falls" in flat(summary(result, "linear"))
    result.before = replace(result.before, force_error=None)
    assert "falls (diverges without the effects, is 0.0123 N m)" in flat(summary(result))
    result.loop_follows = False
    text = flat(summary(result))
    assert "worse than the linear one (the error of the velocity grows by 200 %): the simulated controller is not the" in text
    assert "does not follow from this controller (see above): it drives these models, no loop is closed." in text
    result.torque_logged = False
    text = flat(summary(result))
    assert "The simulated controller is not the drive's (see above): these figures include its errors." in text


def test_a_torque_error_that_grows_is_explained_by_the_filter_or_counts_against_the_model() -> None:
    result = fake()
    result.before = replace(result.before, force_error=0.05, torque_rms=0.184)
    result.after = replace(result.after, force_error=0.08, torque_rms=0.184, force_floor=0.07)
    told = "The extended model misses more of it than the mechanism without effects"
    assert f"{told}; so would a right model: the filter takes from the motion" in flat(summary(result))
    result.after = replace(result.after, force_floor=0.002)
    assert f"{told}: what it names is not all that there is." in flat(summary(result))
    result.after = replace(result.after, force_error=0.0501)
    assert told not in flat(summary(result)), "about the same"


def test_an_interval_is_said_with_as_many_digits_as_its_ends_need() -> None:
    result = fake()
    for rmse, interval, said in (
        (0.2, (0.55, 0.64), "The error falls by 60 % (95 % interval 55 to 64 %)."),
        (0.0003, (0.9993, 0.99945), "The error falls by 99.94 % (95 % interval 99.93 to 99.94 %)."),
        (0.2, (0.6, 0.6), "The error falls by 60 %."),
    ):
        result.after, result.gain_interval = replace(result.after, rmse=rmse), interval
        assert said in flat(summary(result)), said


def test_the_verdict_names_what_is_found_and_what_is_one_of_several() -> None:
    result = fake()
    result.driver = result.line = None
    friction, ripple = result.findings[1:]
    heads = {
        (friction,): "the cause is found, and with it nothing significant is left. Cause: coulomb friction.",
        (friction, replace(friction, effect="load_torque")): "the causes are found, and with them nothing significant is left. "
        "Causes: coulomb friction, load torque.",
        (
            replace(ripple, alternatives=("velocity_ripple", "unbalance")),
        ): "The model was wrong. What is missing is one of: cogging, "
        "velocity ripple or unbalance. These data do not tell them apart. With that nothing significant is left.",
        (friction, ripple): "The model was wrong. Cause: coulomb friction. What is also missing is one of: cogging or velocity "
        "ripple. These data do not tell them apart. With that nothing significant is left.",
    }
    for found, words in heads.items():
        result.verdict, result.findings = "explained", found
        assert words in flat(summary(result)), flat(summary(result))[:400]


def test_figures_of_chance_are_given_as_what_they_are() -> None:
    assert "(bootstrap): at most 0.01." in flat(summary(fake()))
    result = fake()
    result.bootstrap = 999
    assert "(bootstrap): 0.01." in flat(summary(result))
    assert [certainty(x) for x in (412.0, 23.0, 13.0)] == ["beyond doubt", "very likely", "likely"]
    text = evidence_of("unbalance", 23.4, ("cogging", "load_torque"))
    assert text.endswith(
        "or cogging or load torque: one of these is there, very likely (the model without it is 23 BIC units worse); these data "
        "do not say which."
    )
    assert evidence_of("backlash", 412.0, ()).endswith(": beyond doubt (the model without it is 412 BIC units worse).")


def test_no_cause_is_beyond_doubt_where_something_is_left_or_a_parameter_ends_at_its_bound() -> None:
    words = ": very likely (the model without it is 412 BIC units worse)."
    assert evidence_of("backlash", 412.0, (), left=True).endswith(words)
    velocity = np.zeros(3)
    for at_bound, said in ((True, words), (False, words.replace("very likely", "beyond doubt"))):
        known = {"gap": ga.Estimate(0.1, 0.01, "rad", at_bound=at_bound)}, velocity
        assert evidence_of("backlash", 412.0, (), known=known).endswith(said)
    # A size of 1.4 deviations contradicts that it is beyond doubt, however clear an order is; one clear size is enough.
    unclear, clear, order = (ga.Estimate(*row) for row in ((0.01, 0.007, "N m"), (0.02, 0.001, "N m"), (6.0, 0.001, "1/turn")))
    known = {"amplitude": unclear, "order": order}, velocity
    assert evidence_of("cogging", 412.0, (), known=known).endswith(words)
    known = {"amplitude": clear, "order": order, "amplitude_2": unclear}, velocity
    assert evidence_of("cogging", 412.0, (), known=known).endswith(words.replace("very likely", "beyond doubt"))


def test_a_pair_that_does_not_swing_is_no_resonance() -> None:
    result = fake()
    result.mechanics = {name: result.mechanics[name] for name in ("inertia", "viscous_friction")}
    result.model = ga.Model(gain=500.0, poles=[-3.0, -300.0, -900.0], zeros=[-400.0, -700.0])
    text = summary(result)
    assert "resonance  " not in text and "damping ratio" not in text
    assert "a second pair of poles that does not swing" in text
    # One that swings, and that a shaft was not found in, is not said to be at rest.
    pole = 2.0 * np.pi * 194.0 * complex(-0.016, math.sqrt(1.0 - 0.016**2))
    result.model = ga.Model(gain=500.0, poles=[-3.0, pole, pole.conjugate()], zeros=[0.9 * pole, 0.9 * pole.conjugate()])
    assert "a pair of poles at 194 Hz that is no shaft's" in summary(result)


@pytest.mark.parametrize("pair", [(-3.0 + 22.4j, -3.0 - 22.4j), (-5.0, -60.0)])
def test_the_pair_of_a_spring_to_the_ground_is_told_once(pair: tuple[complex, complex]) -> None:
    result = fake()
    result.mechanics = {name: result.mechanics[name] for name in ("inertia", "viscous_friction")}
    result.mechanics["ground_resonance"] = ga.Estimate(3.569, 0.004, "Hz")
    result.model = ga.Model(gain=500.0, poles=list(pair), zeros=[0.0])
    text = summary(result)
    assert "ground resonance" in text and "pair of poles" not in text


def test_a_free_run_that_diverges_twice_has_no_share() -> None:
    assert step_words(math.nan) == "the free run diverges"
    assert step_words(-2000.0) == "more than ten times larger"
    assert step_words(0.834) == "-83 %"


def test_the_file_holds_the_whole_result(dia: ga.Diagnosis, tmp_path: Path) -> None:
    assert dia.verdict == "explained" and [f.effect for f in dia.causes] == ["coulomb_friction"]
    dia.save(tmp_path / "dia.json")
    back = ga.load(tmp_path / "dia.json")
    assert isinstance(back, ga.Diagnosis)
    assert back == dia and back.to_dict() == dia.to_dict() and back.summary() == dia.summary()
    assert back.validation_digests == (drive_record(1).digest,) and back.torque_logged and back.loop_follows
    assert (back.noise, back.bootstrap) == (None, 0)
    highest = np.abs(drive_record().torque).max()
    assert back.one_sided["torque_saturation"].startswith(f"a limit above {highest:.3g} N m would not have shown")
    assert {"integrator_clamp", "command_rate_limit"} <= set(back.one_sided)
    assert not {"coulomb_friction", *back.not_testable} & set(back.one_sided)
    inertia = back.mechanics["inertia"]
    assert abs(inertia.value - 5e-4) < 5.0 * inertia.std < 5e-6 and inertia.unit == "kg m^2"
    assert back.seed == dia.seed and back.digests == (drive_record().digest,) and back.model.effects == dia.model.effects
    np.testing.assert_array_equal(
        ga.simulate(back.model, drive_record(), CONTROLLER), ga.simulate(dia.model, drive_record(), CONTROLLER)
    )
    assert list(tmp_path.iterdir()) == [tmp_path / "dia.json"]


@pytest.mark.long
def test_what_was_found_or_not_tested_is_no_size_that_could_not_show(rec: ga.Record) -> None:
    done = ga.run(DRIVE.with_effect("torque_saturation", limit=1.0), rec, CONTROLLER)
    limited = ga.diagnose(ga.Record(DT, command=rec.command, velocity=done.velocity, torque=done.torque), CONTROLLER)
    assert "torque_saturation" in {f.effect for f in limited.causes} and "torque_saturation" not in limited.one_sided
    assert "integrator_clamp" in limited.one_sided
    open_loop = ga.diagnose(ga.Record(DT, velocity=rec.velocity, torque=rec.torque))
    assert "integrator_clamp" in open_loop.not_testable
    assert set(open_loop.one_sided) == {"torque_saturation", "extra_resonance", "torque_hum"}


def test_a_proposal_survives_the_file() -> None:
    proposal = ga.first_experiment(DT, ga.Limits(100.0, 1.0, math.inf, 2.0))
    assert ga.Proposal.from_dict(proposal.to_dict()) == proposal  # its margin is nan
    assert proposal != ga.first_experiment(DT, ga.Limits(90.0, 1.0, math.inf, 2.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.update(schema="something"), "contains no saved identification, diagnosis, retuning or record"),
        (lambda d: d.update(schema_version=99), "schema_version is 99"),
        (lambda d: d.pop("findings"), "damaged"),
        (lambda d: d.update(before=3), "damaged"),
    ],
)
def test_a_damaged_file_says_so(dia: ga.Diagnosis, tmp_path: Path, change: Any, words: str) -> None:
    data = json.loads(dia.to_json())
    change(data)
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(data))
    with pytest.raises(GaidentError, match=words) as caught:
        ga.load(path)
    assert str(path) in str(caught.value)


@pytest.mark.long
def test_the_picture_renders_and_a_loaded_diagnosis_asks_for_its_records(dia: ga.Diagnosis, rec: ga.Record) -> None:
    for axis in ("rotary", "linear"):
        drawn = io.BytesIO()
        dia.plot(axis=axis).savefig(drawn, format="png", dpi=40)
        assert drawn.getvalue().startswith(b"\x89PNG")
    loaded = ga.Diagnosis.from_dict(dia.to_dict())
    with pytest.raises(GaidentError, match=r"plot\(records\)"):
        loaded.plot()
    assert len(loaded.plot([rec[:400], rec]).axes) == 6
    assert "the longest of 2" in loaded.plot([rec[:400], rec]).get_suptitle()
    assert "the first of the longest of 2" in loaded.plot([rec, rec]).get_suptitle()
    with pytest.raises(SettingsError, match="axis is 'round'"):
        dia.plot(axis="round")


def test_the_curve_over_velocity_is_the_sum_of_its_effects(dia: ga.Diagnosis) -> None:
    curve = velocity_curve(dia, -10.0, 10.0)
    assert curve is not None and curve[2] == "coulomb friction"
    level = dia.causes[0].parameters["torque"].value
    np.testing.assert_allclose(curve[1], -level * np.sign(curve[0]))
    more = SimpleNamespace(
        model=DRIVE.with_effect("quadratic_drag", coefficient=1e-4).with_effect("cogging", amplitude=0.1, order=6, phase=0.0)
    )
    found = velocity_curve(more, 0.0, 10.0)  # type: ignore[arg-type]
    assert found is not None and "cogging" not in found[2]
    assert found[1][-1] == pytest.approx(-0.05 - 1e-4 * 100.0)
    assert velocity_curve(SimpleNamespace(model=ga.Model(1.0, [-1.0])), 0.0, 1.0) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"rec": []}, RecordError, "rec is list"),
        ({"rec": "run.csv"}, RecordError, "rec is str"),
        ({"rec": [1]}, RecordError, "give a gaident.Record"),
        ({"controller": 3.0}, SettingsError, "controller is 3.0"),
        ({"identification": DRIVE}, SettingsError, "identification is Model"),
        ({"validation": []}, RecordError, "validation is list"),
        ({"validation": 4}, RecordError, "validation is int"),
        ({"noise": -0.1}, SettingsError, "noise is -0.1"),
        ({"noise": math.nan}, SettingsError, "noise is nan"),
        ({"noise": True}, SettingsError, "noise is True"),
        ({"bootstrap": -1}, SettingsError, "bootstrap is -1"),
        ({"bootstrap": 1.5}, SettingsError, "bootstrap is 1.5"),
        ({"seed": "a"}, SettingsError, "seed is 'a'"),
        ({"progress": 3}, SettingsError, "progress is 3"),
    ],
)
def test_wrong_use_names_argument_and_value(rec: ga.Record, arguments: dict[str, Any], error: type, words: str) -> None:
    given = {"rec": rec, "controller": CONTROLLER, **arguments}
    with pytest.raises(error, match=words):
        ga.diagnose(**given)


def test_records_that_do_not_fit_the_loop_are_refused(rec: ga.Record) -> None:
    silent = ga.Record(DT, velocity=rec.velocity, torque=rec.torque, name="silent")
    loose = ga.Record(DT, command=rec.command, velocity=rec.velocity, name="loose")
    other = ga.Record(2 * DT, command=rec.command, velocity=rec.velocity)
    with pytest.raises(RecordError, match="silent has no command"):
        ga.diagnose(silent, CONTROLLER)
    with pytest.raises(RecordError, match="loose has no torque"):
        ga.diagnose(loose)
    with pytest.raises(RecordError, match="different sample times"):
        ga.diagnose([rec, other], CONTROLLER)
    with pytest.raises(RecordError, match="silent has no command"):
        ga.diagnose(rec, CONTROLLER, validation=silent)
    with pytest.raises(RecordError, match=r"record 2 has 99 samples: a diagnosis needs 100 or more"):
        ga.diagnose([rec, ga.Record(DT, rec.command[:99], rec.velocity[:99])], CONTROLLER)
    with pytest.raises(RecordError, match="validation record levels is one that the model is fitted to"):
        ga.diagnose(rec, CONTROLLER, validation=[drive_record(1), rec])


def test_a_record_may_begin_in_motion(rec: ga.Record) -> None:
    """In the middle of a level, where a resonance would have to have been moving too."""
    found = ga.diagnose(rec[300:], CONTROLLER)
    assert [f.effect for f in found.causes] == ["coulomb_friction"], found.summary()
    assert found.causes[0].parameters["torque"].value == pytest.approx(0.05, rel=0.05)


def test_standstill_tells_the_noise(rec: ga.Record) -> None:
    rest = ga.Record(DT, command=np.zeros(500), velocity=0.07 * np.random.default_rng(2).standard_normal(500))
    found = ga.diagnose(rec, CONTROLLER, noise=rest)
    assert found.after.noise_floor == found.noise == pytest.approx(np.std(rest.velocity))


def test_progress_is_told_and_an_interrupt_gets_through(rec: ga.Record) -> None:
    told: list[float] = []

    def note(fraction: float, message: str) -> None:
        assert message
        told.append(fraction)
        if len(told) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ga.diagnose(rec, CONTROLLER, progress=note)
    assert told == sorted(told) and told[0] > 0.0 and told[-1] <= 1.0


def test_the_end_of_the_shaft_that_the_data_exclude_is_said_with_what_it_costs() -> None:
    from gaident.diagnosis.explain.ends import Ends

    there = evidence_of("coulomb_friction", 400.0, (), None, Ends(("load",), True, "motor", 118.4))
    assert there.startswith("Dry friction of constant size, at the load: beyond doubt")
    assert there.endswith("(the model without it is 400 BIC units worse, with it at the motor 118).")
    open_ = evidence_of("coulomb_friction", 400.0, (), None, Ends(("motor", "load"), True))
    assert "at the motor or at the load (these data do not say which)" in open_ and open_.endswith("400 BIC units worse).")
