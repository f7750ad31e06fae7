"""Without a logged torque: forms of controller that the given PI lacks, beside what the mechanics may be."""

from __future__ import annotations

import numpy as np
import pytest

import gaident as ga
from drive_rig import Noise, Plant, rig, skip_without_library
from gaident.axis import say
from gaident.diagnosis.explain.wording import like_filters, or_other_form
from gaident.diagnosis.unlogged.controller_forms import VARIANTS
from gaident.diagnosis.unlogged.other_gains import OtherGains
from gaident.diagnosis.unlogged.unlogged_form import UnloggedForm
from gaident.estimation.dataset import DataSet
from gaident.results.estimate import Estimate
from gaident.results.finding import Finding

DT = 1e-3
KP, KI = 0.05, 1.5
J, D = 3e-4, 2e-3
PI = ga.PI(KP, KI)


@pytest.fixture(autouse=True)
def _library() -> None:
    skip_without_library()


def record(controller: ga.Cascade, friction: float = 0.0) -> ga.Record:
    """One mass under a controller that reads a velocity with noise of 0.03 rad/s, no torque in the log."""
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 90)
    plant = Plant(J, D, KP, KI, DT, cascade=controller)
    effects = {"coulomb_friction": {"torque": friction}} if friction else {}
    return rig(plant, levels, effects, Noise(white=0.03), seed=2, torque_logged=False)


@pytest.mark.long
@pytest.mark.parametrize(
    ("controller", "form", "numbers"),
    [
        (
            ga.Cascade(PI, torque_filters=(ga.Notch(60.0, numerator_damping=0.1, denominator_damping=0.7),)),
            "torque_filter",
            {"frequency": 60.0, "numerator_damping": 0.1, "denominator_damping": 0.7},
        ),
        (ga.Cascade(PI, velocity_filters=(ga.LowPass(2e-3),)), "velocity_feedback_filter", {"time_constant": 2e-3}),
        (ga.Cascade(PI, command_filters=(ga.LowPass(4e-3),)), "command_filter", {"time_constant": 4e-3}),
    ],
)
def test_a_filter_that_was_not_given_is_found_and_is_no_mechanics(
    controller: ga.Cascade, form: str, numbers: dict[str, float]
) -> None:
    dia = ga.diagnose(record(controller), PI)
    (found,) = dia.causes
    assert (dia.verdict, found.effect, found.place) == ("explained", form, "controller"), dia.summary()
    for name, value in numbers.items():
        assert abs(found.parameters[name].value - value) < 4.0 * found.parameters[name].std < 0.1 * value
    inertia = dia.mechanics["inertia"]
    assert inertia.value == pytest.approx(J, rel=5e-3)
    assert abs(inertia.value - J) < 3.0 * inertia.std and inertia.of_controller > 0.1 * inertia.std, "the filter is in it"
    assert isinstance(dia.controller, ga.Cascade) and not dia.torque_logged
    said = " ".join(dia.summary().split())
    assert "Log the torque, which shows what the controller does" in said
    assert "nothing shows it: log the torque" in said and "The logged torque" not in said


@pytest.mark.long
def test_a_filter_is_found_beside_friction() -> None:
    dia = ga.diagnose(record(ga.Cascade(PI, velocity_filters=(ga.LowPass(2e-3),)), friction=0.05), PI)
    assert {f.effect for f in dia.causes} == {"velocity_feedback_filter", "coulomb_friction"}, dia.summary()
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    ("controller", "form", "number", "effect"),
    [
        (
            ga.Cascade(ga.PI(KP, KI, command_weight=0.25)),
            "command_weight",
            0.25,
            ("unbalance", {"amplitude": 0.02, "phase": 0.3}),
        ),
        (
            ga.Cascade(PI, velocity_filters=(ga.LowPass(2.5e-3),)),
            "velocity_feedback_filter",
            2.5e-3,
            ("cogging", {"amplitude": 0.012, "order": 6.0, "phase": 0.3}),
        ),
    ],
)
def test_a_form_is_found_beside_a_torque_over_the_angle(
    controller: ga.Cascade, form: str, number: float, effect: tuple[str, dict[str, float]]
) -> None:
    """The search under the given PI finds another torque over the angle, or none: with the form it is another one."""
    name, values = effect
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 90)
    log = rig(Plant(J, D, KP, KI, DT, cascade=controller), levels, {name: values}, Noise(white=0.03), seed=3, torque_logged=False)
    dia = ga.diagnose(log, PI)
    assert dia.verdict == "explained" and {f.effect for f in dia.causes} == {form, name}, dia.summary()
    found = {f.effect: f.parameters for f in dia.causes}
    (estimate,) = found[form].values()
    assert abs(estimate.value - number) < 4.0 * estimate.std < 0.1 * number
    assert found[name]["amplitude"].value == pytest.approx(values["amplitude"], rel=0.05)
    assert dia.mechanics["inertia"].value == pytest.approx(J, rel=5e-3)


@pytest.mark.long
def test_forms_and_other_gains_are_compared_under_the_same_predictors() -> None:
    """Led in the loop other gains leave less than a command weight driven by the torque; with them the inertia is 26 % off."""
    pi, weight = ga.PI(0.04078, 0.9371), 0.776
    total, ratio, resonance = 2.4459e-4, 0.435, 2.0 * np.pi * 134.6
    motor = total / (1.0 + ratio)
    load = total - motor
    stiffness = resonance**2 * motor * load / total
    damping = 0.04 * resonance * motor * load / total
    cascade = ga.Cascade(ga.PI(pi.kp, pi.ki, command_weight=weight))
    plant = Plant(motor, 2e-3, pi.kp, pi.ki, DT, load, 4e-4, stiffness, damping, cascade=cascade)
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 90)
    log = rig(plant, levels, {"coulomb_friction": {"torque": 0.05}}, Noise(white=0.03), seed=56, torque_logged=False)
    dia = ga.diagnose(log, pi)
    assert {f.effect for f in dia.causes} == {"command_weight", "coulomb_friction"}, dia.summary()
    (found,) = [f.parameters["weight"] for f in dia.causes if f.place == "controller"]
    assert abs(found.value - weight) < 3.0 * found.std < 0.01
    assert dia.mechanics["inertia"].value == pytest.approx(total, rel=5e-3)


@pytest.mark.long
def test_an_ip_controller_is_found_although_it_looks_like_a_lag_and_more_damping() -> None:
    """On one mass an IP loop is to its command what a PI loop with a lag of kp/ki on a more damped mass is."""
    dia = ga.diagnose(record(ga.Cascade(ga.PI(KP, KI, command_weight=0.0))), PI)
    (found,) = dia.causes
    assert (dia.verdict, found.effect) == ("explained", "command_weight"), dia.summary()
    weight, inertia = found.parameters["weight"], dia.mechanics["inertia"]
    assert abs(weight.value) < max(3.0 * weight.std, 1e-3)
    assert abs(inertia.value - J) < 3.0 * inertia.std < 0.01 * J


@pytest.mark.long
def test_a_notch_at_the_resonance_of_two_masses_is_found() -> None:
    """The mechanism that is found under the bare PI has an inertia that is far off; the one under the notch is found anew."""
    notch = ga.Notch(29.0, numerator_damping=0.07, denominator_damping=0.7)
    pi = ga.PI(0.0232, 1.367)
    plant = Plant(
        1.02e-4, 3.13e-3, pi.kp, pi.ki, 2.5e-4, 6.97e-4, 9.11e-3, 2.63, 1e-3, cascade=ga.Cascade(pi, torque_filters=(notch,))
    )
    levels = np.repeat([0, 20.0, -35, 10, -10, 50, -50, 25, -5, 5, -20, 40, -30, 15, -15, 0], 360)
    log = rig(plant, levels, noise=Noise(white=0.03), seed=2, torque_logged=False)
    dia = ga.diagnose(log, pi)
    (found,) = dia.causes
    assert (dia.verdict, found.effect) == ("explained", "torque_filter"), dia.summary()
    assert abs(found.parameters["frequency"].value - notch.frequency) < 4.0 * found.parameters["frequency"].std
    total = dia.mechanics["motor_inertia"].value + dia.mechanics["load_inertia"].value
    assert total == pytest.approx(plant.J + plant.JL, rel=2e-3)


@pytest.mark.long
def test_a_filter_of_the_command_is_found_where_other_two_masses_leave_noise_under_a_wrong_one() -> None:
    """Beside the mechanism of the given PI a filter of 3.1 ms ends in noise, with the inertia 46 % off."""
    pi, lag = ga.PI(0.04284638717803306, 1.7159089500919482), ga.LowPass(0.005389489592720065)
    masses = (7.016985537585638e-05, 0.002102811385280519, pi.kp, pi.ki, DT)
    load = (0.00012992164376194001, 0.00042056227705610385, 16.770834995401895, 0.0011057044547520488)
    plant = Plant(*masses, *load, cascade=ga.Cascade(pi, command_filters=(lag,)))
    levels = [0.0, -20.0, -15.0, -35.0, 0.0, 10.0, 25.0, 20.0, 50.0, 40.0, -10.0, 5.0, -50.0, 15.0, -5.0, -30.0]
    log = rig(plant, np.repeat(levels, 90), noise=Noise(white=0.03), seed=10, torque_logged=False)
    dia = ga.diagnose(log, pi)
    (found,) = dia.causes
    assert (dia.verdict, found.effect) == ("explained", "command_filter"), dia.summary()
    assert found.parameters["time_constant"].value == pytest.approx(lag.time_constant, rel=0.01)
    assert dia.mechanics["inertia"].value == pytest.approx(plant.J + plant.JL, rel=5e-3)


def test_what_explains_as_much_as_other_gains_is_their_alternative_with_the_inertia_that_comes_with_it() -> None:
    ki = Estimate(1.2, 0.01, "N m/rad")
    beside = {"command_weight": say("a command weight (weight {:.4g}); the {inertia} is then {:.4g} {kg m^2}", 0.8, 2e-4)}
    found = OtherGains(None, PI, {"ki": ki}, 0.0, 0.0, 90.0, None, beside).finding(PI)  # type: ignore[arg-type]
    assert found.effect == "other_gains" and found.alternatives == ("command_weight",)
    said = "So it does with the given gains and a command weight (weight 0.8); the inertia is then 0.0002 kg m^2. Log the torque"
    assert said in found.evidence


def test_a_form_on_a_model_that_is_none_of_an_axis_is_an_alternative_without_an_inertia() -> None:
    weight = Finding("command_weight", {"weight": Estimate(0.8, 0.01, "1")}, (), 0.0, 0.0, None, say(""), place="controller")
    form = UnloggedForm(None, PI, say("a command weight"), weight, 1.0, 1.0, None, 1.0)  # type: ignore[arg-type]
    for mechanics, said in (({}, ")"), ({"inertia": (2e-4, 2e-4)}, "); the inertia is then 0.0002 kg m^2")):
        found = form.rivals_of_gains(10.0, lambda before, after, known=mechanics: known)  # type: ignore[misc]
        assert str(found["command_weight"]).startswith("a command weight (") and str(found["command_weight"]).endswith(said)
    assert form.rivals_of_gains(0.0, lambda before, after: {}) == {}


def test_what_comes_closer_is_no_other_part_of_a_controller_that_has_none() -> None:
    """The given PI has no filter."""
    notch = next(variant for variant in VARIANTS if len(variant.numbers) == 3)
    text = or_other_form(notch.words)
    assert "a controller with a notch in the torque, which the given one has not, would come closer" in text
    assert "with a notch in the force, which" in text.linear and "another" not in text


def test_the_numbers_of_a_form_are_searched_as_they_are_given() -> None:
    """From a start to the controller and back; ends of a notch: a tenth of the duration, and 0.95 of half the sampling rate."""
    pi = ga.PI(0.05, 0.4)
    dt, duration = 1e-3, 2.0
    for variant in VARIANTS:
        low, high = variant.ends(dt, duration)
        for z in variant.starts(dt, duration):
            assert np.all(low <= z) and np.all(z <= high) and len(z) == len(variant.numbers)
            assert variant.of(pi, z).velocity.kp == pi.kp
    notch = next(variant for variant in VARIANTS if len(variant.numbers) == 3)
    ends = [[n.value(x) for n, x in zip(notch.numbers, z, strict=True)] for z in notch.ends(dt, duration)]
    np.testing.assert_allclose(ends, [(5.0, 0.0, 0.05), (475.0, 1.0, 2.0)])
    (found,) = notch.of(pi, notch.starts(dt, duration)[0]).torque_filters
    assert (found.numerator_damping, found.denominator_damping) == (pytest.approx(0.1), pytest.approx(0.7))
    frequency = notch.numbers[0].estimate(np.log(80.0), 0.01)
    assert (frequency.value, frequency.std, frequency.unit) == (pytest.approx(80.0), pytest.approx(0.8), "Hz")


def test_two_effects_in_series_prove_nothing_without_a_torque() -> None:
    """Filters of a controller look like them; a logged torque would contain the filters."""
    n = np.arange(100.0)
    bare, logged = ga.Record(DT, command=n, velocity=n), ga.Record(DT, command=n, velocity=n, torque=n)
    (note,) = like_filters(DataSet.of([bare], PI), ("torque_lag", "velocity_filter"))
    assert "needs torque lag and velocity filter in series" in note and "Log the torque" in note
    assert like_filters(DataSet.of([bare], PI), ("torque_lag",)) == []
    assert like_filters(DataSet.of([logged], PI), ("torque_lag", "velocity_filter")) == []
